//! A ramp that is not straight.

use super::effect::Effect;
use super::settings::settings;

settings! {
    /// A smooth quadratic and cubic error of the frequency over the ADC window, with this peak.
    ChirpNonlinearity { peak_hz: f64 [-2.0e7, 2.0e7] }
}

impl Effect for ChirpNonlinearity {}

impl ChirpNonlinearity {
    /// Of the quadratic and of the cubic part.
    pub fn parts_hz(&self) -> [f64; 2] {
        [0.7 * self.peak_hz, 0.3 * self.peak_hz]
    }
}

/// Legendre polynomials of the second and the third degree in time: error of the frequency, its rate, and its integral in turns.
/// `s` is −1 at the start of a window and 1 at its end.
pub fn curvature(quadratic_hz: f64, cubic_hz: f64, s: f64, half_window_s: f64) -> (f64, f64, f64) {
    let (p2, p3) = (0.5 * (3.0 * s * s - 1.0), 0.5 * (5.0 * s * s * s - 3.0 * s));
    let (d2, d3) = (3.0 * s, 0.5 * (15.0 * s * s - 3.0));
    let (i2, i3) = (0.5 * (s * s * s - s), 0.5 * (1.25 * s.powi(4) - 1.5 * s * s));
    (
        quadratic_hz * p2 + cubic_hz * p3,
        (quadratic_hz * d2 + cubic_hz * d3) / half_window_s,
        (quadratic_hz * i2 + cubic_hz * i3) * half_window_s,
    )
}
