//! Numbers of the report at a maximum of the likelihood, with intervals, or why the recording does not identify them.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::climb::{Maximum, UNIT, active};
use super::coarse::turned_rad;
use super::place::{AZIMUTH, CLOCK, COUNT, FACING, HEIGHT, Pivot, Place, RANGE, stated};
use super::report::{ESTIMATES, Estimate};
use crate::person::{BodyModel, Motion, Person, Placement};

/// Standard deviations of what the power model does to a place, by number, as its reflectivities and visibility are rough. On the eight
/// practice recordings, whose motions are where they are stated, the root mean squares were 1.3 ms, 0.7°, 6 mm and 0.15°; range and clock
/// as the diagnosis has them, azimuth for arrays whose phases are known to some degrees. The height is a guess.
const FLOOR: [f64; COUNT] = [0.002, 0.0175, 0.008, 0.009, 0.05];
/// Half of the widest 90 % interval that says something, in the units of the report: a fifth of a step's period; an eighth of a turn;
/// half a metre; two beams of the smallest array.
const WIDEST: [(&str, f64); 8] = [
    ("start_s", 0.25),
    ("rotation_deg", 45.0),
    ("origin_x_m", 0.5),
    ("origin_y_m", 0.5),
    ("origin_z_m", 0.5),
    ("range_m", 0.5),
    ("azimuth_deg", 30.0),
    ("facing_deg", 45.0),
];
/// Numbers of a place that each number of the report depends on.
const NEEDS: [(&str, &[usize]); 8] = [
    ("start_s", &[CLOCK]),
    ("rotation_deg", &[FACING, AZIMUTH]),
    ("origin_x_m", &[FACING, RANGE, AZIMUTH]),
    ("origin_y_m", &[FACING, RANGE, AZIMUTH]),
    ("origin_z_m", &[HEIGHT]),
    ("range_m", &[RANGE]),
    ("azimuth_deg", &[AZIMUTH]),
    ("facing_deg", &[FACING]),
];

/// The motion's placement at a place.
pub fn placement(person: &Person, pivot: &Pivot, place: &Place) -> Placement {
    let correction = pivot.correction(place);
    // A body without vertices: only its placement is asked for.
    let bare = Person::Skinned {
        model: BodyModel {
            template: vec![],
            shape_directions: vec![],
            pose_directions: vec![],
            joint_regressor: vec![],
            skinning: vec![],
            parents: vec![],
            faces: vec![],
        },
        motion: Motion { poses: vec![], translations: vec![], betas: vec![], rate_hz: 1.0 },
        placement: stated(person),
    };
    match correction.apply(&bare) {
        Person::Skinned { placement, .. } => placement,
        Person::Meshes { .. } => unreachable!("a skinned person stays one"),
    }
}

/// Numbers of the report at a place, in the order of [`ESTIMATES`]. Range, azimuth and facing are those of the pivot: only about one pivot
/// are the numbers of two places comparable.
pub fn numbers(person: &Person, pivot: &Pivot, place: &Place) -> [f64; 8] {
    let Placement { start_s, origin_m: [x, y, z], .. } = placement(person, pivot, place);
    let heading = pivot.correction(place).heading_rad;
    let angles = [heading, place.facing_rad].map(|angle| turned_rad(angle).to_degrees());
    [start_s, angles[0], x, y, z, place.range_m, place.azimuth_rad.to_degrees(), angles[1]]
}

/// All numbers of the report at a maximum, each by itself.
pub fn estimates(person: &Person, best: &Maximum) -> BTreeMap<&'static str, Estimate> {
    let pivot = &best.fitter.pivot;
    let at = |place: &Place| numbers(person, pivot, place);
    let (here, stated) = (at(&best.place), at(&pivot.stated()));
    let active = active(best.fitter.readings);
    // Of a linear change.
    let mut slopes = DMatrix::zeros(8, COUNT);
    for &number in &active {
        let side = |step: f64| at(&best.place.with(number, best.place.values()[number] + step * UNIT[number]));
        let (low, high) = (side(-1.0), side(1.0));
        for row in 0..8 {
            let (change, angle) = (high[row] - low[row], ESTIMATES[row].1 == "degrees");
            let change = if angle { turned_rad(change.to_radians()).to_degrees() } else { change };
            slopes[(row, number)] = change / (2.0 * UNIT[number]);
        }
    }
    let mut covariance = best.covariance.clone();
    active.iter().for_each(|&number| covariance[(number, number)] += FLOOR[number].powi(2));
    let covariance = &slopes * covariance * slopes.transpose();
    let quantile = StudentsT::new(0.0, 1.0, best.freedom).map_or(1.645, |law| law.inverse_cdf(0.95));
    let estimate = |row: usize| {
        let half = quantile * covariance[(row, row)].max(0.0).sqrt();
        let missing = NEEDS[row].1.iter().find(|number| !active.contains(number));
        let why_not = match missing {
            Some(&number) => Some(not_identified(number, best.place.range_m)),
            None => (half.is_nan() || half > WIDEST[row].1).then(|| too_wide(row, half)),
        };
        let ci90 = why_not.is_none().then_some([here[row] - half, here[row] + half]);
        let estimate = Estimate { stated: stated[row], value: here[row], ci90, identified: why_not.is_none(), why_not };
        (ESTIMATES[row].0, estimate)
    };
    (0..8).map(estimate).collect()
}

fn not_identified(number: usize, range_m: f64) -> String {
    match number {
        AZIMUTH => format!(
            "the antennas do not resolve left and right: the body may stand anywhere on the circle of {range_m:.2} m about the \
             radar, turned with it; the azimuth as stated was kept"
        ),
        _ => "the antennas lie in one height and resolve no other: the height as stated was kept".into(),
    }
}

fn too_wide(row: usize, half: f64) -> String {
    let (name, unit, _) = ESTIMATES[row];
    let why = match name {
        "start_s" => "the motion looks alike for so long",
        "rotation_deg" | "facing_deg" => "what moves returns the same at other headings",
        "range_m" => "ranges are not resolved",
        "azimuth_deg" => "the directions of what moves are not resolved",
        _ => "it depends on what is not identified",
    };
    // Far beyond, the likelihood is flat, and its curvature says nothing.
    if half < 4.0 * WIDEST[row].1 { format!("{why}: ± {half:.2} {unit} (90 %)") } else { why.to_string() }
}
