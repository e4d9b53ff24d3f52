//! A difference in rate between the radar's clock and the motion's (card G3).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    points::BodyPoints,
    values::Values,
};
use crate::body::Displacement;

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "clock_drift";

/// What reports and docs say of `clock_drift`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "G3",
    stage: Stage::Timing,
    needs_person: true,
    title: "a difference in rate between the radar's clock and the motion's",
    explanation: "One of the two clocks is faster, so that the body's displacement along its velocity grows with time.",
    equation: "τ_p(T) → τ_p(T (1 + relative))",
    parameters: &[amplitude("relative", "1", 0.0, -0.1, 0.1)],
    choice: Choice::None,
    look_alikes: &["clock_offset", "breathing"],
    separate_by: "a longer recording: the drift's error grows with time, an offset's does not",
    operator: Operator::Time(displace),
};

/// As a clock's offset that grows with the radar's time from zero on.
///
/// `[point, chirp]`, metres → the same.
///
/// # Gradient
/// Flows to the displacement and to the values.
pub fn displace(displacement: Displacement, values: &Values, points: &BodyPoints<'_>) -> Displacement {
    let times = values.tensor(points.times_s.to_vec(), [1, points.times_s.len()]);
    points.later(displacement, times * values.scalar::<2>("relative"))
}
