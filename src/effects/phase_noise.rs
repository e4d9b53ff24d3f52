//! The oscillator's phase noise (card W8).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "phase_noise",
    card: "W8",
    stage: Stage::Waveform,
    title: "the oscillator's phase noise",
    explanation: "The oscillator's frequency wanders from chirp to chirp: a pedestal in Doppler around strong echoes that grows with range.",
    equation: "× exp(j δ_m τ_p/τ_3m), δ_m normal of deviation per_chirp_rad",
    parameters: &[parameter("per_chirp_rad", "rad at 3 m", 0.0, 0.0, 1.0)],
    look_alikes: &["chirp_start_jitter", "radar_vibration", "gain_drift"],
    separate_by: "two walls at different ranges: this phase grows with range, a vibration's does not",
};
