//! An error of the sampling window's start (card W4).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "adc_start_error";

/// What reports and docs say of `adc_start_error`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W4",
    stage: Stage::Waveform,
    needs_person: false,
    title: "an error of the sampling window's start",
    explanation: "Sampling starts later than declared; the sampled part of the ramp is another one and all phases are wrong in proportion to the delay.",
    equation: "t → t + offset_s, that is × exp(j2π τ_p S offset_s)",
    parameters: &[amplitude("offset_s", "s", 0.0, -1e-05, 1e-05)],
    choice: Choice::None,
    look_alikes: &["if_delay", "if_lowpass"],
    separate_by: "the same scene with another slope; never from one setting of the radar",
    operator: Operator::Signal(apply),
};

/// A constant shift of the chirp's time. Good for shifts up to about one sample: nothing is known beyond the window's
/// ends.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    context.tones(values).warp(signal, context.samples_of(values.first("offset_s")))
}
