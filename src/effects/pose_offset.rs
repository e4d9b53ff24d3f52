//! An offset of the body's place (card G1).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::BodyPoints,
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "pose_offset";

/// What reports and docs say of `pose_offset`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "G1",
    stage: Stage::Scene,
    needs_person: true,
    title: "an offset of the body's place",
    explanation: "The body does not stand where the motion says: all of it is shifted, or turned about the vertical through its middle.",
    equation: "p → R_z(yaw_deg)(p − c) + c + offset_m",
    parameters: &[amplitude("offset_m", "m", 0.0, -0.5, 0.5), amplitude("yaw_deg", "deg", 0.0, -30.0, 30.0)],
    choice: Choice::None,
    look_alikes: &["range_bias", "clothing_delay", "channel_mismatch"],
    separate_by: "a walk through many directions: a shift of the body changes range in front and direction at the side, a range bias changes range alone",
    operator: Operator::Displacement(displace),
};

/// Normals and visibility stay those of the motion.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    let [x, y, z] = values.vector("offset_m").map(|part| part.reshape([1, 1]));
    let centre = points.centre_m;
    let angle = values.scalar::<2>("yaw_deg") * (std::f64::consts::PI / 180.0);
    let (sine, less) = (angle.clone().sin(), angle.cos() - 1.0);
    let from_centre = |axis: usize| {
        let along = points.reference_m.iter().map(|point| point[axis] - centre[axis]).collect();
        values.tensor::<2>(along, [points.reference_m.len(), 1])
    };
    let (right, ahead) = (from_centre(0), from_centre(1));
    let (right, ahead) = (right + displacement.x.clone(), ahead + displacement.y.clone());
    Displacement {
        x: displacement.x + right.clone() * less.clone() - ahead.clone() * sine.clone() + x,
        y: displacement.y + right * sine + ahead * less + y,
        z: displacement.z + z,
    }
}
