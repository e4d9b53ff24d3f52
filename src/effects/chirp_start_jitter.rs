//! A jitter of the chirps' starts (card W9).

use rand::RngExt;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::spread,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "chirp_start_jitter";

/// What reports and docs say of `chirp_start_jitter`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W9",
    stage: Stage::Waveform,
    needs_person: false,
    title: "a jitter of the chirps' starts",
    explanation: "Chirps start now and then one clock tick late, at random: a two-valued phase from chirp to chirp that grows with range.",
    equation: "× exp(j2π S τ_p δ_m), δ_m ∈ {0, jitter_s} at random",
    parameters: &[spread("jitter_s", "s", 0.0, 0.0, 1e-07)],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "a strong wall: the phases take two values here, and spread evenly with phase noise",
    operator: Operator::Signal(apply),
};

/// Every chirp is late with probability ½; the draws of a frame are the same whenever it is simulated.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let mut random = context.random(0x51A7);
    let late = context.chirp_counts().iter().map(|_| if random.random_bool(0.5) { 1.0 } else { 0.0 }).collect();
    let shift = context.per_chirp(late, values) * values.scalar::<4>("jitter_s") * context.radar.sample_rate_hz;
    context.tones(values).shift(signal, shift)
}
