//! A constant offset of the receivers (card R2).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude_of_receivers, fixed},
    values::{Values, repeated},
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "dc_offset";

/// What reports and docs say of `dc_offset`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R2",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a constant offset of the receivers",
    explanation: "Each receiver's output has a constant offset: a line at range zero and speed zero.",
    equation: "s_r → s_r + reference (i_r + j q_r)",
    parameters: &[
        amplitude_of_receivers("i", "of the reference", 0.0, -1.0, 1.0),
        amplitude_of_receivers("q", "of the reference", 0.0, -1.0, 1.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "several transmitters: an offset is the same for all of them, leakage is not",
    operator: Operator::Added(apply),
};

/// `i` and `q` for each receiver, or for all.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let receivers = |name: &str| {
        let [_, rx] = context.channels();
        repeated(values.get(name), rx).reshape([1, rx, 1, 1]) * reference.clone()
    };
    signal.add(Complex::new(receivers("i"), receivers("q")))
}
