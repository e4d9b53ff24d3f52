//! The search for a frequency at which some ranges stand out of their frames' scatter.

use std::cmp::Ordering;
use std::ops::RangeInclusive;

use num_complex::Complex64;

use super::chirps::{Chirps, Sidebands};
use crate::diagnosis::statistics::fisher_tail;

/// Share of one sideband's power that the other has at least.
const ALIKE: f64 = 0.3;
/// Neighbouring ranges that one return fills under the taper.
const OF_ONE: f64 = 2.0;
/// Least power over the scatter that is looked at.
const LEAST_RATIO: f64 = 1.5;
const REFINEMENTS: usize = 16;

#[derive(Clone, Copy)]
pub struct Line {
    pub frequency_hz: f64,
    /// The ranges looked at together.
    pub first: usize,
    pub last: usize,
    /// Power of the training frames' mean over what their scatter makes of it.
    pub ratio: f64,
    /// How often chance makes it there and at that frequency.
    pub chance: f64,
}

impl Line {
    pub fn weaker(&self, other: &Self) -> Ordering {
        other.chance.total_cmp(&self.chance).then(self.ratio.total_cmp(&other.ratio))
    }

    pub fn bins(&self) -> RangeInclusive<usize> {
        self.first..=self.last
    }

    pub fn middle(&self) -> f64 {
        0.5 * (self.first + self.last) as f64
    }
}

impl Chirps<'_> {
    /// The ranges at which a frequency stands out most.
    pub fn strongest(&self, sidebands: &Sidebands, frequency_hz: f64) -> Option<Line> {
        let training = &self.evidence.split.training;
        let ([channels, _], count) = (self.clutter.shape(), training.len() as f64);
        let before = self.before(sidebands, frequency_hz);
        let line = |&[first, last]: &[usize; 2]| {
            let width = last + 1 - first;
            let [upper, lower, scatter] = std::array::from_fn(|part| before[last + 1][part] - before[first][part]);
            let ratio = (upper + lower) / (scatter / (count - 1.0)).max(f64::MIN_POSITIVE);
            let plain = upper.min(lower) >= ALIKE * upper.max(lower) && scatter > 0.0 && ratio > LEAST_RATIO;
            plain.then(|| {
                let freedom = 2.0 * self.independent(width, scatter / (2.0 * (width * channels) as f64 * (count - 1.0)));
                Line { frequency_hz, first, last, ratio, chance: fisher_tail(ratio, freedom, freedom * (count - 1.0)) }
            })
        };
        self.windows.iter().filter_map(line).max_by(Line::weaker)
    }

    /// Sums over the bins before every bin: power of the training frames' mean by sideband, and what scatters around it.
    fn before(&self, sidebands: &Sidebands, frequency_hz: f64) -> Vec<[f64; 3]> {
        let training = &self.evidence.split.training;
        let ([channels, bins], count) = (self.clutter.shape(), training.len() as f64);
        let mut before = vec![[0.0; 3]; bins + 1];
        for (sideband, values) in sidebands.iter().enumerate() {
            let turns = self.turns(frequency_hz, sideband);
            for channel in 0..channels {
                for bin in 0..bins {
                    let (mut sum, mut squares) = (Complex64::ZERO, 0.0);
                    for &frame in training {
                        let value = values[[frame, channel, bin]];
                        sum += value * turns[frame];
                        squares += value.norm_sqr();
                    }
                    let of_mean = sum.norm_sqr() / count;
                    before[bin + 1][sideband] += of_mean;
                    before[bin + 1][2] += (squares - of_mean).max(0.0);
                }
            }
        }
        for bin in 0..bins {
            let sum = before[bin];
            before[bin + 1].iter_mut().zip(sum).for_each(|(value, sum)| *value += sum);
        }
        before
    }

    /// How many of some ranges' values scatter independently, of each sideband. Where frames scatter by more than the noise, something
    /// moves, which is alike in all channels: they count as one. `variance`: of one value.
    pub fn independent(&self, width: usize, variance: f64) -> f64 {
        let channels = self.evidence.cube.channels();
        // The taper's energy is one.
        let noise = self.evidence.total_noise() / (channels * self.loops_s.len()) as f64;
        let all = channels as f64 * (1.0 + (width - 1) as f64 / OF_ONE);
        1.0 + (all - 1.0) * (noise / variance.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// A line beside its true frequency has a scatter of its own.
    pub fn refined(&self, mut line: Line, mut step_hz: f64) -> Line {
        let sidebands = self.sidebands(line.frequency_hz);
        for _ in 0..REFINEMENTS {
            let beside = [-step_hz, step_hz].map(|step| self.strongest(&sidebands, line.frequency_hz + step));
            match beside.into_iter().flatten().find(|beside| line.weaker(beside).is_lt()) {
                Some(better) => line = better,
                None => step_hz *= 0.5,
            }
        }
        line
    }
}
