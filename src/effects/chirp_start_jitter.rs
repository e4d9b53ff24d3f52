//! A jitter of the chirps' starts (card W9).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "chirp_start_jitter",
    card: "W9",
    stage: Stage::Waveform,
    title: "a jitter of the chirps' starts",
    explanation: "Chirps start now and then one clock tick late, at random: a two-valued phase from chirp to chirp that grows with range.",
    equation: "× exp(j2π S τ_p δ_m), δ_m ∈ {0, jitter_s} at random",
    parameters: &[parameter("jitter_s", "s", 0.0, 0.0, 1e-07)],
    look_alikes: &["phase_noise"],
    separate_by: "a strong wall: the phases take two values here, and spread evenly with phase noise",
};
