//! An object that the person carries.

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "carried_reflector",
    card: "",
    stage: Stage::Scene,
    title: "an object that the person carries",
    explanation: "The person carries something that reflects, such as a telephone or keys: an echo that moves with one part of the body.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from the body part's point that is nearest to the radar",
    parameters: &[
        parameter("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["part_reflectivity", "clothing_delay"],
    separate_by: "the same motion with empty hands and pockets",
};
