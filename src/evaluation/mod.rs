//! How well simulated recordings agree with measured ones.
//!
//! [`evaluate`] asks a simulator for its frames, [`compare`] takes them from a second recording folder: a simulation by
//! whatever method, or the same truth recorded again with other noise, which is the best that any simulator can do.
//! Both score frame by frame; [`over_sequences`] says how sure the mean of several recordings is, [`over_draws`] that of several
//! recordings by a simulator that was trained several times.

mod compare;
mod frames;
mod sequences;
mod simulation;

pub use compare::{ComparisonConfig, compare, compare_frames, refuse_different};
pub use frames::{FrameMaps, compare_with, measured_frame};
pub use sequences::{SequenceSummary, over_draws, over_sequences};
pub use simulation::{Simulation, evaluate};

use serde::{Deserialize, Serialize};

use crate::{
    lpips::Network,
    metrics::{Scores, Spread},
};

/// Mean scores: over the frames of one recording, or over recordings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScoreSummary {
    pub psnr_db: Spread,
    pub ssim: Spread,
    pub mean_absolute_error_db: Spread,
    /// Of the images that PSNR and SSIM see, as grey pictures `[velocity, range]`; `None` without a network.
    pub lpips: Option<Spread>,
}

/// What an evaluation of one recording found. Images map `span_db` below the recording's strongest cell to 0 … 1.
///
/// A recording's frames resemble each other, so these spreads have no interval: that takes several recordings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Evaluation {
    pub frames: usize,
    pub span_db: f64,
    /// All cells.
    pub global: Option<ScoreSummary>,
    /// All cells after the mean over each frame's loops is removed.
    pub moving: Option<ScoreSummary>,
    /// The static-removed cells that hold the person, as measured. A network needs an image: its LPIPS is that of the
    /// box around these cells, of [`crate::lpips::Lpips::SMALLEST`] cells at least each way.
    pub person: Option<ScoreSummary>,
    /// The network behind LPIPS, whose files only the user may have.
    pub lpips: Option<Network>,
}

/// The scores of one frame and region.
#[derive(Clone, Copy, Debug)]
struct RegionScores {
    scores: Scores,
    lpips: Option<f64>,
}

impl ScoreSummary {
    /// Over the frames of a recording.
    fn of_frames(frames: &[RegionScores]) -> Option<Self> {
        let spread = |value: fn(&Scores) -> f64| Spread::of_correlated(frames.iter().map(|frame| value(&frame.scores)));
        Some(Self {
            psnr_db: spread(|scores| scores.psnr_db)?,
            ssim: spread(|scores| scores.ssim)?,
            mean_absolute_error_db: spread(|scores| scores.mean_absolute_error_db)?,
            lpips: Spread::of_correlated(frames.iter().filter_map(|frame| frame.lpips)),
        })
    }
}

#[cfg(test)]
mod tests;
