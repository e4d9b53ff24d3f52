//! A body at another range, or a motion that belongs to other frames.

use super::energy::{energy_at, moves, range_and_velocity};
use super::{CLEARLY_DB, Check, PRESENT_DB};
use crate::diagnosis::evidence::Evidence;

/// Largest shift of the body that counts as an effect and not as a wrong scene.
const CALIBRATION_M: f64 = 0.45;
pub(super) const SILENT: &str = "no body is heard where the motion puts it, nor at other ranges";
/// Frames by which a clock may be wrong.
const LATE: isize = 3;

/// Whether the body is where the motion says, or somewhere else, or the motion belongs to other frames.
pub fn body_place(evidence: &Evidence) -> Option<Check> {
    evidence.body.as_ref().filter(|_| moves(evidence))?;
    let level = |shift_m: f64, later: isize| {
        energy_at(
            evidence,
            |frame: usize| frame.checked_add_signed(later),
            |point| {
                let [range, velocity] = range_and_velocity(point, &evidence.radar);
                (range + shift_m > 0.2).then_some([range + shift_m, velocity])
            },
        )
    };
    let here = level(0.0, 0);
    let step = evidence.radar.range_resolution_m().max(0.1);
    let shifts = (-30..=30).map(|i| i as f64 * step);
    let (best_m, best) =
        shifts.map(|shift| (shift, level(shift, 0))).fold((0.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    // Nearer than that it is a matter of calibration, which has effects of its own.
    let elsewhere = best - here >= CLEARLY_DB && best_m.abs() >= CALIBRATION_M;
    // And a clock that is wrong by a few frames has a name.
    let (late, then) =
        (-LATE..=LATE).map(|later| (later, level(0.0, later))).fold((0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    let clock = late != 0 && then >= PRESENT_DB && then - here >= CLEARLY_DB && then >= best;
    let ok = clock || !elsewhere && (here >= PRESENT_DB || best - here >= CLEARLY_DB);
    let found = if clock {
        format!(
            "{here:.1} dB over the noise there, but {then:.1} dB {} frames {}",
            late.abs(),
            if late > 0 { "later" } else { "earlier" }
        )
    } else if ok {
        format!("{here:.1} dB over the noise at the predicted ranges and velocities")
    } else if !elsewhere {
        format!("{here:.1} dB over the noise there: {SILENT}")
    } else {
        format!(
            "{here:.1} dB there, but {best:.1} dB {:.2} m {}: the body is in the wrong place, or the motion belongs to other frames",
            best_m.abs(),
            if best_m > 0.0 { "farther" } else { "nearer" }
        )
    };
    Some(Check::new("body_place", "moving energy where the motion puts the body", found, ok))
}
