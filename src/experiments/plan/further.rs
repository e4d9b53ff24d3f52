//! Stages beyond the comparison on the first site and the adaptation to another room: the second scene, the long trainings whose
//! stability is asked for, and the figures.

use std::path::PathBuf;

use super::stages::Learned;
use super::{ARM_SWING, Drawn, Method, MethodStages, Place, Planner, Trained};
use crate::error::{Error, Result};
use crate::experiments::config::{Protocol, SecondSceneConfig, StabilityConfig};
use crate::experiments::figures::{FigureColumn, FigureTask, Panel};
use crate::experiments::preflight;
use crate::experiments::takes::Take;
use crate::experiments::task::Task;
use crate::experiments::variants::Variant;
use crate::simulator::Part;

/// A picture of one recording by several variants, beside the measured one.
struct Compared {
    name: &'static str,
    title: &'static str,
    static_removed: bool,
    simulated: &'static [(&'static str, Variant)],
    measured: &'static [(&'static str, Panel)],
}

const MEASURED: &[(&str, Panel)] = &[("measured", Panel::Measured)];

const COMPARED: [Compared; 4] = [
    Compared {
        name: "noise",
        title: "Noise, range-Doppler, middle frame",
        static_removed: false,
        simulated: &[("no noise", Variant::WithoutNoise), ("fixed noise", Variant::FixedNoise), ("learned noise", Variant::Ours)],
        measured: MEASURED,
    },
    Compared {
        name: "loss_scale",
        title: "Linear or dB, range-Doppler, middle frame",
        static_removed: false,
        simulated: &[("learned by a linear loss", Variant::LinearLoss), ("learned by a dB loss", Variant::Ours)],
        measured: &[("measured, linear", Panel::MeasuredLinear), ("measured, dB", Panel::Measured)],
    },
    Compared {
        name: "graph",
        title: "Graph convolution, range-Doppler, middle frame, static removed",
        static_removed: true,
        simulated: &[
            ("no GCN in training", Variant::WithoutGcn),
            ("GCN at inference", Variant::GcnAtInference),
            ("HybridSim", Variant::Ours),
        ],
        measured: MEASURED,
    },
    Compared {
        name: "found_effects",
        title: "What the diagnosis found, range-Doppler, middle frame",
        static_removed: false,
        simulated: &[("without", Variant::Ours), ("with what was found", Variant::WithEffects)],
        measured: MEASURED,
    },
];

impl Planner<'_> {
    /// Trained on some actions of the second scene, scored and recognised on others (paper, section 4.8; that the classifier
    /// tells the evaluated actions apart, learned from simulations of the very motions it is tested on as in section 4.5, is our
    /// reading).
    pub(super) fn second_scene(&mut self, first: &Place, place: &Place, scene: &SecondSceneConfig, ours: &Trained) -> Result<()> {
        let config = self.config;
        let subject = &config.split.training;
        for (key, actions) in [("training", &scene.training), ("evaluated", &scene.evaluated)] {
            let shown = |action: &String| place.of_subject(subject).any(|take| take.action == *action);
            if let Some(missing) = actions.iter().find(|action| !shown(action)) {
                return Err(Error::setting(format!("second_scene.{key}"), missing, format!("an action of {subject} there")));
            }
        }
        preflight::check(config, "second_scene.site", &place.board)?;
        preflight::check_recognition(config, &place.board)?;
        preflight::check_same_board("second_scene.site", &first.board, &place.board)?;
        let of = |actions: &[String]| -> Vec<&Take> {
            place.of_subject(subject).filter(|take| actions.contains(&take.action)).collect()
        };
        let (learned, tested) = (of(&scene.training), of(&scene.evaluated));
        let task = Task::Train {
            recordings: learned.iter().map(|take| place.recordings.join(&take.name)).collect(),
            names: learned.iter().map(|take| take.name.clone()).collect(),
            simulator: Box::new(config.simulator.clone()),
            training: Box::new(config.training.clone()),
            seed: config.seed,
            effects: None,
            start_from: None,
        };
        let stage = self.add(format!("train/{}", Method::SceneOurs.id()), vec![], Some(place), task);
        let there = Trained { stage, checkpoint: self.folder(stage).join("last") };
        for (method, trained) in [(Method::SceneOurs, &there), (Method::SceneUnadapted, ours)] {
            let mut stages = MethodStages { train: Some(trained.stage), ..Default::default() };
            for take in &tested {
                let simulate = self.simulate(Drawn::first(method), place, take, trained);
                stages.simulate.push(simulate);
                let simulated = self.folder(simulate).join("recording");
                self.scene_scores(&mut stages, method, place, take, vec![simulate], simulated);
            }
            let learned = self.simulated_by(0, stages.simulate.iter().copied().zip(tested.iter().copied()));
            self.scene_recognition(&mut stages, method, place, &tested, learned);
            self.plan.methods.push((method, vec![stages]));
        }
        if place.again.subjects.contains(subject) {
            let mut stages = MethodStages::default();
            for take in &tested {
                self.scene_scores(&mut stages, Method::SceneAgain, place, take, vec![], place.again.folder.join(&take.name));
            }
            let learned = Learned::recorded(&place.again.folder, &tested);
            self.scene_recognition(&mut stages, Method::SceneAgain, place, &tested, learned);
            self.plan.methods.push((Method::SceneAgain, vec![stages]));
        }
        Ok(())
    }

    fn scene_scores(
        &mut self,
        stages: &mut MethodStages,
        method: Method,
        place: &Place,
        take: &Take,
        parents: Vec<usize>,
        simulated: PathBuf,
    ) {
        let task = self.compare(place, take, simulated, false);
        let stage = self.add(format!("compare/{}/{}", method.id(), take.name), parents, Some(place), task);
        stages.note(stage, take, false);
    }

    fn scene_recognition(
        &mut self,
        stages: &mut MethodStages,
        method: Method,
        place: &Place,
        tested: &[&Take],
        learned: Learned,
    ) {
        if self.config.protocols.contains(&Protocol::SameMotions) {
            let stage = self.recognition(method.id(), Protocol::SameMotions, place, tested, learned);
            stages.recognition.insert(Protocol::SameMotions, stage);
        }
    }

    /// Two long trainings on the first site, with the graph convolution and without.
    pub(super) fn stability(&mut self, place: &Place, stability: &StabilityConfig) {
        let config = self.config;
        let (recordings, names) = super::training_takes(config, place);
        for variant in [Variant::Ours, Variant::WithoutGcn] {
            let task = Task::Stability {
                recordings: recordings.clone(),
                names: names.clone(),
                simulator: Box::new(variant.settings(&config.simulator, &config.dense_surface)),
                training: Box::new(stability.training(&config.training)),
                seed: config.seed,
            };
            let stage = self.add(format!("stability/{}", variant.id()), vec![], Some(place), task);
            self.plan.stability.push((variant, stage));
        }
    }

    /// The paper's pictures of range-Doppler maps, as far as their variants are asked for.
    pub(super) fn figures(&mut self, place: &Place, ours: &Trained) {
        let unseen: Vec<&Take> = place.of_subject(&self.config.split.unseen).collect();
        let column = |title: &str, panel: Panel| FigureColumn { title: title.into(), panel };
        let parts = Part::ALL.map(|part| column(part.name(), Panel::Part(part)));
        let whole = [column("sum", Panel::Whole), column("measured", Panel::Measured)];
        // One row for each action.
        let mut actions: Vec<&Take> = vec![];
        for take in &unseen {
            if !actions.iter().any(|known| known.action == take.action) {
                actions.push(take);
            }
        }
        // Effects act on the sum.
        if self.config.simulator.effects.is_empty() {
            let columns = parts.into_iter().chain(whole).collect();
            self.figure(
                "decomposition",
                "Parts of the signal, range-Doppler, middle frame",
                false,
                columns,
                &actions,
                place,
                ours,
            );
        }
        let Some(&take) = unseen.iter().find(|take| take.action == ARM_SWING).or(unseen.first()) else { return };
        for compared in &COMPARED {
            let simulated = compared.simulated.iter().map(|&(title, variant)| {
                let stage = self.simulated(Method::Variant(variant), take)?;
                Some(column(title, Panel::Simulated(vec![self.folder(stage).join("recording")])))
            });
            let Some(simulated) = simulated.collect::<Option<Vec<_>>>() else { continue };
            let measured = compared.measured.iter().map(|(title, panel)| column(title, panel.clone()));
            let columns = simulated.into_iter().chain(measured).collect();
            self.figure(compared.name, compared.title, compared.static_removed, columns, &[take], place, ours);
        }
    }

    /// The stage that simulated a recording of the first site.
    fn simulated(&self, method: Method, take: &Take) -> Option<usize> {
        let name = format!("simulate/{}/{}", method.id(), take.name);
        self.plan.stages.iter().position(|stage| stage.key.name == name)
    }

    #[allow(clippy::too_many_arguments, reason = "one call says all of a figure")]
    fn figure(
        &mut self,
        name: &str,
        title: &str,
        static_removed: bool,
        columns: Vec<FigureColumn>,
        takes: &[&Take],
        place: &Place,
        ours: &Trained,
    ) {
        let mut parents = vec![ours.stage];
        for column in &columns {
            if let Panel::Simulated(folders) = &column.panel {
                let of = |stage: &usize| folders.iter().any(|folder| folder.starts_with(self.folder(*stage)));
                parents.extend((0..self.plan.stages.len()).filter(of));
            }
        }
        let task = FigureTask {
            figure: name.into(),
            title: title.into(),
            static_removed,
            columns,
            measured: takes.iter().map(|take| place.recordings.join(&take.name)).collect(),
            names: takes.iter().map(|take| take.name.clone()).collect(),
            actions: takes.iter().map(|take| take.action.clone()).collect(),
            checkpoint: ours.checkpoint.clone(),
            seed: self.config.seed,
        };
        let stage = self.add(format!("figure/{name}"), parents, Some(place), Task::Figure(Box::new(task)));
        self.plan.figures.push((name.into(), stage));
    }
}
