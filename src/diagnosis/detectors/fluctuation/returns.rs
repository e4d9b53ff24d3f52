//! Static clutter, frame by frame, and what all of it does together.

use num_complex::Complex64;

use super::course::{Course, Data, Frames};
use crate::diagnosis::evidence::{Evidence, Tapered, blackman_harris};
use crate::diagnosis::statistics::chi2_tail;

/// Power of a static return over the noise of a frame's mean, summed over the channels, that is worth looking at.
const STRONG: f64 = 40.0;
/// Bins between two returns that are taken as different.
pub const SPACING: usize = 3;
/// Power within a frame, over the noise, from which on something moves there.
const QUIET: f64 = 1.3;
/// Share of the change that has the static return's own pattern across the channels.
const SAME_PATTERN: f64 = 0.4;
/// Share of the change that the body's silhouette must explain to be called its shadow; the rest is what the edges of the
/// body do to the clutter around.
const EXPLAINED: f64 = 0.6;
/// Fewest other returns to compare with.
const FEWEST_OTHERS: usize = 2;

/// Relative change of one static return, `[frame]`, and the variances of its parts.
#[derive(Clone, Debug)]
pub struct Series {
    pub change: Vec<Complex64>,
    pub variance: Vec<[f64; 2]>,
}

/// Mean chirp of every frame as a spectrum, and what the noise is worth in it.
pub struct Returns {
    bins: usize,
    pub channels: usize,
    /// `[frame, channel, bin]`
    spectra: Vec<Complex64>,
    /// `[channel, bin]`: mean over the training frames, and with what was subtracted of it.
    clutter: Vec<Complex64>,
    standing: Vec<Complex64>,
    /// Variance `[frame, channel, bin]`.
    variance: Vec<f64>,
    /// `[bin]`: of what changes within a frame, over the noise.
    unrest: Vec<f64>,
    /// `[bin]`: something was taken out there.
    touched: Vec<bool>,
}

impl Returns {
    /// None where the noise is unknown.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
        let fast = Tapered::new(samples);
        // Movers and the body's Doppler side lobes stay out of the mean.
        let slow = blackman_harris(loops);
        let sum: f64 = slow.iter().sum();
        let share: f64 = slow.iter().map(|w| (w / sum).powi(2)).sum();
        let noise = evidence.noise();
        if loops < 8 || noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        let (mut spectra, mut variance, mut unrest) = (vec![], vec![], vec![0.0; bins]);
        for frame in 0..frames {
            for (channel, noise) in noise.iter().enumerate() {
                let chirps = fast.spectra(evidence.cube.channel(frame, channel), 1.0);
                for bin in 0..bins {
                    let at = |index: usize| chirps[index * samples + bin];
                    let mean: Complex64 = (0..loops).map(|index| at(index) * (slow[index] / sum)).sum();
                    let own = (0..loops).map(|index| (at(index) - mean).norm_sqr()).sum::<f64>() / (loops as f64 - 1.0);
                    unrest[bin] += own / noise;
                    spectra.push(mean);
                    // Bursts and noise of any colour are in what one frame shows itself.
                    variance.push(own.max(*noise) * share);
                }
            }
        }
        unrest.iter_mut().for_each(|value| *value /= (frames * channels) as f64);
        let mut clutter = vec![Complex64::ZERO; channels * bins];
        for &frame in &evidence.split.training {
            clutter.iter_mut().zip(&spectra[frame * channels * bins..]).for_each(|(sum, value)| *sum += value);
        }
        clutter.iter_mut().for_each(|value| *value /= evidence.split.training.len() as f64);
        let mut standing = clutter.clone();
        if let Some(subtracted) = &evidence.subtracted {
            let gone = fast.spectra(subtracted, 1.0);
            let of_bins = gone.chunks_exact(samples).flat_map(|chirp| &chirp[..bins]);
            standing.iter_mut().zip(of_bins).for_each(|(value, gone)| *value += gone);
        }
        Some(Self { bins, channels, spectra, clutter, standing, variance, unrest, touched: evidence.touched() })
    }

    pub fn power(&self, bin: usize) -> f64 {
        (0..self.channels).map(|channel| self.standing[channel * self.bins + bin].norm_sqr()).sum()
    }

    /// Mean over the channels: they hardly differ.
    pub fn variance(&self, frame: usize, bin: usize) -> f64 {
        let of = |channel: usize| self.variance[(frame * self.channels + channel) * self.bins + bin];
        (0..self.channels).map(of).sum::<f64>() / self.channels as f64
    }

    /// Ranges where nothing moves within a frame, or was taken out.
    pub fn quiet(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.bins.saturating_sub(6)).filter(|&bin| self.unrest[bin] < QUIET && !self.touched[bin])
    }

    /// Power over what the noise is worth in a frame.
    fn level(&self, bin: usize, training: &[usize]) -> f64 {
        self.power(bin) * training.len() as f64 / training.iter().map(|&frame| self.variance(frame, bin)).sum::<f64>()
    }

    /// Static returns of some ranges, the strongest first.
    pub fn strong(&self, of: &[usize], training: &[usize]) -> Vec<usize> {
        let mut bins: Vec<usize> = of.iter().copied().filter(|&bin| self.level(bin, training) > STRONG).collect();
        bins.sort_by(|&a, &b| self.power(b).total_cmp(&self.power(a)));
        let mut kept: Vec<usize> = vec![];
        for bin in bins {
            if kept.iter().all(|other| other.abs_diff(bin) >= SPACING) {
                kept.push(bin);
            }
        }
        kept
    }

    fn deviation(&self, frame: usize, channel: usize, bin: usize) -> Complex64 {
        self.spectra[(frame * self.channels + channel) * self.bins + bin] - self.clutter[channel * self.bins + bin]
    }

    fn change(&self, frame: usize, bin: usize) -> Complex64 {
        let sum: Complex64 = (0..self.channels)
            .map(|channel| self.standing[channel * self.bins + bin].conj() * self.deviation(frame, channel, bin))
            .sum();
        sum / self.power(bin).max(f64::MIN_POSITIVE)
    }

    /// The part of a deviation that does not look across the channels as the return does.
    pub fn beside(&self, frame: usize, bin: usize) -> Vec<Complex64> {
        let change = self.change(frame, bin);
        let standing = |channel: usize| self.standing[channel * self.bins + bin];
        (0..self.channels).map(|channel| self.deviation(frame, channel, bin) - change * standing(channel)).collect()
    }

    /// A return's change beyond what those of some that are not beside it predict: a gain, a phase, and a phase in proportion to the
    /// delay.
    pub fn relative(&self, bin: usize, of: &[usize]) -> Option<Series> {
        let others: Vec<usize> = of.iter().copied().filter(|other| other.abs_diff(bin) >= SPACING).collect();
        if others.len() < FEWEST_OTHERS {
            return None;
        }
        let frames = self.spectra.len() / (self.channels * self.bins);
        let (mut change, mut variance) = (vec![], vec![]);
        for frame in 0..frames {
            let (mut gain, mut moments, mut phase) = (0.0, [0.0; 3], [0.0; 2]);
            for &other in &others {
                // Half of a complex variance is in each part.
                let weight = 2.0 * self.power(other) / self.variance(frame, other);
                let (value, delay) = (self.change(frame, other), other as f64);
                gain += weight * value.re;
                phase[0] += weight * value.im;
                phase[1] += weight * delay * value.im;
                moments[0] += weight;
                moments[1] += weight * delay;
                moments[2] += weight * delay * delay;
            }
            let determinant = moments[0] * moments[2] - moments[1] * moments[1];
            if determinant <= 1e-9 * moments[0] * moments[2] {
                return None;
            }
            let delay = bin as f64;
            let constant = (moments[2] * phase[0] - moments[1] * phase[1]) / determinant;
            let slope = (moments[0] * phase[1] - moments[1] * phase[0]) / determinant;
            let own = 0.5 * self.variance(frame, bin) / self.power(bin);
            let uncertain = (moments[2] - 2.0 * delay * moments[1] + delay * delay * moments[0]) / determinant;
            change.push(self.change(frame, bin) - Complex64::new(gain / moments[0], constant + slope * delay));
            variance.push([own + 1.0 / moments[0], own + uncertain]);
        }
        Some(Series { change, variance })
    }

    /// Whether the change looks across the channels as the return does: what comes from elsewhere does not.
    pub fn same_pattern(&self, bin: usize, series: &Series, training: &[usize]) -> bool {
        let (mut own, mut all) = (0.0, 0.0);
        for &frame in training {
            let variance = self.variance(frame, bin);
            let common = self.change(frame, bin) - series.change[frame];
            for channel in 0..self.channels {
                let standing = self.standing[channel * self.bins + bin];
                all += (self.deviation(frame, channel, bin) - common * standing).norm_sqr() / variance - 1.0;
            }
            own += series.change[frame].norm_sqr() * self.power(bin) / variance - 1.0;
        }
        own > SAME_PATTERN * all
    }
}

impl Series {
    /// Of both parts over their variances, in some frames.
    pub fn excess(&self, frames: &[usize]) -> [f64; 2] {
        frames.iter().fold([0.0; 2], |[re, im], &frame| {
            let (value, variance) = (self.change[frame], self.variance[frame]);
            [re + value.re.powi(2) / variance[0], im + value.im.powi(2) / variance[1]]
        })
    }

    /// Chance that nothing but noise changes; the mean over the training frames is zero by construction.
    pub fn p_value(&self, training: &[usize]) -> f64 {
        let [re, im] = self.excess(training);
        chi2_tail(re + im, 2.0 * (training.len() as f64 - 1.0))
    }

    /// The courses of both parts.
    pub fn courses(&self, frames: Frames) -> [Course; 2] {
        [0, 1].map(|of| {
            let part = |value: &Complex64| if of == 0 { value.re } else { value.im };
            let series = [self.change.iter().map(part).collect()];
            let noise: Vec<f64> = self.variance.iter().map(|variance| variance[of]).collect();
            Course::new(frames, &Data { series: &series, numbers: 1.0, noise: &noise })
        })
    }

    /// Log-likelihood gain of the courses in all frames, each predicted by the others, nats.
    pub fn nats(&self, frames: Frames) -> f64 {
        self.courses(frames).iter().map(|course| course.predicted).sum()
    }

    /// Whether the share of a return that is seen past the body, `[frame]`, explains the change, also in frames that the
    /// factor was not fitted on.
    pub fn follows(&self, seen: &[f64], Frames { training, held_out, .. }: Frames) -> bool {
        let mean = training.iter().map(|&frame| seen[frame]).sum::<f64>() / training.len() as f64;
        let energy: f64 = training.iter().map(|&frame| (seen[frame] - mean).powi(2)).sum();
        if energy < 1e-6 {
            return false;
        }
        let factor = training.iter().map(|&frame| self.change[frame] * (seen[frame] - mean)).sum::<Complex64>() / energy;
        let explained = |frames: &[usize]| {
            let (mut left, mut all, mut noise) = (0.0, 0.0, 0.0);
            for &frame in frames {
                left += (self.change[frame] - factor * (seen[frame] - mean)).norm_sqr();
                all += self.change[frame].norm_sqr();
                noise += self.variance[frame].iter().sum::<f64>();
            }
            1.0 - (left - noise).max(0.0) / (all - noise).max(f64::MIN_POSITIVE)
        };
        // A shadow weakens: more that is seen is more that returns.
        factor.re > factor.im.abs() && explained(training) >= EXPLAINED && explained(held_out) >= EXPLAINED
    }
}
