//! A delay in the IF chain (card W3).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "if_delay";

/// What reports and docs say of `if_delay`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W3",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a delay in the IF chain",
    explanation: "The IF chain delays the signal, so that each beat is sampled late: a phase in proportion to range.",
    equation: "s(t) → s(t − delay_s), that is × exp(−j2π S τ_p delay_s)",
    parameters: &[amplitude("delay_s", "s", 0.0, -1e-06, 1e-06)],
    choice: Choice::None,
    look_alikes: &["if_lowpass"],
    separate_by: "the same scene with another slope; never from one setting of the radar",
    operator: Operator::Signal(apply),
};

/// A constant shift of the chirp's time.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    context.tones(values).warp(signal, context.samples_of(-values.first("delay_s")))
}
