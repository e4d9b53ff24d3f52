//! An error of the chirp's slope (card W5).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "slope_error";

/// What reports and docs say of `slope_error`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W5",
    stage: Stage::Waveform,
    needs_person: false,
    title: "an error of the chirp's slope",
    explanation: "The ramp is steeper or flatter than declared: all ranges are stretched in proportion.",
    equation: "× exp(j2π τ_p S relative t)",
    parameters: &[amplitude("relative", "1", 0.0, -0.02, 0.02)],
    choice: Choice::None,
    look_alikes: &["pose_offset"],
    separate_by: "two reflectors at known ranges of 1 m and 6 m",
    operator: Operator::Signal(apply),
};

/// t → t (1 + relative), t from the ramp's start.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let radar = context.radar;
    let from_ramp = (0..radar.samples_per_chirp).map(|sample| radar.sample_time_s(sample)).collect::<Vec<_>>();
    let shift_s = values.constant(&from_ramp) * values.first("relative");
    context.tones(values).warp(signal, context.samples_of(shift_s))
}
