//! Spectra of static clutter, which every chirp is compared with.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::Complex64;

use super::part::Group;
use crate::diagnosis::evidence::{Evidence, blackman_harris};
use crate::grid::Grid;

/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Power over the noise that a cell without a mover may have; its law is narrower than this.
const CLEAN: f64 = 1.25;
/// Share of a deviation's power across the channels that may lie aside of the static return's: a strong phase that all
/// share leaves as much where one cell holds returns from several directions.
const ASIDE: f64 = 0.03;
/// Bins beside the body that are not free of it.
const MARGIN: usize = 2;

/// Spectra under a taper, in units of the noise's deviation.
pub struct ClutterSpectra<'a> {
    evidence: &'a Evidence,
    taper: Vec<f64>,
    fft: Arc<dyn Fft<f64>>,
    /// `[channel, bin]`
    mean: Grid<Complex64, 2>,
    /// `[bin]`, sum over the channels.
    power: Vec<f64>,
    /// `[bin]`: something was taken out there.
    touched: Vec<bool>,
}

/// Of a frame: deviations relative to the static returns, `[loop, group]`, and their inverse variances, `[group]`; zero where nothing
/// can be said.
pub struct OfFrame {
    pub deviation: Grid<Complex64, 2>,
    pub weight: Vec<f64>,
}

impl<'a> ClutterSpectra<'a> {
    /// None where the noise is unknown.
    pub fn new(evidence: &'a Evidence) -> Option<Self> {
        let (channels, samples) = (evidence.cube.channels(), evidence.cube.dims[4]);
        let noise = evidence.noise();
        if noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        let taper = blackman_harris(samples);
        let fft = FftPlanner::new().plan_fft_forward(samples);
        let mut mean: Vec<Complex64> = evidence.clutter().iter().enumerate().map(|(i, v)| v * taper[i % samples]).collect();
        fft.process(&mut mean);
        for (channel, spectrum) in mean.chunks_exact_mut(samples).enumerate() {
            spectrum.iter_mut().for_each(|v| *v /= noise[channel].sqrt());
        }
        let mean = Grid::new(["channel", "bin"], [channels, samples], mean);
        let power = (0..evidence.range_bins()).map(|bin| (0..channels).map(|c| mean[[c, bin]].norm_sqr()).sum::<f64>()).collect();
        Some(Self { evidence, taper, fft, mean, power, touched: evidence.touched() })
    }

    fn channels(&self) -> usize {
        self.mean.shape()[0]
    }

    /// Whether a static return is not lost in the noise of a chirp: else it teaches nothing.
    fn is_strong(&self, bin: usize) -> bool {
        self.power[bin] > 3.0 * self.channels() as f64
    }

    /// Groups of ranges with static returns.
    pub fn groups(&self) -> Vec<Group> {
        let bins = self.power.len();
        let width = (bins / 16).max(4 + GAP);
        let group = |g: usize| {
            let range = g * width..(g + 1) * width - GAP;
            let strong: Vec<usize> = range.clone().filter(|&bin| self.is_strong(bin)).collect();
            Group::of(self.evidence, range, &strong, |bin| self.power[bin])
        };
        (0..bins / width).filter_map(group).collect()
    }

    pub fn of_frame(&self, frame: usize, groups: &[Group]) -> OfFrame {
        let loops = self.evidence.cube.dims[3];
        let moving = self.moving(frame);
        let clean = self.clean(&moving);
        let mut deviation = Grid::filled(["loop", "group"], [loops, groups.len()], Complex64::ZERO);
        let mut weight = vec![0.0; groups.len()];
        for (g, group) in groups.iter().enumerate() {
            let used: Vec<usize> = group.bins.clone().filter(|&bin| clean[bin]).collect();
            let own: f64 = used.iter().map(|&bin| self.power[bin]).sum();
            if own <= 0.0 {
                continue;
            }
            for index in 0..loops {
                deviation[[index, g]] = self.along(&moving, &used, index) / own;
            }
            weight[g] = own * own / self.variance_along(&used);
        }
        OfFrame { deviation, weight }
    }

    /// What of a frame is not static, `[channel, loop, bin]`.
    fn moving(&self, frame: usize) -> Grid<Complex64, 3> {
        let [_, _, _, loops, samples] = self.evidence.cube.dims;
        let mut spectra: Vec<Complex64> = Vec::with_capacity(self.channels() * loops * samples);
        for (channel, variance) in self.evidence.noise().iter().enumerate() {
            let scale = 1.0 / variance.sqrt();
            for chirp in self.evidence.cube.channel(frame, channel).chunks_exact(samples) {
                spectra.extend(chirp.iter().zip(&self.taper).map(|(value, w)| value * (w * scale)));
            }
        }
        self.fft.process(&mut spectra);
        for (chirp, spectrum) in spectra.chunks_exact_mut(samples).enumerate() {
            let mean = self.mean.below([chirp / loops]);
            spectrum.iter_mut().zip(mean).for_each(|(value, mean)| *value -= mean);
        }
        Grid::new(["channel", "loop", "bin"], [self.channels(), loops, samples], spectra)
    }

    /// Bins of strong static returns where nothing moves, nor right beside.
    fn clean(&self, moving: &Grid<Complex64, 3>) -> Vec<bool> {
        let [channels, loops, _] = moving.shape();
        let bins = self.power.len();
        let aside: Vec<f64> = (0..bins).map(|bin| self.aside(moving, bin)).collect();
        // The law of a mean of so many powers, five deviations wide.
        let freedom = (loops * (channels - 1).max(1)) as f64;
        let limit = CLEAN.max(1.0 + 5.0 / freedom.sqrt());
        let quiet = |bin: usize| aside[bin] < limit && !self.touched[bin];
        (0..bins).map(|bin| self.is_strong(bin) && (bin.saturating_sub(1)..(bin + 2).min(bins)).all(quiet)).collect()
    }

    /// Power over the noise of what does not come from where the static return comes from: a mover does not, and what is left across
    /// the channels shows it; a gain that all share does. Of one channel, what changes within the frame.
    fn aside(&self, moving: &Grid<Complex64, 3>, bin: usize) -> f64 {
        let [channels, loops, _] = moving.shape();
        let (mut all, mut along, mut sum) = (0.0, 0.0, Complex64::ZERO);
        for index in 0..loops {
            let mut dot = Complex64::ZERO;
            for channel in 0..channels {
                let value = moving[[channel, index, bin]];
                all += value.norm_sqr();
                sum += value;
                dot += self.mean[[channel, bin]].conj() * value;
            }
            along += dot.norm_sqr() / self.power[bin].max(f64::MIN_POSITIVE);
        }
        match (channels, loops) {
            (1, 1) => all,
            (1, _) => (all - sum.norm_sqr() / loops as f64) / (loops - 1) as f64,
            _ if all - along < ASIDE * all => 0.0,
            _ => (all - along) / ((channels - 1) * loops) as f64,
        }
    }

    /// What some bins of a chirp have of the static returns.
    fn along(&self, moving: &Grid<Complex64, 3>, bins: &[usize], index: usize) -> Complex64 {
        let mut dot = Complex64::ZERO;
        for &bin in bins {
            for channel in 0..self.channels() {
                dot += self.mean[[channel, bin]].conj() * moving[[channel, index, bin]];
            }
        }
        dot
    }

    /// Variance of that sum of windowed, hence correlated cells, with white noise in the samples.
    fn variance_along(&self, bins: &[usize]) -> f64 {
        let [channels, samples] = self.mean.shape();
        let mut variance = 0.0;
        for channel in 0..channels {
            let mut filter = vec![Complex64::ZERO; samples];
            for &bin in bins {
                filter[bin] = self.mean[[channel, bin]].conj();
            }
            self.fft.process(&mut filter);
            variance += filter.iter().zip(&self.taper).map(|(h, w)| h.norm_sqr() * w * w).sum::<f64>();
        }
        variance
    }
}

/// Ranges at which the body is not, in one frame.
pub fn free(evidence: &Evidence, frame: usize, bins: usize) -> Vec<bool> {
    let samples = evidence.cube.dims[4];
    let Some(model) = evidence.power() else { return vec![true; bins] };
    let mut free = vec![true; bins];
    for (cell, _) in model.support(frame).iter().enumerate().filter(|(_, there)| **there) {
        let range = cell % samples;
        (range.saturating_sub(MARGIN)..(range + MARGIN + 1).min(bins)).for_each(|near| free[near] = false);
    }
    free
}
