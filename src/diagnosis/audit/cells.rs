//! What the channels hold in the body's cells.

use num_complex::Complex64;

use super::RETURN;
use super::energy::range_and_velocity;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::{BodyPrediction, Point};
use crate::diagnosis::statistics::median;
use crate::radar::Radar;

/// Visits the cells of the body's points that move, in the training frames, where they hold a return that the same range has
/// not at all velocities (a spur does): `see` gets the cell (frame, Doppler row, range bin), the point, its radial velocity, and what the
/// channels hold there.
pub(super) fn moving_cells(
    evidence: &Evidence,
    body: &BodyPrediction,
    channels: &[usize],
    mut see: impl FnMut([usize; 3], &Point, f64, &[Complex64]),
) {
    let ([_, _, _, loops, samples], radar) = (evidence.cube.dims, &evidence.radar);
    for &frame in &evidence.split.training {
        let Some(points) = body.frames.get(frame).filter(|points| !points.is_empty()) else { continue };
        let maps: Vec<Vec<Complex64>> = channels.iter().map(|&channel| evidence.range_doppler(frame, channel)).collect();
        let usual: Vec<f64> = (0..samples)
            .map(|bin| median(&mut (0..loops).map(|row| maps[0][row * samples + bin].norm_sqr()).collect::<Vec<_>>()))
            .collect();
        for point in points.iter().step_by(points.len().div_ceil(200).max(1)) {
            let [range, velocity] = range_and_velocity(point, radar);
            let bin = (range / radar.range_resolution_m()).round() as usize;
            let doppler = (velocity / radar.velocity_resolution_mps()).round() as i64;
            if bin >= samples || doppler.abs() < 3 {
                continue;
            }
            let row = doppler.rem_euclid(loops as i64) as usize;
            let cell = row * samples + bin;
            if maps[0][cell].norm_sqr() < RETURN * usual[bin] {
                continue;
            }
            see([frame, row, bin], point, velocity, &maps.iter().map(|map| map[cell]).collect::<Vec<_>>());
        }
    }
}

/// What a channel's cell has in common with the first channel's once a longer path, in metres, is taken out.
pub(super) fn aligned(own: Complex64, first: Complex64, path_m: f64, radar: &Radar) -> Complex64 {
    own * first.conj() * Complex64::cis(-std::f64::consts::TAU * path_m / radar.wavelength_m())
}
