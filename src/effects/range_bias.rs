//! A constant delay of all paths (card D1').

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "range_bias",
    card: "D1'",
    stage: Stage::Scene,
    title: "a constant delay of all paths",
    explanation: "Cables, boards and antennas delay every path alike, so that all is seen farther away by the same distance.",
    equation: "τ_p → τ_p + 2 offset_m / c",
    parameters: &[parameter("offset_m", "m", 0.0, -0.5, 0.5)],
    look_alikes: &["pose_offset", "slope_error", "if_delay"],
    separate_by: "reflectors at known ranges of 1 m and 6 m: a bias shifts both alike, a slope error in proportion to the range",
};
