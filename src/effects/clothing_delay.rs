//! An extra delay on clothed parts of the body (card T3).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::{BodyPoints, TORSO},
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "clothing_delay";

/// What reports and docs say of `clothing_delay`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T3",
    stage: Stage::Body,
    needs_person: true,
    title: "an extra delay on clothed parts of the body",
    explanation: "Cloth and hair delay the wave on its way to the skin, so that the parts beneath seem farther away than the mesh.",
    equation: "τ_p → τ_p + 2 extra_m / c on the clothed part",
    parameters: &[amplitude("extra_m", "m", 0.0, -0.01, 0.01)],
    choice: Choice::Part,
    look_alikes: &["range_bias"],
    separate_by: "the same motion with and without the coat",
    operator: Operator::Displacement(displace),
};

/// A displacement away from the radar of the body part that is chosen, or of the torso.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    let part = values.choice.as_deref();
    let parts = part.as_slice();
    points.along_sight(displacement, values.scalar::<2>("extra_m"), if parts.is_empty() { &TORSO } else { parts }, values)
}
