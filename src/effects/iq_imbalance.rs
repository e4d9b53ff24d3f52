//! An imbalance of the I and Q channels (card R3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "iq_imbalance",
    card: "R3",
    stage: Stage::Receiver,
    title: "an imbalance of the I and Q channels",
    explanation: "The two receiver branches differ in gain and angle: a faint mirror image of the scene at negative ranges and speeds.",
    equation: "s → s + μ s*, μ = (10^{gain_db/20} − 1 + j phase_deg π/180) / 2",
    parameters: &[parameter("gain_db", "dB", 0.0, -6.0, 6.0), parameter("phase_deg", "deg", 0.0, -30.0, 30.0)],
    look_alikes: &["second_harmonic", "range_alias"],
    separate_by: "a single strong moving reflector: the image moves against it",
};
