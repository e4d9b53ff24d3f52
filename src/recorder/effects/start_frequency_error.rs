//! A ramp that starts at another frequency.

use super::effect::Effect;
use super::settings::settings;
use crate::radar::Radar;

settings! {
    /// The ramp starts at f₀ (1 + relative).
    StartFrequencyError { relative: f64 [-0.05, 0.05] }
}

impl Effect for StartFrequencyError {
    fn disturb(&self, radar: &mut Radar) {
        radar.start_frequency_hz *= 1.0 + self.relative;
    }
}
