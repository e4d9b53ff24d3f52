//! The receiver's compression (card R4).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "compression";

/// What reports and docs say of `compression`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R4",
    stage: Stage::Receiver,
    needs_person: false,
    title: "the receiver's compression",
    explanation: "Strong sums of echoes are amplified less: products of three echoes appear, and weak echoes fade when strong ones are present.",
    equation: "s → s − level |s|² s / reference²",
    parameters: &[
        amplitude("level", "lost at the reference", 0.0, 0.0, 0.5),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["adc_saturation"],
    separate_by: "lower the transmit power by 6 dB: products fall by 18 dB",
    operator: Operator::Nonlinear(apply),
};

/// Third order: `level` is the share of a sample's amplitude that is lost where it equals the reference.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let _ = context;
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let share = signal.clone().power() / (reference.clone() * reference) * values.scalar::<4>("level");
    let lost = signal.clone().scale(share);
    signal.sub(lost)
}
