//! The stages that a method has of a recording: its simulation, its scores, what a classifier learns from it.

use std::path::{Path, PathBuf};

use super::{Drawn, Method, MethodStages, Place, Planner, Trained, training_takes};
use crate::experiments::config::{BaselineName, Protocol};
use crate::experiments::takes::Take;
use crate::experiments::task::Task;
use crate::experiments::variants::Variant;
use crate::recognition::RecognitionConfig;

/// What simulates a recording, and the stages that it needs.
pub(super) struct Simulation {
    task: Task,
    parents: Vec<usize>,
}

/// What a classifier learns from.
#[derive(Clone, Debug, Default)]
pub(super) struct Learned {
    /// That made it.
    pub stages: Vec<usize>,
    pub folders: Vec<PathBuf>,
    pub names: Vec<String>,
    pub draw: usize,
}

impl Learned {
    /// Recordings of these takes below a folder.
    pub fn recorded(folder: &Path, takes: &[&Take]) -> Self {
        let folders = takes.iter().map(|take| folder.join(&take.name)).collect();
        Self { folders, names: takes.iter().map(|take| take.name.clone()).collect(), ..Self::default() }
    }

    /// More of it; the draw stays.
    pub fn and(mut self, more: Self) -> Self {
        self.stages.extend(more.stages);
        self.folders.extend(more.folders);
        self.names.extend(more.names);
        self
    }
}

impl Planner<'_> {
    /// What stages have simulated, by one draw.
    pub(super) fn simulated_by<'a>(&self, draw: usize, simulated: impl Iterator<Item = (usize, &'a Take)>) -> Learned {
        let mut learned = Learned { draw, ..Learned::default() };
        for (stage, take) in simulated {
            learned.stages.push(stage);
            learned.folders.push(self.folder(stage).join("recording"));
            learned.names.push(take.name.clone());
        }
        learned
    }

    pub(super) fn simulate(&mut self, drawn: Drawn, place: &Place, take: &Take, trained: &Trained) -> usize {
        let simulation = self.simulation_by(drawn, place, take, trained);
        self.kept(drawn, place, take, simulation)
    }

    /// A trained simulator's.
    pub(super) fn simulation_by(&self, drawn: Drawn, place: &Place, take: &Take, trained: &Trained) -> Simulation {
        let task = Task::Simulate {
            checkpoint: trained.checkpoint.clone(),
            recording: place.recordings.join(&take.name),
            name: take.name.clone(),
            graph_at_inference: drawn.method == Method::Variant(Variant::GcnAtInference),
            seed: self.config.seed + drawn.draw as u64,
        };
        Simulation { task, parents: vec![trained.stage] }
    }

    /// A simulation that is kept, for scores and classifiers.
    pub(super) fn kept(&mut self, drawn: Drawn, place: &Place, take: &Take, Simulation { task, parents }: Simulation) -> usize {
        self.add(format!("simulate/{}/{}", drawn.id(), take.name), parents, Some(place), task)
    }

    /// Scores of the training subject's recording where nobody learns from its simulation: of the held-out frames, which alone are
    /// simulated.
    pub(super) fn held_out(
        &mut self,
        stages: &mut MethodStages,
        drawn: Drawn,
        place: &Place,
        take: &Take,
        Simulation { task, parents }: Simulation,
    ) {
        let task = Task::HeldOut {
            simulation: Box::new(task),
            fraction: self.config.training.validation_fraction,
            comparison: Box::new(self.config.comparison.clone()),
            weights: self.weights.clone(),
        };
        let stage = self.add(format!("compare/{}/{}", drawn.id(), take.name), parents, Some(place), task);
        stages.note(stage, take, true);
    }

    /// A baseline's: with our direct path, or at the level that the training recordings have. With the noise that a stage has
    /// measured, or the paper's.
    pub(super) fn baseline(
        &mut self,
        method: BaselineName,
        noise: Option<usize>,
        place: &Place,
        take: &Take,
        ours: &Trained,
    ) -> Simulation {
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
        Simulation { task, parents: std::iter::once(parent).chain(noise).collect() }
    }

    /// Of the receiver, as the training recordings show it.
    pub(super) fn noise_level(&mut self, place: &Place) -> usize {
        let (recordings, names) = training_takes(self.config, place);
        self.add("noise_level".into(), vec![], Some(place), Task::NoiseLevel { recordings, names })
    }

    /// Scores of a simulated recording, where its subject is one that is scored.
    pub(super) fn scores(
        &mut self,
        stages: &mut MethodStages,
        drawn: Drawn,
        place: &Place,
        take: &Take,
        parent: usize,
        simulated: PathBuf,
    ) {
        let held_out = take.subject == self.config.split.training;
        let additional = self.is_additional(take);
        let full = drawn == Drawn::first(Method::Variant(Variant::Ours));
        let scored = held_out || take.subject == self.config.split.unseen || (additional && full);
        if !scored {
            return;
        }
        let task = self.compare(place, take, simulated, held_out);
        let stage = self.add(format!("compare/{}/{}", drawn.id(), take.name), vec![parent], Some(place), task);
        if additional {
            stages.additional.push(stage);
        } else {
            stages.note(stage, take, held_out);
        }
    }

    /// Scores of what was recorded in place of a simulation, by a stage of its own or with the site.
    pub(super) fn scores_again(
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

    pub(super) fn is_additional(&self, take: &Take) -> bool {
        self.config.split.additional.as_ref() == Some(&take.subject)
    }

    pub(super) fn compare(&self, place: &Place, take: &Take, simulated: PathBuf, held_out: bool) -> Task {
        Task::Compare {
            measured: place.recordings.join(&take.name),
            simulated,
            name: take.name.clone(),
            held_out_fraction: held_out.then_some(self.config.training.validation_fraction),
            comparison: Box::new(self.config.comparison.clone()),
            weights: self.weights.clone(),
        }
    }

    /// A classifier under the protocol.
    pub(super) fn recognition(
        &mut self,
        id: String,
        protocol: Protocol,
        place: &Place,
        test: &[&Take],
        learned: Learned,
    ) -> usize {
        self.classifier(format!("recognise/{}/{id}", protocol.id()), place, test, learned, self.config.recognition.epochs)
    }

    /// A classifier that learns for so many epochs.
    pub(super) fn classifier(&mut self, name: String, place: &Place, test: &[&Take], learned: Learned, epochs: usize) -> usize {
        let settings = &self.config.recognition;
        let seed = settings.seed + learned.draw as u64;
        let task = Task::Recognise {
            train: learned.folders,
            train_names: learned.names,
            test: test.iter().map(|take| place.recordings.join(&take.name)).collect(),
            names: test.iter().map(|take| take.name.clone()).collect(),
            recognition: Box::new(RecognitionConfig { seed, epochs, ..settings.clone() }),
        };
        self.add(name, learned.stages, Some(place), task)
    }
}
