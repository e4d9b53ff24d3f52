//! Platform vibration before returns from many directions: each range cell's phasor is a sum over directions,
//! which change by different amounts, so that what the cells share is not their deviation but its course in time. One
//! sinusoid with a pattern over channels and ranges that is free, in cells where the body cannot be.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::DMatrix;
use num_complex::Complex64;
use rayon::prelude::*;

use super::field::{PATTERN, ahead, free};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::Cube;
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, NINETY, Place, Volume};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::diagnosis::suspects::climb::climb;
use crate::effects::{self, Stage};

/// Bins over which the window spreads what is independent.
const BINS_PER_VALUE: f64 = 2.0;
/// Bins whose deviations are judged together.
const GROUP_BINS: usize = 4;
/// Groups that must be able to contradict, and the share of them that must agree.
const LEAST_GROUPS: usize = 5;
const AGREEING: f64 = 0.75;
/// Share of what a group is expected to show, from which on it agrees: the pattern over directions is not known.
const SHOWN: f64 = 0.15;
/// A deviation of the returns' amplitudes only is a gain.
const GAIN_LIKE: f64 = 0.7;
/// Share of what a sinusoid explains whose phase is the same everywhere; half of what turns one way.
const LIKENESS: f64 = 0.75;
/// Cells with the strongest returns, which suffice to find the frequency.
const SEARCHED: usize = 48;
/// Phases that are tried before the best is refined.
const PHASES: usize = 8;
/// Least determinant at which a cosine and a sine can be told apart.
const DETERMINED: f64 = 0.05;
/// Teeth of the comb of aliases to either side, and by how much less (nats) one may explain that is not told apart.
const TEETH: i32 = 4;
const ALIAS_GAIN: f64 = 4.6;
/// No mount of a radar vibrates faster with an amplitude that is measurable.
const HIGHEST_HZ: f64 = 300.0;
/// Harmonics that are taken out again.
const HARMONICS: usize = 3;
/// A phase beyond that is no small deviation (rad).
const LARGEST: f64 = 1.5;

/// Deviations of the free cells from their mean, in units of the noise.
struct Cells {
    /// `[frame][channel · bins + bin][loop]`; none where the body may be.
    deviation: Vec<Vec<Option<Vec<Complex64>>>>,
    /// `[channel · bins + bin]`
    still: Vec<Complex64>,
    bins: usize,
    loops: usize,
    starts_s: Vec<f64>,
    loop_s: f64,
}

/// A sinusoid cos(2π f t + θ) with a pattern.
struct Vibration {
    frequency_hz: f64,
    phase: f64,
    /// `[channel · bins + bin]` with its inverse variance, of the free cells; none where the body was in most frames.
    pattern: Vec<Option<(Complex64, f64)>>,
    /// Log-likelihood, and the number of complex values fitted.
    gain: f64,
    values: f64,
    likeness: f64,
}

impl Cells {
    fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, tx, _, loops, samples] = evidence.cube.dims;
        let (channels, bins, noise) = (evidence.cube.channels(), evidence.range_bins(), evidence.noise());
        if loops < 8 || frames < 4 || bins < 16 || noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        let tapered = Tapered::new(samples);
        let still: Vec<Complex64> = (0..channels)
            .flat_map(|channel| {
                let own = &evidence.still()[channel * samples..][..samples];
                tapered.spectra(own, 1.0 / noise[channel].sqrt())[..bins].to_vec()
            })
            .collect();
        let strong: Vec<bool> = (0..bins)
            .map(|bin| (0..channels).map(|c| still[c * bins + bin].norm_sqr()).sum::<f64>() > 3.0 * channels as f64)
            .collect();
        let of_frame = |frame: usize| -> Vec<Option<Vec<Complex64>>> {
            let free = free(evidence, frame, bins);
            let mut cells = Vec::with_capacity(channels * bins);
            for channel in 0..channels {
                let spectra = tapered.spectra(evidence.cube.channel(frame, channel), 1.0 / noise[channel].sqrt());
                for bin in 0..bins {
                    let mean = still[channel * bins + bin];
                    let values = || spectra[bin..].iter().step_by(samples).map(|value| value - mean).collect();
                    cells.push((free[bin] && strong[bin]).then(values));
                }
            }
            cells
        };
        let deviation = (0..frames).into_par_iter().map(of_frame).collect();
        let middle_s = 0.5 * (tx as f64 - 1.0) * evidence.radar.chirp_period_s;
        let starts_s = evidence.starts_s.iter().map(|start| start + middle_s).collect();
        Some(Self { deviation, still, bins, loops, starts_s, loop_s: evidence.radar.loop_period_s() })
    }

    fn time_s(&self, frame: usize, index: usize) -> f64 {
        self.starts_s[frame] + index as f64 * self.loop_s
    }

    fn sums(&self, frames: &[usize], cell: usize, frequency_hz: f64) -> Sums {
        let mut sums = Sums::default();
        let step = Complex64::cis(TAU * frequency_hz * self.loop_s);
        for &frame in frames {
            let Some(values) = &self.deviation[frame][cell] else { continue };
            let mut turn = Complex64::cis(TAU * frequency_hz * self.starts_s[frame]);
            for value in values {
                sums.add(*value, turn);
                turn *= step;
            }
        }
        sums
    }

    /// Of cells that `kept` says.
    fn fit(&self, frames: &[usize], frequency_hz: f64, kept: impl Fn(usize) -> bool + Sync) -> Vibration {
        let of_cell = |cell| if kept(cell) { self.sums(frames, cell, frequency_hz) } else { Sums::default() };
        let sums: Vec<Sums> = (0..self.still.len()).into_par_iter().map(of_cell).map(Sums::centred).collect();
        let known: Vec<&Sums> = sums.iter().filter(|sums| sums.determinant() > DETERMINED).collect();
        let gain = |phase: f64| known.iter().map(|sums| sums.along(phase)).map(|(q, n)| q.norm_sqr() / n).sum::<f64>();
        let phases = (0..PHASES).map(|i| std::f64::consts::PI * i as f64 / PHASES as f64);
        let (first, _) = phases.map(|phase| (phase, gain(phase))).max_by(|a, b| a.1.total_cmp(&b.1)).expect("some phases");
        let (phase, top) = climb(gain, first, std::f64::consts::PI / PHASES as f64, 1e-3);
        let pattern = sums
            .iter()
            .map(|sums| {
                (sums.determinant() > DETERMINED).then(|| {
                    let (q, n) = sums.along(phase);
                    (q / n, n)
                })
            })
            .collect();
        // Noise alone has one unit in each of two courses in time.
        let (count, both) = (known.len() as f64, known.iter().map(|sums| sums.both()).sum::<f64>());
        let likeness = (top - count) / (both - 2.0 * count).max(f64::MIN_POSITIVE);
        Vibration { frequency_hz, phase, pattern, gain: top / BINS_PER_VALUE, values: count / BINS_PER_VALUE, likeness }
    }

    /// Those that suffice for a search.
    fn strongest(&self) -> Vec<bool> {
        let mut order: Vec<usize> = (0..self.still.len()).collect();
        order.sort_by(|&a, &b| self.still[b].norm_sqr().total_cmp(&self.still[a].norm_sqr()));
        let mut kept = vec![false; order.len()];
        order.iter().take(SEARCHED).for_each(|&cell| kept[cell] = true);
        kept
    }

    /// Log-likelihood that some frames gain by a vibration, over what is left of their own power along it.
    fn held_out(&self, frames: &[usize], vibration: &Vibration) -> f64 {
        let (mut gain, mut left, mut count) = (0.0, 0.0, 0.0);
        for (cell, pattern) in vibration.pattern.iter().enumerate() {
            let Some((pattern, _)) = pattern else { continue };
            let sums = self.sums(frames, cell, vibration.frequency_hz);
            let (q, n) = sums.along(vibration.phase);
            if n <= 0.0 {
                continue;
            }
            gain += 2.0 * (pattern.conj() * q).re - n * pattern.norm_sqr();
            left += (q - n * pattern).norm_sqr() / n;
            count += 1.0;
        }
        gain / BINS_PER_VALUE / (left / f64::max(count, 1.0)).max(1.0)
    }
}

/// Of a cell's deviations D: Σ D, Σ D cos ωt, Σ D sin ωt, and the sums of the cosines and sines themselves.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    all: Complex64,
    data: [Complex64; 2],
    basis: [f64; 2],
    /// cos², cos · sin, sin².
    squares: [f64; 3],
}

impl Sums {
    fn add(&mut self, value: Complex64, turn: Complex64) {
        self.count += 1.0;
        self.all += value;
        self.data[0] += value * turn.re;
        self.data[1] += value * turn.im;
        self.basis[0] += turn.re;
        self.basis[1] += turn.im;
        self.squares[0] += turn.re * turn.re;
        self.squares[1] += turn.re * turn.im;
        self.squares[2] += turn.im * turn.im;
    }

    /// With a constant of its own taken out.
    fn centred(self) -> Self {
        if self.count == 0.0 {
            return self;
        }
        let [c, s] = self.basis.map(|sum| sum / self.count);
        let squares =
            [self.squares[0] - c * self.basis[0], self.squares[1] - c * self.basis[1], self.squares[2] - s * self.basis[1]];
        Self { data: [self.data[0] - c * self.all, self.data[1] - s * self.all], squares, ..self }
    }

    /// Whether cosine and sine can be told apart: one where they are orthogonal.
    fn determinant(&self) -> f64 {
        let [cc, cs, ss] = self.squares;
        if self.count > 0.0 { 4.0 * (cc * ss - cs * cs) / (self.count * self.count) } else { 0.0 }
    }

    /// Σ D u and Σ u² for u = cos(ωt + phase).
    fn along(&self, phase: f64) -> (Complex64, f64) {
        let (sin, cos) = phase.sin_cos();
        let [cc, cs, ss] = self.squares;
        (self.data[0] * cos - self.data[1] * sin, cos * cos * cc - 2.0 * cos * sin * cs + sin * sin * ss)
    }

    /// What a cosine and a sine with a factor of their own each would gain.
    fn both(&self) -> f64 {
        let ([cc, cs, ss], [c, s]) = (self.squares, self.data);
        (ss * c.norm_sqr() + cc * s.norm_sqr() - 2.0 * cs * (c.conj() * s).re) / (cc * ss - cs * cs)
    }
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let cells = Cells::new(evidence)?;
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let duration_s = cells.time_s(*training.last()?, cells.loops - 1) - cells.time_s(training[0], 0);
    // What is slower than the recording is a drift.
    let (lowest, highest) = (1.5 / duration_s, HIGHEST_HZ.min(0.5 / cells.loop_s));
    let step = 0.25 / duration_s;
    let strongest = cells.strongest();
    let gain = |frequency: f64| {
        if (lowest..=highest).contains(&frequency) {
            cells.fit(training, frequency, |cell| strongest[cell]).gain
        } else {
            f64::NEG_INFINITY
        }
    };
    let refined = |frequency: f64| climb(gain, frequency, 0.5 * step, 0.01 * step);
    let count = ((highest - lowest) / step).max(0.0) as usize;
    let tried =
        (0..count).into_par_iter().map(|index| lowest + index as f64 * step).map(|frequency| (frequency, gain(frequency)));
    let first = refined(tried.max_by(|a, b| a.1.total_cmp(&b.1))?.0);
    // Gaps between frames make a comb of nearly equal peaks, a frame rate apart; the grid may have missed its top.
    let frame_rate = 1.0 / (cells.time_s(1, 0) - cells.time_s(0, 0));
    let teeth: Vec<(f64, f64)> = (-TEETH..=TEETH).map(|k| refined(first.0 + f64::from(k) * frame_rate)).collect();
    let top = teeth.iter().map(|tooth| tooth.1).fold(first.1, f64::max);
    // Of those that the short frames cannot tell apart, the slowest.
    let alike = teeth.into_iter().chain([first]).filter(|tooth| tooth.1 > top - ALIAS_GAIN);
    let (frequency, top) = alike.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let vibration = cells.fit(training, frequency, |_| true);
    let found = cells.held_out(held_out, &vibration);
    let p_value = corrected(chi2_tail(2.0 * vibration.gain, 2.0 * vibration.values), 4.0 * (highest - lowest) * duration_s);
    if found <= 0.0 || vibration.likeness < LIKENESS {
        return None;
    }
    let (radians, deviation) = amplitude(evidence, &cells, &vibration)?;
    let curvature = (2.0 * top - gain(frequency - 0.1 * step) - gain(frequency + 0.1 * step)) / (0.1 * step).powi(2);
    let frequency_deviation = if curvature > 0.0 { curvature.sqrt().recip() } else { step };
    Some(candidate(evidence, &cells, &vibration, [radians, deviation, frequency_deviation], (p_value, found)))
}

/// Of the phase along the boresight (rad), with its sign, and its deviation; none where the ranges do not share it.
fn amplitude(evidence: &Evidence, cells: &Cells, vibration: &Vibration) -> Option<(f64, f64)> {
    let bin_m = evidence.radar.range_resolution_m();
    let (mut groups, mut along, mut of_still, mut of_pattern) = (vec![], Complex64::ZERO, 0.0, 0.0);
    for start in (0..cells.bins).step_by(GROUP_BINS) {
        let lever = ahead(evidence.room.as_ref(), (start as f64 + 0.5 * GROUP_BINS as f64) * bin_m).powi(2);
        let (mut shown, mut wanted, mut noise) = (0.0, 0.0, 0.0);
        for cell in (0..vibration.pattern.len()).filter(|cell| (start..start + GROUP_BINS).contains(&(cell % cells.bins))) {
            let Some((pattern, information)) = vibration.pattern[cell] else { continue };
            let still = cells.still[cell];
            shown += pattern.norm_sqr() - 1.0 / information;
            noise += 1.0 / information;
            wanted += lever * still.norm_sqr();
            along += still.conj() * pattern;
            of_still += still.norm_sqr();
            of_pattern += pattern.norm_sqr();
        }
        if wanted > 0.0 {
            groups.push((shown, wanted, noise));
        }
    }
    let ratio = |groups: &[(f64, f64, f64)]| {
        let (shown, wanted) = groups.iter().fold((0.0, 0.0), |sum, group| (sum.0 + group.0, sum.1 + group.1));
        shown / f64::max(wanted, f64::MIN_POSITIVE)
    };
    let square = ratio(&groups);
    if square <= 0.0 || along.re.abs() > GAIN_LIKE * (of_still * of_pattern).sqrt() {
        return None;
    }
    let informative: Vec<&(f64, f64, f64)> = groups.iter().filter(|(_, wanted, noise)| square * wanted > 10.0 * noise).collect();
    let agree = informative.iter().filter(|(shown, wanted, _)| *shown > SHOWN * square * wanted).count();
    if informative.len() < LEAST_GROUPS || (agree as f64) < AGREEING * informative.len() as f64 {
        return None;
    }
    // Deviation of the ratio: leave one group out.
    let n = groups.len() as f64;
    let without = (0..groups.len()).map(|out| {
        let kept: Vec<_> = groups.iter().enumerate().filter(|(at, _)| *at != out).map(|(_, group)| *group).collect();
        (ratio(&kept).max(0.0).sqrt() - square.sqrt()).powi(2)
    });
    let deviation = ((n - 1.0) / n * without.sum::<f64>()).sqrt();
    // 2 J₁(φ) / J₀(φ) = φ + φ³/8 + …
    let measured = square.sqrt();
    let phase = (0..20).fold(measured, |phase, _| measured - phase.powi(3) / 8.0);
    // The pattern is i times the static return where that comes from ahead.
    (phase < LARGEST && phase > 0.0).then(|| (phase.copysign(along.im), deviation.hypot(PATTERN * phase)))
}

fn candidate(
    evidence: &Evidence,
    cells: &Cells,
    vibration: &Vibration,
    [radians, deviation, frequency_deviation]: [f64; 3],
    (p_value, gain): (f64, f64),
) -> Candidate {
    let (rx, samples) = (evidence.cube.dims[2], evidence.cube.dims[4]);
    let (starts, loop_s, chirp_s) = (evidence.starts_s.clone(), cells.loop_s, evidence.radar.chirp_period_s);
    let (frequency, phase) = (vibration.frequency_hz, vibration.phase);
    let at = move |frame: usize, channel: usize, index: usize| {
        TAU * frequency * (starts[frame] + index as f64 * loop_s + (channel / rx) as f64 * chirp_s) + phase
    };
    let patterns = patterns(evidence, &at);
    let metres = evidence.radar.wavelength_m() / (2.0 * TAU);
    let (amplitude_m, deviation_m) = (radians.abs() * metres, deviation * metres);
    let chirps = (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64;
    let energy = 0.5 * chirps * patterns[1].iter().map(Complex64::norm_sqr).sum::<f64>();
    Candidate {
        id: Some(effects::radar_vibration::ID),
        behaves_like: Behaviour::SlowTimePhase,
        estimates: vec![
            Estimate::normal("amplitude_m", amplitude_m, deviation_m),
            Estimate::normal("frequency_hz", frequency, frequency_deviation),
        ],
        choice: None,
        place: Place::at(Stage::Scene),
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "The phases of all static returns oscillate at {frequency:.2} ± {:.2} Hz, in phase with one another but each with a \
             strength of its own, as returns from several directions do: the radar itself vibrates, by about {:.1} µm along its \
             boresight.",
            NINETY * frequency_deviation,
            1e6 * amplitude_m
        ),
        curve: None,
        energy,
        correction: Correction::Inverse(
            Arc::new(move |cube: &mut Cube| {
                cube.each_chirp(|[frame, channel, index], chirp| {
                    let turn = at(frame, channel, index);
                    let back = Complex64::cis(-radians * turn.cos());
                    for (n, value) in chirp.iter_mut().enumerate() {
                        let place = channel * samples + n;
                        let vibration: Complex64 =
                            (1..=HARMONICS).map(|order| patterns[order][place] * (order as f64 * turn).cos()).sum();
                        // What moves lies ahead.
                        let still = patterns[0][place];
                        *value = still + (*value - vibration - still) * back;
                    }
                });
            }),
            Volume::KEPT,
        ),
    }
}

/// What is constant, and what oscillates with the sinusoid and its harmonics, in the training frames: least squares,
/// `[order][channel · sample]`. Short frames far apart do not make the harmonics orthogonal.
fn patterns(evidence: &Evidence, at: &impl Fn(usize, usize, usize) -> f64) -> Vec<Vec<Complex64>> {
    let (channels, samples) = (evidence.cube.channels(), evidence.cube.dims[4]);
    let size = HARMONICS + 1;
    let mut patterns = vec![vec![Complex64::ZERO; channels * samples]; size];
    for channel in 0..channels {
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut right = vec![vec![Complex64::ZERO; samples]; size];
        for &frame in &evidence.split.training {
            for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                let turn = at(frame, channel, index);
                let basis: Vec<f64> = (0..size).map(|order| (order as f64 * turn).cos()).collect();
                for (order, weight) in basis.iter().enumerate() {
                    right[order].iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * weight);
                    basis.iter().enumerate().for_each(|(other, factor)| normal[(order, other)] += weight * factor);
                }
            }
        }
        let Some(inverse) = normal.try_inverse() else { continue };
        for (order, pattern) in patterns.iter_mut().enumerate() {
            for n in 0..samples {
                pattern[channel * samples + n] = (0..size).map(|other| right[other][n] * inverse[(order, other)]).sum();
            }
        }
    }
    patterns
}

#[cfg(test)]
#[path = "platform_vibration_tests.rs"]
mod tests;
