//! A ripple of the chirp's frequency (card W7).

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
pub const ID: &str = "chirp_ripple";

/// What reports and docs say of `chirp_ripple`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W7",
    stage: Stage::Waveform,
    needs_person: false,
    title: "a ripple of the chirp's frequency",
    explanation: "The ramp's frequency is modulated sinusoidally: every echo gets a pair of sidelobes, before and behind, whose level grows with range.",
    equation: "× exp(j2π τ_p deviation_hz sin(2π ripple_hz t + phase_rad))",
    parameters: &[
        amplitude("deviation_hz", "Hz", 0.0, 0.0, 10000000.0),
        shaping("ripple_hz", "Hz", 200000.0, 10000.0, 5000000.0),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["wall_ghost", "spur"],
    separate_by: "move the target: the pair keeps its distance and grows with range; a spur stays where it is",
    operator: Operator::Signal(apply),
};

/// A periodic warp of the chirp's time, t from the window's start.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let radar = context.radar;
    let times: Vec<f64> = (0..radar.samples_per_chirp).map(|sample| sample as f64 / radar.sample_rate_hz).collect();
    let angle = values.constant(&times) * values.first("ripple_hz") * TAU + values.first("phase_rad");
    let error_hz = angle.sin() * values.first("deviation_hz");
    context.tones(values).warp(signal, context.samples_of_frequency(error_hz))
}
