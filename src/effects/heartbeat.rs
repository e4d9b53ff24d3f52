//! The heartbeat's motion of the chest (card T2).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "heartbeat",
    card: "T2",
    stage: Stage::Body,
    title: "the heartbeat's motion of the chest",
    explanation: "The chest moves by a fraction of a millimetre with every beat of the heart.",
    equation: "p → p + n_p amplitude_m sin(2π rate_hz T + phase_rad) on the upper torso",
    parameters: &[
        parameter("rate_hz", "Hz", 1.2, 0.7, 3.0),
        parameter("amplitude_m", "m", 0.0, 0.0, 0.001),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["breathing", "radar_vibration"],
    separate_by: "a person who stands still with the breath held",
};
