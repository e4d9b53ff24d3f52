//! Settings of the refinement of a motion.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// How far a motion may be off, and how the error is looked for. Each size is the standard deviation of a Gaussian prior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RefineConfig {
    /// Of the whole recording's place along each axis, metres: about a range cell, which is as far as maps of power lead back.
    pub shift_m: f64,
    /// Of the whole recording's heading, degrees.
    pub heading_deg: f64,
    /// Of the clock, seconds.
    pub clock_s: f64,
    /// Whether single frames are corrected, too, where held-out frames prefer it. Off: it has not been shown to bring a pose nearer to
    /// the truth.
    pub per_frame: bool,
    /// Least change in range that is kept, metres: joints that cameras and inertial sensors track are 26 mm off on average (von
    /// Marcard et al., ECCV 2018), so that a motion which needs less is as right as motions are.
    pub least_m: f64,
    /// Of a frame's place, metres: joints that cameras and inertial sensors track are 26 mm off on average (von Marcard
    /// et al., ECCV 2018).
    pub frame_shift_m: f64,
    /// Of a frame's joint rotations, degrees: those 26 mm at the end of a limb of half a metre.
    pub frame_turn_deg: f64,
    /// Errors of frames this far apart are correlated by 1/e: about a step of walking, seconds. Held-out frames within as long
    /// count as one observation.
    pub smooth_s: f64,
    /// From coarse to fine: the maps are blurred by Gaussians of these many cells.
    pub blur_cells: Vec<f64>,
    /// Steps at each of them.
    pub steps: usize,
    /// Step of a parameter, in standard deviations of its prior; falls to a tenth along half a cosine.
    pub learning_rate: f64,
    /// Training frames that a step looks at, evenly spaced; as many between them are held out.
    pub frames: usize,
    /// Points of the body that stand for all of its visible ones.
    pub points: usize,
}

impl Default for RefineConfig {
    fn default() -> Self {
        Self {
            shift_m: 0.1,
            heading_deg: 10.0,
            clock_s: 0.1,
            per_frame: false,
            least_m: 0.026,
            frame_shift_m: 0.026,
            frame_turn_deg: 3.0,
            smooth_s: 0.5,
            blur_cells: vec![2.0, 1.0],
            steps: 40,
            learning_rate: 0.05,
            frames: 24,
            points: 400,
        }
    }
}

impl RefineConfig {
    /// Refuses what cannot work. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        let positive = [
            ("shift_m", self.shift_m),
            ("heading_deg", self.heading_deg),
            ("clock_s", self.clock_s),
            ("frame_shift_m", self.frame_shift_m),
            ("frame_turn_deg", self.frame_turn_deg),
            ("smooth_s", self.smooth_s),
            ("learning_rate", self.learning_rate),
        ];
        if let Some((name, value)) = positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Err(Error::setting(format!("{key}.{name}"), value, "a positive number"));
        }
        if !(self.least_m.is_finite() && self.least_m >= 0.0) {
            return Err(Error::setting(format!("{key}.least_m"), self.least_m, "metres, 0 or more"));
        }
        let counts = [("steps", self.steps), ("frames", self.frames), ("points", self.points)];
        if let Some((name, _)) = counts.into_iter().find(|(_, value)| *value == 0) {
            return Err(Error::setting(format!("{key}.{name}"), 0, "at least 1"));
        }
        if self.blur_cells.is_empty() || !self.blur_cells.iter().all(|cells| (0.0..=64.0).contains(cells)) {
            return Err(Error::setting(format!("{key}.blur_cells"), format!("{:?}", self.blur_cells), "widths of 0 to 64 cells"));
        }
        Ok(())
    }
}
