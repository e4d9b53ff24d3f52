//! Noise that the receivers have in common (card V4).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "correlated_noise",
    card: "V4",
    stage: Stage::Noise,
    title: "noise that the receivers have in common",
    explanation: "Supply or oscillator noise reaches all receivers at once: a faint echo from one direction in every cell.",
    equation: "n_r → n_r + coefficient n_common",
    parameters: &[parameter("coefficient", "1", 0.0, 0.0, 2.0)],
    look_alikes: &["mutual_coupling"],
    separate_by: "a recording without transmission",
};
