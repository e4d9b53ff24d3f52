//! Settings of the training loop.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::RefineConfig;
use crate::{
    bounds,
    error::{Error, Result},
    heatmap::HeatmapConfig,
    loss::LossConfig,
};

/// Products of epochs, repeats and frames stay within 64 bits.
const MOST_REPETITIONS: usize = 1_000_000;

/// How the held-out frames are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// The last frames of every recording: nothing near them was trained on.
    #[default]
    Last,
    /// Frames drawn from the whole recording.
    Random,
    /// Evenly spaced frames.
    Interleaved,
}

/// How long, on which frames and with which loss a simulator learns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrainingConfig {
    pub epochs: usize,
    /// Frames whose gradients make one step of the optimiser.
    pub frames_per_step: usize,
    pub learning_rate: f64,
    /// The learning rate falls to this along half a cosine.
    pub final_learning_rate: f64,
    /// The gradient of every parameter tensor is clipped to this norm.
    pub gradient_clip: f64,
    /// Held out of training.
    pub validation_fraction: f64,
    pub split: Split,
    /// Train on this many frames only, evenly spaced over those that are not held out; all by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// Times that an epoch visits every frame; with few frames, one visit is too little between two validations.
    #[serde(skip_serializing_if = "is_one")]
    pub repeats: usize,
    /// A checkpoint whose weights training starts from, such as that of another room; the optimiser, the room's
    /// gain and the noise start anew. A relative path starts from the config's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_from: Option<PathBuf>,
    /// Stop after this many epochs without a better validation loss; zero never stops early.
    pub patience_epochs: usize,
    /// Whether the simulator's effects learn too.
    pub learn_effects: bool,
    /// Whether the motions of the recordings are refined first, by centimetres, degrees and milliseconds; needs
    /// `simulator.surface.posing = "tensor"`.
    pub refine_pose: bool,
    pub refine: RefineConfig,
    pub heatmap: HeatmapConfig,
    pub loss: LossConfig,
}

fn is_one(count: &usize) -> bool {
    *count == 1
}

impl Default for TrainingConfig {
    fn default() -> Self {
        Self {
            epochs: 40,
            frames_per_step: 1,
            // Adam's usual one (Kingma and Ba, ICLR 2015). At three times that, some runs lose what they had learned and do not find it
            // again.
            learning_rate: 1e-3,
            final_learning_rate: 1e-4,
            gradient_clip: 1.0,
            validation_fraction: 0.2,
            split: Split::Last,
            frames: None,
            repeats: 1,
            start_from: None,
            patience_epochs: 0,
            learn_effects: true,
            refine_pose: false,
            refine: RefineConfig::default(),
            heatmap: HeatmapConfig::default(),
            loss: LossConfig::default(),
        }
    }
}

impl TrainingConfig {
    /// Refuses counts, rates, fractions and refinements with which no training works.
    pub fn check(&self) -> Result<()> {
        for (key, value) in [("epochs", self.epochs), ("frames_per_step", self.frames_per_step), ("repeats", self.repeats)] {
            bounds::count(format!("training.{key}"), value, MOST_REPETITIONS)?;
        }
        if self.frames == Some(0) {
            return Err(Error::setting("training.frames", 0, "at least 1").with_hint("leave the key out to train on all"));
        }
        let positive = [
            ("learning_rate", self.learning_rate),
            ("final_learning_rate", self.final_learning_rate),
            ("gradient_clip", self.gradient_clip),
        ];
        if let Some((key, value)) = positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Err(Error::setting(format!("training.{key}"), value, "a positive number"));
        }
        self.refine.check("training.refine")?;
        if !(0.0..1.0).contains(&self.validation_fraction) {
            return Err(Error::setting("training.validation_fraction", self.validation_fraction, "0 or more, and less than 1")
                .with_hint("something must be left to train on"));
        }
        Ok(())
    }

    /// Learning rate of a step: half a cosine from `learning_rate` to `final_learning_rate`.
    pub fn learning_rate_at(&self, step: usize, steps: usize) -> f64 {
        let progress = step as f64 / steps.saturating_sub(1).max(1) as f64;
        let weight = 0.5 * (1.0 + (std::f64::consts::PI * progress.min(1.0)).cos());
        self.final_learning_rate + weight * (self.learning_rate - self.final_learning_rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learning_rate_falls_from_first_to_last() {
        let config = TrainingConfig { learning_rate: 1e-2, final_learning_rate: 1e-4, ..Default::default() };
        assert!((config.learning_rate_at(0, 100) - 1e-2).abs() < 1e-12);
        assert!((config.learning_rate_at(99, 100) - 1e-4).abs() < 1e-12);
        assert!(config.learning_rate_at(30, 100) > config.learning_rate_at(31, 100));
    }

    #[test]
    fn settings_that_cannot_train_are_refused_by_name() {
        let config = TrainingConfig { epochs: 0, ..Default::default() };
        assert_eq!(config.check().unwrap_err().to_string(), "`training.epochs` is 0, expected 1 to 1000000");
        let config = TrainingConfig { learning_rate: -1.0, ..Default::default() };
        assert_eq!(config.check().unwrap_err().to_string(), "`training.learning_rate` is -1, expected a positive number");
        for fraction in [f64::NAN, 1.0, -0.1] {
            assert!(TrainingConfig { validation_fraction: fraction, ..Default::default() }.check().is_err());
        }
    }
}
