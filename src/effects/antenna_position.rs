//! Antennas that are not where they are declared (card C2).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "antenna_position",
    card: "C2",
    stage: Stage::Antenna,
    title: "antennas that are not where they are declared",
    explanation: "An antenna's phase centre is a fraction of a wavelength off its place: a phase that changes with the direction.",
    equation: "τ_p → τ_p with tx_m + offset_m[tx], rx_m + offset_m[rx]",
    parameters: &[parameter("offset_m", "m", 0.0, -0.002, 0.002)],
    look_alikes: &["channel_mismatch", "pose_offset"],
    separate_by: "a target over ±40° of direction; a common rotation of the array cannot be told from a turned room",
};
