//! The body's reflection in a wall (card P4, P5).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "wall_ghost",
    card: "P4, P5",
    stage: Stage::Propagation,
    title: "the body's reflection in a wall",
    explanation: "A wall mirrors the body: the wave goes out directly and comes back by way of the wall, and the other way round, which shows a ghost behind the person.",
    equation: "+ coefficient Σ_p A_p [exp j2π(f_c τ_1 + S t τ_1) + exp j2π(f_c τ_2 + S t τ_2)], τ_1 by way of the mirrored receiver, τ_2 of the mirrored transmitter",
    parameters: &[parameter("coefficient", "1", 0.0, -1.0, 1.0), parameter("phase_rad", "rad", 0.0, -6.3, 6.3)],
    look_alikes: &["moving_reflector", "body_multibounce", "floor_bounce"],
    separate_by: "stand at another distance from the wall: the ghost's delay follows the mirror law, a second person's does not",
};
