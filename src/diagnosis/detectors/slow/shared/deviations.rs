//! How the static returns of groups of ranges deviate from their mean over time, chirp by chirp.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::detectors::slow::field::Group;
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::grid::Grid;

/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Bins over which the window correlates noise: a sum over bins has so many times the variance of as many independent ones.
const BINS_PER_VALUE: f64 = 2.0;

/// Relative to the mean.
pub struct Deviation {
    pub group: Group,
    /// `[frame · loops + loop]`
    pub values: Vec<Complex64>,
    /// Of the noise in each of them.
    pub variance: f64,
}

/// Spectra of all chirps in units of the noise's deviation.
struct Chirps {
    /// `[frame, channel, loop, sample]`
    spectra: Grid<Complex64, 4>,
    /// `[channel, bin]`: mean over all frames.
    clutter: Grid<Complex64, 2>,
}

/// Of what is around the radar, and of what moves with it. None where the noise is unknown, or too few ranges have static returns.
pub fn deviations(evidence: &Evidence) -> Option<[Vec<Deviation>; 2]> {
    let chirps = Chirps::new(evidence)?;
    let width = (evidence.range_bins() / 16).max(4 + GAP);
    let touched = evidence.touched();
    let of_group = |g: usize| chirps.deviation(evidence, g * width..(g + 1) * width - GAP, &touched);
    let deviations: Vec<Deviation> = (0..evidence.range_bins() / width).into_par_iter().filter_map(of_group).collect();
    let (own, around): (Vec<Deviation>, Vec<Deviation>) = deviations.into_iter().partition(|deviation| deviation.group.is_own());
    (around.len() > 2).then_some([around, own])
}

impl Chirps {
    fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins, noise) = (evidence.cube.channels(), evidence.range_bins(), evidence.noise());
        if noise.iter().any(|variance| !variance.is_finite() || *variance <= 0.0) {
            return None;
        }
        let tapered = Tapered::new(samples);
        let mut spectra =
            Grid::filled(["frame", "channel", "loop", "sample"], [frames, channels, loops, samples], Complex64::ZERO);
        spectra.values_mut().par_chunks_exact_mut(loops * samples).enumerate().for_each(|(i, own)| {
            let [frame, channel] = [i / channels, i % channels];
            let scale = noise[channel].sqrt().recip();
            own.copy_from_slice(&tapered.spectra(evidence.cube.channel(frame, channel), scale));
        });
        let mut clutter = Grid::filled(["channel", "bin"], [channels, bins], Complex64::ZERO);
        for channel in 0..channels {
            for (frame, index) in (0..frames).flat_map(|frame| (0..loops).map(move |index| (frame, index))) {
                let sums = clutter.below_mut([channel]).iter_mut();
                let chirp = spectra.below([frame, channel, index]);
                sums.zip(chirp).for_each(|(sum, value)| *sum += value / (frames * loops) as f64);
            }
        }
        Some(Self { spectra, clutter })
    }

    fn power(&self, bin: usize) -> f64 {
        (0..self.clutter.shape()[0]).map(|channel| self.clutter[[channel, bin]].norm_sqr()).sum()
    }

    /// None where there is no static clutter.
    fn deviation(&self, evidence: &Evidence, range: std::ops::Range<usize>, touched: &[bool]) -> Option<Deviation> {
        let [frames, channels, loops, _] = self.spectra.shape();
        // As in `field`: static returns that are lost in the noise of a chirp teach nothing, nor do those that were changed.
        let own: Vec<usize> = range.clone().filter(|&bin| self.power(bin) > 3.0 * channels as f64 && !touched[bin]).collect();
        let group = Group::of(evidence, range, &own, |bin| self.power(bin))?;
        let sum: f64 = own.iter().map(|&bin| self.power(bin)).sum();
        let value = |[frame, index]: [usize; 2]| -> Complex64 {
            let along = |channel: usize| {
                let (values, mean) = (self.spectra.below([frame, channel, index]), self.clutter.below([channel]));
                own.iter().map(|&bin| mean[bin].conj() * (values[bin] - mean[bin])).sum::<Complex64>()
            };
            (0..channels).map(along).sum::<Complex64>() / sum
        };
        let values = (0..frames).flat_map(|frame| (0..loops).map(move |index| [frame, index])).map(value).collect();
        Some(Deviation { group, values, variance: BINS_PER_VALUE / sum })
    }
}
