//! Chirps that settle at the start of a frame.

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "chirp_settling",
    card: "",
    stage: Stage::Receiver,
    title: "chirps that settle at the start of a frame",
    explanation: "The first chirps of each frame are weaker until the radar has settled.",
    equation: "× 1 − depth e^{−m/chirps}, m counts the chirps of the frame",
    parameters: &[parameter("depth", "1", 0.0, -1.0, 1.0), parameter("chirps", "chirps", 8.0, 0.5, 200.0)],
    look_alikes: &["gain_drift", "phase_noise"],
    separate_by: "longer frames: the first chirps change, the later ones do not",
};
