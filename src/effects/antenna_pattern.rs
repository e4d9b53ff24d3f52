//! The antennas' directivity (card C3).

use burn::tensor::Tensor;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::BodyPoints,
    values::Values,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "antenna_pattern";

/// What reports and docs say of `antenna_pattern`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "C3",
    stage: Stage::Antenna,
    needs_person: false,
    title: "the antennas' directivity",
    explanation: "The antennas send and receive less towards the side, so that echoes fade as the person leaves the boresight.",
    equation: "A_p → A_p (cos θ_p)^exponent, both ways together",
    parameters: &[amplitude("exponent", "1", 0.0, 0.0, 20.0)],
    choice: Choice::None,
    look_alikes: &["part_reflectivity"],
    separate_by: "a walk sideways, and the same body part seen under several directions",
    operator: Operator::Amplitude(weigh),
};

/// On the body alone: the room's own responses are learned where they stand. One exponent for both ways and both planes,
/// taken at the radar's centre; the same on the body's paths by way of the walls.
///
/// `[point, 1]` → the same.
///
/// # Gradient
/// Flows to the amplitude and to the values.
pub fn weigh(amplitude: Tensor<2>, values: &Values, points: &BodyPoints<'_>) -> Tensor<2> {
    let logs: Vec<f64> = points.off_boresight().into_iter().map(|cosine| cosine.max(0.01).ln()).collect();
    let count = logs.len();
    amplitude * (values.tensor::<2>(logs, [count, 1]) * values.scalar::<2>("exponent")).exp()
}
