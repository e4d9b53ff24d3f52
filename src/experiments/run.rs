//! Does the stages of a plan, one after the other.

use std::collections::BTreeSet;
use std::path::Path;

use burn::tensor::Device;

use super::plan::{Plan, Stage};
use super::stage::{Record, Store};
use super::steps::simulate::{self, Source, Use};
use super::steps::{Bench, Speed, baseline, compare, diagnose, figure, recognise, site, train, write_json};
use super::task::Task;
use crate::data::Shard;
use crate::error::{Error, Result};
use crate::site::record;

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

/// Does what is not done yet of some stages, which must hold all that they need ([`Plan::needed`]), below the store's folder; their
/// records, in the plan's order.
///
/// # Errors
/// Whatever a stage refuses; what was done before stays done.
pub fn run_some(
    plan: &Plan,
    wanted: &BTreeSet<usize>,
    store: &Store,
    devices: &[Device],
    notify: &mut dyn FnMut(Event),
) -> Result<Vec<Record>> {
    let mut bench = Bench::new(devices);
    let of = wanted.len();
    wanted.iter().enumerate().map(|(index, &stage)| one(plan, stage, [index, of], store, &mut bench, notify)).collect()
}

/// One stage, whose parents are done; of a stage that has pieces ([`Stage::pieces`]) also only some, which are kept for whoever
/// does the stage. Whatever the order and the place in which stages are done, they come out the same.
///
/// # Errors
/// A parent that is not done; pieces of a stage that has none; whatever the stage refuses.
pub fn run_one(
    plan: &Plan,
    stage: usize,
    pieces: Shard,
    store: &Store,
    devices: &[Device],
    notify: &mut dyn FnMut(Event),
) -> Result<()> {
    let Stage { key, task, parents, .. } = &plan.stages[stage];
    if let Some(&parent) = parents.iter().find(|&&parent| store.done(&plan.stages[parent].key).is_none()) {
        return Err(Error::Usage {
            message: format!("{}: needs {}, which is not done", key.folder(), plan.stages[parent].key.folder()),
            hint: Some("do the stages in the order in which they are listed".into()),
        });
    }
    if pieces.of == 1 {
        return one(plan, stage, [0, 1], store, &mut Bench::new(devices), notify).map(drop);
    }
    let Task::Site { config, settings_folder } = task else {
        return Err(Error::Usage { message: format!("{}: has no pieces", key.folder()), hint: None });
    };
    let known = store.done(key).is_some();
    notify(Event::Stage { index: 0, of: 1, name: &key.name, known });
    if !known {
        let (folder, _) = store.begin(key)?;
        record(config, settings_folder, &folder, pieces, &mut |done, of, _| notify(Event::Step { done, of }))?;
    }
    Ok(())
}

/// Does the stage, the so-manieth of so many, unless it is done.
pub(super) fn one(
    plan: &Plan,
    stage: usize,
    [index, of]: [usize; 2],
    store: &Store,
    bench: &mut Bench,
    notify: &mut dyn FnMut(Event),
) -> Result<Record> {
    let stage = &plan.stages[stage];
    let name = stage.key.name.as_str();
    let known = store.done(&stage.key);
    notify(Event::Stage { index, of, name, known: known.is_some() });
    if let Some(record) = known {
        return Ok(record);
    }
    let parents = stage.parents.iter().map(|&parent| plan.stages[parent].key.folder()).collect();
    let record = store.perform(&stage.key, stage.settings.clone(), parents, &mut |folder| {
        work(stage, folder, bench, &mut |done, of| notify(Event::Step { done, of }))
    })?;
    notify(Event::Done { name, seconds: record.seconds });
    Ok(record)
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
        Task::Simulate { .. } | Task::Baseline { .. } => {
            let speed = simulated(&stage.task, bench, &mut |source| simulate::keep(source, folder, step))?;
            write_json(&folder.join("speed.json"), &speed)
        }
        Task::HeldOut { simulation, fraction, comparison, .. } => {
            let lpips = bench.lpips(comparison)?;
            let mut score =
                |source: &Source<'_>| simulate::score_held_out(source, *fraction, comparison, lpips.as_deref(), folder);
            simulated(simulation, bench, &mut score).map(drop)
        }
        Task::Calibrate { method, recordings, .. } => baseline::calibrate(*method, recordings, folder, bench, step),
        Task::NoiseLevel { recordings, .. } => baseline::measure_noise(recordings, folder, step),
        Task::Compare { measured, simulated, held_out_fraction, comparison, .. } => {
            compare(measured, simulated, *held_out_fraction, comparison, folder, bench)
        }
        Task::Recognise { train, test, recognition, .. } => recognise(recognition, train, test, folder, bench, step),
    }
}

/// Gives a method's frames to whoever uses them.
fn simulated(task: &Task, bench: &mut Bench, then: Use<'_>) -> Result<Speed> {
    match task {
        Task::Simulate { checkpoint, recording, name, graph_at_inference, seed } => {
            let task = simulate::Task { checkpoint, recording, name, graph_at_inference: *graph_at_inference, seed: *seed };
            simulate::simulate(&task, bench, then)
        }
        Task::Baseline { method, recording, name, gain, checkpoint, noise_level, seed } => {
            let [gain, checkpoint, noise_level] = [gain, checkpoint, noise_level].map(Option::as_deref);
            let task = baseline::Task { method: *method, recording, name, gain, checkpoint, noise_level, seed: *seed };
            baseline::simulate(&task, bench, then)
        }
        _ => unreachable!("planned as a simulation"),
    }
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
