//! A gain that drifts over the recording.

use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The gain changes by this over the recording, linearly in decibels.
    GainDrift { db: f64 [-20.0, 20.0] }
}

impl Effect for GainDrift {}

impl GainDrift {
    /// Within a recording from `first_s` to `last_s`.
    pub fn gain(&self, time_s: f64, [first_s, last_s]: [f64; 2]) -> f64 {
        from_db(self.db * (time_s - first_s) / (last_s - first_s))
    }
}
