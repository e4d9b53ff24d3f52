//! Frames that follow each other in another time than stated.

use super::energy::{Alternative, fit, range_and_velocity};
use crate::diagnosis::evidence::Evidence;

/// The velocities are those of the chirps, which have a clock setting of their own; a frame shows the pose of another frame of the motion:
/// of twice its number where the period was stated as half the true one (two buffers counted as two frames), of half its number where
/// as twice (every second frame kept).
pub(super) fn frame_period(evidence: &Evidence) -> Vec<Alternative> {
    let Some(body) = evidence.body.as_ref().filter(|_| evidence.split.block_loops.is_none()) else { return vec![] };
    let frames = body.frames.len();
    let twice = |frame: usize| Some(2 * frame).filter(|shown| *shown < frames);
    let half = |frame: usize| frame.is_multiple_of(2).then_some(frame / 2);
    let reading = |factor: f64, shown: &dyn Fn(usize) -> Option<usize>| Alternative {
        check: "frame_period",
        expected: "the motion goes on from frame to frame by radar.frame_period_s",
        fit: fit(evidence, shown, |point| Some(range_and_velocity(point, &evidence.radar))),
        place: format!("with frames {factor} times as far apart"),
        hint: format!("radar.frame_period_s should be {:.6}", factor * evidence.radar.frame_period_s),
    };
    vec![reading(2.0, &twice), reading(0.5, &half)]
}
