//! An object that moves by itself (card P2).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "moving_reflector",
    card: "P2",
    stage: Stage::Scene,
    title: "an object that moves by itself",
    explanation: "Something else moves, such as a fan, a curtain or a second person: an echo with a Doppler of its own.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from position_m + axis · swing_m sin(2π rate_hz T + motion_rad)",
    parameters: &[
        parameter("position_m", "m", 0.0, -20.0, 20.0),
        parameter("rate_hz", "Hz", 0.0, 0.0, 20.0),
        parameter("swing_m", "m", 0.0, 0.0, 1.0),
        parameter("axis", "1", 0.0, -1.0, 1.0),
        parameter("motion_rad", "rad", 0.0, -6.3, 6.3),
        parameter("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["wall_ghost", "second_harmonic", "object_radar_object"],
    separate_by: "a recording of the room without the person: the object still moves, a ghost of the person does not",
};
