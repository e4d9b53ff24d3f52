//! All stages of a reproduction and what they depend on, known before the first one runs.
//!
//! Measured recordings come first, then trainings, then every method's simulation of every recording (one recording after
//! the other, so that its geometry is worked out once for all methods) with its scores, then recognition, then `further`
//! experiments and the figures.

mod first_site;
mod few;
mod further;
mod method;
mod place;
mod second_room;
mod stages;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::config::{Protocol, ReproduceConfig, SubjectSplit};
use super::few::Material;
use super::preflight::{self, Board};
use super::stage::{Key, stage_folder};
use super::takes::{Take, check_split};
use super::task::Task;
use super::variants::Variant;
use crate::data::{files, hex};
use crate::error::{Error, Result};
use crate::site::{self, SiteConfig};
pub use method::{Drawn, Method};

/// One stage.
#[derive(Clone, Debug)]
pub struct Stage {
    pub key: Key,
    pub settings: Value,
    /// Stages that must be done before.
    pub parents: Vec<usize>,
    pub task: Task,
}

/// The action on which the paper looks at the graph convolution more closely (table 6).
pub const ARM_SWING: &str = "walk_back_forth_armswing";

/// The stages whose results belong to one draw of a method.
#[derive(Clone, Debug, Default)]
pub struct MethodStages {
    pub train: Option<usize>,
    pub simulate: Vec<usize>,
    /// Scores on the training subject's held-out frames, one stage for each recording.
    pub intra: Vec<usize>,
    /// Scores on the unseen subject.
    pub cross: Vec<usize>,
    /// The names of `cross`' actions, and of its recordings.
    pub cross_actions: Vec<String>,
    pub cross_takes: Vec<String>,
    pub recognition: BTreeMap<Protocol, usize>,
    /// Scores and recognition of the additional unseen subject.
    pub additional: Vec<usize>,
    pub additional_recognition: Option<usize>,
}

/// Classifiers that learned from so many recordings of each action, one stage for each draw.
#[derive(Clone, Debug)]
pub struct FewStages {
    pub recordings: usize,
    pub material: Material,
    pub stages: Vec<usize>,
}

/// What is to be done, in an order in which it can be.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub stages: Vec<Stage>,
    /// In the order of the tables, with one entry for each draw: those of trained simulators have [`ReproduceConfig::seeds`], all
    /// others one.
    pub methods: Vec<(Method, Vec<MethodStages>)>,
    pub few: Vec<FewStages>,
    pub diagnosis: Option<usize>,
    /// With the graph convolution, and without.
    pub stability: Vec<(Variant, usize)>,
    /// By the names of their pictures.
    pub figures: Vec<(String, usize)>,
}

impl Stage {
    /// Into how many pieces its work can be divided ([`super::run_one`]): a site's sequences.
    ///
    /// # Errors
    /// Settings that cannot be a site.
    pub fn pieces(&self) -> Result<usize> {
        match &self.task {
            Task::Site { config, .. } => Ok(site::drawn(config)?.len()),
            _ => Ok(1),
        }
    }
}

impl Plan {
    /// The stage of this folder (`NAME-HASH`).
    ///
    /// # Errors
    /// A folder that no stage has.
    pub fn find(&self, folder: &str) -> Result<usize> {
        self.stages.iter().position(|stage| stage.key.folder() == folder).ok_or_else(|| Error::Usage {
            message: format!("{folder}: no stage of this plan"),
            hint: Some("its settings, or those of a stage that it needs, have changed since the stages were listed".into()),
        })
    }

    /// The stages whose names begin with one of these, and all that they need, in the plan's order.
    ///
    /// # Errors
    /// A beginning that no stage has.
    pub fn needed(&self, beginnings: &[String]) -> Result<BTreeSet<usize>> {
        let mut found = BTreeSet::new();
        for beginning in beginnings {
            let named = |&index: &usize| self.stages[index].key.name.starts_with(beginning.as_str());
            let mut open: Vec<usize> = (0..self.stages.len()).filter(named).collect();
            if open.is_empty() {
                return Err(Error::Usage {
                    message: format!("--stages {beginning}: no stage's name begins so"),
                    hint: Some("`--plan` lists them".into()),
                });
            }
            while let Some(stage) = open.pop() {
                if found.insert(stage) {
                    open.extend(&self.stages[stage].parents);
                }
            }
        }
        Ok(found)
    }
}

/// The settings' name of the site where everything is compared.
const FIRST: &str = "site";

/// Where measured recordings are.
struct Place {
    /// The stage that records them; none where the user did.
    stage: Option<usize>,
    /// Stands for recordings that the user made.
    key: Key,
    recordings: PathBuf,
    again: Again,
    /// The stage that records it with another draw of the mesh's error.
    other_mesh: Option<usize>,
    takes: Vec<Take>,
    board: Board,
}

/// The same truth recorded a second time, for some subjects.
#[derive(Clone, Debug, Default)]
struct Again {
    folder: PathBuf,
    subjects: Vec<String>,
}

impl Place {
    fn of_subject<'a>(&'a self, subject: &'a str) -> impl Iterator<Item = &'a Take> + 'a {
        self.takes.iter().filter(move |take| take.subject == subject)
    }
}

/// The sequences of a site that is not recorded yet.
type Sequences = dyn Fn(&SiteConfig, &Path) -> Result<Vec<site::Sequence>>;

struct Planner<'a> {
    config: &'a ReproduceConfig,
    root: &'a Path,
    sequences: &'a Sequences,
    /// Of the files behind LPIPS.
    weights: Option<String>,
    plan: Plan,
}

/// Plans a reproduction whose results go below `root`, an absolute path.
///
/// # Errors
/// Sites that cannot be read or split as asked for.
pub fn plan(config: &ReproduceConfig, root: &Path) -> Result<Plan> {
    plan_of(config, root, &site::sequences)
}

/// The same for who has planned it before: whether everybody stays in their room is not asked again.
///
/// # Errors
/// As [`plan`], less that.
pub fn plan_again(config: &ReproduceConfig, root: &Path) -> Result<Plan> {
    plan_of(config, root, &|config, _| site::drawn(config))
}

fn plan_of(config: &ReproduceConfig, root: &Path, sequences: &Sequences) -> Result<Plan> {
    let weights = config.comparison.lpips.as_ref().map(|lpips| digest(&[&lpips.weights, &lpips.heads])).transpose()?;
    let mut planner = Planner { config, root, weights, sequences, plan: Plan::default() };
    let first = planner.place(FIRST, &config.site)?;
    let second = config.second_room.as_deref().map(|site| planner.place("second_room", site)).transpose()?;
    let scene = config.second_scene.as_ref().map(|scene| planner.place("second_scene", &scene.site)).transpose()?;
    let trained = planner.all(&first, second.as_ref())?;
    planner.beyond(&first, scene.as_ref(), &trained[&Variant::Ours][0])?;
    Ok(planner.plan)
}

/// The trainings of every variant, one for each draw.
type Trainings = BTreeMap<Variant, Vec<Trained>>;

/// A training stage and the checkpoint that it leaves.
#[derive(Clone, Debug)]
struct Trained {
    stage: usize,
    checkpoint: PathBuf,
}

impl Planner<'_> {
    fn all(&mut self, first: &Place, second: Option<&Place>) -> Result<Trainings> {
        let SubjectSplit { training, unseen, additional } = &self.config.split;
        check_split(&first.takes, training, unseen, additional.as_deref())?;
        if let Some(second) = second
            && second.of_subject(training).next().is_none()
        {
            return Err(Error::setting("second_room", second.recordings.display(), format!("recordings of {training}")));
        }
        preflight::check(self.config, "site", &first.board)?;
        preflight::check_recognition(self.config, &first.board)?;
        if let Some(second) = second {
            preflight::check(self.config, "second_room", &second.board)?;
            preflight::check_adaptation(self.config, &first.board, &second.board, second.of_subject(training).count())?;
        }
        let trained = self.trainings(first)?;
        let adapted = second.map(|second| self.adaptations(second, &trained[&Variant::Ours][0]));
        self.methods(first, &trained)?;
        if let (Some(second), Some(adapted)) = (second, adapted) {
            self.second_room(second, &adapted);
        }
        Ok(trained)
    }

    /// What is asked for beyond the comparison and the adaptation.
    fn beyond(&mut self, first: &Place, scene: Option<&Place>, ours: &Trained) -> Result<()> {
        if let (Some(place), Some(scene)) = (scene, &self.config.second_scene) {
            self.second_scene(first, place, scene, ours)?;
        }
        if let Some(stability) = &self.config.stability {
            self.stability(first, stability);
        }
        self.figures(first, ours);
        Ok(())
    }

    fn add(&mut self, name: String, mut parents: Vec<usize>, place: Option<&Place>, task: Task) -> usize {
        parents.extend(place.and_then(|place| place.stage));
        let settings = serde_json::to_value(&task).expect("plain data");
        let mut keys: Vec<&Key> = parents.iter().map(|&parent| &self.plan.stages[parent].key).collect();
        keys.extend(place.filter(|place| place.stage.is_none()).map(|place| &place.key));
        let key = Key::new(name, &settings, &keys);
        if let Some(known) = self.plan.stages.iter().position(|stage| stage.key == key) {
            return known;
        }
        self.plan.stages.push(Stage { key, settings, parents, task });
        self.plan.stages.len() - 1
    }

    fn folder(&self, stage: usize) -> PathBuf {
        stage_folder(self.root, &self.plan.stages[stage].key)
    }

    fn trainings(&mut self, place: &Place) -> Result<Trainings> {
        let config = self.config;
        let (recordings, names) = training_takes(config, place);
        let mut trained: Trainings = BTreeMap::new();
        // Draws after one another: what of the geometry is known serves all of them.
        let draws = config.variants.iter().flat_map(|&variant| (0..config.seeds).map(move |draw| (variant, draw)));
        for (variant, draw) in draws {
            let simulator = Box::new(variant.settings(&config.simulator, &config.dense_surface));
            let mut parents = vec![];
            let mut effects = None;
            if variant == Variant::WithEffects {
                let stage = self.diagnosis(place)?;
                effects = Some(self.folder(stage).join("effects.json"));
                parents.push(stage);
            }
            let task = Task::Train {
                recordings: recordings.clone(),
                names: names.clone(),
                simulator,
                training: Box::new(variant.training(&config.training)),
                seed: config.seed + draw as u64,
                effects,
                start_from: None,
            };
            let drawn = Drawn { method: Method::Variant(variant.trained_as()), draw };
            let stage = self.add(format!("train/{}", drawn.id()), parents, Some(place), task);
            trained.entry(variant).or_default().push(Trained { stage, checkpoint: self.folder(stage).join("last") });
        }
        Ok(trained)
    }

    fn diagnosis(&mut self, place: &Place) -> Result<usize> {
        let config = self.config;
        let of_subject = |take: &&Take| take.action == config.diagnosed_action;
        let take = place.of_subject(&config.split.training).find(of_subject).ok_or_else(|| {
            Error::setting("diagnosed_action", &config.diagnosed_action, format!("an action of {}", config.split.training))
        })?;
        let task = Task::Diagnose {
            recording: place.recordings.join(&take.name),
            name: take.name.clone(),
            diagnosis: config.diagnosis.clone(),
        };
        let stage = self.add(format!("diagnose/{}", take.name), vec![], Some(place), task);
        self.plan.diagnosis = Some(stage);
        Ok(stage)
    }
}

impl MethodStages {
    fn note(&mut self, stage: usize, take: &Take, held_out: bool) {
        if held_out {
            self.intra.push(stage);
        } else {
            self.cross.push(stage);
            self.cross_actions.push(take.action.clone());
            self.cross_takes.push(take.name.clone());
        }
    }
}

/// First digits of the hash of some files.
fn digest(files: &[&PathBuf]) -> Result<String> {
    let mut digest = Sha256::new();
    for file in files {
        digest.update(files::read(file)?);
    }
    Ok(hex(&digest.finalize()[..6]))
}

/// Folders and names of the recordings that simulators learn from.
fn training_takes(config: &ReproduceConfig, place: &Place) -> (Vec<PathBuf>, Vec<String>) {
    let takes = place.of_subject(&config.split.training);
    takes.map(|take| (place.recordings.join(&take.name), take.name.clone())).unzip()
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
