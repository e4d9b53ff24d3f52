//! The heartbeat's motion of the chest (card T2).

use std::f64::consts::TAU;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::{amplitude, angle, shaping},
    points::{BodyPoints, CHEST},
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "heartbeat";

/// What reports and docs say of `heartbeat`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "T2",
    stage: Stage::Body,
    needs_person: true,
    title: "the heartbeat's motion of the chest",
    explanation: "The chest moves by a fraction of a millimetre with every beat of the heart.",
    equation: "p → p + n_p amplitude_m sin(2π rate_hz T + phase_rad) on the upper torso",
    parameters: &[
        shaping("rate_hz", "Hz", 1.2, 0.7, 3.0),
        amplitude("amplitude_m", "m", 0.0, 0.0, 0.001),
        angle("phase_rad", "rad", 0.0, -6.3, 6.3),
    ],
    choice: Choice::None,
    look_alikes: &["breathing", "radar_vibration"],
    separate_by: "a person who stands still with the breath held",
    operator: Operator::Displacement(displace),
};

/// One sine along the surface's normals, the same phase everywhere on the upper torso.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    let angle = values.tensor(points.times_s.to_vec(), [1, points.times_s.len()]) * values.scalar::<2>("rate_hz") * TAU;
    let swing = (angle + values.scalar::<2>("phase_rad")).sin() * values.scalar::<2>("amplitude_m");
    points.along_normals(displacement, swing, &CHEST, values)
}
