//! A point that reflects.

use num_complex::Complex64;

use super::effect::Effect;
use super::settings::settings;
use crate::recorder::vector::{Vector, distance};

settings! {
    /// Relative to the body's root mean square (without a body: to the peak sample).
    StaticReflector { position_m: [f64; 3] [-100.0, 100.0], amplitude: f64 [0.0, 1.0e3] }
}

impl Effect for StaticReflector {}

impl StaticReflector {
    /// Its place, and its amplitude at 1 m from the antennas' `centre`; `level` is what amplitudes are relative to.
    pub fn point(&self, centre: Vector, level: f64) -> (Vector, Complex64) {
        (self.position_m, (self.amplitude * level * distance(self.position_m, centre).powi(2)).into())
    }
}
