//! Another reflectivity of one part of the body (card T4).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "part_reflectivity",
    card: "T4",
    stage: Stage::Body,
    title: "another reflectivity of one part of the body",
    explanation: "One part of the body reflects more or less. The learned reflectivity takes this up exactly: a change of description that no recording can prove, never missing physics.",
    equation: "A_p → A_p 10^{db/20} on the body part",
    parameters: &[parameter("db", "dB", 0.0, -20.0, 20.0)],
    look_alikes: &["carried_reflector"],
    separate_by: "none with one person: it cannot be told from the learned reflectivity; the same garment on several persons hints at it",
};
