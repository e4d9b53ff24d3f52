//! Beams of the receivers along x: what arrives from a direction adds up.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::radar::{Radar, SPEED_OF_LIGHT};

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

/// Extent of the receivers along x; none where they tell no direction.
pub fn aperture_m(radar: &Radar) -> Option<f64> {
    let ends = radar.rx_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at[0]), high.max(at[0])]);
    Some(ends[1] - ends[0]).filter(|aperture| radar.rx_m.len() > 1 && *aperture > 0.0)
}

/// Sum over the receivers.
pub fn beam(values: &[Complex64], steering: &[Complex64]) -> Complex64 {
    values.iter().zip(steering).map(|(value, turn)| value * turn).sum()
}

/// Power of the beams of all transmitters, `[tx · rx]`.
pub fn power(values: &[Complex64], steering: &[Complex64]) -> f64 {
    values.chunks_exact(steering.len()).map(|values| beam(values, steering).norm_sqr()).sum()
}
