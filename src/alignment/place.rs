//! A rigid placement of the motion, in the numbers that a radar distinguishes.

use crate::body::PoseCorrection;
use crate::person::{Person, Placement};

/// How a placement is varied: all differ from what the recording states only by a turn about the vertical, a shift and a clock.
///
/// Range, heading to the line of sight and clock show in one receiver's range-Doppler maps; the azimuth only in the phases between
/// receivers, and there alone: turning person and place together about the radar leaves every range and velocity as it was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// The motion happens later than stated by this, seconds.
    pub clock_s: f64,
    /// Turn against the line of sight, counter-clockwise seen from above, radians from what is stated.
    pub facing_rad: f64,
    /// Horizontal distance of the pivot from the antennas' centre, metres.
    pub range_m: f64,
    /// Of the pivot, positive to the right, radians.
    pub azimuth_rad: f64,
    /// Higher than stated by this, metres.
    pub height_m: f64,
}

/// Numbers of a [`Place`].
pub const COUNT: usize = 5;
pub const CLOCK: usize = 0;
pub const FACING: usize = 1;
pub const RANGE: usize = 2;
pub const AZIMUTH: usize = 3;
pub const HEIGHT: usize = 4;

impl Place {
    pub fn values(&self) -> [f64; COUNT] {
        [self.clock_s, self.facing_rad, self.range_m, self.azimuth_rad, self.height_m]
    }

    pub fn of(values: [f64; COUNT]) -> Self {
        let [clock_s, facing_rad, range_m, azimuth_rad, height_m] = values;
        Self { clock_s, facing_rad, range_m, azimuth_rad, height_m }
    }

    pub fn with(&self, number: usize, value: f64) -> Self {
        let mut values = self.values();
        values[number] = value;
        Self::of(values)
    }
}

/// What is turned about, and where it is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pivot {
    /// Middle of the body's track as stated, radar frame, metres.
    pub stated_m: [f64; 3],
    /// Of the antennas.
    pub centre_m: [f64; 3],
}

impl Pivot {
    /// The placement as stated.
    pub fn stated(&self) -> Place {
        let [x, y] = [0, 1].map(|axis| self.stated_m[axis] - self.centre_m[axis]);
        Place { range_m: x.hypot(y), azimuth_rad: x.atan2(y), ..Place::default() }
    }

    /// By what the motion as stated comes to a place.
    pub fn correction(&self, place: &Place) -> PoseCorrection {
        let stated = self.stated();
        let (sine, cosine) = place.azimuth_rad.sin_cos();
        let target = [
            self.centre_m[0] + place.range_m * sine,
            self.centre_m[1] + place.range_m * cosine,
            self.stated_m[2] + place.height_m,
        ];
        PoseCorrection {
            clock_s: place.clock_s,
            // Azimuths grow clockwise, headings counter-clockwise.
            heading_rad: place.facing_rad - (place.azimuth_rad - stated.azimuth_rad),
            pivot_m: self.stated_m,
            shift_m: std::array::from_fn(|axis| target[axis] - self.stated_m[axis]),
            ..PoseCorrection::default()
        }
    }
}

impl Pivot {
    /// The same place about another point of the motion.
    pub fn restated(&self, place: &Place, stated_m: [f64; 3]) -> (Self, Place) {
        let correction = self.correction(place);
        let (sine, cosine) = correction.heading_rad.sin_cos();
        let [x, y] = [0, 1].map(|axis| stated_m[axis] - self.stated_m[axis]);
        let turned = [cosine * x - sine * y, sine * x + cosine * y, stated_m[2] - self.stated_m[2]];
        let there: [f64; 3] = std::array::from_fn(|axis| turned[axis] + self.stated_m[axis] + correction.shift_m[axis]);
        let pivot = Self { stated_m, ..*self };
        let [x, y] = [0, 1].map(|axis| there[axis] - self.centre_m[axis]);
        let azimuth_rad = x.atan2(y);
        let facing_rad = correction.heading_rad + (azimuth_rad - pivot.stated().azimuth_rad);
        let height_m = there[2] - stated_m[2];
        (pivot, Place { clock_s: place.clock_s, facing_rad, range_m: x.hypot(y), azimuth_rad, height_m })
    }
}

/// Placement of the motion as stated; meshes are in the radar frame already.
pub fn stated(person: &Person) -> Placement {
    match person {
        Person::Skinned { placement, .. } => placement.clone(),
        Person::Meshes { pose_times_s, .. } => Placement {
            start_s: pose_times_s[0],
            radar_from_motion: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            origin_m: [0.0; 3],
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIVOT: Pivot = Pivot { stated_m: [0.6, 2.9, -0.1], centre_m: [0.1, 0.0, 0.2] };

    #[test]
    fn what_is_stated_is_no_correction() {
        let correction = PIVOT.correction(&PIVOT.stated());
        assert!(correction.heading_rad.abs() < 1e-12 && correction.shift_m.iter().all(|shift| shift.abs() < 1e-12));
    }

    #[test]
    fn a_turn_about_the_radar_leaves_ranges_and_headings_to_the_line_of_sight() {
        let stated = PIVOT.stated();
        let correction = PIVOT.correction(&Place { azimuth_rad: stated.azimuth_rad + 0.4, ..stated });
        let turned = |[x, y, z]: [f64; 3], angle: f64| {
            let (sine, cosine) = angle.sin_cos();
            [cosine * x - sine * y, sine * x + cosine * y, z]
        };
        // A hand beside the pivot.
        let hand = [0.9, 3.1, 0.3];
        let after: [f64; 3] = {
            let about = turned(std::array::from_fn(|axis| hand[axis] - PIVOT.stated_m[axis]), correction.heading_rad);
            std::array::from_fn(|axis| about[axis] + PIVOT.stated_m[axis] + correction.shift_m[axis])
        };
        let range = |place: [f64; 3]| (0..3).map(|axis| (place[axis] - PIVOT.centre_m[axis]).powi(2)).sum::<f64>().sqrt();
        assert!((range(after) - range(hand)).abs() < 1e-12);
        let azimuth = |place: [f64; 3]| (place[0] - PIVOT.centre_m[0]).atan2(place[1] - PIVOT.centre_m[1]);
        assert!((azimuth(after) - azimuth(hand) - 0.4).abs() < 1e-12);
    }

    #[test]
    fn a_place_about_another_point_is_the_same_correction() {
        let place = Place { clock_s: 0.2, facing_rad: 0.5, range_m: 2.2, azimuth_rad: -0.3, height_m: 0.1 };
        let (pivot, restated) = PIVOT.restated(&place, [-0.4, 4.0, 0.2]);
        let (one, other) = (PIVOT.correction(&place), pivot.correction(&restated));
        assert!((one.heading_rad - other.heading_rad).abs() < 1e-12 && restated.clock_s == 0.2);
        let moved = |correction: &PoseCorrection, [x, y, z]: [f64; 3]| -> [f64; 3] {
            let (sine, cosine) = correction.heading_rad.sin_cos();
            let [x, y] = [x - correction.pivot_m[0], y - correction.pivot_m[1]];
            let about = [cosine * x - sine * y, sine * x + cosine * y, z - correction.pivot_m[2]];
            std::array::from_fn(|axis| about[axis] + correction.pivot_m[axis] + correction.shift_m[axis])
        };
        let point = [1.0, 2.0, 0.7];
        let (one, other) = (moved(&one, point), moved(&other, point));
        assert!((0..3).all(|axis| (one[axis] - other[axis]).abs() < 1e-12), "{one:?} {other:?}");
    }
}
