//! The receiver's second harmonic (card R5).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "second_harmonic",
    card: "R5",
    stage: Stage::Receiver,
    title: "the receiver's second harmonic",
    explanation: "The mixer or amplifier squares a little of the signal: strong echoes appear again at twice the range, speed and array phase.",
    equation: "s → s + κ s² / reference, κ = 10^{level_db/20} + re + j im",
    parameters: &[
        parameter("level_db", "dB of the reference", -200.0, -120.0, 20.0),
        parameter("re", "of the reference", 0.0, -10.0, 10.0),
        parameter("im", "of the reference", 0.0, -10.0, 10.0),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["object_radar_object", "wall_ghost"],
    separate_by: "step out of the boresight: a harmonic doubles the phases across the array, a second trip does not; or lower the transmit power by 6 dB",
};
