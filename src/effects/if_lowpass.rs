//! The receiver's IF low-pass filter (card R8).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "if_lowpass",
    card: "R8",
    stage: Stage::Receiver,
    title: "the receiver's IF low-pass filter",
    explanation: "The anti-alias filter delays all echoes a little and weakens far ones.",
    equation: "× 1 / (1 + j f_b/corner_hz), f_b = S τ; corner_hz = 0 stands for no filter",
    parameters: &[parameter("corner_hz", "Hz", 0.0, 0.0, 100000000.0)],
    look_alikes: &["start_frequency_error", "if_delay", "if_highpass"],
    separate_by: "the shape of the noise floor over range in an empty room",
};
