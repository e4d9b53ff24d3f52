//! An error of the chirp's start frequency (card W3).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "start_frequency_error";

/// What reports and docs say of `start_frequency_error`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W3",
    stage: Stage::Waveform,
    needs_person: false,
    title: "an error of the chirp's start frequency",
    explanation: "The ramp starts at another frequency than declared, so that every path's phase is wrong in proportion to its delay.",
    equation: "× exp(j2π τ_p f_0 relative) on path p",
    parameters: &[amplitude("relative", "1", 0.0, -0.01, 0.01)],
    choice: Choice::None,
    look_alikes: &["adc_start_error", "if_delay", "if_lowpass"],
    separate_by: "the same scene with another slope: a delay in the receiver counts in proportion to the slope, the start frequency does not; never from one setting of the radar",
    operator: Operator::Signal(apply),
};

/// A constant shift of the chirp's time by δf/S.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let error_hz = values.first("relative") * context.radar.start_frequency_hz;
    context.tones(values).warp(signal, context.samples_of_frequency(error_hz))
}
