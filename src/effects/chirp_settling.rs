//! Chirps that settle at the start of a frame.

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, shaping},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "chirp_settling";

/// What reports and docs say of `chirp_settling`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "",
    stage: Stage::Receiver,
    needs_person: false,
    title: "chirps that settle at the start of a frame",
    explanation: "The first chirps of each frame are weaker until the radar has settled.",
    equation: "× 1 − depth e^{−m/chirps}, m counts the chirps of the frame",
    parameters: &[amplitude("depth", "1", 0.0, -1.0, 1.0), shaping("chirps", "chirps", 8.0, 0.5, 200.0)],
    choice: Choice::None,
    look_alikes: &["gain_drift", "phase_noise"],
    separate_by: "longer frames: the first chirps change, the later ones do not",
    operator: Operator::Signal(apply),
};

/// An exponential approach, from anew in every frame.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let counts = context.per_chirp(context.chirp_counts(), values);
    let decay = (-counts / values.scalar::<4>("chirps").clamp_min(0.1)).exp();
    signal.scale(-decay * values.scalar::<4>("depth") + 1.0)
}
