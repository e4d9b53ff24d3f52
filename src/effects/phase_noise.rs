//! The oscillator's phase noise (card W8).

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::spread,
    values::Values,
};
use crate::{complex::Complex, radar::SPEED_OF_LIGHT};

/// Range that `per_chirp_rad` refers to.
const REFERENCE_M: f64 = 3.0;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "phase_noise";

/// What reports and docs say of `phase_noise`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W8",
    stage: Stage::Waveform,
    needs_person: false,
    title: "the oscillator's phase noise",
    explanation: "The oscillator's frequency wanders from chirp to chirp: a pedestal in Doppler around strong echoes that grows with range.",
    equation: "× exp(j δ_m τ_p/τ_3m), δ_m normal of deviation per_chirp_rad",
    parameters: &[spread("per_chirp_rad", "rad at 3 m", 0.0, 0.0, 1.0)],
    choice: Choice::None,
    look_alikes: &["chirp_start_jitter", "gain_drift"],
    separate_by: "two walls at different ranges: this phase grows with range, a vibration's does not",
    operator: Operator::Signal(apply),
};

/// Only the part that is slower than a chirp: a frequency error of its own for every chirp, drawn at random, the same
/// for all receivers. The draws of a frame are the same whenever it is simulated; they are not those of a recording.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let mut random = context.random(0x9A5E);
    let draws = context.chirp_counts().iter().map(|_| StandardNormal.sample(&mut random)).collect();
    // A phase φ at 3 m is a shift of the chirp's time by φ / (2π S τ_3m).
    let beat_hz = context.radar.slope_hz_per_s * 2.0 * REFERENCE_M / SPEED_OF_LIGHT;
    let samples_per_rad = context.radar.sample_rate_hz / (TAU * beat_hz);
    let shift = context.per_chirp(draws, values) * values.scalar::<4>("per_chirp_rad") * samples_per_rad;
    context.tones(values).shift(signal, shift)
}
