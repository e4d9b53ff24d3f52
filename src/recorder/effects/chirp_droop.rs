//! Power that falls within a chirp.

use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The power falls by this over the ADC window, linearly in decibels.
    ChirpDroop { db: f64 [-20.0, 20.0] }
}

impl Effect for ChirpDroop {}

impl ChirpDroop {
    /// Of a sample among those of a chirp.
    pub fn gain(&self, sample: usize, samples: usize) -> f64 {
        from_db(-self.db * sample as f64 / (samples - 1).max(1) as f64)
    }
}
