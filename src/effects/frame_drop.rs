//! Frames that were lost (card G4).

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::fixed,
    values::Values,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "frame_drop";

/// What reports and docs say of `frame_drop`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "G4",
    stage: Stage::Timing,
    needs_person: false,
    title: "frames that were lost",
    explanation: "Frames are missing from the recording, so that from there on every frame shows the body later than its number says.",
    equation: "T_k → T_k + count·T_F for k ≥ at",
    parameters: &[fixed("at", "frame", 0.0, 0.0, 1000000.0), fixed("count", "frames", 0.0, 0.0, 1000.0)],
    choice: Choice::None,
    look_alikes: &["clock_offset", "clock_drift"],
    separate_by: "the frames' own time stamps, or a motion with a sharp event on either side of the gap",
    operator: Operator::Frame(shift),
};

/// How many frames later than its number a frame shows the scene. No gradient.
pub fn shift(values: &Values, frame: usize) -> usize {
    if frame as f64 >= values.host("at")[0] { values.host("count")[0].max(0.0).round() as usize } else { 0 }
}
