//! A static return that is modulated at one frequency while the others are constant: a lamp, a motor, a screen.
//!
//! Its two sidebands are alike and go on from frame to frame. What moves there has other phases in every frame, so the
//! frames' own scatter is what a line must stand out of. A lamp shines on all that is around it, so ranges are looked at
//! together, too.

use std::cmp::Ordering;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::sinusoid::Sinusoid;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics::{corrected, fisher_tail};
use crate::effects::Stage;

/// Slower modulations belong to people, faster ones to electronics.
const LOWEST_HZ: f64 = 20.0;
const HIGHEST_HZ: f64 = 500.0;
/// Part of a turn that a frame must see: less of it is a slope, which a slow body has, too.
const OF_TURN: f64 = 0.5;
/// Frequencies per resolution cell of the recording.
const FINE: f64 = 4.0;
/// Frequencies per resolution cell of a frame at which its amplitude is worked out.
const COARSE: f64 = 8.0;
/// Share of one sideband's power that the other has at least.
const ALIKE: f64 = 0.3;
/// Neighbouring ranges that are looked at together, and how many of them one return fills under the taper.
const TOGETHER: [usize; 3] = [1, 6, 20];
const OF_ONE: f64 = 2.0;
/// Least power over the scatter that is looked at.
const LEAST_RATIO: f64 = 1.5;
/// Bins to either side that a return reaches under the taper.
const REACH: usize = 3;
/// Ranges to either side that may be modulated with it, and by how much more than by chance they must.
const WIDEST: usize = 16;
const PLAIN: f64 = 20.0;
/// Share of its modulation depth that all other static returns have at most, but for so many standard deviations: else it is the
/// receiver's own amplitude modulation. And how much less likely (nats) it must be that they are modulated as deeply.
const OTHERS: f64 = 0.3;
const CHANCE: f64 = 2.0;
const SURELY: f64 = 12.0;
/// Share of the static returns' power that lies elsewhere at least: without it, noise would say whether it is the receiver's.
const ELSEWHERE: f64 = 0.01;
const FEWEST_FRAMES: usize = 5;
const REFINEMENTS: usize = 16;

/// Chirps without what is static during a frame, by range, and when they were: what changes from frame to frame is no such
/// modulation.
struct Chirps<'a> {
    evidence: &'a Evidence,
    bins: usize,
    /// Static returns, `[channel · bin]`.
    still: Vec<Complex64>,
    /// `[frame][loop · channel · bin]`
    spectra: Vec<Vec<Complex64>>,
    /// First and last of ranges that are looked at together.
    windows: Vec<[usize; 2]>,
    /// Of the loops relative to their frame's middle.
    loops_s: Vec<f64>,
    /// Of the frames' middles.
    middles_s: Vec<f64>,
}

/// Amplitudes of both sidebands in every frame, `[sideband][frame · channel · bin]`.
type Sidebands = [Vec<Complex64>; 2];

#[derive(Clone, Copy)]
struct Line {
    frequency_hz: f64,
    /// The ranges looked at together.
    first: usize,
    last: usize,
    /// Power of the training frames' mean over what their scatter makes of it.
    ratio: f64,
    /// How often chance makes it there and at that frequency.
    chance: f64,
}

/// A complex depth with its variance.
struct Depth {
    mean: Complex64,
    variance: f64,
}

impl Line {
    fn weaker(&self, other: &Self) -> Ordering {
        other.chance.total_cmp(&self.chance).then(self.ratio.total_cmp(&other.ratio))
    }

    fn bins(&self) -> RangeInclusive<usize> {
        self.first..=self.last
    }

    fn middle(&self) -> f64 {
        0.5 * (self.first + self.last) as f64
    }
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let training = &evidence.split.training;
    if training.len() < FEWEST_FRAMES
        || evidence.split.held_out.is_empty()
        || evidence.accepted_unnamed.contains(&Behaviour::Modulated)
    {
        return None;
    }
    let chirps = Chirps::new(evidence)?;
    let duration_s = chirps.middles_s[training[training.len() - 1]] - chirps.middles_s[training[0]];
    let [lowest_hz, highest_hz] = chirps.band_hz();
    if duration_s * lowest_hz < FEWEST_FRAMES as f64 || highest_hz <= lowest_hz {
        return None;
    }
    let coarse = 1.0 / (COARSE * chirps.frame_s());
    let fine = 1.0 / (FINE * duration_s);
    let cells = ((highest_hz - lowest_hz) / coarse).ceil() as usize;
    let strongest = |cell: usize| {
        let start = lowest_hz + cell as f64 * coarse;
        let sidebands = chirps.sidebands(start + 0.5 * coarse);
        let count = (coarse / fine).ceil() as usize;
        (0..count).filter_map(|i| chirps.strongest(&sidebands, start + i as f64 * fine)).max_by(Line::weaker)
    };
    let line = (0..cells).into_par_iter().filter_map(strongest).max_by(Line::weaker)?;
    let line = chirps.refined(line, 0.5 * fine);
    let tried = (highest_hz - lowest_hz) * duration_s * (chirps.bins / 2 * TOGETHER.len()) as f64;
    let p_value = corrected(line.chance, tried);
    if p_value >= 0.01 {
        return None;
    }
    let sidebands = chirps.referenced(line.frequency_hz);
    let gain = chirps.gain(&line, &sidebands);
    if gain > 0.0 && chirps.others_are_constant(&line, &sidebands) {
        candidate(&chirps, &chirps.settled(line), p_value, gain)
    } else {
        None
    }
}

impl<'a> Chirps<'a> {
    fn new(evidence: &'a Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
        if loops < 8 || bins < 16 {
            return None;
        }
        let tapered = Tapered::new(samples);
        let still = tapered.spectra(evidence.still(), 1.0);
        let spectra = (0..frames).into_par_iter().map(|frame| {
            let mut spectra = vec![Complex64::ZERO; loops * channels * bins];
            for channel in 0..channels {
                let chirps = tapered.spectra(evidence.cube.channel(frame, channel), 1.0);
                for bin in 0..bins {
                    let chirp = |index: usize| chirps[index * samples + bin];
                    let mean = (0..loops).map(chirp).sum::<Complex64>() / loops as f64;
                    for index in 0..loops {
                        spectra[(index * channels + channel) * bins + bin] = chirp(index) - mean;
                    }
                }
            }
            spectra
        });
        let loop_s = evidence.radar.loop_period_s();
        let middle = 0.5 * (loops - 1) as f64;
        let still: Vec<Complex64> = (0..channels * bins).map(|i| still[i / bins * samples + i % bins]).collect();
        Some(Self {
            evidence,
            bins,
            windows: windows(&still, bins),
            spectra: spectra.collect(),
            still,
            loops_s: (0..loops).map(|index| (index as f64 - middle) * loop_s).collect(),
            middles_s: evidence.starts_s.iter().map(|start| start + middle * loop_s).collect(),
        })
    }

    /// Lowest and highest frequency that is looked at.
    fn band_hz(&self) -> [f64; 2] {
        [LOWEST_HZ.max(OF_TURN / self.frame_s()), HIGHEST_HZ.min(0.4 / self.evidence.radar.loop_period_s())]
    }

    fn frame_s(&self) -> f64 {
        self.loops_s.len() as f64 * self.evidence.radar.loop_period_s()
    }

    /// At plus and minus a frequency, with the phases of the frames' middles.
    fn sidebands(&self, frequency_hz: f64) -> Sidebands {
        [1.0, -1.0].map(|sign| {
            let turns: Vec<Complex64> =
                self.loops_s.iter().map(|time| Complex64::cis(-sign * TAU * frequency_hz * time)).collect();
            let of_frame = |spectra: &Vec<Complex64>| {
                let size = spectra.len() / turns.len();
                let mut sum = vec![Complex64::ZERO; size];
                for (chirp, turn) in spectra.chunks_exact(size).zip(&turns) {
                    sum.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * turn);
                }
                sum.iter_mut().for_each(|value| *value /= turns.len() as f64);
                sum
            };
            self.spectra.iter().flat_map(of_frame).collect()
        })
    }

    /// Back to the recording's beginning, by frame.
    fn turns(&self, frequency_hz: f64, sideband: usize) -> Vec<Complex64> {
        let sign = [-1.0, 1.0][sideband];
        self.middles_s.iter().map(|time| Complex64::cis(sign * TAU * frequency_hz * time)).collect()
    }

    /// Sidebands with the phases of the recording's beginning.
    fn referenced(&self, frequency_hz: f64) -> Sidebands {
        let mut sidebands = self.sidebands(frequency_hz);
        for (sideband, values) in sidebands.iter_mut().enumerate() {
            let turns = self.turns(frequency_hz, sideband);
            let size = values.len() / turns.len();
            for (frame, turn) in values.chunks_exact_mut(size).zip(turns) {
                frame.iter_mut().for_each(|value| *value *= turn);
            }
        }
        sidebands
    }

    /// The ranges at which a frequency stands out most.
    fn strongest(&self, sidebands: &Sidebands, frequency_hz: f64) -> Option<Line> {
        let training = &self.evidence.split.training;
        let (channels, bins, count) = (self.evidence.cube.channels(), self.bins, training.len() as f64);
        // Sums over the bins before: power of the training frames' mean by sideband, and what scatters around it.
        let mut before = vec![[0.0; 3]; bins + 1];
        for (sideband, values) in sidebands.iter().enumerate() {
            let turns = self.turns(frequency_hz, sideband);
            for channel in 0..channels {
                for bin in 0..bins {
                    let (mut sum, mut squares) = (Complex64::ZERO, 0.0);
                    for &frame in training {
                        let value = values[(frame * channels + channel) * bins + bin];
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

    /// How many of some ranges' values scatter independently, of each sideband. Where frames scatter by more than the noise, something
    /// moves, which is alike in all channels: they count as one. `variance`: of one value.
    fn independent(&self, width: usize, variance: f64) -> f64 {
        let channels = self.evidence.cube.channels();
        // The taper's energy is one.
        let noise = self.evidence.noise().iter().sum::<f64>() / (channels * self.loops_s.len()) as f64;
        let all = channels as f64 * (1.0 + (width - 1) as f64 / OF_ONE);
        1.0 + (all - 1.0) * (noise / variance.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// A line beside its true frequency has a scatter of its own.
    fn refined(&self, mut line: Line, mut step_hz: f64) -> Line {
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

    /// Log-likelihood gain of the held-out frames by the training frames' mean, nats.
    fn gain(&self, line: &Line, sidebands: &Sidebands) -> f64 {
        let (training, held_out) = (&self.evidence.split.training, &self.evidence.split.held_out);
        let channels = self.evidence.cube.channels();
        let (mut gained, mut scatter) = (0.0, 0.0);
        for values in sidebands {
            for (channel, bin) in (0..channels).flat_map(|channel| line.bins().map(move |bin| (channel, bin))) {
                let value = |frame: usize| values[(frame * channels + channel) * self.bins + bin];
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
    fn others_are_constant(&self, line: &Line, sidebands: &Sidebands) -> bool {
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
    fn depth(&self, values: &[Complex64], wanted: &dyn Fn(usize) -> bool) -> Depth {
        let training = &self.evidence.split.training;
        let (channels, count) = (self.evidence.cube.channels(), training.len() as f64);
        let mut depths = vec![Complex64::ZERO; training.len()];
        let mut all = 0.0;
        for bin in (0..self.bins).filter(|&bin| wanted(bin)) {
            let sideband = |channel: usize, frame: usize| values[(frame * channels + channel) * self.bins + bin];
            let scatter: f64 = (0..channels).map(|channel| self.spread(|frame| sideband(channel, frame)).1).sum();
            let weight = 1.0 / scatter.max(f64::MIN_POSITIVE);
            for channel in 0..channels {
                let still = self.still[channel * self.bins + bin];
                let own = training.iter().map(|&frame| still.conj() * sideband(channel, frame) * weight);
                depths.iter_mut().zip(own).for_each(|(depth, own)| *depth += own);
                all += still.norm_sqr() * weight;
            }
        }
        depths.iter_mut().for_each(|depth| *depth /= all.max(f64::MIN_POSITIVE));
        let mean = depths.iter().sum::<Complex64>() / count;
        let variance = depths.iter().map(|depth| (depth - mean).norm_sqr()).sum::<f64>() / (count * (count - 1.0));
        Depth { mean, variance: variance.max(f64::MIN_POSITIVE) }
    }

    /// Of the frequencies that the frame rate aliases to one another, the one whose sinusoid explains most within the frames.
    fn settled(&self, line: Line) -> Line {
        let rate_hz = 1.0 / self.evidence.radar.frame_period_s;
        let [lowest_hz, highest_hz] = self.band_hz();
        let tooth = |k: i32| line.frequency_hz + f64::from(k) * rate_hz;
        let reach = ((highest_hz - lowest_hz) / rate_hz) as i32;
        let teeth = (-reach..=reach).map(tooth).filter(|frequency| (lowest_hz..highest_hz).contains(frequency));
        let explained = |frequency_hz: f64| {
            let sinusoid = self.sinusoid(frequency_hz)?;
            Some((frequency_hz, line.bins().map(|bin| self.explained(&sinusoid, bin)[0]).sum::<f64>()))
        };
        let best = teeth.filter_map(explained).max_by(|a, b| a.1.total_cmp(&b.1));
        Line { frequency_hz: best.map_or(line.frequency_hz, |best| best.0), ..line }
    }

    fn sinusoid(&self, frequency_hz: f64) -> Option<Sinusoid<'_>> {
        Sinusoid::new(&self.evidence.split.training, &self.middles_s, &self.loops_s, frequency_hz)
    }

    /// Energy that a sinusoid explains at a range beyond what is constant, and what it leaves.
    fn explained(&self, sinusoid: &Sinusoid, bin: usize) -> [f64; 2] {
        let channels = self.evidence.cube.channels();
        let of_channel = |channel: usize| {
            let value = |frame: usize, index: usize| self.spectra[frame][(index * channels + channel) * self.bins + bin];
            let sums = sinusoid.sums(value);
            let fitted = sinusoid.fitted(sums);
            let all: f64 = (0..2).map(|part| (fitted[part].conj() * sums[part]).re).sum();
            let indices = || 0..self.loops_s.len();
            let energy: f64 =
                sinusoid.training.iter().flat_map(|&frame| indices().map(move |index| value(frame, index).norm_sqr())).sum();
            [all, energy - all]
        };
        (0..channels).map(of_channel).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    }

    /// The ranges around one that are modulated with it.
    fn patch(&self, sinusoid: &Sinusoid, line: &Line) -> RangeInclusive<usize> {
        let modulated_too = |bin: usize| {
            let [explained, left] = self.explained(sinusoid, bin);
            explained * sinusoid.basis.len() as f64 > PLAIN * 2.0 * left
        };
        let first = (0..line.first).rev().take(WIDEST).take_while(|&bin| modulated_too(bin)).last().unwrap_or(line.first);
        let last = (line.last + 1..self.bins).take(WIDEST).take_while(|&bin| modulated_too(bin)).last().unwrap_or(line.last);
        let reached = reached(line.first, line.last);
        first.min(*reached.start())..=last.max(*reached.end())
    }

    /// Parts in proportion to the cosine and to the sine in some ranges, `[cosine, sine][channel · sample]`.
    fn waves(&self, sinusoid: &Sinusoid, patch: &RangeInclusive<usize>) -> [Vec<Complex64>; 2] {
        let evidence = self.evidence;
        let [frames, .., samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
        let mut waves = [vec![], vec![]];
        for channel in 0..channels {
            let moving: Vec<Vec<Complex64>> = (0..frames).map(|frame| evidence.moving(frame, channel)).collect();
            let of_sample = |n: usize| sinusoid.fitted(sinusoid.sums(|frame, index| moving[frame][index * samples + n]));
            let fitted: Vec<[Complex64; 2]> = (0..samples).map(of_sample).collect();
            for (part, waves) in waves.iter_mut().enumerate() {
                let mut wave: Vec<Complex64> = fitted.iter().map(|fitted| fitted[part]).collect();
                forward.process(&mut wave);
                for (bin, value) in wave.iter_mut().enumerate() {
                    *value *= if patch.contains(&bin) { 1.0 / samples as f64 } else { 0.0 };
                }
                inverse.process(&mut wave);
                waves.extend(wave);
            }
        }
        waves
    }
}

/// Ranges that are reached from some.
fn reached(first: usize, last: usize) -> RangeInclusive<usize> {
    first.saturating_sub(REACH)..=last + REACH
}

/// First and last of ranges to look at together, beside which there are static returns. `still`: `[channel · bin]`.
fn windows(still: &[Complex64], bins: usize) -> Vec<[usize; 2]> {
    let mut powers = vec![0.0; bins];
    still.iter().enumerate().for_each(|(i, value)| powers[i % bins] += value.norm_sqr());
    let all: f64 = powers.iter().sum();
    let of_width = |width: usize| {
        (0..(bins + 1).saturating_sub(width)).step_by(width.div_ceil(2)).map(move |first| [first, first + width - 1])
    };
    let beside = |&[first, last]: &[usize; 2]| {
        let reached = reached(first, last);
        let elsewhere: f64 = (0..bins).filter(|bin| !reached.contains(bin)).map(|bin| powers[bin]).sum();
        elsewhere >= ELSEWHERE * all
    };
    TOGETHER.into_iter().flat_map(of_width).filter(beside).collect()
}

fn candidate(chirps: &Chirps, line: &Line, p_value: f64, gain: f64) -> Option<Candidate> {
    let evidence = chirps.evidence;
    let samples = evidence.cube.dims[4];
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = line.middle() * bin_m;
    let sinusoid = chirps.sinusoid(line.frequency_hz)?;
    let (patch, means) = (chirps.patch(&sinusoid, line), sinusoid.means);
    let waves = chirps.waves(&sinusoid, &patch);
    let [near_m, far_m] = [patch.start(), patch.end()].map(|bin| *bin as f64 * bin_m);
    let chirp_count = (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64;
    let energy = waves.iter().flatten().map(|value| value.norm_sqr()).sum::<f64>() * 0.5 * chirp_count;
    let (starts_s, loop_s, frequency_hz) = (evidence.starts_s.clone(), evidence.radar.loop_period_s(), line.frequency_hz);
    let frame_rate_hz = 1.0 / evidence.radar.frame_period_s;
    Some(Candidate {
        id: None,
        behaves_like: Behaviour::Modulated,
        estimates: vec![],
        choice: None,
        place: Place { range_m: Some([near_m, far_m]), ..Place::at(Stage::Scene) },
        p_value: p_value.max(f64::MIN_POSITIVE),
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "The return {range_m:.2} m away is modulated at {frequency_hz:.1} Hz (or at that and a multiple of the \
             {frame_rate_hz:.1} frames per second), coherently from frame to frame, while the other ranges are constant: a lamp or \
             a machine is there."
        ),
        curve: None,
        energy,
        correction: Correction::Samples(Arc::new(move |cube| {
            cube.each_chirp(|[frame, channel, index], chirp| {
                let (sine, cosine) = (TAU * frequency_hz * (starts_s[frame] + index as f64 * loop_s)).sin_cos();
                let [with_cosine, with_sine] = [0, 1].map(|part| &waves[part][channel * samples..][..samples]);
                for ((value, a), b) in chirp.iter_mut().zip(with_cosine).zip(with_sine) {
                    *value -= a * (cosine - means[0]) + b * (sine - means[1]);
                }
            });
        })),
    })
}

#[cfg(test)]
#[path = "modulation_tests.rs"]
mod tests;
