//! Noise with rare strong samples (card V3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "impulsive_noise",
    card: "V3",
    stage: Stage::Noise,
    title: "noise with rare strong samples",
    explanation: "Now and then a single sample is far off: noise with heavier tails than a Gaussian's.",
    equation: "noise × (1 + excess) on a share `probability` of the samples",
    parameters: &[parameter("probability", "1", 0.0, 0.0, 0.2), parameter("excess", "1", 10.0, 0.0, 1000.0)],
    look_alikes: &["interference"],
    separate_by: "a recording without transmission; bursts last several samples, impulses one",
};
