//! Waves that bend around the body's edges (card T7).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "soft_occlusion",
    card: "T7",
    stage: Stage::Propagation,
    title: "waves that bend around the body's edges",
    explanation: "A point is not suddenly hidden: its echo fades as its surface turns away, over the width that diffraction gives.",
    equation: "A_p → A_p (1 − exp(−cos²θ_p / width²)), θ_p between the normal and the line of sight",
    parameters: &[parameter("width", "cosine", 0.0, 0.0, 0.5)],
    look_alikes: &["part_reflectivity"],
    separate_by: "the same edge passed from either side",
};
