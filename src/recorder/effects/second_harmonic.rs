//! A mixer or amplifier that squares.

use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;
use crate::recorder::signal::Signal;

settings! {
    /// Adds κ s², of the peak sample relative to itself.
    SecondHarmonic { level_db: f64 [-120.0, 0.0] }
}

impl Effect for SecondHarmonic {}

impl SecondHarmonic {
    /// `per_peak`: 1 over the peak sample.
    pub fn apply(&self, per_peak: f64, signal: &mut Signal) {
        let square = from_db(self.level_db) * per_peak;
        signal.values.iter_mut().for_each(|value| *value += square * *value * *value);
    }
}
