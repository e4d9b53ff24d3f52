//! The body seen a second time, by a longer way: in a mirror (`wall_ghost`, `floor_bounce`), or after a bounce between its own
//! parts (`body_multibounce`).

use std::f64::consts::TAU;

use super::Point;
use crate::diagnosis::vector::{difference, dot, norm};
use crate::effects;
use crate::paths::distance;
use crate::radar::Radar;
use crate::room::Boundary;

/// Rough skin returns as much to every side as at this cosine.
const ROUGH: f64 = 0.1;
/// Bodies return this factor more or less in amplitude to one side than to another (standard deviation of the log).
pub const SIDE_SPREAD: f64 = 0.3;

/// What the body's image at a boundary is called.
pub fn mirror_id(boundary: Boundary) -> &'static str {
    if boundary == Boundary::Floor { effects::floor_bounce::ID } else { effects::wall_ghost::ID }
}

/// Power that comes beside the direct return, for every point of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Echo {
    /// By way of one boundary of the room, once and twice.
    Mirror { boundary: Boundary, distance_m: f64, coefficient: f64 },
    /// The whole return once more.
    Delayed { extra_m: f64, coefficient: f64 },
}

impl Echo {
    /// Points in the line of sight that would send what arrives by the longer way.
    pub fn points(self, radar: &Radar, points: &[Point]) -> Vec<Point> {
        let centre = radar.centre_m();
        match self {
            Self::Delayed { extra_m, coefficient } => points
                .iter()
                .map(|point| {
                    let (range_m, velocity_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
                    let towards = way(radar, point.position_m);
                    let cosine = dot(towards, point.normal);
                    let spread = coefficient.powi(2) * point.area_m2 / range_m.max(0.1).powi(4);
                    let image = Mirrored { range_m: range_m + extra_m, velocity_mps, spread, cosine };
                    image.in_sight(centre, towards, point.part)
                })
                .collect(),
            Self::Mirror { boundary, distance_m, coefficient } => points
                .iter()
                .flat_map(|point| {
                    let towards = way(radar, point.position_m);
                    [false, true].map(|twice| {
                        let image = mirrored_return(radar, point, boundary, distance_m, twice);
                        let power = coefficient.powi(if twice { 4 } else { 2 });
                        Mirrored { spread: power * image.spread, ..image }.in_sight(centre, towards, point.part)
                    })
                })
                .collect(),
        }
    }
}

/// One point of the body, seen by a longer way.
pub struct Mirrored {
    /// Half the length of the path.
    pub range_m: f64,
    pub velocity_mps: f64,
    /// Of its area over the ranges' fourth power, both directions of the way together.
    pub spread: f64,
    /// Between its normal and the middle of the two ways.
    pub cosine: f64,
}

impl Mirrored {
    /// A point in a direction (unit vector to the radar) that sends the same power from the same range, as fast.
    fn in_sight(&self, centre_m: [f64; 3], towards: [f64; 3], part: usize) -> Point {
        // Any direction that is not the line of sight.
        let other = if towards[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let along = dot(other, towards);
        let aside: [f64; 3] = std::array::from_fn(|axis| other[axis] - along * towards[axis]);
        let length = norm(aside).max(1e-9);
        let (cosine, sine) = (self.cosine, (1.0 - self.cosine * self.cosine).max(0.0).sqrt());
        Point {
            position_m: std::array::from_fn(|axis| centre_m[axis] - towards[axis] * self.range_m),
            velocity_mps: towards.map(|x| -x * self.velocity_mps),
            normal: std::array::from_fn(|axis| cosine * towards[axis] + sine * aside[axis] / length),
            area_m2: self.spread * self.range_m.max(0.1).powi(4),
            part,
        }
    }
}

/// What a lossless mirror at a boundary makes of a point.
pub fn mirrored_return(radar: &Radar, point: &Point, boundary: Boundary, distance_m: f64, twice: bool) -> Mirrored {
    let (axis, sign) = boundary.axis();
    let mut image = *point;
    image.position_m[axis] = 2.0 * sign * distance_m - point.position_m[axis];
    image.velocity_mps[axis] *= -1.0;
    let (near_m, near_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
    let (far_m, far_mps) = range_and_velocity(radar, image.position_m, image.velocity_mps);
    let (near_m, far_m) = (near_m.max(0.1), far_m.max(0.1));
    let near = way(radar, point.position_m);
    // From the point itself the mirrored way leaves towards the radar's image.
    let mut far = way(radar, image.position_m);
    far[axis] *= -1.0;
    let half: [f64; 3] = if twice { far } else { std::array::from_fn(|i| near[i] + far[i]) };
    let cosine = (dot(half, point.normal) / norm(half).max(1e-6)).max(ROUGH);
    let (range_m, velocity_mps, spread) = if twice {
        (far_m, far_mps, far_m.powi(-4))
    } else {
        let both = both_ways(radar, point.position_m, image.position_m);
        (0.5 * (near_m + far_m), 0.5 * (near_mps + far_mps), both / (near_m * far_m).powi(2))
    };
    Mirrored { range_m, velocity_mps, spread: spread * point.area_m2, cosine }
}

/// Power of a path and the same path backwards over that of one of them, mean over the channels: they are equally long
/// for antennas at one place, and all the less for those that are apart.
fn both_ways(radar: &Radar, point_m: [f64; 3], image_m: [f64; 3]) -> f64 {
    let [point_m, image_m] = [point_m, image_m].map(|at| difference(at, radar.position_m));
    let legs = |antennas: &[[f64; 3]]| -> Vec<f64> {
        // A leg to the point less the leg to its image.
        antennas.iter().map(|&antenna| distance(point_m, antenna) - distance(image_m, antenna)).collect()
    };
    let (sent, received) = (legs(&radar.tx_m), legs(&radar.rx_m));
    let number = TAU / radar.wavelength_m();
    let sum: f64 = sent.iter().flat_map(|s| received.iter().map(move |r| 2.0 + 2.0 * (number * (s - r)).cos())).sum();
    sum / (sent.len() * received.len()) as f64
}

/// Mean of the legs to all antennas, and how fast it grows.
pub fn range_and_velocity(radar: &Radar, position_m: [f64; 3], velocity_mps: [f64; 3]) -> (f64, f64) {
    let from_radar = difference(position_m, radar.position_m);
    let mean = |antennas: &[[f64; 3]]| {
        let (range, speed) = antennas.iter().fold((0.0, 0.0), |(range, speed), &antenna| {
            let offset = difference(from_radar, antenna);
            let length = norm(offset).max(1e-6);
            (range + length, speed + dot(offset, velocity_mps) / length)
        });
        (range / antennas.len() as f64, speed / antennas.len() as f64)
    };
    let (sent, received) = (mean(&radar.tx_m), mean(&radar.rx_m));
    (0.5 * (sent.0 + received.0), 0.5 * (sent.1 + received.1))
}

/// Unit vector to the radar.
fn way(radar: &Radar, from_m: [f64; 3]) -> [f64; 3] {
    let way = difference(radar.centre_m(), from_m);
    let length = norm(way).max(1e-6);
    way.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_echo_is_where_the_longer_way_puts_it() {
        let radar = Radar::small(4);
        let point = Point {
            position_m: [0.4, 3.0, 0.1],
            velocity_mps: [0.3, 1.0, 0.0],
            normal: [0.0, -1.0, 0.0],
            area_m2: 0.02,
            part: 3,
        };
        let direct = range_and_velocity(&radar, point.position_m, point.velocity_mps);
        let replica = |echo: Echo| -> Vec<(f64, f64)> {
            let of = |point: &Point| range_and_velocity(&radar, point.position_m, point.velocity_mps);
            echo.points(&radar, &[point]).iter().map(of).collect()
        };
        let delayed = replica(Echo::Delayed { extra_m: 0.5, coefficient: 0.3 })[0];
        // Antennas are a few centimetres apart.
        assert!((delayed.0 - direct.0 - 0.5).abs() < 1e-3 && (delayed.1 - direct.1).abs() < 1e-2, "{delayed:?} {direct:?}");
        let mirrors = replica(Echo::Mirror { boundary: Boundary::Right, distance_m: 2.0, coefficient: 0.5 });
        // The image stands at x = 3.6.
        let image = range_and_velocity(&radar, [3.6, 3.0, 0.1], [-0.3, 1.0, 0.0]);
        assert!((mirrors[0].0 - 0.5 * (direct.0 + image.0)).abs() < 2e-3, "{mirrors:?}");
        assert!((mirrors[1].0 - image.0).abs() < 2e-3 && (mirrors[1].1 - image.1).abs() < 2e-2, "{mirrors:?}");
        let twice = Echo::Delayed { extra_m: 0.0, coefficient: 0.5 }.points(&radar, &[point])[0];
        assert!((twice.area_m2 / point.area_m2 - 0.25).abs() < 1e-3 && twice.part == 3);
    }

    #[test]
    fn both_directions_of_a_way_add_up_in_phase_only_where_they_are_equally_long() {
        let mut radar = Radar::small(4);
        (radar.tx_m, radar.rx_m) = (vec![[0.0; 3]], vec![[0.0; 3]]);
        assert!((both_ways(&radar, [0.0, 3.0, 0.0], [3.0, 3.0, 0.0]) - 4.0).abs() < 1e-9);
        radar.rx_m = (0..64).map(|i| [0.001 * f64::from(i), 0.0, 0.0]).collect();
        let beside = both_ways(&radar, [0.0, 3.0, 0.0], [3.0, 3.0, 0.0]);
        assert!((beside - 2.0).abs() < 0.5, "{beside}");
        // The floor's image is as far from each of them.
        assert!(both_ways(&radar, [0.0, 3.0, 0.0], [0.0, 3.0, -2.0]) > 3.9);
    }
}
