//! All stages of a reproduction and what they depend on, known before the first one runs.
//!
//! Measured recordings come first, then trainings, then every method's simulation of every recording (one recording after
//! the other, so that its geometry is worked out once for all methods) with its scores, then recognition, then `further`
//! experiments and the figures.

mod further;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::config::{BaselineName, Protocol, ReproduceConfig, SubjectSplit};
use super::preflight::{self, Board};
use super::stage::{Key, read_record, stage_folder};
use super::takes::{Take, check_split, read_takes, takes_in};
use super::task::Task;
use super::variants::Variant;
use crate::data::{entries::entries, files, hex};
use crate::error::{Error, Result};
use crate::site::{self, SiteConfig};
use crate::training::TrainingConfig;

/// Who simulates; or, for comparison, measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    Baseline(BaselineName),
    /// A baseline with the noise that the training recordings' receiver has, in place of the paper's share of the signal.
    ReceiverNoise(BaselineName),
    Variant(Variant),
    /// The same truth recorded again with other noise: no simulator can do better.
    Again,
    /// The same with another draw of the mesh's error too: nobody who knows the body no better can predict how its returns
    /// interfere.
    OtherMesh,
    /// Ours brought to the second room by so many of its frames; with zero, as it was.
    Adapted(usize),
    /// Trained from the beginning on so many frames of the second room, as many steps long.
    FromScratch(usize),
    /// Trained on some actions of the second scene, used on others.
    SceneOurs,
    /// Used on them as the first site trained it.
    SceneUnadapted,
    /// As [`Method::Again`], in the second scene.
    SceneAgain,
}

impl Method {
    /// As in folders.
    pub fn id(self) -> String {
        match self {
            Self::Baseline(name) => name.id().into(),
            Self::ReceiverNoise(name) => format!("{}-receiver-noise", name.id()),
            Self::Variant(variant) => variant.id().into(),
            Self::Again => "again".into(),
            Self::OtherMesh => "other_mesh".into(),
            Self::Adapted(frames) => format!("adapted_{frames}"),
            Self::FromScratch(frames) => format!("from_scratch_{frames}"),
            Self::SceneOurs => "scene_ours".into(),
            Self::SceneUnadapted => "scene_unadapted".into(),
            Self::SceneAgain => "scene_again".into(),
        }
    }

    /// As in tables.
    pub fn title(self) -> String {
        match self {
            Self::Baseline(name) => name.title().into(),
            Self::ReceiverNoise(name) => format!("{}, receiver's noise", name.title()),
            Self::Variant(variant) => variant.title().into(),
            Self::Again => "measured again (ceiling)".into(),
            Self::OtherMesh => "measured with another mesh error".into(),
            Self::Adapted(frames) => format!("HybridSim, adapted to {frames} frames"),
            Self::FromScratch(frames) => format!("HybridSim, trained on {frames} frames only"),
            Self::SceneOurs => "HybridSim, trained there on other actions".into(),
            Self::SceneUnadapted => "HybridSim as the first site trained it".into(),
            Self::SceneAgain => "measured again there (ceiling)".into(),
        }
    }
}

/// One stage.
#[derive(Clone, Debug)]
pub struct Stage {
    pub key: Key,
    pub settings: Value,
    /// Stages that must be done before.
    pub parents: Vec<usize>,
    pub task: Task,
}

/// The stages whose results belong to one method.
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

/// What is to be done, in an order in which it can be.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub stages: Vec<Stage>,
    /// In the order of the tables.
    pub methods: Vec<(Method, MethodStages)>,
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
    planner.beyond(&first, scene.as_ref(), &trained[&Variant::Ours])?;
    Ok(planner.plan)
}

/// A training stage and the checkpoint that it leaves.
#[derive(Clone, Debug)]
struct Trained {
    stage: usize,
    checkpoint: PathBuf,
}

impl Planner<'_> {
    fn all(&mut self, first: &Place, second: Option<&Place>) -> Result<BTreeMap<Variant, Trained>> {
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
        let adapted = second.map(|second| self.adaptations(second, &trained[&Variant::Ours]));
        self.methods(first, &trained);
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

    /// A site that is recorded, or a folder of recordings.
    fn place(&mut self, name: &str, path: &Path) -> Result<Place> {
        if path.is_dir() {
            let recordings = files::absolute(path)?;
            let mut board = None;
            let takes = read_takes(&recordings, &mut |recording| Board::join(&mut board, recording))?;
            let (_, board) = board.expect("no takes are refused");
            let key = Key::new(name, &(&recordings, &takes, contents(&recordings)?), &[]);
            return Ok(Place { stage: None, key, recordings, again: Again::default(), other_mesh: None, takes, board });
        }
        let config = SiteConfig::read(path, &[])?;
        let board = Board::of_site(&config)?;
        if config.unseen.contains(&self.config.split.training) {
            let expected = format!("a subject that {} does not list as unseen", path.display());
            return Err(Error::setting("split.training", &self.config.split.training, expected));
        }
        let settings_folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let again = config.again.clone();
        let other_mesh = self.other_mesh(name, &config, &settings_folder);
        let task = Task::Site { config: Box::new(config.clone()), settings_folder: settings_folder.clone() };
        let stage = self.add(name.into(), vec![], None, task);
        let folder = self.folder(stage);
        // Posing everybody, as the plan of a site does, is not needed again once they are recorded.
        let takes = match read_record(&folder) {
            Some(_) => takes_in(&folder.join("recordings"))?,
            None => planned((self.sequences)(&config, &settings_folder)?),
        };
        let key = self.plan.stages[stage].key.clone();
        Ok(Place {
            stage: Some(stage),
            key,
            recordings: folder.join("recordings"),
            again: Again { folder: folder.join("again"), subjects: again },
            other_mesh,
            takes,
            board,
        })
    }

    /// The compared subjects of the first site as another mesh of the same error has them, and the subject on whom the
    /// receiver's gain is settled.
    fn other_mesh(&mut self, name: &str, config: &SiteConfig, settings_folder: &Path) -> Option<usize> {
        if !(self.config.other_mesh && name == FIRST && config.record.mesh_error_m > 0.0) {
            return None;
        }
        let SubjectSplit { training, unseen, .. } = &self.config.split;
        let settled = config.subjects.first()?;
        let compared = |subject: &&String| [training, unseen, settled].contains(subject);
        let mut config = SiteConfig { again: vec![], ..config.clone() };
        config.subjects.retain(|subject| compared(&subject));
        config.unseen.retain(|subject| compared(&subject));
        config.record.redraw += 1;
        let task = Task::Site { config: Box::new(config), settings_folder: settings_folder.to_path_buf() };
        Some(self.add("other_mesh".into(), vec![], None, task))
    }

    fn trainings(&mut self, place: &Place) -> Result<BTreeMap<Variant, Trained>> {
        let config = self.config;
        let (recordings, names) = training_takes(config, place);
        let mut trained: BTreeMap<Variant, Trained> = BTreeMap::new();
        for &variant in &config.variants {
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
                seed: config.seed,
                effects,
                start_from: None,
            };
            let stage = self.add(format!("train/{}", variant.trained_as().id()), parents, Some(place), task);
            trained.insert(variant, Trained { stage, checkpoint: self.folder(stage).join("last") });
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

    /// Simulation, scores and recognition of every method, on the first site.
    fn methods(&mut self, place: &Place, trained: &BTreeMap<Variant, Trained>) {
        let config = self.config;
        let SubjectSplit { training, unseen, additional } = &config.split;
        let rules: &[fn(BaselineName) -> Method] =
            if config.receiver_noise { &[Method::Baseline, Method::ReceiverNoise] } else { &[Method::Baseline] };
        let baselines = config.baselines.iter().flat_map(|&name| rules.iter().map(move |rule| rule(name)));
        let mut methods: Vec<(Method, MethodStages)> = baselines
            .chain(config.variants.iter().map(|&variant| Method::Variant(variant)))
            .map(|method| (method, MethodStages::default()))
            .collect();
        let [mut again, mut other_mesh] = [MethodStages::default(), MethodStages::default()];
        // Everybody is needed where the classifier learns from others.
        let everybody = config.protocols.contains(&Protocol::OtherSubjects);
        let is_additional = |take: &Take| additional.as_ref() == Some(&take.subject);
        let needed = |take: &&Take| everybody || take.subject == *training || take.subject == *unseen || is_additional(take);
        let mut simulations: Vec<Vec<(usize, &Take)>> = vec![vec![]; methods.len()];
        for take in place.takes.iter().filter(needed) {
            for ((method, stages), simulations) in methods.iter_mut().zip(&mut simulations) {
                if !everybody && is_additional(take) && *method != Method::Variant(Variant::Ours) {
                    continue;
                }
                let ours = &trained[&Variant::Ours];
                let simulate = match *method {
                    Method::Variant(variant) => {
                        stages.train = Some(trained[&variant].stage);
                        self.simulate(*method, place, take, &trained[&variant])
                    }
                    Method::Baseline(name) => self.baseline(name, None, place, take, ours),
                    Method::ReceiverNoise(name) => {
                        let noise = self.noise_level(place);
                        self.baseline(name, Some(noise), place, take, ours)
                    }
                    _ => unreachable!("the first site has baselines and variants"),
                };
                stages.simulate.push(simulate);
                simulations.push((simulate, take));
                let simulated = self.folder(simulate).join("recording");
                self.scores(stages, *method, place, take, simulate, simulated);
            }
            if place.again.subjects.contains(&take.subject) {
                self.scores_again(&mut again, Method::Again, place, take, place.again.folder.join(&take.name), None);
            }
            // Another mesh is recorded of the compared subjects alone.
            if let Some(stage) = place.other_mesh.filter(|_| !is_additional(take)) {
                let recorded = self.folder(stage).join("recordings").join(&take.name);
                self.scores_again(&mut other_mesh, Method::OtherMesh, place, take, recorded, Some(stage));
            }
        }
        let tested: Vec<&Take> = place.of_subject(unseen).collect();
        let second: Vec<&Take> = place.takes.iter().filter(|take| is_additional(take)).collect();
        let learn_additional = !second.is_empty() && config.protocols.contains(&Protocol::SameMotions);
        for ((method, stages), simulated) in methods.iter_mut().zip(&simulations) {
            if *method == Method::Variant(Variant::Ours) && learn_additional {
                let learned: Vec<usize> =
                    simulated.iter().filter(|(_, take)| is_additional(take)).map(|&(stage, _)| stage).collect();
                let folders = learned.iter().map(|&stage| self.folder(stage).join("recording")).collect();
                let id = format!("{}_additional", method.id());
                stages.additional_recognition =
                    Some(self.recognition(id, Protocol::SameMotions, place, &second, learned, folders));
            }
            for &protocol in &config.protocols {
                let learned: Vec<usize> = simulated
                    .iter()
                    .filter(|(_, take)| (take.subject == *unseen) == (protocol == Protocol::SameMotions))
                    .map(|&(stage, _)| stage)
                    .collect();
                let folders = learned.iter().map(|&stage| self.folder(stage).join("recording")).collect();
                let stage = self.recognition(method.id(), protocol, place, &tested, learned, folders);
                stages.recognition.insert(protocol, stage);
            }
        }
        // Trained on what was measured: how well it could go.
        for &protocol in &config.protocols {
            let folders: Option<Vec<PathBuf>> = match protocol {
                Protocol::SameMotions => {
                    let recorded = place.again.subjects.contains(unseen);
                    recorded.then(|| place.of_subject(unseen).map(|take| place.again.folder.join(&take.name)).collect())
                }
                Protocol::OtherSubjects => {
                    let others = place.takes.iter().filter(|take| take.subject != *unseen);
                    Some(others.map(|take| place.recordings.join(&take.name)).collect())
                }
            };
            if let Some(folders) = folders {
                let stage = self.recognition("again".into(), protocol, place, &tested, vec![], folders);
                again.recognition.insert(protocol, stage);
            }
        }
        if learn_additional && second.iter().all(|take| place.again.subjects.contains(&take.subject)) {
            let folders = second.iter().map(|take| place.again.folder.join(&take.name)).collect();
            let id = "again_additional".into();
            again.additional_recognition = Some(self.recognition(id, Protocol::SameMotions, place, &second, vec![], folders));
        }
        self.plan.methods.extend(methods);
        if let Some(stage) = place.other_mesh {
            if config.protocols.contains(&Protocol::SameMotions) {
                let recorded = self.folder(stage).join("recordings");
                let folders = place.of_subject(unseen).map(|take| recorded.join(&take.name)).collect();
                let id = Method::OtherMesh.id();
                let learned = self.recognition(id, Protocol::SameMotions, place, &tested, vec![stage], folders);
                other_mesh.recognition.insert(Protocol::SameMotions, learned);
            }
            self.plan.methods.push((Method::OtherMesh, other_mesh));
        }
        self.plan.methods.push((Method::Again, again));
    }

    fn simulate(&mut self, method: Method, place: &Place, take: &Take, trained: &Trained) -> usize {
        let task = Task::Simulate {
            checkpoint: trained.checkpoint.clone(),
            recording: place.recordings.join(&take.name),
            name: take.name.clone(),
            graph_at_inference: method == Method::Variant(Variant::GcnAtInference),
            seed: self.config.seed,
        };
        self.add(format!("simulate/{}/{}", method.id(), take.name), vec![trained.stage], Some(place), task)
    }

    /// A baseline's simulation of a recording: with our direct path, or at the level that the training recordings have.
    /// With the noise that a stage has measured, or the paper's.
    fn baseline(&mut self, method: BaselineName, noise: Option<usize>, place: &Place, take: &Take, ours: &Trained) -> usize {
        let (parent, gain, checkpoint) = match method {
            BaselineName::TwoBounce => (ours.stage, None, Some(ours.checkpoint.clone())),
            _ => {
                let (recordings, names) = training_takes(self.config, place);
                let task = Task::Calibrate { method, recordings, names };
                let stage = self.add(format!("calibrate/{}", method.id()), vec![], Some(place), task);
                (stage, Some(self.folder(stage).join("gain.json")), None)
            }
        };
        let (recording, name, seed) = (place.recordings.join(&take.name), take.name.clone(), self.config.seed);
        let noise_level = noise.map(|stage| self.folder(stage).join("noise.json"));
        let task = Task::Baseline { method, recording, name, gain, checkpoint, noise_level, seed };
        let id = if noise.is_some() { Method::ReceiverNoise(method) } else { Method::Baseline(method) }.id();
        let parents = std::iter::once(parent).chain(noise).collect();
        self.add(format!("simulate/{id}/{}", take.name), parents, Some(place), task)
    }

    /// Of the receiver, as the training recordings show it.
    fn noise_level(&mut self, place: &Place) -> usize {
        let (recordings, names) = training_takes(self.config, place);
        self.add("noise_level".into(), vec![], Some(place), Task::NoiseLevel { recordings, names })
    }

    /// Scores of a simulated recording, where its subject is one that is scored.
    fn scores(
        &mut self,
        stages: &mut MethodStages,
        method: Method,
        place: &Place,
        take: &Take,
        parent: usize,
        simulated: PathBuf,
    ) {
        let held_out = take.subject == self.config.split.training;
        let additional = self.is_additional(take);
        let full = method == Method::Variant(Variant::Ours);
        let scored = held_out || take.subject == self.config.split.unseen || (additional && full);
        if !scored {
            return;
        }
        let task = self.compare(place, take, simulated, held_out);
        let stage = self.add(format!("compare/{}/{}", method.id(), take.name), vec![parent], Some(place), task);
        if additional {
            stages.additional.push(stage);
        } else {
            stages.note(stage, take, held_out);
        }
    }

    /// Scores of what was recorded in place of a simulation, by a stage of its own or with the site.
    fn scores_again(
        &mut self,
        stages: &mut MethodStages,
        method: Method,
        place: &Place,
        take: &Take,
        again: PathBuf,
        by: Option<usize>,
    ) {
        let held_out = take.subject == self.config.split.training;
        let additional = self.is_additional(take);
        if held_out || additional || take.subject == self.config.split.unseen {
            let task = self.compare(place, take, again, held_out);
            let parents = by.into_iter().collect();
            let stage = self.add(format!("compare/{}/{}", method.id(), take.name), parents, Some(place), task);
            if additional {
                stages.additional.push(stage);
            } else {
                stages.note(stage, take, held_out);
            }
        }
    }

    fn is_additional(&self, take: &Take) -> bool {
        self.config.split.additional.as_ref() == Some(&take.subject)
    }

    fn compare(&self, place: &Place, take: &Take, simulated: PathBuf, held_out: bool) -> Task {
        Task::Compare {
            measured: place.recordings.join(&take.name),
            simulated,
            name: take.name.clone(),
            held_out_fraction: held_out.then_some(self.config.training.validation_fraction),
            comparison: Box::new(self.config.comparison.clone()),
            weights: self.weights.clone(),
        }
    }

    fn recognition(
        &mut self,
        id: String,
        protocol: Protocol,
        place: &Place,
        test: &[&Take],
        parents: Vec<usize>,
        train: Vec<PathBuf>,
    ) -> usize {
        let task = Task::Recognise {
            train,
            test: test.iter().map(|take| place.recordings.join(&take.name)).collect(),
            names: test.iter().map(|take| take.name.clone()).collect(),
            recognition: Box::new(self.config.recognition.clone()),
        };
        self.add(format!("recognise/{}/{id}", protocol.id()), parents, Some(place), task)
    }

    /// Trainings in the second room.
    fn adaptations(&mut self, place: &Place, ours: &Trained) -> Vec<(Method, Trained)> {
        let config = self.config;
        let (recordings, names) = training_takes(config, place);
        let mut trained = vec![];
        for &frames in &config.adaptation.frames {
            if frames == 0 {
                trained.push((Method::Adapted(0), ours.clone()));
                continue;
            }
            for method in [Method::Adapted(frames), Method::FromScratch(frames)] {
                let adapted = matches!(method, Method::Adapted(_));
                let task = Task::Train {
                    recordings: recordings.clone(),
                    names: names.clone(),
                    simulator: Box::new(config.simulator.clone()),
                    training: Box::new(TrainingConfig {
                        frames: Some(frames),
                        epochs: 1,
                        repeats: (config.adaptation.steps * config.training.frames_per_step).div_ceil(frames),
                        patience_epochs: 0,
                        ..config.training.clone()
                    }),
                    seed: config.seed,
                    effects: None,
                    start_from: adapted.then(|| ours.checkpoint.clone()),
                };
                let parents = if adapted { vec![ours.stage] } else { vec![] };
                let stage = self.add(format!("train/{}", method.id()), parents, Some(place), task);
                trained.push((method, Trained { stage, checkpoint: self.folder(stage).join("last") }));
            }
        }
        trained
    }

    /// Scores of the adapted simulators on the second room's held-out frames.
    fn second_room(&mut self, place: &Place, trained: &[(Method, Trained)]) {
        let mut methods: Vec<(Method, MethodStages)> = trained
            .iter()
            .map(|(method, trained)| (*method, MethodStages { train: Some(trained.stage), ..Default::default() }))
            .collect();
        for take in place.of_subject(&self.config.split.training) {
            for ((method, stages), (_, trained)) in methods.iter_mut().zip(trained) {
                let simulate = self.simulate(*method, place, take, trained);
                stages.simulate.push(simulate);
                let simulated = self.folder(simulate).join("recording");
                self.scores(stages, *method, place, take, simulate, simulated);
            }
        }
        self.plan.methods.extend(methods);
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

/// The recordings that a site will have, in the order in which [`takes_in`] finds them afterwards: keys depend on it.
fn planned(sequences: Vec<site::Sequence>) -> Vec<Take> {
    let take =
        |sequence: site::Sequence| Take { name: sequence.name, subject: sequence.subject, action: sequence.action.name().into() };
    let mut takes: Vec<Take> = sequences.into_iter().map(take).collect();
    takes.sort();
    takes
}

/// First digits of the hash of some files.
fn digest(files: &[&PathBuf]) -> Result<String> {
    let mut digest = Sha256::new();
    for file in files {
        digest.update(files::read(file)?);
    }
    Ok(hex(&digest.finalize()[..6]))
}

/// Every file below a folder with its size and when it was written: what is changed there is done again.
fn contents(folder: &Path) -> Result<Vec<(String, u64, u128)>> {
    let mut found = vec![];
    let mut folders = vec![folder.to_path_buf()];
    while let Some(at) = folders.pop() {
        for path in entries(&at)? {
            let about = std::fs::metadata(&path).map_err(|error| Error::read(&path, error))?;
            if about.is_dir() {
                folders.push(path);
                continue;
            }
            let written = about.modified().ok().and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
            found.push((name, about.len(), written.map_or(0, |since| since.as_nanos())));
        }
    }
    found.sort();
    Ok(found)
}

/// Folders and names of the recordings that simulators learn from.
fn training_takes(config: &ReproduceConfig, place: &Place) -> (Vec<PathBuf>, Vec<String>) {
    let takes = place.of_subject(&config.split.training);
    takes.map(|take| (place.recordings.join(&take.name), take.name.clone())).unzip()
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
