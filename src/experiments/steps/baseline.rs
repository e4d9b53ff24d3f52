//! Simulates one recording by somebody else's method, at the level of the training recordings.

use std::path::{Path, PathBuf};

use burn::tensor::Device;
use serde::{Deserialize, Serialize};

use super::bench::{Bench, seed_of};
use super::measure::{Speed, write_json};
use super::simulate::{Source, Use};
use crate::baselines::{
    Baseline, BaselineNoise, Calibration, MmGpe, MmGpeConfig, Rendering, RfGenesis, RfGenesisConfig, TwoBounce, TwoBounceConfig,
    noise_level,
};
use crate::data::{Recording, files::read_json};
use crate::error::{Error, Result};
use crate::experiments::config::BaselineName;
use crate::person::Person;

/// Frames of each training recording that gain and noise are found on.
const CALIBRATION_FRAMES: usize = 4;

/// Amplitude from a method's own unit to the receiver's.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Gain {
    gain: f64,
}

/// σ of each component of a sample.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct NoiseLevel {
    deviation: f64,
}

/// Measures the receiver's noise in training recordings.
pub fn measure_noise(recordings: &[PathBuf], folder: &Path, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    let opened: Vec<Recording> = recordings.iter().map(Recording::open).collect::<Result<_>>()?;
    step(0, recordings.len());
    write_json(&folder.join("noise.json"), &NoiseLevel { deviation: noise_level(&opened, CALIBRATION_FRAMES)? })
}

/// Finds a method's one gain on training recordings.
pub fn calibrate(
    method: BaselineName,
    recordings: &[PathBuf],
    folder: &Path,
    bench: &mut Bench,
    step: &mut dyn FnMut(usize, usize),
) -> Result<()> {
    let mut calibration = Calibration::default();
    for (index, path) in recordings.iter().enumerate() {
        let recording = Recording::open(path)?;
        calibration.add(&recording, &*open(method, &recording, None, bench.device())?, CALIBRATION_FRAMES)?;
        step(index + 1, recordings.len());
    }
    write_json(&folder.join("gain.json"), &Gain { gain: calibration.gain()? })
}

/// One recording to simulate by a method that is not ours.
pub struct Task<'a> {
    pub method: BaselineName,
    pub recording: &'a Path,
    pub name: &'a str,
    /// Absent for a method that is in the receiver's unit already.
    pub gain: Option<&'a Path>,
    pub checkpoint: Option<&'a Path>,
    /// Absent: the paper's noise.
    pub noise_level: Option<&'a Path>,
    pub seed: u64,
}

/// Hands the frames of a method, with gain and noise, to `then`.
///
/// # Errors
/// A recording, gain or checkpoint that cannot be read, and whatever the method or `then` refuses.
pub fn simulate(task: &Task, bench: &mut Bench, then: Use<'_>) -> Result<Speed> {
    let recording = Recording::open(task.recording)?;
    let baseline = open(task.method, &recording, task.checkpoint, bench.device())?;
    let gain = task.gain.map(read_json::<Gain>).transpose()?.map_or(1.0, |found| found.gain);
    let seed = seed_of(task.seed, task.name);
    let noise = match task.noise_level.map(read_json::<NoiseLevel>).transpose()? {
        Some(NoiseLevel { deviation }) => BaselineNoise::Level { seed, deviation },
        None => BaselineNoise::Rate { seed },
    };
    let rendering = Rendering { baseline: &*baseline, gain, noise };
    then(&Source { recording: &recording, look: &|_| Ok(()), frame: &|frame| rendering.frame(frame) })
}

/// # Errors
/// A recording without a person; whatever the method refuses.
fn open(method: BaselineName, recording: &Recording, checkpoint: Option<&Path>, device: &Device) -> Result<Box<dyn Baseline>> {
    let radar = &recording.radar;
    let person = || -> Result<&Person> {
        recording.person().ok_or_else(|| {
            Error::field(recording.folder.join("recording.toml"), "motion", "missing", "a body with its motion, or meshes")
                .with_hint("this method simulates the person and nothing else; leave it out of `baselines`")
        })
    };
    Ok(match method {
        BaselineName::Mmgpe => Box::new(MmGpe::new(radar, person()?, &MmGpeConfig::default(), device)?),
        BaselineName::MmgpeSurface => Box::new(MmGpe::new(radar, person()?, &MmGpeConfig::over_the_surface(), device)?),
        BaselineName::RfGenesis => Box::new(RfGenesis::new(radar, person()?, &RfGenesisConfig::default(), device)?),
        BaselineName::RfGenesisReleased => Box::new(RfGenesis::new(radar, person()?, &RfGenesisConfig::released(), device)?),
        BaselineName::TwoBounce => {
            let checkpoint = checkpoint.expect("planned with the checkpoint whose direct path it keeps");
            let (room, config) = (recording.room.as_ref(), TwoBounceConfig::default());
            Box::new(TwoBounce::open(checkpoint, radar, room, recording.person(), &config, device)?.0)
        }
    })
}
