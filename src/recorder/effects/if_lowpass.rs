//! A low-pass filter of the intermediate frequency.

use super::effect::Effect;
use super::section::Section;
use super::settings::settings;

settings! {
    /// One pole.
    IfLowpass { corner_hz: f64 [1.0e5, 1.0e9] }
}

impl Effect for IfLowpass {}

impl IfLowpass {
    /// The one section that the filter is.
    pub fn sections(&self) -> Vec<Section> {
        vec![Section { corner_hz: self.corner_hz, is_high: false }]
    }
}
