//! An offset of the body's place (card G1).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "pose_offset",
    card: "G1",
    stage: Stage::Scene,
    title: "an offset of the body's place",
    explanation: "The body does not stand where the motion says: all of it is shifted, or turned about the vertical through its middle.",
    equation: "p → R_z(yaw_deg)(p − c) + c + offset_m",
    parameters: &[parameter("offset_m", "m", 0.0, -0.5, 0.5), parameter("yaw_deg", "deg", 0.0, -30.0, 30.0)],
    look_alikes: &["range_bias", "clock_offset", "clothing_delay"],
    separate_by: "a walk through many directions: a shift of the body changes range in front and direction at the side, a range bias changes range alone",
};
