//! An offset between the radar's clock and the motion's (card G2).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::BodyPoints,
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "clock_offset";

/// What reports and docs say of `clock_offset`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "G2",
    stage: Stage::Timing,
    needs_person: true,
    title: "an offset between the radar's clock and the motion's",
    explanation: "The motion was filmed by another clock: at each chirp the body is where it will be, or was, a moment later; every moving part is displaced along its velocity.",
    equation: "τ_p(T) → τ_p(T + offset_s)",
    parameters: &[amplitude("offset_s", "s", 0.0, -0.5, 0.5)],
    choice: Choice::None,
    look_alikes: &["pose_offset", "tdm_phase"],
    separate_by: "a motion that starts, stops and turns back: the offset's error changes sign with the velocity, a displaced pose's does not",
    operator: Operator::Time(displace),
};

/// Along the velocity, to first order: an acceleration of 10 m/s² errs by 5 µm for 1 ms, by 0.5 mm for 10 ms. Normals and
/// visibility stay.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    points.later(displacement, values.scalar::<2>("offset_s"))
}
