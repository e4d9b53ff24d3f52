//! A ripple of the chirp's frequency (card W7).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "chirp_ripple",
    card: "W7",
    stage: Stage::Waveform,
    title: "a ripple of the chirp's frequency",
    explanation: "The ramp's frequency swings periodically: every echo gets a pair of fainter ones, before and behind, whose strength grows with range.",
    equation: "× exp(j2π τ_p deviation_hz sin(2π ripple_hz t + phase_rad))",
    parameters: &[
        parameter("deviation_hz", "Hz", 0.0, 0.0, 10000000.0),
        parameter("ripple_hz", "Hz", 200000.0, 10000.0, 5000000.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["wall_ghost", "spur", "chirp_nonlinearity"],
    separate_by: "move the target: the pair keeps its distance and grows with range; a spur stays where it is",
};
