//! The chest's breathing (card T1).

use std::f64::consts::TAU;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    points::{BodyPoints, TORSO},
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "breathing";

/// What reports and docs say of `breathing`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T1",
    stage: Stage::Body,
    needs_person: true,
    title: "the chest's breathing",
    explanation: "The torso's surface moves in and out by a few millimetres as the person breathes, which the motion does not hold.",
    equation: "p → p + n_p amplitude_m sin(2π rate_hz T + phase_rad) on the torso",
    parameters: &[
        shaping("rate_hz", "Hz", 0.25, 0.1, 0.7),
        amplitude("amplitude_m", "m", 0.0, 0.0, 0.012),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["pose_offset"],
    separate_by: "a person who stands still, and a breath held on command",
    operator: Operator::Displacement(displace),
};

/// One sine along the surface's normals, the same phase everywhere on the torso.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    let angle = values.tensor(points.times_s.to_vec(), [1, points.times_s.len()]) * values.scalar::<2>("rate_hz") * TAU;
    let swing = (angle + values.scalar::<2>("phase_rad")).sin() * values.scalar::<2>("amplitude_m");
    points.along_normals(displacement, swing, &TORSO, values)
}
