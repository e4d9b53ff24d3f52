//! The receiver's compression (card R4).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "compression",
    card: "R4",
    stage: Stage::Receiver,
    title: "the receiver's compression",
    explanation: "Strong sums of echoes are amplified less: products of three echoes appear, and weak echoes fade when strong ones are present.",
    equation: "s → s − level |s|² s / reference²",
    parameters: &[
        parameter("level", "lost at the reference", 0.0, 0.0, 0.5),
        parameter("reference", "recording's unit", 0.0, 0.0, 1000000000.0),
    ],
    look_alikes: &["gain_drift", "adc_saturation"],
    separate_by: "lower the transmit power by 6 dB: products fall by 18 dB",
};
