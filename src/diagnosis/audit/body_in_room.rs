//! A motion that leaves the room.

use super::Check;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;
use crate::diagnosis::statistics::median;
use crate::room::Boundary;

/// How far a motion may leave the room: the radar's place is known no better.
const OUTSIDE_M: f64 = 0.3;

/// Whether the motion stays in the room.
pub(super) fn body_in_room(evidence: &Evidence) -> Option<Check> {
    let (body, room) = (evidence.body.as_ref()?, evidence.room.as_ref()?);
    let beyond = |boundary: Boundary| -> Option<f64> {
        let (distance, (axis, sign)) = (room.distance_m(boundary)?, boundary.axis());
        // The middle of the body's points: a hand may reach through a wall that is not where it was measured.
        let of_frame = |points: &Vec<Point>| {
            let mut along: Vec<f64> = points.iter().map(|point| sign * point.position_m[axis] - distance).collect();
            (!along.is_empty()).then(|| median(&mut along))
        };
        body.frames.iter().filter_map(of_frame).reduce(f64::max)
    };
    let farthest = room.boundaries().into_iter().filter_map(|boundary| Some((boundary, beyond(boundary)?)));
    let (boundary, outside) = farthest.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let ok = outside <= OUTSIDE_M;
    let found = if ok {
        "it does".into()
    } else {
        let distance = room.distance_m(boundary).unwrap_or_default();
        format!(
            "the motion puts the body {outside:.2} m behind the {} boundary, which is {distance:.2} m away: the body's place or the \
             room's size is wrong",
            boundary.name()
        )
    };
    Some(Check::new("body_in_room", "the body stays in the room", found, ok))
}
