//! A vibration of the radar (card I2).

use std::f64::consts::TAU;

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "radar_vibration";

/// What reports and docs say of `radar_vibration`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "I2",
    stage: Stage::Scene,
    needs_person: false,
    title: "a vibration of the radar",
    explanation: "The radar itself shakes along its boresight, so that the phases of all echoes, also those of the walls, oscillate together.",
    equation: "s(T) → s(T) exp(j 4π amplitude_m sin(2π frequency_hz T + phase_rad) / λ)",
    parameters: &[
        amplitude("amplitude_m", "m", 0.0, 0.0, 0.001),
        shaping("frequency_hz", "Hz", 0.0, 0.0, 1000.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["phase_noise", "breathing"],
    separate_by: "a wall at another range: a vibration moves both alike, phase noise in proportion to the range; the radar on a soft mount",
    operator: Operator::Signal(apply),
};

/// Along the boresight: one phase for all echoes of a chirp, the cosine of their direction left out.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let middle_s = context.radar.sample_time_s(context.radar.samples_per_chirp / 2);
    let times = context.ramp_times_s().into_iter().map(|time| time + middle_s).collect();
    let angle = context.per_chirp(times, values) * values.scalar::<4>("frequency_hz") * TAU + values.scalar::<4>("phase_rad");
    let turns = angle.sin() * values.scalar::<4>("amplitude_m") * (2.0 / context.radar.wavelength_m());
    signal.mul(Complex::unit(turns))
}
