//! Sinusoidal motion.

use std::f64::consts::TAU;

use super::vector::{Vector, length, scale};

#[derive(Clone, Copy, Debug)]
pub struct SinusoidalMotion {
    pub amplitude_m: Vector,
    pub rate_hz: f64,
    pub phase_rad: f64,
}

impl SinusoidalMotion {
    /// By up to `swing_m` to either side along an axis of any length.
    pub fn along(axis: Vector, swing_m: f64, rate_hz: f64, phase_rad: f64) -> Self {
        Self { amplitude_m: scale(axis, swing_m / length(axis).max(1e-300)), rate_hz, phase_rad }
    }

    pub fn position(&self, time_s: f64) -> Vector {
        scale(self.amplitude_m, (TAU * self.rate_hz * time_s + self.phase_rad).sin())
    }

    pub fn velocity(&self, time_s: f64) -> Vector {
        let rate = TAU * self.rate_hz;
        scale(self.amplitude_m, rate * (rate * time_s + self.phase_rad).cos())
    }
}
