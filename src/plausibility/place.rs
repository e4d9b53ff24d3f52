//! Where the body is: before the radar, within its range, and in the room.

use super::units::{LENGTHS, likely};
use super::{Facts, Finding, Kind, Look, Part};
use crate::room::Boundary;

/// How far a tracked body may seem to be in a wall without a word: the error of a vertex of bodies that are estimated from
/// video (99 mm on 3DPW; Kocabas et al., VIBE, CVPR 2020, table 1).
const TRACKING_ERROR_M: f64 = 0.1;
/// Height of a knee, of its person's (Winter, Biomechanics and Motor Control of Human Movement, 4th edition, figure 4.1):
/// nobody stands deeper than that in a floor.
const KNEE: f64 = 0.285;
/// Somebody who is farther than this above the floor the whole time neither stands on it nor sits on a chair, whose seat is 0.4
/// to 0.51 m high (EN 1335-1).
const FLOATS_M: f64 = 0.51;
/// Where a person who is placed in other units would be.
const ROOM_M: [f64; 2] = [0.3, 20.0];

fn looks(facts: &Facts) -> &[Look] {
    facts.course.as_ref().map_or(&[], |course| &course.looks)
}

/// The look that is worst by some measure.
fn worst(facts: &Facts, measure: impl Fn(&Look) -> f64) -> Option<(f64, &Look)> {
    looks(facts).iter().map(|look| (measure(look), look)).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// What places the body, for messages.
fn finding(facts: &Facts, kind: Kind, found: String, expected: impl Into<String>) -> Finding {
    match &facts.placement {
        Some(placement) => {
            let [x, y, z] = placement.origin_m;
            let found = format!("[{x:.2}, {y:.2}, {z:.2}], which brings {found}");
            Finding::new(kind, Part::Settings, "motion.origin_m", found, expected)
        }
        None => Finding::new(kind, Part::Body, "vertices", found, expected),
    }
}

const MOVE: &str = "move the person with motion.origin_m, person.distance_m or --distance";

/// An echo from beyond the unambiguous range folds back to a wrong range.
pub fn unambiguous_range(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    let Some((farthest, look)) = worst(facts, |look| look.farthest_m) else { return vec![] };
    let limit = radar.max_range_m();
    if farthest <= limit {
        return vec![];
    }
    let found = format!("the body up to {farthest:.2} m from the radar at {:.2} s", look.time_s);
    let expected = format!("a body within the radar's unambiguous range of {limit:.2} m");
    let hint = match likely(farthest, &LENGTHS, ROOM_M).filter(|_| farthest > ROOM_M[1]) {
        Some((unit, factor)) => format!("in {unit} it would be {:.2} m; {MOVE}", farthest * factor),
        None => format!("{MOVE}; a higher sample rate or a lower slope reaches farther"),
    };
    vec![finding(facts, Kind::Refuse, found, expected).with_hint(hint)]
}

/// The radar looks along +y: a body is before it, and nobody swallows it.
pub fn in_front(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    let ahead = radar.centre_m()[1];
    if let Some(look) = looks(facts).iter().find(|look| look.encloses_radar) {
        let found = format!("the body around the radar at {:.2} s", look.time_s);
        return vec![finding(facts, Kind::Refuse, found, "a body outside of the radar").with_hint(MOVE)];
    }
    let middle = |look: &Look| 0.5 * (look.low_m[1] + look.high_m[1]);
    let Some((behind, look)) = worst(facts, |look| ahead - middle(look)) else { return vec![] };
    if behind >= 0.0 {
        let found = format!("the body {behind:.2} m behind the radar at {:.2} s", look.time_s);
        return vec![finding(facts, Kind::Refuse, found, "a body before the radar, which looks along +y").with_hint(MOVE)];
    }
    let Some((behind, look)) = worst(facts, |look| ahead - look.low_m[1]).filter(|(behind, _)| *behind > 0.0) else {
        return vec![];
    };
    let found = format!("a part of the body {behind:.2} m behind the radar at {:.2} s", look.time_s);
    vec![finding(facts, Kind::Note, found, "a body before the radar, which looks along +y")]
}

/// The middle of a body is in the room, and its feet are on the floor. A part that is beyond a boundary is noted: the room may
/// be measured, and the body tracked, less well than that.
pub fn in_the_room(facts: &Facts) -> Vec<Finding> {
    let Some(room) = &facts.room else { return vec![] };
    room.boundaries().into_iter().filter_map(|boundary| beyond(facts, boundary, room.distance_m(boundary)?)).collect()
}

fn beyond(facts: &Facts, boundary: Boundary, distance_m: f64) -> Option<Finding> {
    let (axis, sign) = boundary.axis();
    let part = |look: &Look| f64::max(sign * look.low_m[axis], sign * look.high_m[axis]) - distance_m;
    let middle = |look: &Look| sign * 0.5 * (look.low_m[axis] + look.high_m[axis]) - distance_m;
    let (most, look) = worst(facts, part).filter(|(most, _)| *most > TRACKING_ERROR_M)?;
    let (farthest, there) = worst(facts, middle)?;
    let knee_m = facts.body.as_ref().map_or(f64::INFINITY, |body| KNEE * body.length_m[0]);
    let sunk = boundary == Boundary::Floor && most > knee_m;
    let (kind, what, most, look) = match (farthest > 0.0, sunk) {
        (true, _) => (Kind::Refuse, "the body", part(there), there),
        (false, true) => (Kind::Refuse, "the body", most, look),
        (false, false) => (Kind::Note, "a part of the body", most, look),
    };
    let name = boundary.name();
    let found = format!("{what} {most:.2} m beyond the {name} boundary at {:.2} s", look.time_s);
    let expected = format!("a body in the room, whose {name} boundary is {distance_m} m away (room.{name}_m)");
    let hint = match boundary {
        Boundary::Floor => format!(
            "a motion's origin is on the floor, motion.origin_m[2] = -room.floor_m; raised by {most:.2} m (infer --raise) it would stand on it"
        ),
        _ => format!("{MOVE}, or correct room.{name}_m"),
    };
    Some(finding(facts, kind, found, expected).with_hint(hint))
}

/// Whoever never comes near the floor floats.
pub fn on_the_floor(facts: &Facts) -> Vec<Finding> {
    let Some(floor_m) = facts.room.as_ref().and_then(|room| room.floor_m) else { return vec![] };
    let above = |look: &Look| look.low_m[2] + floor_m;
    let Some(least) = looks(facts).iter().map(above).min_by(f64::total_cmp).filter(|&least| least > FLOATS_M) else {
        return vec![];
    };
    let found = format!("the body no nearer than {least:.2} m to the floor");
    vec![finding(facts, Kind::Note, found, "a person who stands on the floor, or sits or lies near it")]
}

/// A faster echo folds back to a wrong velocity.
pub fn unambiguous_velocity(facts: &Facts) -> Vec<Finding> {
    let Some(radar) = &facts.radar else { return vec![] };
    let limit = radar.max_tracked_velocity_mps();
    let radial = |look: &Look| look.speed_mps.map_or(0.0, |[_, radial]| radial);
    let Some((fastest, look)) = worst(facts, radial).filter(|(fastest, _)| *fastest > limit) else { return vec![] };
    let found = format!("a part of the body that moves at {fastest:.2} m/s along the line of sight at {:.2} s", look.time_s);
    let from = if radar.loops_per_frame == 1 { "from frame to frame" } else { "from loop to loop" };
    let expected = format!("at most {limit:.2} m/s, which the radar measures without ambiguity {from}");
    let (field, part) = if facts.motion.is_some() { ("poses", Part::Motion) } else { ("vertices", Part::Body) };
    vec![Finding::new(Kind::Note, part, field, found, expected)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plausibility::test_support::{facts, walker};
    use crate::radar::Radar;
    use crate::room::Room;

    fn room() -> Room {
        Room {
            left_m: Some(1.9),
            right_m: Some(2.4),
            front_m: Some(5.6),
            back_m: Some(0.6),
            floor_m: Some(1.0),
            ceiling_m: Some(1.7),
        }
    }

    /// Two moments at and near a place.
    fn at(place: [f64; 3]) -> Facts {
        let [x, y, z] = place;
        facts(&walker(&[place, [x, y + 0.1, z]]), room())
    }

    type Check = fn(&Facts) -> Vec<Finding>;
    const ALL: [Check; 5] = [unambiguous_range, in_front, in_the_room, on_the_floor, unambiguous_velocity];

    #[test]
    fn a_person_in_the_room_passes() {
        for check in ALL {
            assert!(check(&at([0.0, 2.0, -1.0])).is_empty());
        }
    }

    #[test]
    fn too_far_behind_the_wall_around_the_radar_and_behind_it_are_told() {
        let told = |check: Check, place: [f64; 3], part: &str| {
            let found = check(&at(place));
            assert_eq!((found.len(), found[0].kind), (1, Kind::Refuse), "{found:?}");
            assert!(found[0].found.contains(part), "{found:?}");
        };
        told(unambiguous_range, [0.0, 20.0, -1.0], "the body up to 20.4");
        told(in_the_room, [0.0, 8.0, -1.0], "the body 2.80 m beyond the front boundary at 0.10 s");
        told(in_front, [-0.25, -0.2, -1.0], "the body around the radar at 0.00 s");
        told(in_front, [0.0, -2.0, -1.0], "the body 1.85 m behind the radar at 0.00 s");
        told(in_the_room, [-2.2, 2.0, -1.0], "0.30 m beyond the left boundary");
        told(in_the_room, [2.2, 2.0, -1.0], "0.30 m beyond the right boundary");
        told(in_the_room, [0.0, 2.0, -1.5], "0.50 m beyond the floor boundary");
        told(in_the_room, [0.0, 2.0, 1.0], "1.00 m beyond the ceiling boundary");
        told(in_the_room, [0.0, -0.9, -1.0], "0.30 m beyond the back boundary");
        let hint = unambiguous_range(&at([0.0, 300.0, -1.0]))[0].hint.clone().unwrap();
        assert!(hint.contains("in centimetres it would be 3.00 m"), "{hint}");
    }

    #[test]
    fn a_part_behind_and_a_person_in_the_air_are_notes() {
        let kinds = |found: Vec<Finding>| found.into_iter().map(|finding| finding.kind).collect::<Vec<_>>();
        assert_eq!(kinds(in_front(&at([0.3, -0.1, -1.0]))), [Kind::Note]);
        assert_eq!(kinds(on_the_floor(&at([0.0, 2.0, -0.2]))), [Kind::Note]);
        assert!(in_the_room(&at([0.0, 2.0, -1.05])).is_empty(), "soles that tracking has in the floor");
        assert_eq!(kinds(in_the_room(&at([0.0, 2.0, -1.3]))), [Kind::Note]);
        let arm = in_the_room(&at([-2.1, 2.0, -1.0]));
        assert!(arm[0].kind == Kind::Note && arm[0].found.starts_with("a part of the body 0.20 m beyond the left"), "{arm:?}");
    }

    #[test]
    fn folding_velocities_are_noted_and_one_chirp_a_frame_folds_sooner() {
        let walk = walker(&[[0.0, 2.0, -1.0], [0.0, 2.15, -1.0], [0.0, 2.3, -1.0]]);
        let mut facts = facts(&walk, room());
        assert!(unambiguous_velocity(&facts).is_empty());
        facts.radar = Some(Radar { loops_per_frame: 1, ..Radar::small(2) });
        let found = unambiguous_velocity(&facts);
        assert_eq!((found[0].kind, found[0].field.as_str()), (Kind::Note, "vertices"));
        assert!(found[0].expected.contains("from frame to frame"), "{found:?}");
    }
}
