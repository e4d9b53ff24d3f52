//! Waves that bend around the body's edges (card T7).

use burn::tensor::Tensor;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::shaping,
    points::BodyPoints,
    values::Values,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "soft_occlusion";

/// What reports and docs say of `soft_occlusion`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T7",
    stage: Stage::Propagation,
    needs_person: true,
    title: "waves that bend around the body's edges",
    explanation: "A point is not suddenly hidden: its echo fades as its surface turns away, over the width that diffraction gives.",
    equation: "A_p → A_p (1 − exp(−cos²θ_p / width²)), θ_p between the normal and the line of sight",
    parameters: &[shaping("width", "cosine", 0.0, 0.0, 0.5)],
    choice: Choice::None,
    look_alikes: &["part_reflectivity"],
    separate_by: "the same edge passed from either side",
    operator: Operator::Amplitude(weigh),
};

/// Only the body's own horizon: points that turn away fade before hidden point removal drops them. What another part
/// covers still goes at once.
///
/// `[point, 1]` → the same.
///
/// # Gradient
/// Flows to the amplitude and to the values.
pub fn weigh(amplitude: Tensor<2>, values: &Values, points: &BodyPoints<'_>) -> Tensor<2> {
    let cosines = points.facing();
    let width = values.scalar::<2>("width");
    let squares = values.tensor::<2>(cosines.iter().map(|cosine| cosine * cosine).collect(), [cosines.len(), 1]);
    // The floor keeps a width of zero finite and exactly neutral but for surfaces seen on edge.
    let hidden = (-(squares + 1e-9) / (width.clone() * width + 1e-12)).exp();
    amplitude * (-hidden + 1.0)
}
