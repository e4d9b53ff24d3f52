//! A delay of everything that a chirp holds.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::resample::Resampler;
use crate::radar::Radar;

/// A part of the receiver's chain that delays everything by `delay_s`: s(t − τ) times the ramp's own beat with τ. Exact,
/// as Φ(t) − Φ(t − τ − τ') = [Φ(t − τ) − Φ(t − τ − τ')] + [Φ(t) − Φ(t − τ)]. The first sample is where the radar's window begins.
pub fn delayed(signal: &[Complex64], resampler: &Resampler, radar: &Radar, delay_s: f64) -> Vec<Complex64> {
    let mut values = resampler.shifted(signal, -delay_s * radar.sample_rate_hz);
    for (n, value) in values.iter_mut().enumerate() {
        let time_s = radar.adc_start_s + n as f64 / radar.sample_rate_hz;
        let turns = delay_s * (radar.start_frequency_hz + radar.slope_hz_per_s * (time_s - 0.5 * delay_s));
        *value *= Complex64::cis(TAU * turns.fract());
    }
    values
}
