//! The room by itself: how large it is.

use super::units::{Unit, likely};
use super::{Facts, Finding, Kind, Part};

/// The length of one of the largest halls there are (the Aerium at Brand, 360 m by 210 m).
const LONGEST_M: f64 = 360.0;
/// What rooms are drawn in.
const UNITS: [Unit; 2] = [("millimetres", 1e-3), ("centimetres", 1e-2)];
/// Picks the unit in the hint, and decides nothing.
const USUAL_M: [f64; 2] = [1.0, 30.0];

/// No boundary of a room is farther than a hall is long.
pub fn size(facts: &Facts) -> Vec<Finding> {
    let Some(room) = &facts.room else { return vec![] };
    let distances = room.boundaries().into_iter().filter_map(|boundary| Some((boundary, room.distance_m(boundary)?)));
    let Some((boundary, far_m)) = distances.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, far_m)| *far_m > LONGEST_M) else {
        return vec![];
    };
    let field = format!("room.{}_m", boundary.name());
    let expected = format!("a room, no boundary farther than {LONGEST_M} m");
    let finding = Finding::new(Kind::Refuse, Part::Settings, &field, format!("a boundary {far_m} m away"), expected);
    vec![match likely(far_m, &UNITS, USUAL_M) {
        Some((unit, factor)) => {
            finding.with_hint(format!("in {unit} it would be {:.2} m: multiply the room's lengths by {factor}", far_m * factor))
        }
        None => finding.with_hint("lengths are in metres"),
    }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::Room;

    fn of(front_m: f64) -> Vec<Finding> {
        let room = Room { front_m: Some(front_m), left_m: Some(front_m / 2.0), ..Room::default() };
        size(&Facts { room: Some(room), ..Facts::default() })
    }

    #[test]
    fn a_room_in_another_unit_is_refused_with_the_unit() {
        assert!(of(4.6).is_empty() && of(300.0).is_empty() && size(&Facts::default()).is_empty());
        for (front, unit) in [(4600.0, "in millimetres it would be 4.60 m"), (460.0, "in centimetres it would be 4.60 m")] {
            let found = of(front);
            assert_eq!((found[0].kind, found[0].field.as_str()), (Kind::Refuse, "room.front_m"));
            assert!(found[0].hint.as_ref().unwrap().contains(unit), "{:?}", found[0].hint);
        }
        assert_eq!(of(1e6)[0].hint.as_deref(), Some("lengths are in metres"));
    }
}
