//! A gain that changes with time (card W10).

use super::{
    context::Context,
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::Values,
};
use crate::complex::Complex;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "gain_drift";

/// What reports and docs say of `gain_drift`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "W10",
    stage: Stage::Receiver,
    needs_person: false,
    title: "a gain that changes with time",
    explanation: "Temperature or a recalibration changes the gain of all echoes in the course of the recording.",
    equation: "× 10^{db(T)/20}, db piecewise linear over the frames",
    parameters: &[amplitude("db", "dB", 0.0, -20.0, 20.0)],
    choice: Choice::None,
    look_alikes: &["part_reflectivity", "compression"],
    separate_by: "a wall in view: its echo changes along with the body's; a step occurs at one instant, a drift does not",
    operator: Operator::Signal(apply),
};

/// One number is the change from the first frame to the last, about the middle; several are the gains at knots that are
/// spread evenly over the frames.
///
/// `[tx, rx, loop, sample]` → the same.
///
/// # Gradient
/// Flows to the signal and to the values.
pub fn apply(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let decibels = values.get("db");
    let [knots] = decibels.dims();
    let progress = context.frame as f64 / (context.radar.frames.max(2) - 1) as f64;
    let gain_db = if knots == 1 {
        decibels * (progress - 0.5)
    } else {
        let place = (progress * (knots - 1) as f64).clamp(0.0, (knots - 1) as f64);
        let before = (place.floor() as usize).min(knots - 2);
        let share = place - before as f64;
        decibels.clone().narrow(0, before, 1) * (1.0 - share) + decibels.narrow(0, before + 1, 1) * share
    };
    signal.scale((gain_db * (std::f64::consts::LN_10 / 20.0)).exp().reshape([1, 1, 1, 1]))
}
