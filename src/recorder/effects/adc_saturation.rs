//! A converter that saturates.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// The peak sample over the ADC's rail; above 1 it clips.
    AdcSaturation { level: f64 [0.1, 20.0] }
}

impl Effect for AdcSaturation {}

impl AdcSaturation {
    /// Where the rail of samples is whose largest component is this.
    pub fn rail(&self, largest_component: f64) -> f64 {
        largest_component / self.level
    }
}
