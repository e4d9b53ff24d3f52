//! Noise that is stronger at low frequencies (card V2).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "coloured_noise",
    card: "V2",
    stage: Stage::Noise,
    title: "noise that is stronger at low frequencies",
    explanation: "The receiver's noise is not the same at all beat frequencies: the floor rises towards short ranges.",
    equation: "noise power × 1 + (knee_hz/f)^power",
    parameters: &[parameter("knee_hz", "Hz", 0.0, 0.0, 2000000.0), parameter("power", "1", 1.0, 0.2, 3.0)],
    look_alikes: &["tx_leakage", "if_highpass"],
    separate_by: "a recording without transmission",
};
