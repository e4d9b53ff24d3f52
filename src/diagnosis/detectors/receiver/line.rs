//! Where a line over the maps cannot be anything that moves, and the strongest one there.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::Evidence;
use crate::diagnosis::evidence::beat::empty_bins;
use crate::diagnosis::evidence::{hann, transform};
use crate::diagnosis::locate::Residual;
use crate::diagnosis::power::{CLUTTER_BINS, Cells};
use crate::diagnosis::statistics::median;

/// Range bins that a mover must have passed during the recording.
const LEAVES_BINS: f64 = 6.0;
/// Where lines are looked for, in cells of both axes: one between two cells shows only half of its power in either.
const BETWEEN: [[usize; 2]; 4] = [[0, 0], [0, 1], [1, 0], [1, 1]];

/// Fewest others of which a median is taken.
const FEWEST_ROWS: usize = 8;

/// Where a line of a fixed range and Doppler frequency cannot be anything that moves, and the powers there.
pub struct Line<'a> {
    evidence: &'a Evidence,
    /// Beat frequencies without room and body.
    empty: Vec<bool>,
    /// Noise of each beat frequency, over that of the recording: a response that was undone leaves more of it where little came through.
    levels: Vec<f64>,
    /// Over what room and body have elsewhere.
    residual: Option<Residual>,
    /// Doppler bins from which on a mover leaves its range bins during the recording.
    fast: f64,
}

impl<'a> Line<'a> {
    pub fn new(evidence: &'a Evidence) -> Self {
        let cells = Cells::new(&evidence.radar);
        let duration_s = evidence.starts_s.last().map_or(0.0, |last| last - evidence.starts_s[0]);
        let fast = LEAVES_BINS / (cells.bins_per_m * duration_s.max(1e-9)) * cells.doppler_per_mps;
        let residual = evidence.power().and_then(|_| Residual::new(evidence));
        Self { evidence, empty: empty_bins(evidence), levels: levels(evidence), residual, fast }
    }

    fn is_usable(&self, doppler: usize, range: usize) -> bool {
        let loops = self.evidence.cube.dims[3];
        let leaves = doppler.min(loops - doppler) as f64 > self.fast;
        self.empty[range] || (leaves && self.residual.as_ref().is_some_and(|residual| range < residual.bins))
    }

    /// The strongest line on the cells and half way to the next ones, in the order of [`BETWEEN`], and among how many.
    pub fn strongest(&self) -> [(Option<Strongest>, usize); BETWEEN.len()] {
        let [_, _, _, loops, samples] = self.evidence.cube.dims;
        let cells = BETWEEN.map(|between| self.cells(between));
        let frames = &self.evidence.split.training;
        let powers: Vec<[Vec<f64>; BETWEEN.len()]> = frames.par_iter().map(|&frame| self.powers(frame, &cells)).collect();
        std::array::from_fn(|place| {
            // The median over the frames: a mover crosses a cell, a line stays.
            let of_cell = |index: usize| {
                let power = median(&mut powers.iter().map(|powers| powers[place][index]).collect::<Vec<f64>>());
                let [slow, fast] = [0, 1].map(|axis| cells[place][index][axis] as f64 + 0.5 * BETWEEN[place][axis] as f64);
                Strongest { power, at: (slow / loops as f64, fast / samples as f64) }
            };
            let count = cells[place].len();
            ((0..count).into_par_iter().map(of_cell).max_by(|a, b| a.power.total_cmp(&b.power)), count)
        })
    }

    /// Cells at which a line is detectable, half way to the next ones along the axes marked in `between`.
    fn cells(&self, between: [usize; 2]) -> Vec<[usize; 2]> {
        let [_, _, _, loops, samples] = self.evidence.cube.dims;
        (1..loops - between[0])
            .flat_map(|doppler| (0..samples - between[1]).map(move |range| [doppler, range]))
            .filter(|&cell| neighbours(cell, between).all(|[doppler, range]| self.is_usable(doppler, range)))
            .collect()
    }

    /// Mean powers of all channels over what is expected there; half way to the next cells, over the most of these.
    fn powers(&self, frame: usize, cells: &[Vec<[usize; 2]>; BETWEEN.len()]) -> [Vec<f64>; BETWEEN.len()] {
        let own = self.unmodelled(frame, [0, 0]);
        let samples = self.evidence.cube.dims[4];
        let index = |[doppler, range]: [usize; 2]| doppler * samples + range;
        let share = |near: [usize; 2]| self.power(frame, near) / own[index(near)].max(f64::MIN_POSITIVE);
        std::array::from_fn(|place| {
            let between = BETWEEN[place];
            if between == [0, 0] {
                return cells[place].iter().map(|&cell| self.power(frame, cell)).collect();
            }
            let moved = self.unmodelled(frame, between);
            let least = |cell: [usize; 2]| neighbours(cell, between).map(share).fold(f64::INFINITY, f64::min);
            cells[place].iter().map(|&cell| moved[index(cell)] * least(cell)).collect()
        })
    }

    /// Powers over the noise alone, of the channels' mean, so far along both axes.
    fn unmodelled(&self, frame: usize, between: [usize; 2]) -> Vec<f64> {
        let [_, _, _, loops, samples] = self.evidence.cube.dims;
        let [slow, fast] = [0.5 * between[0] as f64 / loops as f64, 0.5 * between[1] as f64 / samples as f64];
        let channels = self.evidence.cube.channels();
        let mut powers = vec![0.0; loops * samples];
        for channel in 0..channels {
            let turned = |(i, value): (usize, Complex64)| value * tone(slow, fast, i / samples, i % samples).conj();
            let moving = self.evidence.moving(frame, channel).into_iter().enumerate();
            let map = transform(&moving.map(turned).collect::<Vec<Complex64>>(), samples);
            let scale = 1.0 / (channels as f64 * self.evidence.noise()[channel].max(1e-300));
            powers.iter_mut().zip(map).for_each(|(power, value)| *power += scale * value.norm_sqr());
        }
        powers
    }

    /// Over what is expected; zero where nothing can be said.
    fn power(&self, frame: usize, [doppler, range]: [usize; 2]) -> f64 {
        let at = [frame, doppler, range];
        match &self.residual {
            Some(residual) if !self.empty[range] => f64::from(if residual.count[at] > 0.0 { residual.ratio[at] } else { 0.0 }),
            _ => f64::from(self.evidence.maps()[at]) / self.levels[range],
        }
    }
}

/// The median over the other velocities (order-statistic CFAR, Rohling 1983), by the median of a mean of exponential variables (Choi
/// 1994), and never less than the noise.
fn levels(evidence: &Evidence) -> Vec<f64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let rows: Vec<usize> = (0..loops).filter(|&row| row.min(loops - row) > CLUTTER_BINS).collect();
    if rows.len() < FEWEST_ROWS {
        return vec![1.0; samples];
    }
    let (maps, channels) = (evidence.maps(), evidence.cube.channels() as f64);
    let of_bin = |bin: usize| {
        let frames = evidence.split.training.iter();
        let powers = frames.flat_map(|&frame| rows.iter().map(move |&row| f64::from(maps[[frame, row, bin]])));
        (median(&mut powers.collect::<Vec<f64>>()) * channels / (channels - 1.0 / 3.0)).max(1.0)
    };
    (0..samples).into_par_iter().map(of_bin).collect()
}

/// A line, with its median power and its turns per chirp and per sample.
pub struct Strongest {
    pub power: f64,
    pub at: (f64, f64),
}

/// The cells about a place between them.
fn neighbours([doppler, range]: [usize; 2], between: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    (0..=between[0]).flat_map(move |i| (0..=between[1]).map(move |j| [doppler + i, range + j]))
}

/// Of amplitude 1, at a sample of a chirp of a frame.
pub fn tone(slow: f64, fast: f64, chirp: usize, sample: usize) -> Complex64 {
    Complex64::cis(TAU * (slow * chirp as f64 + fast * sample as f64))
}

/// Of each chirp, the amplitude at a beat frequency (turns per sample), under a Hann window.
pub fn in_chirps(chirps: &[Complex64], samples: usize, fast: f64) -> Vec<Complex64> {
    let window = hann(samples);
    let all: f64 = window.iter().sum();
    let turns: Vec<Complex64> = (0..samples).map(|n| Complex64::cis(-TAU * fast * n as f64) * (window[n] / all)).collect();
    chirps.chunks_exact(samples).map(|chirp| chirp.iter().zip(&turns).map(|(value, turn)| value * turn).sum()).collect()
}

/// Of amplitudes by chirp, the one that turns so from chirp to chirp, under a Hann window.
pub fn along(amplitudes: &[Complex64], slow: f64) -> Complex64 {
    turned_back(amplitudes, 1, slow)[0] / hann(amplitudes.len()).iter().sum::<f64>()
}

/// Sum of chirps under a Hann window over the loops, each turned back by how far a tone (turns per chirp) has turned in it.
pub fn turned_back(chirps: &[Complex64], samples: usize, slow: f64) -> Vec<Complex64> {
    let mut sum = vec![Complex64::ZERO; samples];
    for (index, (chirp, weight)) in chirps.chunks_exact(samples).zip(hann(chirps.len() / samples)).enumerate() {
        let turn = Complex64::cis(-TAU * slow * index as f64) * weight;
        sum.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * turn);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    #[test]
    fn a_line_between_cells_has_its_whole_power_half_way_to_the_next() {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::small(6) };
        let (slow, fast) = (10.5 / 32.0, 40.5 / 64.0);
        let evidence = Evidence::in_noise(radar, 5, |[_, _, chirp, n]| 0.5 * tone(slow, fast, chirp, n));
        let line = Line { evidence: &evidence, empty: vec![true; 64], levels: vec![1.0; 64], residual: None, fast: 0.0 };
        let [on, _, _, half] = line.strongest().map(|(found, _)| found.expect("empty ranges"));
        assert_eq!(half.at, (slow, fast));
        // Scalloping of a Hann window (Harris 1978, table 1): 1.42 dB along each axis.
        let lost_db = 10.0 * ((half.power - 1.0) / (on.power - 1.0)).log10();
        println!("lost {lost_db} dB");
        assert!((lost_db - 2.84).abs() < 0.3, "{lost_db}");
    }
}
