//! Noise that is stronger at low frequencies (card V2).

use std::f64::consts::TAU;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::shaping,
    values::Values,
};
use crate::{complex::Complex, radar::Radar};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "coloured_noise";

/// What reports and docs say of `coloured_noise`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "V2",
    stage: Stage::Noise,
    needs_person: false,
    title: "noise that is stronger at low frequencies",
    explanation: "The receiver's noise is not the same at all beat frequencies: the floor rises towards short ranges.",
    equation: "noise power × 1 + (knee_hz/f)^power",
    parameters: &[shaping("knee_hz", "Hz", 0.0, 0.0, 2000000.0), shaping("power", "1", 1.0, 0.2, 3.0)],
    choice: Choice::None,
    look_alikes: &["tx_leakage", "if_highpass"],
    separate_by: "a recording without transmission",
    operator: Operator::Noise(shape),
};

/// By the Fourier transform of the window; below half a range bin the spectrum stays as it is there.
///
/// Standard normal noise `[tx, rx, loop, sample]` → noise with this effect.
///
/// # Gradient
/// Flows to the values.
pub fn shape(normals: Complex<4>, values: &Values, radar: &Radar, seed: u64) -> Complex<4> {
    let _ = seed;
    let samples = radar.samples_per_chirp;
    let bin_hz = radar.sample_rate_hz / samples as f64;
    let matrix = |sign: f64, weight: f64| {
        let angle = |entry: usize| sign * TAU * ((entry / samples) * (entry % samples) % samples) as f64 / samples as f64;
        let part = |of: fn(f64) -> f64| {
            values.tensor::<2>((0..samples * samples).map(|entry| weight * of(angle(entry))).collect(), [samples, samples])
        };
        Complex::new(part(f64::cos), part(f64::sin))
    };
    let inverse_hz = |bin: usize| 1.0 / (bin.min(samples - bin) as f64).max(0.5) / bin_hz;
    let ratio = values.constant(&(0..samples).map(inverse_hz).collect::<Vec<_>>()) * values.first("knee_hz");
    // 0 to a power has no logarithm: without a knee nothing is added.
    let white = ratio.clone().detach().lower_equal_elem(0.0);
    let added = (ratio.mask_fill(white.clone(), 1.0).log() * values.first("power")).exp().mask_fill(white, 0.0);
    let change = ((added + 1.0).sqrt() - 1.0).reshape([1, samples]);
    let [tx, rx, loops, _] = normals.dims();
    let flat = normals.clone().reshape([tx * rx * loops, samples]);
    let spectrum = flat.matmul(matrix(-1.0, 1.0)).scale(change);
    normals.add(spectrum.matmul(matrix(1.0, 1.0 / samples as f64)).reshape([tx, rx, loops, samples]))
}
