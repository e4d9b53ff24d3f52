//! The direction in which a beam is strongest.

use super::super::beams::{aperture_m, directions_deg, unit};
use super::PointsConfig;
use crate::radar::Radar;

/// Directions for each beam width of the array: with four, the strongest of a grid is within an eighth of a beam of the
/// maximum, where a parabola finds it.
const PER_BEAM: f64 = 4.0;
/// Most directions of a grid along one angle.
const MOST: usize = 361;

/// A grid of directions. An angle that the array does not resolve is 0.
pub struct Search {
    azimuths_deg: Vec<f64>,
    elevations_deg: Vec<f64>,
}

impl Search {
    pub fn new(radar: &Radar, config: &PointsConfig) -> Self {
        let grid = |axis: usize, limit_deg: f64| {
            let beams = 2.0 * limit_deg.to_radians().sin() * aperture_m(radar, axis) / radar.wavelength_m();
            let count = ((PER_BEAM * beams).ceil() as usize).min(MOST) | 1;
            directions_deg(if aperture_m(radar, axis) > 0.0 { count.max(5) } else { 1 }, limit_deg)
        };
        Self { azimuths_deg: grid(0, config.azimuth_limit_deg), elevations_deg: grid(2, config.elevation_limit_deg) }
    }

    /// The unit vector of the direction of most power, refined between the grid's by a parabola along each angle.
    pub fn strongest(&self, power: impl Fn([f64; 3]) -> f64) -> [f64; 3] {
        let [columns, rows] = [self.azimuths_deg.len(), self.elevations_deg.len()];
        let at = |row: usize, column: usize| power(unit(self.azimuths_deg[column], self.elevations_deg[row]));
        let all: Vec<f64> = (0..rows * columns).map(|index| at(index / columns, index % columns)).collect();
        let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b])).expect("a grid has directions");
        let (row, column) = (best / columns, best % columns);
        let azimuth = refined(&self.azimuths_deg, column, |column| all[row * columns + column]);
        let elevation = refined(&self.elevations_deg, row, |row| all[row * columns + column]);
        unit(azimuth, elevation)
    }
}

/// The place of the maximum of a parabola through three neighbours, even in the sine; the grid's own at its ends.
fn refined(angles_deg: &[f64], index: usize, power: impl Fn(usize) -> f64) -> f64 {
    if index == 0 || index + 1 >= angles_deg.len() {
        return angles_deg[index];
    }
    let [before, here, after] = [index - 1, index, index + 1].map(&power);
    let bend = before - 2.0 * here + after;
    let step = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    let sine = |index: usize| angles_deg[index].to_radians().sin();
    (sine(index) + step * (sine(index + 1) - sine(index))).clamp(-1.0, 1.0).asin().to_degrees()
}
