//! A vibration of the radar (card I2).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "radar_vibration",
    card: "I2",
    stage: Stage::Scene,
    title: "a vibration of the radar",
    explanation: "The radar itself shakes along its boresight, so that all echoes, also those of the walls, swing in phase together.",
    equation: "s(T) → s(T) exp(j 4π amplitude_m sin(2π frequency_hz T + phase_rad) / λ)",
    parameters: &[
        parameter("amplitude_m", "m", 0.0, 0.0, 0.001),
        parameter("frequency_hz", "Hz", 0.0, 0.0, 1000.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["phase_noise", "breathing"],
    separate_by: "a wall at another range: a vibration moves both alike, phase noise in proportion to the range; the radar on a soft mount",
};
