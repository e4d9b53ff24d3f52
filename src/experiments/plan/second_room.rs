//! A second room, to which trained simulators are brought.

use super::{Drawn, Method, MethodStages, Place, Planner, Trained, training_takes};
use crate::experiments::task::Task;
use crate::training::TrainingConfig;

impl Planner<'_> {
    /// Trainings in the second room.
    pub(super) fn adaptations(&mut self, place: &Place, ours: &Trained) -> Vec<(Method, Trained)> {
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
    pub(super) fn second_room(&mut self, place: &Place, trained: &[(Method, Trained)]) {
        let mut methods: Vec<(Method, MethodStages)> = trained
            .iter()
            .map(|(method, trained)| (*method, MethodStages { train: Some(trained.stage), ..Default::default() }))
            .collect();
        for take in place.of_subject(&self.config.split.training) {
            for ((method, stages), (_, trained)) in methods.iter_mut().zip(trained) {
                let drawn = Drawn::first(*method);
                let simulation = self.simulation_by(drawn, place, take, trained);
                self.held_out(stages, drawn, place, take, simulation);
            }
        }
        self.plan.methods.extend(methods.into_iter().map(|(method, stages)| (method, vec![stages])));
    }
}
