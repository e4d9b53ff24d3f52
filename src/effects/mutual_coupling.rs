//! Coupling between neighbouring receivers (card C4).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "mutual_coupling",
    card: "C4",
    stage: Stage::Antenna,
    title: "coupling between neighbouring receivers",
    explanation: "Each receiver also picks up what its neighbours receive.",
    equation: "s_r → s_r + (z + re + j im)(s_{r−1} + s_{r+1}), |z| = 10^{level_db/20}",
    parameters: &[
        parameter("level_db", "dB of the neighbour", -200.0, -120.0, 0.0),
        parameter("re", "1", 0.0, -1.0, 1.0),
        parameter("im", "1", 0.0, -1.0, 1.0),
    ],
    look_alikes: &["channel_mismatch"],
    separate_by: "a strong reflector at several directions",
};
