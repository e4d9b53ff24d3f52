//! The receiver's second harmonic (card R5).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, fixed, level},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "second_harmonic";

/// What reports and docs say of `second_harmonic`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "R5",
    stage: Stage::Receiver,
    needs_person: false,
    title: "the receiver's second harmonic",
    explanation: "The mixer or amplifier squares a little of the signal: strong echoes appear again at twice the range, speed and array phase.",
    equation: "s → s + κ s² / reference, κ = 10^{level_db/20} + re + j im",
    parameters: &[
        level("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        amplitude("re", "of the reference", 0.0, -10.0, 10.0),
        amplitude("im", "of the reference", 0.0, -10.0, 10.0),
        fixed("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    choice: Choice::None,
    look_alikes: &["wall_ghost"],
    separate_by: "step out of the boresight: a harmonic doubles the phases across the array, a second trip does not; or lower the transmit power by 6 dB",
    operator: Operator::Nonlinear(apply),
};

/// κ s² / reference: the level is that of the harmonic of a sample as strong as the reference.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let _ = context;
    let strength = values.amplitude();
    let reference = values.reference(&signal).reshape([1, 1, 1, 1]);
    let re = strength.re.narrow(0, 0, 1).reshape([1, 1, 1, 1]) / reference.clone();
    let im = strength.im.narrow(0, 0, 1).reshape([1, 1, 1, 1]) / reference;
    let square = signal.clone().mul(signal.clone());
    signal.add(square.mul(Complex::new(re, im)))
}
