//! A phase of any course in time that the static returns of most ranges share, where nobody is tracked.
//!
//! Without a body whose returns could be set aside, something that moves may be stronger than everything that stands still. So no
//! mean over the ranges is taken: each range is foretold by the others, frequency by frequency of slow time, and a range that does
//! not share what they have is left out. Where ranges vary each for itself, the phases of their spectra are independent of one
//! another and uniform, whatever the spectra's magnitudes are. A bet on each phase (von Mises' law about the one that is foretold,
//! over the uniform law) has a mean of one then, and so has the product of bets in which each may depend on those before it: its
//! inverse is a p-value (Ville's inequality; Shafer, Testing by betting, Journal of the Royal Statistical Society A 184, 2021). No
//! course in time, no spectrum of the noise and no threshold is assumed.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::{FftDirection, FftPlanner};

use super::UNDECIDED;
use super::candidates::{self, Deviation};
use super::field::{Group, PATTERN, Part, ahead};
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics;
use crate::radar::SPEED_OF_LIGHT;

/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Bins over which the window correlates noise: a sum over bins has so many times the variance of as many independent ones.
const BINS_PER_VALUE: f64 = 2.0;
/// Shares of the concentration that a phase would have if a range shared everything: bets are placed on each, and on sharing nothing.
/// Powers of about three from next to nothing, since what a range adds of its own is not known.
const SHARES: [f64; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];
/// What a range would gain (nats) if it shared everything, for its silence to tell anything: as in `field`.
const TELLING_GAIN: f64 = 10.0;
/// Turns during the recording below which a course is a drift: as in `sway`.
const SLOWEST_TURNS: f64 = 1.5;

/// The deviation of a group of ranges, as a spectrum over slow time.
struct Spectrum {
    values: Vec<Complex64>,
    /// Of the noise in each of them.
    variance: f64,
}

/// What most ranges share.
struct Shared {
    part: Part,
    /// Logarithm of the product of bets.
    log_bets: f64,
    /// Ranges that share it, and those that could tell.
    sharing: usize,
    telling: usize,
    /// Its spectrum, and of each value how much more than noise it is.
    values: Vec<Complex64>,
    ratios: Vec<f64>,
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let course = Course::of(evidence);
    let deviations = deviations(evidence)?;
    let part = |part: Part| shared(&spectra(&deviations, &course, part), part);
    let (phase, delay) = (part(Part::Phase), part(Part::Delay));
    // Where ranges do not tell, what moves the radar goes before what moves its oscillator: it needs no second cause.
    let best = [Some(phase?), delay]
        .into_iter()
        .flatten()
        .reduce(|phase, delay| if delay.log_bets > phase.log_bets + UNDECIDED { delay } else { phase })?;
    // A bet is won by two ranges that hang together; all returns are concerned where most that can tell have it.
    (2 * best.sharing > best.telling && best.log_bets > 0.0).then(|| candidate(evidence, &course, &best))
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

    /// Unitary: white noise keeps its variance. Means over the whole and mirrored frequencies are left out.
    fn spectrum(&self, course: &[f64]) -> Vec<Complex64> {
        let half = |course: Vec<f64>, scale: f64| -> Vec<Complex64> {
            let count = course.len();
            let mut values: Vec<Complex64> = course.into_iter().map(Complex64::from).collect();
            FftPlanner::new().plan_fft(count, FftDirection::Forward).process(&mut values);
            values[1..count.div_ceil(2)].iter().map(|value| value * scale).collect()
        };
        if self.even {
            return half(course.to_vec(), (course.len() as f64).sqrt().recip());
        }
        let means: Vec<f64> =
            course.chunks_exact(self.loops).map(|frame| frame.iter().sum::<f64>() / self.loops as f64).collect();
        let mut values = half(means.clone(), (self.loops as f64 / self.frames as f64).sqrt());
        for (frame, mean) in course.chunks_exact(self.loops).zip(means) {
            values.extend(half(frame.iter().map(|value| value - mean).collect(), (self.loops as f64).sqrt().recip()));
        }
        values
    }

    /// The course that has such a spectrum.
    fn back(&self, values: &[Complex64]) -> Vec<f64> {
        let whole = |half: &[Complex64], count: usize, scale: f64| -> Vec<f64> {
            let mut all = vec![Complex64::ZERO; count];
            for (k, value) in half.iter().enumerate() {
                (all[k + 1], all[count - 1 - k]) = (*value, value.conj());
            }
            FftPlanner::new().plan_fft(count, FftDirection::Inverse).process(&mut all);
            all.into_iter().map(|value| value.re * scale).collect()
        };
        let count = self.frames * self.loops;
        if self.even {
            return whole(values, count, (count as f64).sqrt().recip());
        }
        let (of_means, within) = values.split_at(self.frames.div_ceil(2) - 1);
        let means = whole(of_means, self.frames, ((self.loops * self.frames) as f64).sqrt().recip());
        let each = self.loops.div_ceil(2) - 1;
        (0..self.frames)
            .flat_map(|frame| {
                let own = whole(&within[frame * each..][..each], self.loops, (self.loops as f64).sqrt().recip());
                let mean = means[frame];
                own.into_iter().map(move |value| mean + value)
            })
            .collect()
    }

    /// Frequency (Hz) of each value of a spectrum.
    fn frequencies_hz(&self) -> Vec<f64> {
        let half = |count: usize, period_s: f64| (1..count.div_ceil(2)).map(move |k| k as f64 / (count as f64 * period_s));
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

/// Of all groups, surest first; of a phase in proportion to the delay per second of it.
fn spectra(deviations: &Deviations, course: &Course, part: Part) -> Vec<Spectrum> {
    let of_group = |(group, values, variance): &(Group, Vec<Complex64>, f64)| {
        let lever = part.lever(group);
        let phases: Vec<f64> = values.iter().map(|value| value.im / lever).collect();
        // Half of a complex variance is in the phase; both parts of a phase's spectrum have half of that each.
        let variance = 0.5 * variance / (lever * lever);
        Spectrum { values: course.spectrum(&phases), variance }
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
        let (mut log_bets, mut sharing, mut telling) = (0.0, 0, 0);
        for spectrum in spectra.iter().enumerate().filter(|(index, _)| *index != first).map(|(_, spectrum)| spectrum) {
            let (won, most) = bet(&reference, spectrum);
            log_bets += won;
            if most > TELLING_GAIN {
                telling += 1;
                sharing += usize::from(won > 0.0);
            }
            if won > 0.0 {
                reference.add(spectrum);
            }
        }
        let all: Vec<(Complex64, f64)> = (0..reference.sum.len()).map(|index| reference.value(index)).collect();
        let (values, ratios) = all.into_iter().unzip();
        Shared { part, log_bets, sharing, telling, values, ratios }
    };
    let all: Vec<Shared> = (0..count).into_par_iter().map(of_first).collect();
    let log_bets = log_sum(all.iter().map(|shared| shared.log_bets)) - (count as f64).ln();
    let best = all.into_iter().max_by(|a, b| a.log_bets.total_cmp(&b.log_bets))?;
    Some(Shared { log_bets, ..best })
}

/// Logarithm of what a bet on a group's phases returns, and of what it would return if the group had what is foretold.
fn bet(reference: &Reference, spectrum: &Spectrum) -> (f64, f64) {
    let (mut returns, mut most) = ([0.0; SHARES.len() + 1], 0.0);
    for (index, value) in spectrum.values.iter().enumerate() {
        let (known, ratio) = reference.value(index);
        let kept = statistics::kept(ratio);
        let foretold = known * kept;
        let variance = spectrum.variance + kept / reference.information;
        let concentration = 2.0 * value.norm() * foretold.norm() / variance;
        if concentration > 0.0 {
            let along = (value * foretold.conj()).re / (value.norm() * foretold.norm());
            for (sum, share) in returns.iter_mut().zip(SHARES) {
                *sum += share * concentration * along - log_bessel_0(share * concentration);
            }
        }
        most += foretold.norm_sqr() / variance;
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

/// Share of a course's power that its slowest cosines have, up to so many turns (a type-II transform has no jump at the ends).
fn slow_share(course: &[f64]) -> f64 {
    let count = course.len() as f64;
    let most = (2.0 * SLOWEST_TURNS) as usize;
    let along = |k: usize| {
        let cosine = |i: usize| (std::f64::consts::PI * k as f64 * (i as f64 + 0.5) / count).cos();
        course.iter().enumerate().map(|(i, value)| value * cosine(i)).sum::<f64>().powi(2) * 2.0 / count
    };
    let all: f64 = course.iter().map(|value| value * value).sum();
    (1..=most).map(along).sum::<f64>() / all.max(f64::MIN_POSITIVE)
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

fn candidate(evidence: &Evidence, course: &Course, shared: &Shared) -> Candidate {
    let values: Vec<Complex64> =
        shared.values.iter().zip(&shared.ratios).map(|(v, ratio)| v * statistics::kept(*ratio)).collect();
    let phases = course.back(&values);
    let rms = (phases.iter().map(|phase| phase * phase).sum::<f64>() / phases.len() as f64).sqrt();
    let slow = slow_share(&phases);
    let [low_hz, frequency_hz, high_hz] = quartiles(&course.frequencies_hz(), &values);
    let width_hz = (0.5 * (high_hz - low_hz)).max(0.5 / course.duration_s());
    let loops = course.loops;
    let deviation: Deviation = Arc::new(move |[frame, _, index]| phases[frame * loops + index]);
    let spent = statistics::learned(shared.ratios.iter().copied()) * shared.ratios.len() as f64 / (course.frames * loops) as f64;
    let ranges = format!("{} of the {} ranges that can tell share it", shared.sharing, shared.telling);
    let (id, estimates, statement) = if shared.part == Part::Delay {
        let at_3_m = rms * candidates::stated_delay_s();
        (
            None,
            vec![],
            format!(
                "The phase of the static returns varies in proportion to their delay, by {at_3_m:.4} rad (standard deviation) at 3 m; {ranges}."
            ),
        )
    } else if slow > 0.5 {
        let text = format!(
            "The phase of the static returns drifts over the {:.1} s of the recording, by {rms:.4} rad (standard deviation), at all ranges \
             alike; {ranges}.",
            course.duration_s()
        );
        (None, vec![], text)
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
            "All static returns swing in phase together, by {rms:.4} rad (standard deviation) at {frequency_hz:.2} ± {width_hz:.2} Hz{alias}; \
             {ranges}: the radar itself vibrates, by {:.1} µm along its boresight (standard deviation).",
            1e6 * rms * metres
        );
        (Some("radar_vibration"), estimates, text)
    };
    Candidate {
        id,
        behaves_like: candidates::behaves_like(shared.part),
        estimates,
        choice: None,
        place: if id.is_some() { Place::at("scene") } else { candidates::place(shared.part) },
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
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::Radar;

    #[test]
    fn bessel_function_of_order_zero() {
        // Abramowitz and Stegun, table 9.8: e^-x I0(x).
        for (x, scaled) in
            [(0.1, 0.907_100_93), (1.0, 0.465_759_61), (3.0, 0.243_000_35), (5.0, 0.183_540_81), (10.0, 0.127_833_34)]
        {
            assert!((log_bessel_0(x) - x - f64::ln(scaled)).abs() < 1e-6, "{x}");
        }
        assert_eq!(log_bessel_0(0.0), 0.0);
    }

    /// Static returns at several ranges, of which those beyond the first turn by `phase` of the time.
    fn evidence(gap_s: f64, seed: u64, phase: impl Fn(f64) -> f64, own: impl Fn(f64, usize) -> f64) -> Evidence {
        let mut radar = Radar { samples_per_chirp: 96, loops_per_frame: 16, ..Radar::small(24) };
        radar.frame_period_s = radar.loops_per_frame as f64 * radar.loop_period_s() + gap_s;
        let clock = radar.clone();
        let bins = [3.0, 11.0, 20.0, 27.0, 34.0, 43.0, 52.0];
        Evidence::in_noise(radar, seed, move |[frame, channel, index, n]| {
            let time_s = clock.chirp_time_s(frame, 0, index);
            let range = |(i, bin): (usize, &f64)| {
                let turn = if i == 0 { 0.0 } else { phase(time_s) } + own(time_s, i);
                Complex64::from_polar(20.0 / (1 + i) as f64, TAU * bin * n as f64 / 96.0 + turn + (i * channel) as f64)
            };
            bins.iter().enumerate().map(range).sum()
        })
    }

    #[test]
    fn a_course_comes_back_from_its_spectrum() {
        for gap_s in [0.0, 0.02] {
            let course = Course::of(&evidence(gap_s, 1, |_| 0.0, |_, _| 0.0));
            assert_eq!(course.even, gap_s == 0.0);
            let values: Vec<f64> = (0..24 * 16).map(|i| (0.3 * i as f64).sin() + 0.2 * ((i / 16) as f64).cos()).collect();
            let spectrum = course.spectrum(&values);
            assert_eq!(spectrum.len(), course.frequencies_hz().len());
            // What is left out holds nothing a second time.
            let once = course.back(&spectrum);
            let twice = course.back(&course.spectrum(&once));
            assert!(once.iter().zip(&twice).all(|(a, b)| (a - b).abs() < 1e-9));
            let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
            let of_spectrum = 2.0 * spectrum.iter().map(Complex64::norm_sqr).sum::<f64>();
            assert!((square(&once) - of_spectrum).abs() < 1e-9 * of_spectrum);
        }
    }

    /// Every range by a course of its own, far stronger at one.
    fn own(time_s: f64, range: usize) -> f64 {
        0.05 * (1.0 + 10.0 * f64::from(u8::from(range == 1))) * (TAU * (7.0 + 1.7 * range as f64) * time_s + range as f64).sin()
    }

    #[test]
    fn a_phase_that_most_ranges_share_is_found_beside_what_moves_by_itself() {
        // No single line: three that are no multiples of one another.
        let shakes = |time_s: f64| 0.1 * [31.0, 37.7, 44.1].iter().map(|f| (TAU * f * time_s).sin()).sum::<f64>();
        for gap_s in [0.0, 0.02] {
            let found = find(&evidence(gap_s, 2, shakes, own)).expect("a shared phase");
            assert_eq!(found.id, Some("radar_vibration"), "{}", found.statement);
            assert!(found.p_value < 1e-6 && found.gain > 13.0, "{} {}", found.p_value, found.gain);
        }
        // Slower than the recording, it is a drift, which has no name.
        let duration_s = 24.0 * 16.0 * evidence(0.0, 1, |_| 0.0, own).radar.loop_period_s();
        let drifts = |time_s: f64| 0.4 * time_s / duration_s;
        let found = find(&evidence(0.0, 2, drifts, |_, _| 0.0)).expect("a drift");
        assert!(found.id.is_none() && found.p_value < 1e-6, "{}", found.statement);
    }

    #[test]
    fn ranges_that_vary_each_for_itself_share_nothing() {
        for seed in 0..12 {
            for gap_s in [0.0, 0.02] {
                let p_value = |evidence: &Evidence| find(evidence).map_or(1.0, |found| found.p_value);
                assert!(p_value(&evidence(gap_s, seed, |_| 0.0, |_, _| 0.0)) > 1e-3, "{seed}");
                assert!(p_value(&evidence(gap_s, seed, |_| 0.0, own)) > 1e-3, "{seed}");
            }
        }
    }
}
