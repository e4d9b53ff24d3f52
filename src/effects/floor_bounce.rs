//! The body's reflection in the floor (card P6).

use super::info::{EffectInfo, Stage, parameter};

pub static INFO: EffectInfo = EffectInfo {
    id: "floor_bounce",
    card: "P6",
    stage: Stage::Propagation,
    title: "the body's reflection in the floor",
    explanation: "The wave also reaches the body by way of the floor, once or twice; the sum with the direct wave makes the echo fade and swell with range.",
    equation: "+ Σ_p A_p [Γ (e^{j…τ_1} + e^{j…τ_2}) + Γ² e^{j…τ_12}], Γ = coefficient, the mirror being the floor",
    parameters: &[parameter("coefficient", "1", 0.0, -1.0, 1.0), parameter("phase_rad", "rad", 0.0, -6.3, 6.3)],
    look_alikes: &["wall_ghost", "part_reflectivity", "body_multibounce"],
    separate_by: "a carpet or absorber on the floor between radar and person",
};
