//! Range-angle maps: a beam steered over the virtual array, wherever its antennas are.

use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;

use super::{Analysis, Axis, Gate, Map, doppler_turns_per_loop};
use crate::grid::Grid;

/// The directions that a beam visits.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    axis: Axis,
    /// Unit vectors in the radar frame.
    directions: Vec<[f64; 3]>,
}

impl Scan {
    /// Azimuths from −`limit_deg` to `limit_deg` in steps of `step_deg`, positive to the right, at elevation 0.
    pub fn azimuth(limit_deg: f64, step_deg: f64) -> Self {
        Self::new("azimuth", degrees(limit_deg, step_deg), |angle| [angle.sin(), angle.cos(), 0.0])
    }

    /// Elevations from −`limit_deg` to `limit_deg` in steps of `step_deg`, positive upwards, at azimuth 0.
    pub fn elevation(limit_deg: f64, step_deg: f64) -> Self {
        Self::new("elevation", degrees(limit_deg, step_deg), |angle| [0.0, angle.cos(), angle.sin()])
    }

    fn new(name: &'static str, degrees: Vec<f64>, direction: impl Fn(f64) -> [f64; 3]) -> Self {
        let directions = degrees.iter().map(|degree| direction(degree.to_radians())).collect();
        Self { axis: Axis::new(name, "°", degrees), directions }
    }

    /// The angles, degrees.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }
}

fn degrees(limit: f64, step: f64) -> Vec<f64> {
    let steps = (limit / step).floor() as i64;
    (-steps..=steps).map(|index| index as f64 * step).collect()
}

impl Analysis {
    /// Power of one frame towards every direction, `[angle, range]`, summed over Doppler.
    ///
    /// Every Doppler bin is steered on its own, after the phase that its velocity gathers between the turns of the
    /// transmitters is taken away; velocities beyond the unambiguous ones therefore smear. `frame`: `[tx, rx, loop, sample]`.
    pub fn range_angle(&self, frame: &[num_complex::Complex32], scan: &Scan, gate: &Gate) -> Map {
        let (velocities, ranges) = (self.velocity_axis(), self.range_axis());
        let [loops, bins] = [velocities.len(), ranges.len()];
        let maps = self.range_doppler_complex(frame);
        let power: Vec<f64> = scan
            .directions
            .par_iter()
            .flat_map_iter(|&direction| {
                let mut power = vec![0.0; bins];
                for doppler in (0..loops).filter(|&doppler| gate.holds_velocity(velocities.values[doppler])) {
                    let beam = self.beam(&maps, direction, doppler, 0..bins);
                    power.iter_mut().zip(beam).for_each(|(sum, value)| *sum += value.norm_sqr());
                }
                power.iter_mut().zip(&ranges.values).filter(|(_, range)| !gate.holds_range(**range)).for_each(|(p, _)| *p = 0.0);
                power
            })
            .collect();
        Map::new(scan.axis.clone(), ranges, power)
    }

    /// A beam towards `direction`, a unit vector in the radar frame: the cells `bins` of one Doppler bin, `[range]`.
    ///
    /// `maps`: of every antenna, as [`Analysis::range_doppler_complex`] gives them. The phase that the bin's velocity gathers
    /// between the turns of the transmitters is taken away; one that is beyond the unambiguous velocities is not.
    ///
    /// # Panics
    /// When `maps` are not those of all antennas.
    pub fn beam(&self, maps: &Grid<Complex64, 3>, direction: [f64; 3], doppler: usize, bins: Range<usize>) -> Vec<Complex64> {
        let weights = self.steering(direction, doppler);
        assert_eq!(
            maps.shape()[0],
            weights.len(),
            "beam: maps of {} antennas, of which there are {}",
            maps.shape()[0],
            weights.len()
        );
        let mut beam = vec![Complex64::default(); bins.len()];
        for (channel, weight) in weights.into_iter().enumerate() {
            let cells = &maps.below([channel, doppler])[bins.clone()];
            beam.iter_mut().zip(cells).for_each(|(sum, value)| *sum += weight * value);
        }
        beam
    }

    /// Weights of every antenna pair for one direction and Doppler bin, which sum to 1 in size.
    ///
    /// An antenna displaced by d towards the target sees exp(−j 2π d·u/λ): the weight is its conjugate. Transmitter j fires
    /// j chirps late, when Doppler has turned the phase by j/n_tx of its turns per loop.
    fn steering(&self, direction: [f64; 3], doppler: usize) -> Vec<Complex64> {
        let transmitters = self.radar.tx_m.len();
        let per_loop = doppler_turns_per_loop(doppler, self.radar.loops_per_frame);
        let positions = self.channel_positions_m();
        let size = 1.0 / positions.len() as f64;
        let steer = |(tx, position): (usize, [f64; 3])| {
            let path: f64 = (0..3).map(|axis| position[axis] * direction[axis]).sum();
            let turns = path / self.radar.wavelength_m() - per_loop * tx as f64 / transmitters as f64;
            Complex64::from_polar(size, std::f64::consts::TAU * turns)
        };
        positions.into_iter().map(steer).collect()
    }

    /// Of every antenna pair: its transmitter, and the sum of both positions (the virtual antenna), in axis order `tx, rx`.
    fn channel_positions_m(&self) -> Vec<(usize, [f64; 3])> {
        let pairs =
            self.radar.tx_m.iter().enumerate().flat_map(|(tx, from)| {
                self.radar.rx_m.iter().map(move |to| (tx, std::array::from_fn(|axis| from[axis] + to[axis])))
            });
        pairs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::{HeatmapConfig, synthetic};
    use crate::radar::Radar;

    fn at(azimuth_deg: f64, range: f64) -> [f64; 3] {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        [range * sin, range * cos, 0.0]
    }

    #[test]
    fn a_point_off_boresight_is_found_at_its_azimuth_and_range() {
        let radar = synthetic::radar();
        let analysis = Analysis::new(&radar, &HeatmapConfig::default());
        for azimuth in [-35.0, 0.0, 20.0] {
            let signal = synthetic::point(&radar, |_| at(azimuth, 5.0));
            let map = analysis.range_angle(&signal, &Scan::azimuth(75.0, 1.0), &Gate::default());
            let [row, column] = map.peak();
            assert!((map.rows.values[row] - azimuth).abs() <= 1.0, "found {}°, wanted {azimuth}°", map.rows.values[row]);
            assert!((map.columns.values[column] - 5.0).abs() < 0.05);
        }
    }

    #[test]
    fn a_moving_point_keeps_its_azimuth_although_transmitters_take_turns() {
        let radar = synthetic::radar();
        let analysis = Analysis::new(&radar, &HeatmapConfig::default());
        // near the fastest unambiguous velocity the turn between transmitters is almost a quarter of a cycle
        for velocity in [-0.9 * radar.max_velocity_mps(), 0.8 * radar.max_velocity_mps()] {
            let signal = synthetic::point(&radar, |time| at(15.0, 4.0 + velocity * time));
            let map = analysis.range_angle(&signal, &Scan::azimuth(75.0, 1.0), &Gate::default());
            let found = map.rows.values[map.peak()[0]];
            assert!((found - 15.0).abs() <= 1.0, "found {found}° at {velocity} m/s");
        }
    }

    #[test]
    fn elevation_needs_antennas_above_each_other_and_is_then_found() {
        let half = 0.5 * synthetic::radar().wavelength_m();
        let rx_m = vec![[0.0; 3], [half, 0.0, 0.0], [0.0, 0.0, half], [half, 0.0, half]];
        let radar = Radar { tx_m: vec![[0.0; 3]], rx_m, ..synthetic::radar() };
        let signal = synthetic::point(&radar, |_| [0.0, 4.0 * 0.3f64.cos(), 4.0 * 0.3f64.sin()]);
        let map =
            Analysis::new(&radar, &HeatmapConfig::default()).range_angle(&signal, &Scan::elevation(60.0, 1.0), &Gate::default());
        assert!((map.rows.values[map.peak()[0]] - 0.3f64.to_degrees()).abs() <= 1.0);
    }

    #[test]
    fn a_path_of_amplitude_one_peaks_at_one_in_its_direction() {
        let radar = synthetic::radar();
        let bin = radar.range_resolution_m();
        // between the two array centres, so that the mean path is a whole number of bins
        let centre = radar.centre_m();
        let signal = synthetic::point(&radar, |_| [centre[0], 20.0 * bin, 0.0]);
        let only_still = Gate { velocity_mps: Some([-1e-6, 1e-6]), ..Gate::default() };
        let map = Analysis::new(&radar, &HeatmapConfig::default()).range_angle(&signal, &Scan::azimuth(10.0, 1.0), &only_still);
        assert!((map.max() - 1.0).abs() < 0.02, "{}", map.max());
    }
}
