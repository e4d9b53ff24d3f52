//! A motion turned by half a turn: somebody who comes when the motion says that he goes.

use super::energy::{Alternative, fit, range_and_velocity};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;

/// Turned about the vertical axis through the motion's origin, or where that is unknown (meshes) through the middle of the first
/// frame's points: every place and every velocity is another one.
pub(super) fn heading(evidence: &Evidence, origin_m: Option<[f64; 3]>) -> Option<Alternative> {
    let body = evidence.body.as_ref()?;
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
    Some(Alternative {
        check: "heading",
        expected: "the person faces and walks as the motion says",
        fit: fit(evidence, Some, |point| Some(range_and_velocity(&turned(point), &evidence.radar))),
        place: "where it would be turned by 180°".into(),
        hint: "the heading is wrong by 180°, or the motion's forward axis".into(),
    })
}
