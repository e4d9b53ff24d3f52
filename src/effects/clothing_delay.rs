//! An extra delay on clothed parts of the body (card T3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "clothing_delay",
    card: "T3",
    stage: Stage::Body,
    title: "an extra delay on clothed parts of the body",
    explanation: "Cloth and hair delay the wave on its way to the skin, so that the parts beneath seem farther away than the mesh.",
    equation: "τ_p → τ_p + 2 extra_m / c on the clothed part",
    parameters: &[parameter("extra_m", "m", 0.0, -0.01, 0.01)],
    look_alikes: &["pose_offset", "range_bias"],
    separate_by: "the same motion with and without the coat",
};
