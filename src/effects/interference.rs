//! Bursts from another radar (card I1).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "interference",
    card: "I1",
    stage: Stage::Receiver,
    title: "bursts from another radar",
    explanation: "Another radar's chirp crosses ours now and then: short bursts in single chirps, over all ranges.",
    equation: "+ (re + j im) reference e^{jπ (n − n_b)² / length} on samples first … first + length of a chirp",
    parameters: &[
        parameter("bursts", "per frame", 0.0, 0.0, 1000.0),
        parameter("frame", "frame", 0.0, 0.0, 1000000.0),
        parameter("chirp", "chirp of the frame", 0.0, 0.0, 1000000.0),
        parameter("first", "sample", 0.0, 0.0, 1000000.0),
        parameter("length", "samples", 16.0, 1.0, 1000000.0),
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["impulsive_noise", "spur"],
    separate_by: "switch the other radar off, or transmit nothing: the bursts stay without our own signal",
};
