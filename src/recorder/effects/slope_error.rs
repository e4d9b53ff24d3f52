//! A ramp of another slope.

use super::effect::Effect;
use super::settings::settings;
use crate::radar::Radar;

settings! {
    /// The ramp climbs by S (1 + relative).
    SlopeError { relative: f64 [-0.2, 0.2] }
}

impl Effect for SlopeError {
    fn disturb(&self, radar: &mut Radar) {
        radar.slope_hz_per_s *= 1.0 + self.relative;
    }
}
