//! Frames that follow each other in another time than stated.

use super::energy::{energy_at, moves, range_and_velocity};
use super::{CLEARLY_DB, Check, PRESENT_DB};
use crate::diagnosis::evidence::Evidence;

/// The velocities are those of the chirps, which have a clock setting of their own; a frame shows the pose of another frame of the motion:
/// of twice its number where the period was stated as half the true one (two buffers counted as two frames), of half its number where
/// as twice (every second frame kept). Both are compared with what is stated over the same frames.
pub(super) fn frame_period(evidence: &Evidence) -> Option<Check> {
    let frames = evidence.body.as_ref().filter(|_| moves(evidence) && evidence.split.block_loops.is_none())?.frames.len();
    let level = |shown: &dyn Fn(usize) -> Option<usize>| {
        energy_at(evidence, shown, |point| Some(range_and_velocity(point, &evidence.radar)))
    };
    let twice = |frame: usize| Some(2 * frame).filter(|shown| *shown < frames);
    let half = |frame: usize| frame.is_multiple_of(2).then_some(frame / 2);
    // As stated, over the frames that the reading shows, and as read.
    let both =
        |factor: f64, shown: &dyn Fn(usize) -> Option<usize>| (factor, level(&|frame| shown(frame).map(|_| frame)), level(shown));
    let compared = [both(2.0, &twice), both(0.5, &half)];
    let wrong = compared.iter().find(|(_, as_is, other)| *other >= PRESENT_DB && other - as_is >= CLEARLY_DB);
    let found = match wrong {
        Some((factor, as_is, other)) => format!(
            "{as_is:.1} dB where the motion puts the body, {other:.1} dB with frames {factor} times as far apart: \
             radar.frame_period_s should be {:.6}",
            factor * evidence.radar.frame_period_s
        ),
        None => {
            let [(_, as_is, twice), (_, _, half)] = compared;
            format!("{as_is:.1} dB as stated, {twice:.1} dB with frames twice as far apart, {half:.1} dB with half of it")
        }
    };
    Some(Check::new("frame_period", "the motion goes on from frame to frame by radar.frame_period_s", found, wrong.is_none()))
}
