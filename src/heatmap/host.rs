//! Range-Doppler on the host: f64, rustfft, any length.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::{Complex32, Complex64};
use serde::{Deserialize, Serialize};

use super::{Axis, HeatmapConfig, Map, Window, range_axis, range_bins, velocity_axis};
use crate::grid::Grid;
use crate::radar::{Radar, Sampling};

/// Borrowed IF samples, `[frame, tx, rx, loop, sample]`; the imaginary parts of a real-sampled signal are ignored.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// The last axis fastest.
    pub values: &'a [Complex32],
    /// Lengths of the five axes.
    pub dims: [usize; 5],
}

impl<'a> Samples<'a> {
    /// # Panics
    /// When the number of values is not the product of the axes.
    pub fn new(values: &'a [Complex32], dims: [usize; 5]) -> Self {
        assert_eq!(values.len(), dims.iter().product::<usize>(), "samples: {} values for {dims:?}", values.len());
        Self { values, dims }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.dims[0]
    }

    /// `[tx, rx, loop, sample]` of one frame.
    pub fn frame(&self, frame: usize) -> &'a [Complex32] {
        let length: usize = self.dims[1..].iter().product();
        &self.values[frame * length..(frame + 1) * length]
    }
}

/// What counts as static, and is taken away before the transforms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StaticRemoval {
    #[default]
    None,
    /// The mean over the loops of each frame: static clutter for a frame.
    Loops,
    /// The mean over all loops of all frames: static clutter for the recording.
    Frames,
}

/// The samples without what is static, `[frame, tx, rx, loop, sample]`.
pub fn remove_static(samples: Samples<'_>, removal: StaticRemoval) -> Vec<Complex32> {
    let [frames, transmitters, receivers, loops, length] = samples.dims;
    let channels = transmitters * receivers;
    let shape = [frames, channels, loops, length];
    let mut values = Grid::new(["frame", "channel", "loop", "sample"], shape, samples.values.to_vec());
    // Frames that have one mean.
    let groups: Vec<Vec<usize>> = match removal {
        StaticRemoval::None => Vec::new(),
        StaticRemoval::Loops => (0..frames).map(|frame| vec![frame]).collect(),
        StaticRemoval::Frames => vec![(0..frames).collect()],
    };
    for channel in 0..channels {
        for group in &groups {
            let chirps = || group.iter().flat_map(|&frame| (0..loops).map(move |index| (frame, index)));
            let count = (group.len() * loops) as f64;
            for sample in 0..length {
                let sum: Complex64 = chirps().map(|(frame, index)| widen(values[[frame, channel, index, sample]])).sum();
                let mean = sum / count;
                let mean = Complex32::new(mean.re as f32, mean.im as f32);
                chirps().for_each(|(frame, index)| values[[frame, channel, index, sample]] -= mean);
            }
        }
    }
    values.into_values()
}

pub(super) fn widen(value: Complex32) -> Complex64 {
    Complex64::new(value.re.into(), value.im.into())
}

/// The maps of one radar on the host. Powers are averaged over the antennas unless said otherwise.
#[derive(Clone)]
pub struct Analysis {
    pub(super) radar: Radar,
    range_window: Vec<f64>,
    pub(super) doppler_kind: Window,
    doppler_window: Vec<f64>,
    range_fft: Arc<dyn Fft<f64>>,
    doppler_fft: Arc<dyn Fft<f64>>,
}

impl Analysis {
    /// Prepares the windows and transforms for one radar's chirps and frames.
    pub fn new(radar: &Radar, config: &HeatmapConfig) -> Self {
        let mut planner = FftPlanner::new();
        let scale = if radar.sampling == Sampling::Real { 2.0 } else { 1.0 };
        Self {
            range_window: config.range_window.weights(radar.samples_per_chirp).into_iter().map(|w| w * scale).collect(),
            doppler_kind: config.doppler_window,
            doppler_window: config.doppler_window.weights(radar.loops_per_frame),
            range_fft: planner.plan_fft_forward(radar.samples_per_chirp),
            doppler_fft: planner.plan_fft_forward(radar.loops_per_frame),
            radar: radar.clone(),
        }
    }

    /// Ranges of the maps' columns, m.
    pub fn range_axis(&self) -> Axis {
        range_axis(&self.radar)
    }

    /// Radial velocities of the maps' rows, m/s.
    pub fn velocity_axis(&self) -> Axis {
        velocity_axis(&self.radar)
    }

    /// Range DFT of every chirp: `[…, sample]` to `[…, range]`.
    pub fn range_profiles(&self, chirps: &[Complex32]) -> Vec<Complex64> {
        let samples = self.radar.samples_per_chirp;
        assert_eq!(chirps.len() % samples, 0, "range_profiles: {} values, {samples} samples a chirp", chirps.len());
        let bins = range_bins(samples, self.radar.sampling);
        let mut profiles = Vec::with_capacity(chirps.len() / samples * bins);
        let mut buffer = vec![Complex64::default(); samples];
        for chirp in chirps.chunks_exact(samples) {
            for ((slot, &value), weight) in buffer.iter_mut().zip(chirp).zip(&self.range_window) {
                let value = widen(value) * weight;
                *slot = if self.radar.sampling == Sampling::Real { value.re.into() } else { value };
            }
            self.range_fft.process(&mut buffer);
            if self.radar.slope_hz_per_s > 0.0 {
                profiles.extend_from_slice(&buffer[..bins]);
            } else {
                // The beat frequency of a falling chirp is negative.
                profiles.extend((0..bins).map(|bin| buffer[(samples - bin) % samples]));
            }
        }
        profiles
    }

    /// Complex maps of every antenna, zero Doppler in the middle, from `[…, loop, sample]`.
    pub fn range_doppler_complex(&self, signal: &[Complex32]) -> Grid<Complex64, 3> {
        let loops = self.radar.loops_per_frame;
        let bins = range_bins(self.radar.samples_per_chirp, self.radar.sampling);
        let mut maps = self.range_profiles(signal);
        assert_eq!(maps.len() % (loops * bins), 0, "range_doppler: {} values, {loops} loops", signal.len());
        let mut buffer = vec![Complex64::default(); loops];
        for map in maps.chunks_exact_mut(loops * bins) {
            for bin in 0..bins {
                for (index, slot) in buffer.iter_mut().enumerate() {
                    *slot = map[index * bins + bin] * self.doppler_window[index];
                }
                self.doppler_fft.process(&mut buffer);
                for (frequency, value) in buffer.iter().enumerate() {
                    map[(frequency + loops / 2) % loops * bins + bin] = *value;
                }
            }
        }
        Grid::new(["antenna", "doppler", "range"], [maps.len() / (loops * bins), loops, bins], maps)
    }

    /// Range-Doppler power of one frame, `[doppler, range]`, averaged over its antennas.
    ///
    /// `frame`: `[tx, rx, loop, sample]`, or any subset of antennas.
    pub fn range_doppler(&self, frame: &[Complex32]) -> Map {
        Map::new(self.velocity_axis(), self.range_axis(), mean_power(&self.range_doppler_complex(frame)))
    }
}

/// Power of complex maps, `[doppler, range]`, averaged over the antennas.
pub fn mean_power(maps: &Grid<Complex64, 3>) -> Vec<f64> {
    let [antennas, loops, bins] = maps.shape();
    let mut power = vec![0.0; loops * bins];
    for map in maps.values().chunks_exact(loops * bins) {
        power.iter_mut().zip(map).for_each(|(sum, value)| *sum += value.norm_sqr() / antennas as f64);
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::synthetic;

    #[test]
    fn a_point_at_three_metres_peaks_in_its_range_bin() {
        for sampling in [Sampling::Complex, Sampling::Real] {
            let radar = Radar { sampling, ..synthetic::radar() };
            let signal = synthetic::point(&radar, |_| [0.0, 3.0, 0.0]);
            let map = Analysis::new(&radar, &HeatmapConfig::default()).range_doppler(&signal);
            let [row, column] = map.peak();
            assert_eq!(column, (3.0 / radar.range_resolution_m()).round() as usize, "{sampling:?}");
            assert_eq!(map.rows.values[row], 0.0, "{sampling:?}");
        }
    }

    #[test]
    fn a_point_in_the_middle_of_its_cell_has_zero_decibels() {
        for sampling in [Sampling::Complex, Sampling::Real] {
            let mut radar = Radar { sampling, ..synthetic::radar() };
            (radar.tx_m, radar.rx_m) = (vec![[0.0; 3]], vec![[0.0; 3]]);
            let range = 20.0 * radar.range_resolution_m();
            let signal = synthetic::point(&radar, |_| [0.0, range, 0.0]);
            let map = Analysis::new(&radar, &HeatmapConfig::default()).range_doppler(&signal);
            assert_eq!(map.peak()[1], 20);
            assert!((map.max() - 1.0).abs() < 1e-5, "{sampling:?}: {}", map.max());
        }
    }

    #[test]
    fn a_receding_point_has_a_positive_velocity_of_the_right_size() {
        let radar = synthetic::radar();
        let step = radar.velocity_resolution_mps();
        for velocity in [1.3, -2.1] {
            let signal = synthetic::point(&radar, |time| [0.0, 3.0 + velocity * time, 0.0]);
            let map = Analysis::new(&radar, &HeatmapConfig::default()).range_doppler(&signal);
            let found = map.rows.values[map.peak()[0]];
            assert!((found - velocity).abs() <= 0.5 * step + 1e-3, "found {found}, wanted {velocity}, bins of {step}");
        }
    }

    #[test]
    fn a_falling_chirp_shows_the_range_velocity_and_side_of_a_rising_one() {
        for sampling in [Sampling::Complex, Sampling::Real] {
            let rising = Radar { sampling, ..synthetic::radar() };
            let falling = Radar { slope_hz_per_s: -rising.slope_hz_per_s, ..rising.clone() };
            let peaks: Vec<(f64, f64, f64)> = [rising, falling]
                .iter()
                .map(|radar| {
                    let signal = synthetic::point(radar, |time| [1.0, 3.0 + 1.3 * time, 0.0]);
                    let analysis = Analysis::new(radar, &HeatmapConfig::default());
                    let map = analysis.range_doppler(&signal);
                    let [row, column] = map.peak();
                    let maps = analysis.range_doppler_complex(&signal);
                    let between = maps[[1, row, column]] * maps[[0, row, column]].conj();
                    (map.columns.values[column], map.rows.values[row], between.arg())
                })
                .collect();
            let step = synthetic::radar().velocity_resolution_mps();
            assert!((peaks[0].0 - peaks[1].0).abs() < 0.06, "{sampling:?}: {peaks:?}");
            assert!((peaks[0].1 - peaks[1].1).abs() < 1.01 * step && peaks[1].1 > 0.0, "{sampling:?}: {peaks:?}");
            assert!((peaks[0].2 - peaks[1].2).abs() < 0.1 && peaks[0].2.abs() > 0.3, "{sampling:?}: {peaks:?}");
        }
    }

    #[test]
    fn static_removal_leaves_only_what_moves() {
        let radar = Radar { frames: 3, ..synthetic::radar() };
        let wall = synthetic::point(&radar, |_| [0.5, 4.0, 0.0]);
        let walker = synthetic::point(&radar, |time| [0.0, 3.0 + 1.0 * time, 0.0]);
        let both: Vec<Complex32> = wall.iter().zip(&walker).map(|(a, b)| 100.0 * a + b).collect();
        let samples = Samples::new(&both, radar.dims());
        let analysis = Analysis::new(&radar, &HeatmapConfig::default());
        let range = |values: &[Complex32]| {
            let map = analysis.range_doppler(Samples::new(values, radar.dims()).frame(1));
            map.columns.values[map.peak()[1]]
        };
        assert!((range(&both) - 4.03).abs() < 0.05);
        for removal in [StaticRemoval::Loops, StaticRemoval::Frames] {
            let moving = remove_static(samples, removal);
            assert!((range(&moving) - 3.05).abs() < 0.05, "{removal:?}: {}", range(&moving));
        }
        assert_eq!(remove_static(samples, StaticRemoval::None), both);
    }

    #[test]
    fn the_mean_over_frames_keeps_what_steps_between_frames() {
        let radar = Radar { frames: 2, ..synthetic::radar() };
        // still within each frame, a quarter of a wavelength (half a turn) farther in the second one
        let step = 0.25 * radar.wavelength_m();
        let signal = synthetic::point(&radar, |time| [0.0, if time < 0.04 { 3.0 } else { 3.0 + step }, 0.0]);
        let samples = Samples::new(&signal, radar.dims());
        let power = |removal| remove_static(samples, removal).iter().map(|v| v.norm_sqr()).sum::<f32>();
        assert!(power(StaticRemoval::Loops) < 1e-6 * power(StaticRemoval::None));
        // Half a turn apart, the two frames' mean is nothing.
        let kept = power(StaticRemoval::Frames) / power(StaticRemoval::None);
        assert!((kept - 1.0).abs() < 1e-2, "{kept}");
    }
}
