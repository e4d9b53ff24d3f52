//! A transient at the ramp's edge.

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "ramp_edge_transient",
    card: "",
    stage: Stage::Receiver,
    title: "a transient at the ramp's edge",
    explanation: "At the start or the end of each ramp the receiver has not settled: the same additive jump in the first or last samples of every chirp.",
    equation: "+ (10^{level_db/20} + re + j im) reference on the last `samples` samples (the first ones where negative)",
    parameters: &[
        parameter("samples", "samples", 1.0, -64.0, 64.0),
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["spur", "interference", "chirp_droop"],
    separate_by: "a shorter sampling window inside the ramp: the transient disappears",
};
