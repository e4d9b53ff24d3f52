//! A motion turned by half a turn: somebody who comes when the motion says that he goes.

use super::energy::{energy_at, moves, range_and_velocity};
use super::{CLEARLY_DB, Check, PRESENT_DB};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;

/// Turned about the vertical axis through the motion's origin, or where that is unknown (meshes) through the middle of the first
/// frame's points: every place and every velocity is another one.
pub(super) fn heading(evidence: &Evidence, origin_m: Option<[f64; 3]>) -> Option<Check> {
    let body = evidence.body.as_ref().filter(|_| moves(evidence))?;
    let pivot = origin_m.or_else(|| {
        let first = body.frames.iter().find(|points| !points.is_empty())?;
        let sum = |axis: usize| first.iter().map(|point| point.position_m[axis]).sum::<f64>();
        Some(std::array::from_fn(|axis| sum(axis) / first.len() as f64))
    })?;
    let turned = |point: &Point| {
        let [x, y, z] = point.position_m;
        let [vx, vy, vz] = point.velocity_mps;
        Point { position_m: [2.0 * pivot[0] - x, 2.0 * pivot[1] - y, z], velocity_mps: [-vx, -vy, vz], ..*point }
    };
    let as_is = energy_at(evidence, Some, |point| Some(range_and_velocity(point, &evidence.radar)));
    let other = energy_at(evidence, Some, |point| Some(range_and_velocity(&turned(point), &evidence.radar)));
    let ok = other < PRESENT_DB || other - as_is < CLEARLY_DB;
    let hint = if ok { "" } else { ": the heading is wrong by 180°, or the motion's forward axis" };
    Some(Check::new(
        "heading",
        "the person faces and walks as the motion says",
        format!("{as_is:.1} dB where the motion puts the body, {other:.1} dB where it would be turned by 180°{hint}"),
        ok,
    ))
}
