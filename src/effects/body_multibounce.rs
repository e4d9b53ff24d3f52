//! Echoes between parts of the body (card T9).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "body_multibounce",
    card: "T9",
    stage: Stage::Propagation,
    title: "echoes between parts of the body",
    explanation: "The wave goes from one part of the body to another before it returns: a faint second body, a little behind the first.",
    equation: "+ coefficient s_body(τ + 2 extra_m / c)",
    parameters: &[
        parameter("extra_m", "m", 0.3, 0.0, 1.5),
        parameter("coefficient", "1", 0.0, -1.0, 1.0),
        parameter("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    look_alikes: &["floor_bounce", "wall_ghost"],
    separate_by: "arms held away from the body, legs apart",
};
