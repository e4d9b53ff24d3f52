//! Trains one simulator.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Bench;
use super::measure::write_json;
use crate::config::{Config, DataConfig};
use crate::data::{atomic, files::read_json};
use crate::effects::EffectSetting;
use crate::error::{Error, Result};
use crate::simulator::SimulatorConfig;
use crate::training::checkpoint::read_state;
use crate::training::{EpochMetrics, Event, Outcome, TrainingConfig};

/// What one simulator is trained on and how.
pub struct Task<'a> {
    pub recordings: &'a [PathBuf],
    pub simulator: &'a SimulatorConfig,
    pub training: &'a TrainingConfig,
    pub seed: u64,
    pub effects: &'a Option<PathBuf>,
    pub start_from: &'a Option<PathBuf>,
}

/// Leaves the run folder that `hybridsim train` would: its `config.toml` makes the same again. A training that was killed
/// goes on after its last whole epoch.
pub fn train(task: &Task, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    write_json(&folder.join("progress.json"), &run(task, folder, bench, step)?.progress)
}

/// How a training went.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Stability {
    /// Steps of the optimiser that were done.
    pub steps: usize,
    /// Where a number was no longer finite; none where the training came to its end.
    pub broke: Option<Broke>,
    /// Whole epochs.
    pub history: Vec<EpochMetrics>,
}

/// The step in which a number was no longer finite, and the first stage of the signal's way that made it so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Broke {
    pub step: usize,
    pub stage: String,
}

/// The same of a training that may break: that it does is a result.
pub fn stability(task: &Task, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    let found = match run(task, folder, bench, step) {
        Ok(Outcome { progress, .. }) => Stability { steps: progress.steps_done, broke: None, history: progress.history },
        Err(Error::NonFinite { stage, step }) => {
            let last = folder.join("last");
            let history = if last.is_dir() { read_state(&last)?.progress.history } else { vec![] };
            Stability { steps: step, broke: Some(Broke { step, stage }), history }
        }
        Err(error) => return Err(error),
    };
    write_json(&folder.join("stability.json"), &found)
}

fn run(task: &Task, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<Outcome> {
    let mut simulator = task.simulator.clone();
    if let Some(effects) = task.effects {
        simulator.effects.extend(read_json::<Vec<EffectSetting>>(effects)?);
    }
    let config = Config {
        seed: task.seed,
        data: DataConfig { recordings: task.recordings.to_vec() },
        simulator,
        training: TrainingConfig { start_from: task.start_from.clone(), ..task.training.clone() },
        ..Default::default()
    };
    let config_toml = config.to_toml();
    atomic::write_text(folder.join("config.toml"), &config_toml)?;
    let recordings = bench.training(task.recordings, &config.simulator)?;
    let trainer = config.trainer(&recordings, &config_toml, folder, &bench.devices)?;
    let last = folder.join("last");
    atomic::recover(&last)?;
    let mut steps = 0;
    trainer.run(last.is_dir().then_some(last.as_path()), &mut |event| match event {
        Event::Started { steps: all, first_step, .. } => {
            steps = all;
            step(first_step, steps);
        }
        Event::Step { step: done, .. } => step(done, steps),
        _ => {}
    })
}
