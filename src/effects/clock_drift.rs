//! A difference in rate between the radar's clock and the motion's (card G3).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "clock_drift",
    card: "G3",
    stage: Stage::Timing,
    title: "a difference in rate between the radar's clock and the motion's",
    explanation: "One of the two clocks is faster, so that the body's displacement along its velocity grows with time.",
    equation: "τ_p(T) → τ_p(T (1 + relative))",
    parameters: &[parameter("relative", "1", 0.0, -0.01, 0.01)],
    look_alikes: &["clock_offset", "breathing"],
    separate_by: "a longer recording: the drift's error grows with time, an offset's does not",
};
