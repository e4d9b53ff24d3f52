//! A gain that settles at the start of each frame.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The first chirps of each frame are weaker by `depth`, recovering over `chirps`.
    ChirpSettling { depth: f64 [0.0, 1.0], chirps: f64 [0.1, 1000.0] }
}

impl Effect for ChirpSettling {}

impl ChirpSettling {
    /// Of a chirp by its number in the frame.
    pub fn gain(&self, number: usize) -> f64 {
        1.0 - self.depth * (-(number as f64) / self.chirps).exp()
    }
}
