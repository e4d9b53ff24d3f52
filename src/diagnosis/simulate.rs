//! The trained simulator on the held-out frames: as it is, and with the effects that were found.

use std::path::Path;

use burn::tensor::Device;

use super::report::{SimulatorFit, SimulatorScores};
use crate::data::atomic::AtomicFolder;
use crate::effects::EffectSetting;
use crate::error::Result;
use crate::evaluation::{Simulation, evaluate};
use crate::heatmap::{HeatmapConfig, Map};
use crate::metrics::MetricsConfig;
use crate::simulator::{Simulator, SimulatorConfig};
use crate::training::{Event, LoadedRecording, Split, Trainer, TrainingConfig, checkpoint, site};

/// What the simulators start from.
pub struct Start<'a> {
    pub simulator: &'a SimulatorConfig,
    pub learning: &'a TrainingConfig,
    pub epochs: usize,
    pub seed: u64,
    pub device: &'a Device,
    /// A simulator that is trained already, in place of the baseline.
    pub checkpoint: Option<&'a Path>,
}

impl Start<'_> {
    /// How simulators learn from all but a part of the frames.
    fn learning_without(&self, held_out: f64) -> TrainingConfig {
        TrainingConfig {
            epochs: self.epochs,
            validation_fraction: held_out,
            split: Split::Interleaved,
            frames: None,
            repeats: 1,
            start_from: None,
            ..self.learning.clone()
        }
    }
}

/// Both simulators, and what they are worth.
pub struct Simulated {
    pub fit: SimulatorFit,
    /// Static-removed maps of the held-out frames: measured, baseline, with the effects; dB.
    pub maps: [Map; 3],
}

/// Trains (or opens) the baseline, then the same with the effects, and compares both with the frames that neither saw.
/// The second one's checkpoint goes to `keep`. `None` without body and room, where there is nothing to simulate.
///
/// `learning`: how long and how fast; which frames are held out is the diagnosis' choice.
///
/// # Errors
/// What training refuses; a checkpoint that cannot be read.
pub fn before_and_after(
    folder: &Path,
    effects: &[EffectSetting],
    start: &Start<'_>,
    keep: &Path,
    progress: &mut dyn FnMut(&str),
) -> Result<Option<Simulated>> {
    let config = match start.checkpoint {
        Some(checkpoint) => checkpoint::read_state(checkpoint)?.simulator,
        None => start.simulator.clone(),
    };
    let recordings = [LoadedRecording::open(folder, &config, false)?];
    let frames = recordings[0].scene.radar.frames;
    if (recordings[0].recording.person().is_none() && recordings[0].recording.room.is_none()) || frames < 4 {
        return Ok(None);
    }
    let held_out: Vec<usize> = (0..frames).filter(|frame| frame % 4 == 2).collect();
    let learning = start.learning_without(held_out.len() as f64 / frames as f64);
    let scratch = AtomicFolder::replacing(keep)?;
    // The second one goes on from the first, where that was there before.
    let onwards = TrainingConfig { start_from: start.checkpoint.map(Path::to_path_buf), ..learning.clone() };
    let mut train = |config: &SimulatorConfig, learning: &TrainingConfig, name: &str| -> Result<Simulator> {
        let folder = scratch.path().join(name);
        let trainer = Trainer {
            config: learning,
            simulator_config: config,
            seed: start.seed,
            recordings: &recordings,
            site: site(&recordings, config),
            config_toml: "",
            folder: &folder,
            devices: std::slice::from_ref(start.device),
        };
        let outcome = trainer.run(None, &mut |event| {
            if let Event::Epoch(metrics) = event {
                progress(&format!("training the simulator {name} the effects: epoch {}", metrics.epoch + 1));
            }
        })?;
        Ok(outcome.simulator)
    };
    let baseline = match start.checkpoint {
        Some(folder) => checkpoint::open(folder, start.device)?.0,
        None => train(&config, &learning, "without")?,
    };
    let before = Held::of(&recordings[0], &baseline, &held_out, start.seed)?;
    // What the checkpoint knows already stays, unless it was found anew.
    let known = config.effects.iter().filter(|known| effects.iter().all(|found| found.id != known.id)).cloned();
    let with = SimulatorConfig { effects: known.chain(effects.iter().cloned()).collect(), ..config.clone() };
    let after = match effects {
        [] => None,
        _ => Some(Held::of(&recordings[0], &train(&with, &onwards, "with")?, &held_out, start.seed)?),
    };
    let after = after.as_ref().unwrap_or(&before);
    let maps = [before.measured.clone(), before.simulated.clone(), after.simulated.clone()];
    let fit = SimulatorFit { before: before.scores, after: after.scores };
    if !effects.is_empty() {
        scratch.finish()?;
    }
    Ok(Some(Simulated { fit, maps }))
}

/// A simulator's maps of the held-out frames.
struct Held {
    scores: SimulatorScores,
    measured: Map,
    simulated: Map,
}

impl Held {
    fn of(recording: &LoadedRecording, simulator: &Simulator, held_out: &[usize], seed: u64) -> Result<Self> {
        let simulation = Simulation::new(simulator, &recording.scene, seed, true);
        let (mut squares, mut cells) = (0.0, 0.0f64);
        let mut sums: Option<(Map, Map)> = None;
        let heatmap = HeatmapConfig::default();
        let found =
            evaluate(recording, &simulation, held_out, &heatmap, &MetricsConfig::default(), None, &mut |_, all, moving| {
                let pairs = all.measured.values.iter().zip(&all.simulated.values);
                squares += pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                cells += all.measured.values.len() as f64;
                match &mut sums {
                    None => sums = Some((moving.measured, moving.simulated)),
                    Some((measured, simulated)) => {
                        for (sum, map) in [(measured, &moving.measured), (simulated, &moving.simulated)] {
                            sum.values.iter_mut().zip(&map.values).for_each(|(sum, value)| *sum = sum.max(*value));
                        }
                    }
                }
            })?;
        let global = found.global.as_ref();
        let person = found.person.as_ref();
        let (measured, simulated) = sums.expect("at least one frame is held out");
        Ok(Self {
            scores: SimulatorScores {
                db_mse: squares / cells.max(1.0),
                psnr_db: global.map_or(0.0, |scores| scores.psnr_db.mean),
                ssim: global.map_or(0.0, |scores| scores.ssim.mean),
                person_error_db: person.map(|scores| scores.mean_absolute_error_db.mean),
            },
            measured,
            simulated,
        })
    }
}
