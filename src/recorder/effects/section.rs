//! A first-order section of the intermediate frequency's filter.

use num_complex::Complex64;

/// A first-order high-pass or low-pass with its corner.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    pub corner_hz: f64,
    pub is_high: bool,
}

impl Section {
    /// Complex gain at a frequency; 1/√2 in amplitude at the corner.
    pub fn response(&self, frequency_hz: f64) -> Complex64 {
        let ratio = Complex64::new(0.0, frequency_hz / self.corner_hz);
        if self.is_high { ratio / (1.0 + ratio) } else { 1.0 / (1.0 + ratio) }
    }
}
