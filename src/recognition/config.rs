//! Settings of recognition.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::data::settings::{read_settings, settings_from_table};
use crate::error::{Error, Result};
use crate::heatmap::HeatmapConfig;

/// How recordings become maps, and how the classifier learns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecognitionConfig {
    pub seed: u64,
    /// Frames that the classifier sees at a time.
    pub window_frames: usize,
    /// From the start of one window to that of the next.
    pub stride_frames: usize,
    /// Nearest and farthest range that count.
    pub range_m: [f64; 2],
    /// Largest azimuth of the time-angle map, to both sides, and its step.
    pub azimuth_deg: f64,
    pub azimuth_step_deg: f64,
    /// What is weaker than this below the sequence's strongest cell is clipped.
    pub floor_db: f64,
    pub heatmap: HeatmapConfig,
    /// Output channels of the three convolutions of each branch.
    pub channels: [usize; 3],
    pub epochs: usize,
    /// Windows that make one step.
    pub batch: usize,
    pub learning_rate: f64,
    /// Augmentation: windows start up to so many frames earlier or later.
    pub shift_frames: usize,
    /// Augmentation: the level of all maps changes by up to this.
    pub gain_db: f64,
    /// Of the intervals.
    pub confidence: f64,
    /// Resamplings of the test sequences behind the intervals over sequences.
    pub resamplings: usize,
}

impl Default for RecognitionConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            window_frames: 16,
            stride_frames: 4,
            range_m: [0.5, 6.0],
            azimuth_deg: 60.0,
            azimuth_step_deg: 4.0,
            floor_db: -40.0,
            heatmap: HeatmapConfig::default(),
            channels: [8, 16, 32],
            epochs: 60,
            batch: 16,
            learning_rate: 2.0e-3,
            shift_frames: 2,
            gain_db: 3.0,
            confidence: 0.95,
            resamplings: 2000,
        }
    }
}

impl RecognitionConfig {
    /// Reads a config file, or takes the defaults, changed by `--set key=value`.
    pub fn read(path: Option<&Path>, sets: &[String]) -> Result<Self> {
        let config: Self = match path {
            Some(path) => read_settings(path, sets)?,
            None => settings_from_table(toml::Table::new(), "the defaults", sets)?,
        };
        config.check()?;
        Ok(config)
    }

    /// The resolved configuration, as kept beside the result.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("settings are plain data")
    }

    /// Refuses numbers that cannot work.
    pub fn check(&self) -> Result<()> {
        // Windows, batches and resamplings are held in memory; a million is a day's frames.
        const MOST: usize = 1_000_000;
        for (key, value, least) in [
            ("window_frames", self.window_frames, 4),
            ("stride_frames", self.stride_frames, 1),
            ("epochs", self.epochs, 1),
            ("batch", self.batch, 1),
            ("resamplings", self.resamplings, 100),
            ("channels", self.channels.into_iter().min().unwrap_or(0), 1),
        ] {
            if !(least..=MOST).contains(&value) {
                return Err(Error::setting(key, value, format!("{least} to {MOST}")));
            }
        }
        for (key, value, low, high) in [
            ("range_m[0]", self.range_m[0], 0.0, self.range_m[1]),
            ("azimuth_deg", self.azimuth_deg, 1.0, 90.0),
            ("azimuth_step_deg", self.azimuth_step_deg, 0.1, self.azimuth_deg),
            ("floor_db", self.floor_db, -200.0, -1.0),
            ("learning_rate", self.learning_rate, 1.0e-8, 1.0),
            ("gain_db", self.gain_db, 0.0, 60.0),
            ("confidence", self.confidence, 0.5, 0.999),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Error::setting(key, value, format!("{low} to {high}")));
            }
        }
        Ok(())
    }
}
