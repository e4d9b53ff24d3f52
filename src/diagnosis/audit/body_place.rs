//! A body at another range, or a motion that belongs to other frames.

use super::energy::{Alternative, Fit, fit, range_and_velocity};
use crate::diagnosis::evidence::Evidence;

/// Largest shift of the body that counts as an effect (a wrong range scale or delay) and not as a wrong scene.
const CALIBRATION_M: f64 = 0.45;
/// Frames by which a clock may be wrong: an effect, too.
const LATE: isize = 3;
/// Ranges that are tried to either side.
const SHIFTS: i32 = 30;

fn moved(evidence: &Evidence, shift_m: f64, later: isize) -> Fit {
    let shown = |frame: usize| frame.checked_add_signed(later);
    fit(evidence, shown, |point| {
        let [range, velocity] = range_and_velocity(point, &evidence.radar);
        (range + shift_m > 0.2).then_some([range + shift_m, velocity])
    })
}

fn shifts_m(evidence: &Evidence) -> impl Iterator<Item = f64> {
    let step = evidence.radar.range_resolution_m().max(0.1);
    (-SHIFTS..=SHIFTS).map(move |i| f64::from(i) * step)
}

/// What is stated, and what differs from it only by an effect that has a name: a range that is a little off (`None`), or a clock that is
/// wrong by a few frames.
pub(super) fn as_stated(evidence: &Evidence) -> Vec<(Option<isize>, Fit)> {
    let near = shifts_m(evidence).filter(|shift| *shift != 0.0 && shift.abs() < CALIBRATION_M);
    let clocks = (-LATE..=LATE).filter(|later| *later != 0);
    std::iter::once((None, moved(evidence, 0.0, 0)))
        .chain(near.map(|shift| (None, moved(evidence, shift, 0))))
        .chain(clocks.map(|later| (Some(later), moved(evidence, 0.0, later))))
        .collect()
}

pub(super) fn elsewhere(evidence: &Evidence) -> Vec<Alternative> {
    let far = shifts_m(evidence).filter(|shift| shift.abs() >= CALIBRATION_M);
    far.map(|shift| Alternative {
        check: "body_place",
        expected: "moving energy where the motion puts the body",
        fit: moved(evidence, shift, 0),
        place: format!("{:.2} m {}", shift.abs(), if shift > 0.0 { "farther" } else { "nearer" }),
        hint: "the body is in the wrong place, or the motion belongs to other frames".into(),
    })
    .collect()
}
