//! Whether a line goes on in held-out frames, and whether it is in some ranges only.

use num_complex::Complex64;

use super::chirps::{Chirps, Sidebands, reached};
use super::line::Line;
use crate::grid::Grid;

/// Share of its modulation depth that all other static returns have at most, but for so many standard deviations: else it is the
/// receiver's own amplitude modulation. And how much less likely (nats) it must be that they are modulated as deeply.
const OTHERS: f64 = 0.3;
const CHANCE: f64 = 2.0;
const SURELY: f64 = 12.0;

/// A complex depth with its variance.
struct Depth {
    mean: Complex64,
    variance: f64,
}

impl Chirps<'_> {
    /// Log-likelihood gain of the held-out frames by the training frames' mean, nats.
    pub fn nats(&self, line: &Line, sidebands: &Sidebands) -> f64 {
        let (training, held_out) = (&self.evidence.split.training, &self.evidence.split.held_out);
        let [channels, _] = self.clutter.shape();
        let (mut gained, mut scatter) = (0.0, 0.0);
        for values in sidebands {
            for (channel, bin) in (0..channels).flat_map(|channel| line.bins().map(move |bin| (channel, bin))) {
                let value = |frame: usize| values[[frame, channel, bin]];
                let (mean, own) = self.spread(value);
                scatter += own;
                gained += held_out.iter().map(|&frame| value(frame).norm_sqr() - (value(frame) - mean).norm_sqr()).sum::<f64>();
            }
        }
        let width = line.bins().count();
        let numbers = (sidebands.len() * channels * width) as f64;
        let variance = (scatter / (numbers * (training.len() - 1) as f64)).max(f64::MIN_POSITIVE);
        gained / variance * self.independent(width, variance) / (channels * width) as f64
    }

    /// Mean of a value over the training frames, and the sum of what scatters around it.
    fn spread(&self, value: impl Fn(usize) -> Complex64) -> (Complex64, f64) {
        let training = &self.evidence.split.training;
        let mean = training.iter().map(|&frame| value(frame)).sum::<Complex64>() / training.len() as f64;
        (mean, training.iter().map(|&frame| (value(frame) - mean).norm_sqr()).sum())
    }

    /// Whether the other static returns, together, are surely not modulated as deeply: a modulation of the receiver's gain is in
    /// all of them.
    pub fn others_are_constant(&self, line: &Line, sidebands: &Sidebands) -> bool {
        let reached = reached(line.first, line.last);
        let near = |bin: usize| reached.contains(&bin);
        sidebands.iter().all(|values| {
            let (own, others) = (self.depth(values, &near), self.depth(values, &|bin| !near(bin)));
            let [constant, modulated] =
                [Complex64::ZERO, own.mean].map(|depth| (others.mean - depth).norm_sqr() / others.variance);
            others.mean.norm() < OTHERS * own.mean.norm() + CHANCE * others.variance.sqrt() && modulated > constant + SURELY
        })
    }

    /// Modulation depth of some static returns, mean of the training frames; ranges count the less the more their frames scatter.
    fn depth(&self, values: &Grid<Complex64, 3>, wanted: &dyn Fn(usize) -> bool) -> Depth {
        let training = &self.evidence.split.training;
        let ([channels, bins], count) = (self.clutter.shape(), training.len() as f64);
        let mut depths = vec![Complex64::ZERO; training.len()];
        let mut all = 0.0;
        for bin in (0..bins).filter(|&bin| wanted(bin)) {
            let sideband = |channel: usize, frame: usize| values[[frame, channel, bin]];
            let scatter: f64 = (0..channels).map(|channel| self.spread(|frame| sideband(channel, frame)).1).sum();
            let weight = 1.0 / scatter.max(f64::MIN_POSITIVE);
            for channel in 0..channels {
                let clutter = self.clutter[[channel, bin]];
                let own = training.iter().map(|&frame| clutter.conj() * sideband(channel, frame) * weight);
                depths.iter_mut().zip(own).for_each(|(depth, own)| *depth += own);
                all += clutter.norm_sqr() * weight;
            }
        }
        depths.iter_mut().for_each(|depth| *depth /= all.max(f64::MIN_POSITIVE));
        let mean = depths.iter().sum::<Complex64>() / count;
        let variance = depths.iter().map(|depth| (depth - mean).norm_sqr()).sum::<f64>() / (count * (count - 1.0));
        Depth { mean, variance: variance.max(f64::MIN_POSITIVE) }
    }
}
