//! A gain that changes with time (card W10).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "gain_drift",
    card: "W10",
    stage: Stage::Receiver,
    title: "a gain that changes with time",
    explanation: "Temperature or a recalibration changes the gain of all echoes in the course of the recording.",
    equation: "× 10^{db(T)/20}, db piecewise linear over the frames",
    parameters: &[parameter("db", "dB", 0.0, -20.0, 20.0)],
    look_alikes: &["chirp_settling", "part_reflectivity", "compression"],
    separate_by: "a wall in view: its echo changes along with the body's; a step has a date, a drift has none",
};
