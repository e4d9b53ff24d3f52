//! What training reports about each epoch.

use serde::{Deserialize, Serialize};

/// What training reports about one epoch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpochMetrics {
    pub epoch: usize,
    pub learning_rate: f64,
    /// Mean squared difference of the heatmaps, dB², as trained (noise injected, graph convolution at random).
    pub training_loss: f64,
    /// The same on held-out frames as at inference; `None` without any.
    pub validation_loss: Option<f64>,
    pub noise_rate: Option<f64>,
    /// Of a single step, dB²; checkpoints of before do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_loss: Option<f64>,
    /// Largest absolute derivative of a step's loss by any number that learns, before clipping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_gradient: Option<f64>,
}

impl EpochMetrics {
    /// What decides which checkpoint is the best.
    pub fn score(&self) -> f64 {
        self.validation_loss.unwrap_or(self.training_loss)
    }
}
