//! Velocity against time by the short-time Fourier transform over all chirps (the spectrogram of micro-Doppler pictures; Chen, The
//! Micro-Doppler Effect in Radar, 2011, ch. 2), where [`Analysis::time_doppler`] has one column a frame.

use hybridsim_fft::FftPlanner;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;

use super::{Analysis, Axis, Gate, Map, Samples, axes::doppler_turns_per_loop};
use crate::radar::Radar;

/// Of a foot that swings: half a sine up to 4 m/s in 0.4 s. Sets the length of the window and nothing else.
const ACCELERATION_MPS2: f64 = 30.0;
/// Hops of a window: Hann's overlaps by three quarters as usual.
const OVERLAP: usize = 4;
/// Most columns of a map: as many as a picture of three maps has pixels for each.
const MOST_COLUMNS: usize = 512;

/// Which loops a column looks at.
#[derive(Clone, Debug, PartialEq)]
struct Plan {
    /// Loops of a window.
    window: usize,
    /// Loops from one window to the next.
    hop: usize,
    /// Frames that follow each other without a gap.
    frames_at_once: usize,
}

impl Plan {
    fn new(radar: &Radar, frames: usize) -> Self {
        let (loops, period_s) = (radar.loops_per_frame, radar.loop_period_s());
        // Frames without a gap between them are one long frame.
        let gap_s = radar.frame_period_s - loops as f64 * period_s;
        let frames_at_once = if gap_s.abs() < 1e-3 * period_s { frames } else { 1 };
        let length = loops * frames_at_once;
        // A velocity that changes by a in T smears over 2 a T / wavelength, which the window resolves as 1 / T.
        let settled_s = (radar.wavelength_m() / (2.0 * ACCELERATION_MPS2)).sqrt();
        let window = ((settled_s / period_s).round() as usize).clamp(1, length);
        let hop = (window / OVERLAP).max(loops * frames / MOST_COLUMNS).max(1);
        Self { window, hop, frames_at_once }
    }

    /// First loops of the windows within frames that follow each other.
    fn starts(&self, loops: usize) -> impl Iterator<Item = usize> {
        let spare = loops * self.frames_at_once - self.window;
        // Evenly on both sides.
        (spare % self.hop / 2..=spare).step_by(self.hop)
    }
}

impl Analysis {
    /// Power `[velocity, time]`, summed over the gate's ranges, mean over the antennas. Remove what is static before.
    ///
    /// Time is the middle of a window, in even steps; what lies between two frames shows the nearest window.
    pub fn spectrogram(&self, samples: Samples<'_>, gate: &Gate) -> Map {
        let (radar, frames) = (&self.radar, samples.frames());
        let plan = Plan::new(radar, frames);
        let bins = plan.window.max(radar.loops_per_frame);
        let stretches: Vec<usize> = (0..frames).step_by(plan.frames_at_once).collect();
        let columns: Vec<(f64, Vec<f64>)> =
            stretches.into_par_iter().flat_map_iter(|first| self.stretch(samples, first, &plan, bins, gate)).collect();
        let per_turn = radar.wavelength_m() / (2.0 * radar.loop_period_s());
        let velocities = (0..bins).map(|bin| doppler_turns_per_loop(bin, bins) * per_turn).collect();
        even(Axis::new("velocity", "m/s", velocities), &columns, radar, &plan)
    }

    /// Time and `[velocity]` of every window of frames that follow each other.
    fn stretch(&self, samples: Samples<'_>, first: usize, plan: &Plan, bins: usize, gate: &Gate) -> Vec<(f64, Vec<f64>)> {
        let radar = &self.radar;
        let [_, transmitters, receivers, loops, length] = radar.dims();
        let ranges: Vec<usize> =
            self.range_axis().values.iter().enumerate().filter(|(_, r)| gate.holds_range(**r)).map(|(i, _)| i).collect();
        let channels = transmitters * receivers;
        let weights = self.doppler_kind.weights(plan.window);
        let fft = FftPlanner::new().plan_fft_forward(bins);
        let starts: Vec<usize> = plan.starts(loops).collect();
        let mut powers = vec![vec![0.0; bins]; starts.len()];
        for channel in 0..channels {
            let chirps: Vec<Complex32> = (first..first + plan.frames_at_once)
                .flat_map(|frame| &samples.frame(frame)[channel * loops * length..(channel + 1) * loops * length])
                .copied()
                .collect();
            let profiles = self.range_profiles(&chirps);
            let all = profiles.len() / (loops * plan.frames_at_once);
            powers.par_iter_mut().zip(&starts).for_each(|(power, &start)| {
                let mut buffer = vec![Complex64::default(); bins];
                for &range in &ranges {
                    buffer.fill(Complex64::default());
                    for (index, weight) in weights.iter().enumerate() {
                        buffer[index] = profiles[(start + index) * all + range] * weight;
                    }
                    fft.process(&mut buffer);
                    for (frequency, value) in buffer.iter().enumerate() {
                        power[(frequency + bins / 2) % bins] += value.norm_sqr() / channels as f64;
                    }
                }
            });
        }
        let middle = 0.5 * (plan.window as f64 - 1.0);
        let time = |start: usize| radar.chirp_time_s(first, 0, 0) + (start as f64 + middle) * radar.loop_period_s();
        starts.iter().map(|&start| time(start)).zip(powers).collect()
    }
}

/// Even steps in time, each of the nearest column: hops, or frames where a frame has one column.
fn even(rows: Axis, columns: &[(f64, Vec<f64>)], radar: &Radar, plan: &Plan) -> Map {
    let (first, last) = (columns[0].0, columns[columns.len() - 1].0);
    let alone = plan.starts(radar.loops_per_frame).nth(1).is_none();
    let step = if alone { radar.frame_period_s } else { plan.hop as f64 * radar.loop_period_s() };
    let step = step.max((last - first) / MOST_COLUMNS as f64);
    let times: Vec<f64> = (0..=((last - first) / step).round() as usize).map(|index| first + index as f64 * step).collect();
    let nearest = |time: &f64| {
        let after = columns.partition_point(|(at, _)| at < time).min(columns.len() - 1);
        let before = after.saturating_sub(1);
        if (columns[before].0 - time).abs() < (columns[after].0 - time).abs() { before } else { after }
    };
    let chosen: Vec<usize> = times.iter().map(nearest).collect();
    let values = (0..rows.len()).flat_map(|row| chosen.iter().map(move |&column| columns[column].1[row])).collect();
    Map::new(rows, Axis::new("time", "s", times), values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::{HeatmapConfig, synthetic};

    /// 256 loops of 160 us in each of two frames.
    fn radar(frame_period_s: f64) -> Radar {
        Radar { loops_per_frame: 256, frames: 2, frame_period_s, ..synthetic::radar() }
    }

    fn map(radar: &Radar, range_m: impl Fn(f64) -> f64) -> Map {
        let signal = synthetic::point(radar, |time| [0.0, range_m(time), 0.0]);
        Analysis::new(radar, &HeatmapConfig::default()).spectrogram(Samples::new(&signal, radar.dims()), &Gate::default())
    }

    /// Of every column, the velocity of its strongest cell.
    fn velocities(map: &Map) -> Vec<f64> {
        let strongest = |column: usize| (0..map.rows.len()).max_by(|&a, &b| map.at(a, column).total_cmp(&map.at(b, column)));
        (0..map.columns.len()).map(|column| map.rows.values[strongest(column).unwrap()]).collect()
    }

    #[test]
    fn a_velocity_that_changes_within_a_frame_is_followed() {
        // With a pause between the frames, and without one.
        for period_s in [0.1, 256.0 * synthetic::radar().loop_period_s()] {
            let radar = radar(period_s);
            let acceleration = 12.0;
            let map = map(&radar, |time| 3.0 - 0.5 * time + 0.5 * acceleration * time * time);
            let step = map.rows.values[1] - map.rows.values[0];
            let resolution = radar.wavelength_m() / (2.0 * Plan::new(&radar, 2).window as f64 * radar.loop_period_s());
            assert!(map.columns.len() > 20, "{}", map.columns.len());
            let inside = |time: f64| (time % period_s) < 250.0 * radar.loop_period_s();
            for (time, found) in map.columns.values.iter().zip(velocities(&map)).filter(|(time, _)| inside(**time)) {
                let wanted = acceleration * time - 0.5;
                // Half a resolution, and the half window within which the nearest column lies.
                assert!((found - wanted).abs() < 0.5 * resolution + step, "{time} s: found {found}, wanted {wanted}");
            }
        }
    }

    #[test]
    fn a_point_in_the_middle_of_its_range_cell_sums_to_hanns_main_lobe() {
        let mut radar = radar(0.1);
        (radar.tx_m, radar.rx_m) = (vec![[0.0; 3]], vec![[0.0; 3]]);
        let range_m = 20.0 * radar.range_resolution_m();
        // Hann's periodic window has 1, 1/2 and 1/2 as amplitudes in its three bins.
        let map = map(&radar, |_| range_m);
        assert!((map.max() - 1.5).abs() < 1e-3, "{}", map.max());
    }

    #[test]
    fn frames_shorter_than_a_window_are_one_column_each() {
        let radar = Radar { loops_per_frame: 16, frames: 5, ..synthetic::radar() };
        let map = map(&radar, |_| 3.0);
        assert_eq!(map.dims(), [16, 5]);
        assert!((map.columns.values[1] - map.columns.values[0] - radar.frame_period_s).abs() < 1e-12);
    }

    #[test]
    fn a_long_recording_has_no_more_columns_than_a_picture_shows() {
        let radar = radar(0.1);
        let plan = Plan::new(&radar, 100_000);
        let columns: Vec<(f64, Vec<f64>)> = (0..100_000)
            .flat_map(|frame| plan.starts(256).map(move |start| (frame, start)))
            .map(|(frame, start)| (0.1 * frame as f64 + start as f64 * radar.loop_period_s(), vec![0.0]))
            .collect();
        assert!(columns.len() <= 2 * 100_000, "{}", columns.len());
        let map = even(Axis::new("velocity", "m/s", vec![0.0]), &columns, &radar, &plan);
        assert!(map.columns.len() <= MOST_COLUMNS + 1);
    }
}
