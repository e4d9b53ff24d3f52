//! How much of the room at one range is seen past the body.

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::BodyPrediction;
use crate::diagnosis::vector::{difference, dot, norm};
use crate::room::{Boundary, Room};

/// Half of the angle between neighbouring points of the body, radians.
const POINT_RAD: f64 = 0.012;
/// Distance of the points on the boundaries, metres.
const STEP_M: f64 = 0.08;
/// Most points of the body that are looked at.
const MOST_POINTS: usize = 600;

type Direction = [f64; 3];

/// Mean share that is free of the first Fresnel zone around the rays to the room's surface within `reach_m` of a range,
/// `[frame]`. Where a boundary is hit at a right angle, that mirror point alone counts. None without a room there.
pub fn seen(evidence: &Evidence, body: &BodyPrediction, range_m: f64, reach_m: f64) -> Option<Vec<f64>> {
    let room = evidence.room.as_ref()?;
    let centre = evidence.radar.centre_m();
    let directions = directions(room, centre, range_m, reach_m);
    if directions.is_empty() {
        return None;
    }
    let wavelength = evidence.radar.wavelength_m();
    let of_frame = |points: &Vec<crate::diagnosis::Point>| {
        let rays: Vec<(Direction, f64)> = points
            .iter()
            .step_by(points.len().div_ceil(MOST_POINTS).max(1))
            .map(|point| {
                let away = difference(point.position_m, centre);
                let range = norm(away).max(1e-6);
                (away.map(|x| x / range), range)
            })
            .collect();
        let mean = rays.iter().map(|(_, range)| range).sum::<f64>() / rays.len().max(1) as f64;
        // Angle under which the zone's radius at the body appears.
        let zone = (wavelength * (range_m - mean).max(0.05) / (range_m * mean.max(0.1))).sqrt();
        let free = |direction: &Direction| {
            let nearest = rays.iter().map(|(ray, _)| dot(*ray, *direction)).fold(-1.0, f64::max);
            ((nearest.clamp(-1.0, 1.0).acos() - POINT_RAD) / zone + 0.5).clamp(0.0, 1.0)
        };
        directions.iter().map(free).sum::<f64>() / directions.len() as f64
    };
    Some(body.frames.iter().map(of_frame).collect())
}

/// Unit vectors from the antennas' centre to the room's surface in front of the radar.
fn directions(room: &Room, centre: Direction, range_m: f64, reach_m: f64) -> Vec<Direction> {
    let seen = room.boundaries().into_iter().filter(|&boundary| boundary != Boundary::Back);
    let foot = seen.clone().find(|&boundary| room.distance_m(boundary).is_some_and(|d| (d - range_m).abs() < reach_m));
    if let Some(boundary) = foot {
        return vec![boundary.normal().map(|x| -x)];
    }
    let (low, high) = room.extent_m(range_m);
    let mut found = vec![];
    for boundary in seen {
        let Some(distance) = room.distance_m(boundary) else { continue };
        let (axis, sign) = boundary.axis();
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let steps = |side: usize| ((high[side] - low[side]) / STEP_M) as usize + 1;
        for i in 0..steps(u) {
            for j in 0..steps(v) {
                let mut at = [0.0; 3];
                at[axis] = sign * distance;
                at[u] = low[u] + i as f64 * STEP_M;
                at[v] = low[v] + j as f64 * STEP_M;
                let away = difference(at, centre);
                let range = norm(away);
                if away[1] > 0.0 && (range - range_m).abs() < reach_m {
                    found.push(away.map(|x| x / range));
                }
            }
        }
    }
    found
}
