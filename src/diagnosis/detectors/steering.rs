//! Beams of the receivers along x: what arrives from a direction adds up.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::diagnosis::statistics::bounds;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Beams per beam width of the receivers.
const BEAMS_PER_WIDTH: f64 = 1.6;

/// Undoes the phases that a direction (x over range) has at the receivers, at the middle of the band: the array phase falls
/// towards it.
pub fn steering(radar: &Radar, sine: f64) -> Vec<Complex64> {
    let wave = wave(radar);
    radar.rx_m.iter().map(|at| Complex64::cis(wave * at[0] * sine)).collect()
}

/// Phase per metre.
pub fn wave(radar: &Radar) -> f64 {
    TAU * (radar.carrier_hz() + 0.5 * radar.bandwidth_hz()) / SPEED_OF_LIGHT
}

/// Extent of the receivers along x; none where they resolve no direction.
pub fn aperture_m(radar: &Radar) -> Option<f64> {
    let [left, right] = bounds(radar.rx_m.iter().map(|at| at[0]));
    Some(right - left).filter(|aperture| radar.rx_m.len() > 1 && *aperture > 0.0)
}

/// Sum over the receivers.
pub fn beam(values: &[Complex64], steering: &[Complex64]) -> Complex64 {
    values.iter().zip(steering).map(|(value, turn)| value * turn).sum()
}

/// Power of the beams of all transmitters, `[tx · rx]`.
pub fn power(values: &[Complex64], steering: &[Complex64]) -> f64 {
    values.chunks_exact(steering.len()).map(|values| beam(values, steering).norm_sqr()).sum()
}

/// Directions that the receivers tell apart, and some between.
pub fn sines(radar: &Radar) -> Vec<f64> {
    let Some(aperture) = aperture_m(radar) else { return vec![0.0] };
    let count = radar.rx_m.len() as f64;
    let width = TAU / (wave(radar) * aperture * count / (count - 1.0));
    let beams = ((2.0 / width * BEAMS_PER_WIDTH).ceil() as usize).clamp(1, 16);
    (0..beams).map(|beam| (2.0 * beam as f64 + 1.0) / beams as f64 - 1.0).collect()
}
