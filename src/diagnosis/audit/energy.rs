//! Energy where the body is predicted.

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;
use crate::radar::Radar;

/// Mean energy at the cells of the body's points, dB over the noise: in each frame those of the frame of the motion that `shown` says,
/// if any, each at the range (m) and velocity (m/s) that `cell` says.
pub(super) fn energy_at(
    evidence: &Evidence,
    shown: impl Fn(usize) -> Option<usize>,
    cell: impl Fn(&Point) -> Option<[f64; 2]>,
) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let Some(body) = &evidence.body else { return 0.0 };
    let maps = evidence.maps();
    let mut hit = vec![false; maps.len()];
    for frame in 0..body.frames.len() {
        let Some(points) = shown(frame).and_then(|shown| body.frames.get(shown)) else { continue };
        for [range_m, velocity] in points.iter().filter_map(&cell) {
            let bin = range_m / evidence.radar.range_resolution_m();
            let doppler = velocity / evidence.radar.velocity_resolution_mps();
            if doppler.abs() < 2.5 {
                continue;
            }
            let (bin, doppler) =
                ((bin.round() as i64).rem_euclid(samples as i64), (doppler.round() as i64).rem_euclid(loops as i64));
            hit[(frame * loops + doppler as usize) * samples + bin as usize] = true;
        }
    }
    let (sum, count) = hit
        .iter()
        .zip(maps)
        .filter(|(hit, _)| **hit)
        .fold((0.0, 0.0), |(s, n), (_, value)| (s + f64::from(*value).max(1.0).ln(), n + 1.0));
    if count > 0.0 { 10.0 / std::f64::consts::LN_10 * sum / count } else { 0.0 }
}

/// Range and radial velocity of a point of the body.
pub fn range_and_velocity(point: &Point, radar: &Radar) -> [f64; 2] {
    let centre = radar.centre_m();
    let to: [f64; 3] = std::array::from_fn(|axis| point.position_m[axis] - centre[axis]);
    let range = to.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
    [range, to.iter().zip(&point.velocity_mps).map(|(x, v)| x * v).sum::<f64>() / range]
}

/// Whether the body ever moves fast enough to be told from what stands still.
pub(super) fn moves(evidence: &Evidence) -> bool {
    let fast = 2.5 * evidence.radar.velocity_resolution_mps();
    let points = evidence.body.iter().flat_map(|body| body.frames.iter().flatten());
    points.map(|point| range_and_velocity(point, &evidence.radar)[1].abs()).any(|speed| speed > fast)
}
