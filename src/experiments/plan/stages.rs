//! The stages that a method has of a recording: its simulation, its scores, what a classifier learns from it.

use std::path::{Path, PathBuf};

use super::{Drawn, Method, MethodStages, Place, Planner, Trained, training_takes};
use crate::experiments::config::{BaselineName, Protocol};
use crate::experiments::takes::Take;
use crate::experiments::task::Task;
use crate::experiments::variants::Variant;
use crate::recognition::RecognitionConfig;

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
        let task = Task::Simulate {
            checkpoint: trained.checkpoint.clone(),
            recording: place.recordings.join(&take.name),
            name: take.name.clone(),
            graph_at_inference: drawn.method == Method::Variant(Variant::GcnAtInference),
            seed: self.config.seed + drawn.draw as u64,
        };
        self.add(format!("simulate/{}/{}", drawn.id(), take.name), vec![trained.stage], Some(place), task)
    }

    /// A baseline's simulation of a recording: with our direct path, or at the level that the training recordings have.
    /// With the noise that a stage has measured, or the paper's.
    pub(super) fn baseline(
        &mut self,
        method: BaselineName,
        noise: Option<usize>,
        place: &Place,
        take: &Take,
        ours: &Trained,
    ) -> usize {
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
