//! Does the stages of a plan, one after the other.

use std::collections::BTreeSet;
use std::path::Path;

use burn::tensor::Device;

use super::plan::{Plan, Stage};
use super::stage::{Record, Store};
use super::steps::{Bench, baseline, compare, diagnose, figure, recognise, simulate, site, train};
use super::task::Task;
use crate::error::Result;

/// What happens in a reproduction, for whoever shows it.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// A stage begins. `known`: it is done already.
    Stage { index: usize, of: usize, name: &'a str, known: bool },
    /// How far the stage is.
    Step { done: usize, of: usize },
    /// It is done.
    Done { name: &'a str, seconds: f64 },
}

/// Does what is not done yet, below the store's folder; the records of all stages, in the plan's order.
///
/// # Errors
/// Whatever a stage refuses; what was done before stays done.
pub fn run(plan: &Plan, store: &Store, devices: &[Device], tell: &mut dyn FnMut(Event)) -> Result<Vec<Record>> {
    run_some(plan, &(0..plan.stages.len()).collect(), store, devices, tell)
}

/// The same for some stages, which must hold all that they need ([`Plan::needed`]).
///
/// # Errors
/// Whatever a stage refuses; what was done before stays done.
pub fn run_some(
    plan: &Plan,
    wanted: &BTreeSet<usize>,
    store: &Store,
    devices: &[Device],
    tell: &mut dyn FnMut(Event),
) -> Result<Vec<Record>> {
    let mut bench = Bench::new(devices);
    let of = wanted.len();
    let mut records = Vec::with_capacity(of);
    for (index, stage) in wanted.iter().map(|&stage| &plan.stages[stage]).enumerate() {
        let name = stage.key.name.as_str();
        let known = store.done(&stage.key);
        tell(Event::Stage { index, of, name, known: known.is_some() });
        let record = match known {
            Some(record) => record,
            None => {
                let parents = stage.parents.iter().map(|&parent| plan.stages[parent].key.folder()).collect();
                let record = store.perform(&stage.key, stage.settings.clone(), parents, &mut |folder| {
                    work(stage, folder, &mut bench, &mut |done, of| tell(Event::Step { done, of }))
                })?;
                tell(Event::Done { name, seconds: record.seconds });
                record
            }
        };
        records.push(record);
    }
    Ok(records)
}

fn work(stage: &Stage, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    match &stage.task {
        Task::Site { config, settings_folder } => site(config, settings_folder, folder, step),
        Task::Diagnose { recording, diagnosis, .. } => diagnose(recording, diagnosis, folder, step),
        Task::Train { recordings, simulator, training, seed, effects, start_from, .. } => {
            let task = train::Task { recordings, simulator, training, seed: *seed, effects, start_from };
            train::train(&task, folder, bench, step)
        }
        Task::Stability { recordings, simulator, training, seed, .. } => {
            let task = train::Task { recordings, simulator, training, seed: *seed, effects: &None, start_from: &None };
            train::stability(&task, folder, bench, step)
        }
        Task::Figure(task) => figure(task, folder, bench, step),
        Task::Simulate { checkpoint, recording, name, graph_at_inference, seed } => {
            let task = simulate::Task { checkpoint, recording, name, graph_at_inference: *graph_at_inference, seed: *seed };
            simulate::simulate(&task, folder, bench, step)
        }
        Task::Calibrate { method, recordings, .. } => baseline::calibrate(*method, recordings, folder, bench, step),
        Task::NoiseLevel { recordings, .. } => baseline::measure_noise(recordings, folder, step),
        Task::Baseline { method, recording, name, gain, checkpoint, noise_level, seed } => {
            let [gain, checkpoint, noise_level] = [gain, checkpoint, noise_level].map(Option::as_deref);
            let task = baseline::Task { method: *method, recording, name, gain, checkpoint, noise_level, seed: *seed };
            baseline::simulate(&task, folder, bench, step)
        }
        Task::Compare { measured, simulated, held_out_fraction, comparison, .. } => {
            compare(measured, simulated, *held_out_fraction, comparison, folder, bench)
        }
        Task::Recognise { train, test, recognition, .. } => recognise(recognition, train, test, folder, bench, step),
    }
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
