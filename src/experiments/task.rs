//! What a stage does, with all that its result depends on. Paths are left out of a stage's hash: what is found there has
//! stages of its own, or names that are in it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::config::BaselineName;
use super::figures::FigureTask;
use crate::diagnosis::DiagnosisConfig;
use crate::evaluation::ComparisonConfig;
use crate::recognition::RecognitionConfig;
use crate::simulator::SimulatorConfig;
use crate::site::SiteConfig;
use crate::training::TrainingConfig;

/// A stage's work and all settings that shape its result.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "task", rename_all = "snake_case")]
pub enum Task {
    /// Leaves `recordings/` and `again/`.
    Site {
        config: Box<SiteConfig>,
        /// What relative paths in `config` start from.
        #[serde(skip)]
        settings_folder: PathBuf,
    },
    /// Leaves `report.json` and `effects.json`.
    Diagnose {
        #[serde(skip)]
        recording: PathBuf,
        name: String,
        diagnosis: DiagnosisConfig,
    },
    /// Leaves `last/`, the checkpoint after the last epoch: none is chosen by what it scores on held-out frames.
    Train {
        #[serde(skip)]
        recordings: Vec<PathBuf>,
        names: Vec<String>,
        simulator: Box<SimulatorConfig>,
        training: Box<TrainingConfig>,
        seed: u64,
        /// A diagnosis' effects, which are added to the simulator's.
        #[serde(skip)]
        effects: Option<PathBuf>,
        #[serde(skip)]
        start_from: Option<PathBuf>,
    },
    /// Leaves `stability.json`, with the largest loss and gradient of every epoch, also where the training breaks.
    Stability {
        #[serde(skip)]
        recordings: Vec<PathBuf>,
        names: Vec<String>,
        simulator: Box<SimulatorConfig>,
        training: Box<TrainingConfig>,
        seed: u64,
    },
    /// Leaves a picture under the figure's name, and `figure.json`.
    Figure(Box<FigureTask>),
    /// Leaves `recording/` and `speed.json`.
    Simulate {
        #[serde(skip)]
        checkpoint: PathBuf,
        #[serde(skip)]
        recording: PathBuf,
        name: String,
        graph_at_inference: bool,
        seed: u64,
    },
    /// Leaves `gain.json`: one gain for the whole site, from a physical model's own unit to the receiver's.
    Calibrate {
        method: BaselineName,
        #[serde(skip)]
        recordings: Vec<PathBuf>,
        names: Vec<String>,
    },
    /// Leaves `noise.json`: what the receiver adds to each component of a sample.
    NoiseLevel {
        #[serde(skip)]
        recordings: Vec<PathBuf>,
        names: Vec<String>,
    },
    /// Leaves what `Simulate` does.
    Baseline {
        method: BaselineName,
        #[serde(skip)]
        recording: PathBuf,
        name: String,
        #[serde(skip)]
        gain: Option<PathBuf>,
        #[serde(skip)]
        checkpoint: Option<PathBuf>,
        /// Absent: the paper's noise.
        #[serde(skip)]
        noise_level: Option<PathBuf>,
        seed: u64,
    },
    /// Leaves `scores.json` of the frames that training held out, so large a part of the recording, by a [`Self::Simulate`] or a
    /// [`Self::Baseline`], of which nothing is kept.
    HeldOut {
        simulation: Box<Self>,
        fraction: f64,
        comparison: Box<ComparisonConfig>,
        #[serde(skip_serializing_if = "Option::is_none")]
        weights: Option<String>,
    },
    /// Leaves `scores.json`.
    Compare {
        #[serde(skip)]
        measured: PathBuf,
        #[serde(skip)]
        simulated: PathBuf,
        name: String,
        /// Scored are the frames that training held out, so large a part of the recording; all by default.
        held_out_fraction: Option<f64>,
        comparison: Box<ComparisonConfig>,
        /// Hash of the files behind LPIPS.
        #[serde(skip_serializing_if = "Option::is_none")]
        weights: Option<String>,
    },
    /// Leaves `classifier/`, with `recognition.json` and `confusion.png`.
    Recognise {
        #[serde(skip)]
        train: Vec<PathBuf>,
        train_names: Vec<String>,
        #[serde(skip)]
        test: Vec<PathBuf>,
        names: Vec<String>,
        recognition: Box<RecognitionConfig>,
    },
}

impl Task {
    /// The recording whose simulation this is, or is about.
    pub fn simulated_recording(&self) -> Option<&Path> {
        match self {
            Self::Simulate { recording, .. } | Self::Baseline { recording, .. } => Some(recording),
            Self::HeldOut { simulation, .. } => simulation.simulated_recording(),
            Self::Compare { measured, .. } => Some(measured),
            _ => None,
        }
    }
}
