//! Trains one simulator.

use std::path::{Path, PathBuf};

use super::{Bench, read_json};
use crate::config::{Config, DataConfig};
use crate::data::atomic;
use crate::effects::EffectSetting;
use crate::error::Result;
use crate::simulator::SimulatorConfig;
use crate::training::{Event, TrainingConfig};

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
    let outcome = trainer.run(last.is_dir().then_some(last.as_path()), &mut |event| match event {
        Event::Started { steps: all, first_step, .. } => {
            steps = all;
            step(first_step, steps);
        }
        Event::Step { step: done, .. } => step(done, steps),
        _ => {}
    })?;
    let progress = serde_json::to_string_pretty(&outcome.progress).expect("plain data");
    atomic::write_text(folder.join("progress.json"), &progress)
}
