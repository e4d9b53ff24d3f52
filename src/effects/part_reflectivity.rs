//! Another reflectivity of one part of the body (card T4).

use burn::tensor::Tensor;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::{BodyPoints, TORSO},
    values::Values,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "part_reflectivity";

/// What reports and docs say of `part_reflectivity`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T4",
    stage: Stage::Body,
    needs_person: true,
    title: "another reflectivity of one part of the body",
    explanation: "One part of the body reflects more or less. The learned reflectivity takes this up exactly: a change of description that no recording can prove, never missing physics.",
    equation: "A_p → A_p 10^{db/20} on the body part",
    parameters: &[amplitude("db", "dB", 0.0, -20.0, 20.0)],
    choice: Choice::Part,
    look_alikes: &[],
    separate_by: "none with one person: it cannot be told from the learned reflectivity; the same garment on several persons hints at it",
    operator: Operator::Amplitude(weigh),
};

/// On the body part that is chosen, or the torso.
///
/// `[point, 1]` → the same.
///
/// # Gradient
/// Flows to the amplitude and to the values.
pub fn weigh(amplitude: Tensor<2>, values: &Values, points: &BodyPoints<'_>) -> Tensor<2> {
    let part = values.choice.as_deref();
    let mask = points.mask(if part.is_none() { &TORSO } else { part.as_slice() }, values);
    amplitude * (mask * values.scalar::<2>("db") * (std::f64::consts::LN_10 / 20.0)).exp()
}
