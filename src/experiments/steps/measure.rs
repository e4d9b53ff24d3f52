//! Numbers: how fast, how alike, how well recognised.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Bench;
use crate::data::{Recording, atomic};
use crate::error::Result;
use crate::evaluation::{ComparisonConfig, compare_frames};
use crate::recognition::{self, RecognitionConfig, Stage};
use crate::training::{FrameSplit, Split};

/// Wall clock of a simulated recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Speed {
    pub frames: usize,
    /// Poses and visibility, seconds over all frames; a baseline's count as part of its signal.
    pub geometry_s: f64,
    /// From there to samples.
    pub signal_s: f64,
}

/// Writes a value as indented JSON, whole or not at all; fails where the folder cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    atomic::write_text(path, &serde_json::to_string_pretty(value).expect("plain data"))
}

/// Scores of a simulated recording, on all frames or on those that training held out.
pub fn compare(
    measured: &Path,
    simulated: &Path,
    held_out_fraction: Option<f64>,
    config: &ComparisonConfig,
    folder: &Path,
    bench: &mut Bench,
) -> Result<()> {
    let (measured, simulated) = (Recording::open(measured)?, Recording::open(simulated)?);
    let all = measured.frames();
    let frames: Vec<usize> = match held_out_fraction {
        None => (0..all).collect(),
        Some(fraction) => held_out(all, fraction),
    };
    let lpips = bench.lpips(config)?;
    let found = compare_frames(&measured, &simulated, &frames, &config.heatmap, &config.metrics, lpips.as_deref())?;
    write_json(&folder.join("scores.json"), &found)
}

/// The frames of a recording that no training learns from.
pub fn held_out(frames: usize, fraction: f64) -> Vec<usize> {
    FrameSplit::new(&[frames], fraction, Split::Last, 0).validation.iter().map(|id| id.frame).collect()
}

/// Trains a classifier on some recordings and tests it on others.
pub fn recognise(
    config: &RecognitionConfig,
    train: &[PathBuf],
    test: &[PathBuf],
    folder: &Path,
    bench: &Bench,
    step: &mut dyn FnMut(usize, usize),
) -> Result<()> {
    let found = recognition::run(config, train, test, bench.device(), &mut |stage| match stage {
        Stage::Reading { done, of } | Stage::Training { done, of, .. } => step(done, of),
    })?;
    let result = folder.join("classifier");
    // An earlier attempt may have come as far as this.
    let _ = std::fs::remove_dir_all(&result);
    recognition::write(&found, config, atomic::AtomicFolder::create(&result)?)
}
