//! A high-pass filter of the intermediate frequency.

use super::effect::Effect;
use super::section::Section;
use super::settings::{first_order, settings};

settings! {
    /// `order` equal first-order sections.
    IfHighpass {
        corner_hz: f64 [1.0e3, 5.0e6],
        #[serde(default = "first_order")] order: usize [1.0, 4.0],
        /// Absent or true: in steady state; false: it starts from rest when the ramp does.
        #[serde(default = "yes")] settled: bool,
        /// A multiplication of each chirp's DFT instead of a filter in time.
        #[serde(default)] circular: bool,
    }
}

fn yes() -> bool {
    true
}

impl Effect for IfHighpass {}

impl IfHighpass {
    /// As many equal sections as the order says.
    pub fn sections(&self) -> Vec<Section> {
        vec![Section { corner_hz: self.corner_hz, is_high: true }; self.order]
    }
}
