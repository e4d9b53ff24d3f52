//! A bend of the chirp (card W6).

use super::{
    context::{Context, legendre},
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "chirp_nonlinearity";

/// What reports and docs say of `chirp_nonlinearity`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W6",
    stage: Stage::Waveform,
    needs_person: false,
    title: "a bend of the chirp",
    explanation: "The ramp is not straight: an echo is smeared over ranges, the more the farther it is.",
    equation: "× exp(j2π τ_p δf(t)), δf = Σ_k peak_hz[k] P_{k+2}(x), x = −1 … 1 over the window",
    parameters: &[amplitude("peak_hz", "Hz", 0.0, -10000000.0, 10000000.0)],
    choice: Choice::None,
    look_alikes: &["chirp_droop", "chirp_ripple"],
    separate_by: "a strong reflector at two ranges: this smear grows with the range, a receiver's does not",
    operator: Operator::Signal(apply),
};

/// A warp of the chirp's time by Legendre polynomials from the second order on; those below are the start frequency and
/// the slope.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let along = context.along_the_chirp();
    let peaks = values.get("peak_hz");
    let [orders] = peaks.dims();
    let mut error_hz = values.constant(&vec![0.0; along.len()]);
    for order in 0..orders {
        let shape: Vec<f64> = along.iter().map(|&x| legendre(order + 2, x)).collect();
        error_hz = error_hz + values.constant(&shape) * peaks.clone().narrow(0, order, 1);
    }
    context.tones(values).warp(signal, context.samples_of_frequency(error_hz))
}
