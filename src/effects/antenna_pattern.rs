//! The antennas' directivity (card C3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "antenna_pattern",
    card: "C3",
    stage: Stage::Antenna,
    title: "the antennas' directivity",
    explanation: "The antennas send and receive less towards the side, so that echoes fade as the person leaves the boresight.",
    equation: "A_p → A_p (cos θ_p)^exponent, both ways together",
    parameters: &[parameter("exponent", "1", 0.0, 0.0, 20.0)],
    look_alikes: &["part_reflectivity"],
    separate_by: "a walk sideways, and the same body part seen under several directions",
};
