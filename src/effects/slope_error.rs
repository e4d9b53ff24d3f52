//! An error of the chirp's slope (card W5).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "slope_error",
    card: "W5",
    stage: Stage::Waveform,
    title: "an error of the chirp's slope",
    explanation: "The ramp is steeper or flatter than declared: all ranges are stretched in proportion.",
    equation: "× exp(j2π τ_p S relative t)",
    parameters: &[parameter("relative", "1", 0.0, -0.02, 0.02)],
    look_alikes: &["range_bias", "pose_offset"],
    separate_by: "two reflectors at known ranges of 1 m and 6 m",
};
