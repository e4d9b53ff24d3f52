//! A spur (card R12).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "spur",
    card: "R12",
    stage: Stage::Receiver,
    title: "a spur",
    explanation: "A clock's tone reaches the receiver: a line at one beat frequency that has no echo behind it.",
    equation: "+ (10^{level_db/20} + re + j im) reference exp(j2π frequency_hz T)",
    parameters: &[
        parameter("frequency_hz", "Hz", 0.0, -100000000.0, 100000000.0),
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["static_reflector", "interference", "range_alias"],
    separate_by: "transmit nothing: the spur stays",
};
