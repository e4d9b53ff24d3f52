//! An error in the time between the transmitters' slots (card G5).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::BodyPoints,
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "tdm_phase";

/// What reports and docs say of `tdm_phase`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "G5",
    stage: Stage::Timing,
    needs_person: false,
    title: "an error in the time between the transmitters' slots",
    explanation: "The transmitters fire one after the other, later than assumed; a moving part gains a phase from one transmitter to the next, which turns its direction.",
    equation: "τ_p → τ_p + τ̇_p · j · slot_s for transmitter j",
    parameters: &[amplitude("slot_s", "s", 0.0, -0.001, 0.001)],
    choice: Choice::None,
    look_alikes: &["channel_mismatch"],
    separate_by: "two directions of walking: the phase changes sign with the velocity, a transmitter's own phase does not",
    operator: Operator::Time(displace),
};

/// A clock's offset that grows from transmitter to transmitter.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    points.later(displacement, values.scalar::<2>("slot_s") * points.tx as f64)
}
