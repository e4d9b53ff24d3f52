//! An object at rest that the scene does not know (card P1).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "static_reflector",
    card: "P1",
    stage: Stage::Scene,
    title: "an object at rest that the scene does not know",
    explanation: "Something at rest, such as furniture, sends an echo that no wall or body explains.",
    equation: "+ amplitude e^{jφ} exp j2π(f_c τ + S t τ) / (d_tx d_rx), τ from position_m",
    parameters: &[
        parameter("position_m", "m", 0.0, -20.0, 20.0),
        parameter("amplitude", "recording's unit·m²", 0.0, -1000000000.0, 1000000000.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["tx_leakage", "range_alias", "wall_ghost"],
    separate_by: "turn the radar: leakage stays in place, the object turns with the room; or change the sample rate, which moves an alias",
};
