//! A phase of any course in time that the static returns of most ranges share, where nobody is tracked.
//!
//! Without a body whose returns could be set aside, something that moves may be stronger than everything that stands still. So no
//! mean over the ranges is taken: each range is predicted by the others, frequency by frequency of slow time, and a range that does
//! not share what they have is left out. Where ranges vary each for itself, the phases of their spectra are independent of one
//! another and uniform, whatever the spectra's magnitudes are. A bet on each phase (von Mises' law about the one that is predicted,
//! over the uniform law) has a mean of one then, and so has the product of bets in which each may depend on those before it: its
//! inverse is a p-value (Ville's inequality; Shafer, Testing by betting, Journal of the Royal Statistical Society A 184, 2021). No
//! course in time, no spectrum of the noise and no threshold is assumed.
//!
//! Phases of neighbouring frequencies hang together where a course jumps from its end to its beginning: what is slow is taken out
//! first, and a sine tapers the rest, under which frequencies two apart are independent. Both halves of the frequencies then bet with
//! half of their winnings' logarithm (Cauchy and Schwarz: the mean of the root of a product is one at most).

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::{FftDirection, FftPlanner};

use super::candidates::{self, Deviation};
use super::field::{Group, PATTERN, Part, ahead};
use super::selection::UNDECIDED;
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};
use crate::radar::SPEED_OF_LIGHT;

/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Bins over which the window correlates noise: a sum over bins has so many times the variance of as many independent ones.
const BINS_PER_VALUE: f64 = 2.0;
/// Shares of the concentration that a phase would have if a range shared everything: bets are placed on each, and on sharing nothing.
/// Powers of about three from next to nothing, since what a range adds of its own is not known.
const SHARES: [f64; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];
/// What a range would gain (nats) if it shared everything, for its absence to be informative: as in `field`.
const INFORMATIVE_GAIN: f64 = 10.0;
/// Half turns up to which a course is slow: what turns less than one and a half times during a recording is a drift (as in
/// `platform_vibration`).
const SLOW: usize = 3;
/// Interleaved sets of frequencies, each of which is independent under the taper.
const SETS: f64 = 2.0;
/// First frequency of a stretch, in turns: slower ones are taken out.
const FIRST: usize = SLOW.div_ceil(2);

/// The deviation of a group of ranges, as a course and as a spectrum over slow time.
struct Spectrum {
    course: Vec<f64>,
    values: Vec<Complex64>,
    /// Of the noise in each of them.
    variance: f64,
}

/// What most ranges share.
struct Shared {
    part: Part,
    /// Logarithm of the product of bets.
    log_bets: f64,
    /// Ranges that share it, and those that are informative.
    sharing: usize,
    informative: usize,
    /// Those that share it, as places in the spectra.
    members: Vec<usize>,
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let course = Course::of(evidence);
    let deviations = deviations(evidence)?;
    let part = |part: Part| shared(&spectra(&deviations, &course, part), part);
    let (phase, delay) = (part(Part::Phase), part(Part::Delay));
    // Where ranges do not distinguish the two, what moves the radar goes before what moves its oscillator: it needs no second
    // cause.
    let best = [Some(phase?), delay]
        .into_iter()
        .flatten()
        .reduce(|phase, delay| if delay.log_bets > phase.log_bets + UNDECIDED { delay } else { phase })?;
    // A bet is won by two ranges that hang together; all returns are concerned where most that are informative have it.
    (2 * best.sharing > best.informative && best.log_bets > 0.0).then(|| candidate(evidence, &course, &deviations, &best))
}

/// Deviations of groups of ranges from their mean over time, relative to it, `[frame · loops + loop]`, with the noise's variance.
type Deviations = Vec<(Group, Vec<Complex64>, f64)>;

fn deviations(evidence: &Evidence) -> Option<Deviations> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let (channels, bins, noise) = (evidence.cube.channels(), evidence.range_bins(), evidence.noise());
    if noise.iter().any(|variance| !variance.is_finite() || *variance <= 0.0) {
        return None;
    }
    let tapered = Tapered::new(samples);
    let spectra: Vec<Vec<Complex64>> = (0..frames * channels)
        .into_par_iter()
        .map(|i| tapered.spectra(evidence.cube.channel(i / channels, i % channels), noise[i % channels].sqrt().recip()))
        .collect();
    let chirp = |frame: usize, channel: usize, index: usize| &spectra[frame * channels + channel][index * samples..][..bins];
    let mut still = vec![Complex64::ZERO; channels * bins];
    for (i, own) in still.chunks_exact_mut(bins).enumerate() {
        for (frame, index) in (0..frames).flat_map(|frame| (0..loops).map(move |index| (frame, index))) {
            own.iter_mut().zip(chirp(frame, i, index)).for_each(|(sum, value)| *sum += value / (frames * loops) as f64);
        }
    }
    let power = |bin: usize| (0..channels).map(|c| still[c * bins + bin].norm_sqr()).sum::<f64>();
    // As in `field`: static returns that are lost in the noise of a chirp teach nothing.
    let strong: Vec<bool> = (0..bins).map(|bin| power(bin) > 3.0 * channels as f64).collect();
    let width = (bins / 16).max(4 + GAP);
    let delay_of_bin = evidence.radar.sample_rate_hz / (samples as f64 * evidence.radar.slope_hz_per_s);
    let of_group = |start: usize| {
        let range = start * width..(start + 1) * width - GAP;
        let own: Vec<usize> = range.clone().filter(|&bin| strong[bin]).collect();
        let sum: f64 = own.iter().map(|&bin| power(bin)).sum();
        if sum <= 0.0 {
            return None;
        }
        let delay_s = own.iter().map(|&bin| power(bin) * bin as f64).sum::<f64>() / sum * delay_of_bin;
        let ahead = ahead(evidence.room.as_ref(), 0.5 * SPEED_OF_LIGHT * delay_s);
        let value = |i: usize| -> Complex64 {
            let along = |channel: usize| {
                let (values, mean) = (chirp(i / loops, channel, i % loops), &still[channel * bins..][..bins]);
                own.iter().map(|&bin| mean[bin].conj() * (values[bin] - mean[bin])).sum::<Complex64>()
            };
            (0..channels).map(along).sum::<Complex64>() / sum
        };
        let values = (0..frames * loops).map(value).collect();
        Some((Group { delay_s, ahead, bins: range }, values, BINS_PER_VALUE / sum))
    };
    let groups: Deviations = (0..bins / width).into_par_iter().filter_map(of_group).collect();
    (groups.len() > 2).then_some(groups)
}

/// How a course over all chirps is turned into values of independent phases and back: over all chirps where these follow one another
/// evenly, else over the frames' means and within each frame.
struct Course {
    frames: usize,
    loops: usize,
    even: bool,
    frame_s: f64,
    loop_s: f64,
}

impl Course {
    fn of(evidence: &Evidence) -> Self {
        let [frames, _, _, loops, _] = evidence.cube.dims;
        let loop_s = evidence.radar.loop_period_s();
        let starts = &evidence.starts_s;
        let frame_s = (starts[frames - 1] - starts[0]) / (frames - 1).max(1) as f64;
        let even = starts.windows(2).all(|pair| (pair[1] - pair[0] - loops as f64 * loop_s).abs() < 0.5 * loop_s);
        Self { frames, loops, even, frame_s, loop_s }
    }

    /// Stretches of even sampling: all chirps, or the frames' means (scaled to a chirp's noise) and each frame about its own.
    fn stretches(&self, course: &[f64]) -> Vec<Vec<f64>> {
        if self.even {
            return vec![course.to_vec()];
        }
        let root = (self.loops as f64).sqrt();
        let means: Vec<f64> = course.chunks_exact(self.loops).map(|frame| frame.iter().sum::<f64>() / root).collect();
        let within = course.chunks_exact(self.loops).zip(&means);
        let within: Vec<Vec<f64>> = within.map(|(frame, mean)| frame.iter().map(|value| value - mean / root).collect()).collect();
        std::iter::once(means).chain(within).collect()
    }

    /// The spectrum of each stretch without what is slow in it, under a taper; white noise keeps its variance.
    fn spectrum(&self, course: &[f64]) -> Vec<Complex64> {
        let of_stretch = |stretch: Vec<f64>| {
            let count = stretch.len();
            let taper = |i: usize| (2.0 / count as f64).sqrt() * (std::f64::consts::PI * (i as f64 + 0.5) / count as f64).sin();
            let left = without_slow(&stretch).into_iter().enumerate();
            let mut values: Vec<Complex64> = left.map(|(i, value)| Complex64::from(value * taper(i))).collect();
            FftPlanner::new().plan_fft(count, FftDirection::Forward).process(&mut values);
            values.into_iter().take(count.div_ceil(2)).skip(FIRST)
        };
        self.stretches(course).into_iter().flat_map(of_stretch).collect()
    }

    /// What of a course in white noise of a variance is no noise, by Wiener's filter.
    fn denoised(&self, course: &[f64], variance: f64) -> Vec<f64> {
        let mut stretches = self.stretches(course);
        for stretch in &mut stretches {
            let count = stretch.len();
            let mut values: Vec<Complex64> = stretch.iter().copied().map(Complex64::from).collect();
            let mut planner = FftPlanner::new();
            planner.plan_fft(count, FftDirection::Forward).process(&mut values);
            for value in &mut values {
                let ratio = (value.norm_sqr() / (count as f64 * variance) - 1.0).max(0.0);
                *value *= statistics::kept(ratio) / count as f64;
            }
            planner.plan_fft(count, FftDirection::Inverse).process(&mut values);
            stretch.iter_mut().zip(values).for_each(|(own, value)| *own = value.re);
        }
        if self.even {
            return stretches.swap_remove(0);
        }
        let root = (self.loops as f64).sqrt();
        let (means, within) = (&stretches[0], &stretches[1..]);
        means.iter().zip(within).flat_map(|(mean, frame)| frame.iter().map(move |value| mean / root + value)).collect()
    }

    /// Frequency (Hz) of each value of a spectrum.
    fn frequencies_hz(&self) -> Vec<f64> {
        let half = |count: usize, period_s: f64| (FIRST..count.div_ceil(2)).map(move |k| k as f64 / (count as f64 * period_s));
        if self.even {
            return half(self.frames * self.loops, self.loop_s).collect();
        }
        let within = (0..self.frames).flat_map(|_| half(self.loops, self.loop_s));
        half(self.frames, self.frame_s).chain(within).collect()
    }

    fn duration_s(&self) -> f64 {
        self.frames as f64 * if self.even { self.loops as f64 * self.loop_s } else { self.frame_s }
    }
}

/// What is left of a stretch once its slowest cosines are away (a type-II transform: they have no jump at the ends).
fn without_slow(stretch: &[f64]) -> Vec<f64> {
    let count = stretch.len();
    let mut left = stretch.to_vec();
    for k in 0..=SLOW.min(count - 1) {
        let cosine = |i: usize| (std::f64::consts::PI * k as f64 * (i as f64 + 0.5) / count as f64).cos();
        let square: f64 = (0..count).map(|i| cosine(i).powi(2)).sum();
        let along = left.iter().enumerate().map(|(i, value)| value * cosine(i)).sum::<f64>() / square;
        left.iter_mut().enumerate().for_each(|(i, value)| *value -= along * cosine(i));
    }
    left
}

/// Of all groups, surest first; of a phase in proportion to the delay per second of it.
fn spectra(deviations: &Deviations, course: &Course, part: Part) -> Vec<Spectrum> {
    let of_group = |(group, values, variance): &(Group, Vec<Complex64>, f64)| {
        let lever = part.lever(group);
        let phases: Vec<f64> = values.iter().map(|value| value.im / lever).collect();
        // Half of a complex variance is in the phase; both parts of a phase's spectrum have half of that each.
        let variance = 0.5 * variance / (lever * lever);
        Spectrum { values: course.spectrum(&phases), course: phases, variance }
    };
    let mut spectra: Vec<Spectrum> = deviations.par_iter().map(of_group).collect();
    spectra.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    spectra
}

/// What several groups say of a spectrum.
#[derive(Clone)]
struct Reference {
    sum: Vec<Complex64>,
    information: f64,
}

impl Reference {
    fn add(&mut self, spectrum: &Spectrum) {
        self.sum.iter_mut().zip(&spectrum.values).for_each(|(sum, value)| *sum += value / spectrum.variance);
        self.information += spectrum.variance.recip();
    }

    /// A value, and how much more than noise it is.
    fn value(&self, index: usize) -> (Complex64, f64) {
        let value = self.sum[index] / self.information;
        (value, (value.norm_sqr() * self.information - 1.0).max(0.0))
    }
}

/// Bets of all groups, each on those before it that share something, from each group as the first: their mean is a bet, too.
fn shared(spectra: &[Spectrum], part: Part) -> Option<Shared> {
    let count = spectra.len();
    let of_first = |first: usize| {
        let mut reference = Reference { sum: vec![Complex64::ZERO; spectra[first].values.len()], information: 0.0 };
        reference.add(&spectra[first]);
        let (mut log_bets, mut sharing, mut informative, mut members) = (0.0, 0, 0, vec![first]);
        for (index, spectrum) in spectra.iter().enumerate().filter(|(index, _)| *index != first) {
            let (won, most) = bet(&reference, spectrum);
            log_bets += won;
            if most > INFORMATIVE_GAIN {
                informative += 1;
                sharing += usize::from(won > 0.0);
            }
            if won > 0.0 {
                reference.add(spectrum);
                members.push(index);
            }
        }
        Shared { part, log_bets, sharing, informative, members }
    };
    let all: Vec<Shared> = (0..count).into_par_iter().map(of_first).collect();
    let log_bets = log_sum(all.iter().map(|shared| shared.log_bets)) - (count as f64).ln();
    let best = all.into_iter().max_by(|a, b| a.log_bets.total_cmp(&b.log_bets))?;
    Some(Shared { log_bets, ..best })
}

/// Logarithm of what a bet on a group's phases returns, and of what it would return if the group had what is predicted.
fn bet(reference: &Reference, spectrum: &Spectrum) -> (f64, f64) {
    let (mut returns, mut most) = ([0.0; SHARES.len() + 1], 0.0);
    for (index, value) in spectrum.values.iter().enumerate() {
        let (known, ratio) = reference.value(index);
        let kept = statistics::kept(ratio);
        let predicted = known * kept;
        let variance = spectrum.variance + kept / reference.information;
        let concentration = 2.0 * value.norm() * predicted.norm() / variance;
        if concentration > 0.0 {
            let along = (value * predicted.conj()).re / (value.norm() * predicted.norm());
            for (sum, share) in returns.iter_mut().zip(SHARES) {
                *sum += (share * concentration * along - log_bessel_0(share * concentration)) / SETS;
            }
        }
        most += predicted.norm_sqr() / variance / SETS;
    }
    (log_sum(returns.into_iter()) - (returns.len() as f64).ln(), most)
}

/// Logarithm of a sum of exponentials.
fn log_sum(logarithms: impl Iterator<Item = f64> + Clone) -> f64 {
    let top = logarithms.clone().fold(f64::NEG_INFINITY, f64::max);
    top + logarithms.map(|value| (value - top).exp()).sum::<f64>().ln()
}

/// ln I₀(x) of a positive number (Abramowitz and Stegun 1964, 9.8.1 and 9.8.2; errors below 2e-7).
fn log_bessel_0(x: f64) -> f64 {
    let polynomial = |t: f64, terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * t + term);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        return polynomial(t, &[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3]).ln();
    }
    let terms = [
        0.398_942_28,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    x - 0.5 * x.ln() + polynomial(3.75 / x, &terms).ln()
}

/// Frequencies below which a quarter, half and three quarters of a spectrum's power lie.
fn quartiles(frequencies_hz: &[f64], values: &[Complex64]) -> [f64; 3] {
    let mut powers: Vec<(f64, f64)> = frequencies_hz.iter().copied().zip(values.iter().map(Complex64::norm_sqr)).collect();
    powers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = powers.iter().map(|(_, power)| power).sum();
    [0.25, 0.5, 0.75].map(|share| {
        let mut sum = 0.0;
        let below = |&&(_, power): &&(f64, f64)| {
            sum += power;
            sum < share * all
        };
        let count = powers.iter().take_while(below).count();
        powers[count.min(powers.len() - 1)].0
    })
}

fn candidate(evidence: &Evidence, course: &Course, deviations: &Deviations, shared: &Shared) -> Candidate {
    let spectra = spectra(deviations, course, shared.part);
    let members: Vec<&Spectrum> = shared.members.iter().map(|&index| &spectra[index]).collect();
    let information: f64 = members.iter().map(|member| member.variance.recip()).sum();
    let count = course.frames * course.loops;
    let mean = |i: usize| members.iter().map(|member| member.course[i] / member.variance).sum::<f64>() / information;
    let phases = course.denoised(&(0..count).map(mean).collect::<Vec<f64>>(), information.recip());
    let values = course.spectrum(&phases);
    // A spectrum has one of two sides.
    let rms = (2.0 * values.iter().map(Complex64::norm_sqr).sum::<f64>() / count as f64).sqrt();
    let ratios = values.iter().map(|value| value.norm_sqr() * information);
    let spent = statistics::learned(ratios.collect::<Vec<f64>>().into_iter()) * values.len() as f64 / count as f64;
    let [low_hz, frequency_hz, high_hz] = quartiles(&course.frequencies_hz(), &values);
    let width_hz = (0.5 * (high_hz - low_hz)).max(0.5 / course.duration_s());
    let loops = course.loops;
    let deviation: Deviation = Arc::new(move |[frame, _, index]| phases[frame * loops + index]);
    let ranges = format!("{} of the {} informative ranges share it", shared.sharing, shared.informative);
    let (id, estimates, statement) = if shared.part == Part::Delay {
        let at_3_m = rms * candidates::stated_delay_s();
        (
            None,
            vec![],
            format!(
                "The phase of the static returns varies in proportion to their delay, by {at_3_m:.4} rad (standard deviation) at 3 m; {ranges}."
            ),
        )
    } else {
        let metres = evidence.radar.wavelength_m() / (4.0 * std::f64::consts::PI);
        let amplitude_m = std::f64::consts::SQRT_2 * rms * metres;
        let estimates = vec![
            Estimate::normal("amplitude_m", amplitude_m, amplitude_m * PATTERN),
            Estimate::normal("frequency_hz", frequency_hz, width_hz),
        ];
        let alias = if course.even {
            String::new()
        } else {
            format!(" (or that beside a multiple of {:.2} Hz, the rate of the frames)", course.frame_s.recip())
        };
        let text = format!(
            "The phases of all static returns fluctuate together, by {rms:.4} rad (standard deviation) at {frequency_hz:.2} ± \
             {width_hz:.2} Hz{alias}; {ranges}: the radar itself vibrates, by {:.1} µm along its boresight (standard deviation).",
            1e6 * rms * metres
        );
        (Some(effects::radar_vibration::ID), estimates, text)
    };
    Candidate {
        id,
        behaves_like: candidates::behaves_like(shared.part),
        estimates,
        choice: None,
        place: if id.is_some() { Place::at(Stage::Scene) } else { candidates::place(shared.part) },
        p_value: (-shared.log_bets).exp().min(1.0),
        gain: shared.log_bets,
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: None,
        energy: rms * rms * course.frames as f64 * loops as f64 * evidence.still().iter().map(|v| v.norm_sqr()).sum::<f64>(),
        correction: candidates::correction(evidence, shared.part, deviation, spent),
    }
}

#[cfg(test)]
#[path = "shared_tests.rs"]
mod tests;
