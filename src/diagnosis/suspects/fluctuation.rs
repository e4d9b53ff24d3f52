//! Static returns that change while others stay: one that swings at one frequency (`hum`), and one behind the body that
//! changes from frame to frame, because the body's shadow falls on it (card T7) or it stirs itself.
//!
//! Of the latter: what all static returns do together (gain, phase, a phase in proportion to the delay) is somebody else's
//! affair and is taken from the other returns, frame by frame. Only the strong ranges beyond the body's reach are looked
//! at, where nothing moves within a frame; a change must keep the pattern that the return has across the receivers.

mod hum;
mod silhouette;

use std::sync::Arc;

use num_complex::Complex64;
use rustfft::FftPlanner;

use crate::diagnosis::evidence::{Evidence, Tapered, blackman_harris};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Place, Rung};
use crate::diagnosis::statistics::{DECIBEL, chi2_tail, corrected};

/// Metres around the body's surface that its own slow returns may reach.
const MARGIN_M: f64 = 0.4;
/// Power of a static return over the noise of a frame's mean, summed over the channels, that is worth looking at.
const STRONG: f64 = 40.0;
/// Bins between two returns that are taken as different.
const SPACING: usize = 3;
/// Power within a frame, over the noise, from which on something moves there.
const QUIET: f64 = 1.3;
/// Share of the change that has the static return's own pattern across the channels.
const SAME_PATTERN: f64 = 0.4;
/// Share of the change that the body's silhouette must explain to be called its shadow; the rest is what the edges of the
/// body do to the clutter around.
const EXPLAINED: f64 = 0.6;
/// Fewest training frames.
const FEWEST: usize = 6;
/// Fewest other returns to compare with.
const FEWEST_OTHERS: usize = 2;
pub const BEHAVES_LIKE: &str = "static returns that change at one range";
pub const ID: &str = "soft_occlusion";

/// Relative change of one static return, `[frame]`, and the variances of its parts.
#[derive(Clone, Debug)]
struct Series {
    change: Vec<Complex64>,
    variance: Vec<[f64; 2]>,
}

/// Mean chirp of every frame as a spectrum, and what the noise is worth in it.
struct Returns {
    bins: usize,
    channels: usize,
    /// `[frame, channel, bin]`
    spectra: Vec<Complex64>,
    /// `[channel, bin]`: mean over the training frames.
    still: Vec<Complex64>,
    /// Variance `[frame, channel, bin]`.
    variance: Vec<f64>,
    /// `[bin]`: of what is not still within a frame, over the noise.
    unrest: Vec<f64>,
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    judged(evidence).into_iter().chain(hum::find(evidence)).collect()
}

fn judged(evidence: &Evidence) -> Option<Candidate> {
    let body = evidence.body.as_ref()?;
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let known = [BEHAVES_LIKE, ID].iter().any(|id| evidence.accepted.contains(id));
    if known || training.len() < FEWEST || held_out.is_empty() {
        return None;
    }
    let centre = evidence.radar.centre_m();
    let distance = |at: [f64; 3]| (0..3).map(|axis| (at[axis] - centre[axis]).powi(2)).sum::<f64>().sqrt();
    let points = body.frames.iter().flatten().map(|point| distance(point.position_m));
    let [near_m, far_m] = points.fold([f64::MAX, 0.0], |[near, far]: [f64; 2], d| [near.min(d), far.max(d)]);
    if far_m <= 0.0 {
        return None;
    }
    let returns = Returns::new(evidence)?;
    let bin_m = evidence.radar.range_resolution_m();
    let all = returns.strong(training);
    let range = |bin: usize| bin as f64 * bin_m;
    let usable: Vec<usize> =
        all.into_iter().filter(|&bin| range(bin) < near_m - MARGIN_M || range(bin) > far_m + MARGIN_M).collect();
    let behind: Vec<usize> = usable.iter().copied().filter(|&bin| range(bin) > far_m + MARGIN_M).collect();
    let best = behind
        .iter()
        .filter_map(|&bin| {
            let others: Vec<usize> = usable.iter().copied().filter(|&other| other != bin).collect();
            let series = returns.relative(bin, &others)?;
            let p_value = corrected(series.p_value(training), behind.len() as f64);
            let gain = series.gain(training, held_out);
            (p_value < 0.01 && gain > 0.0 && returns.same_pattern(bin, &series, training)).then_some((bin, series, p_value, gain))
        })
        .max_by(|a, b| a.3.total_cmp(&b.3))?;
    let (bin, series, p_value, gain) = best;
    let seen = silhouette::seen(evidence, body, range(bin), 1.5 * bin_m);
    let named = seen.is_some_and(|seen| series.follows(&seen, training, held_out));
    Some(candidate(evidence, bin, &series, named, p_value, gain))
}

impl Returns {
    /// None where the noise is unknown.
    fn new(evidence: &Evidence) -> Option<Self> {
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
        let mut still = vec![Complex64::ZERO; channels * bins];
        for &frame in &evidence.split.training {
            still.iter_mut().zip(&spectra[frame * channels * bins..]).for_each(|(sum, value)| *sum += value);
        }
        still.iter_mut().for_each(|value| *value /= evidence.split.training.len() as f64);
        Some(Self { bins, channels, spectra, still, variance, unrest })
    }

    fn power(&self, bin: usize) -> f64 {
        (0..self.channels).map(|channel| self.still[channel * self.bins + bin].norm_sqr()).sum()
    }

    /// Mean over the channels: they hardly differ.
    fn variance(&self, frame: usize, bin: usize) -> f64 {
        let of = |channel: usize| self.variance[(frame * self.channels + channel) * self.bins + bin];
        (0..self.channels).map(of).sum::<f64>() / self.channels as f64
    }

    /// Static returns where nothing moves, the strongest first.
    fn strong(&self, training: &[usize]) -> Vec<usize> {
        let level = |bin: usize| {
            let variance = training.iter().map(|&frame| self.variance(frame, bin)).sum::<f64>() / training.len() as f64;
            self.power(bin) / variance
        };
        let mut bins: Vec<usize> =
            (0..self.bins.saturating_sub(6)).filter(|&bin| level(bin) > STRONG && self.unrest[bin] < QUIET).collect();
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
        self.spectra[(frame * self.channels + channel) * self.bins + bin] - self.still[channel * self.bins + bin]
    }

    fn change(&self, frame: usize, bin: usize) -> Complex64 {
        let sum: Complex64 = (0..self.channels)
            .map(|channel| self.still[channel * self.bins + bin].conj() * self.deviation(frame, channel, bin))
            .sum();
        sum / self.power(bin).max(f64::MIN_POSITIVE)
    }

    /// A return's change beyond what the others predict: a gain, a phase, and a phase in proportion to the delay.
    fn relative(&self, bin: usize, others: &[usize]) -> Option<Series> {
        if others.len() < FEWEST_OTHERS {
            return None;
        }
        let frames = self.spectra.len() / (self.channels * self.bins);
        let (mut change, mut variance) = (vec![], vec![]);
        for frame in 0..frames {
            let (mut gain, mut moments, mut phase) = (0.0, [0.0; 3], [0.0; 2]);
            for &other in others {
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
    fn same_pattern(&self, bin: usize, series: &Series, training: &[usize]) -> bool {
        let (mut own, mut all) = (0.0, 0.0);
        for &frame in training {
            let variance = self.variance(frame, bin);
            let common = self.change(frame, bin) - series.change[frame];
            for channel in 0..self.channels {
                let still = self.still[channel * self.bins + bin];
                all += (self.deviation(frame, channel, bin) - common * still).norm_sqr() / variance - 1.0;
            }
            own += series.change[frame].norm_sqr() * self.power(bin) / variance - 1.0;
        }
        own > SAME_PATTERN * all
    }
}

impl Series {
    /// Of both parts over their variances, in some frames.
    fn excess(&self, frames: &[usize]) -> [f64; 2] {
        frames.iter().fold([0.0; 2], |[re, im], &frame| {
            let (value, variance) = (self.change[frame], self.variance[frame]);
            [re + value.re.powi(2) / variance[0], im + value.im.powi(2) / variance[1]]
        })
    }

    /// Chance that nothing but noise changes; the mean over the training frames is zero by construction.
    fn p_value(&self, training: &[usize]) -> f64 {
        let [re, im] = self.excess(training);
        chi2_tail(re + im, 2.0 * (training.len() as f64 - 1.0))
    }

    /// Held-out gain of changes of a variance that the training frames tell, nats.
    fn gain(&self, training: &[usize], held_out: &[usize]) -> f64 {
        let freedom = training.len() as f64 - 1.0;
        let part = |of: usize| -> f64 {
            let value = |frame: usize| if of == 0 { self.change[frame].re } else { self.change[frame].im };
            let square: f64 = training.iter().map(|&frame| value(frame).powi(2)).sum::<f64>() / freedom;
            let noise: f64 = training.iter().map(|&frame| self.variance[frame][of]).sum::<f64>() / training.len() as f64;
            let own = (square - noise).max(0.0);
            held_out
                .iter()
                .map(|&frame| {
                    let ratio = 1.0 + own / self.variance[frame][of];
                    0.5 * (value(frame).powi(2) / self.variance[frame][of] * (1.0 - 1.0 / ratio) - ratio.ln())
                })
                .sum()
        };
        part(0) + part(1)
    }

    /// Whether the share of a return that is seen past the body, `[frame]`, explains the change, also in frames that the
    /// factor was not fitted on.
    fn follows(&self, seen: &[f64], training: &[usize], held_out: &[usize]) -> bool {
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

fn candidate(evidence: &Evidence, bin: usize, series: &Series, named: bool, p_value: f64, gain: f64) -> Candidate {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = bin as f64 * bin_m;
    let echo = around(evidence, bin);
    let own: f64 = echo.iter().map(|value| value.norm_sqr()).sum();
    let square: f64 = series.change.iter().map(|value| value.norm_sqr()).sum();
    let rms = (square / series.change.len() as f64).sqrt();
    let change = series.change.clone();
    let decibel: Vec<f64> = change.iter().map(|v| DECIBEL * (1.0 + v).norm().max(1e-3).ln()).collect();
    let [low, high] = decibel.iter().fold([f64::MAX, f64::MIN], |[l, h], &v| [l.min(v), h.max(v)]);
    let why = if named {
        "when the body's silhouette covers it: the body casts a shadow on the room."
    } else {
        "and the body's silhouette alone does not explain it: something stirs there, or passes in front of it."
    };
    Candidate {
        id: named.then_some(ID),
        behaves_like: BEHAVES_LIKE,
        estimates: vec![],
        choice: None,
        place: Place {
            range_m: Some([range_m - 1.5 * bin_m, range_m + 1.5 * bin_m]),
            velocity_mps: Some([0.0, 0.0]),
            ..Place::at(if named { "propagation" } else { "scene" })
        },
        p_value: p_value.max(f64::MIN_POSITIVE),
        gain,
        rung: Rung::F,
        look_alikes: vec![],
        statement: format!(
            "The static return {range_m:.2} m away changes from frame to frame by {:.0} % (over {:.1} dB) while the other static \
             returns stay, {why}",
            100.0 * rms,
            high - low
        ),
        curve: Some(Curve {
            title: format!("Static return {range_m:.2} m away, relative to the others"),
            x_label: "time, s".into(),
            y_label: "level, dB".into(),
            series: vec![("measured".into(), evidence.starts_s.clone(), decibel)],
        }),
        energy: own * square * loops as f64,
        correction: Correction::Samples(Arc::new(move |cube| {
            cube.each_chirp(|[frame, channel, _], chirp| {
                let echo = &echo[channel * samples..][..samples];
                chirp.iter_mut().zip(echo).for_each(|(value, echo)| *value -= change[frame] * echo);
            });
        })),
    }
}

/// The part of the static returns that lies within two bins of one, `[channel, sample]`.
fn around(evidence: &Evidence, bin: usize) -> Vec<Complex64> {
    const REACH: usize = 2;
    let samples = evidence.cube.dims[4];
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
    let mut echo = evidence.still().to_vec();
    forward.process(&mut echo);
    for (i, value) in echo.iter_mut().enumerate() {
        *value *= if (i % samples).abs_diff(bin) <= REACH { 1.0 / samples as f64 } else { 0.0 };
    }
    inverse.process(&mut echo);
    echo
}

#[cfg(test)]
mod tests;
