//! ADC clipping: components pile up at one value.

use std::f64::consts::{FRAC_2_PI, SQRT_2};
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use statrs::function::erf::erfc_inv;

use super::declipping::{Declip, FARTHEST};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::clutter_power;
use crate::diagnosis::evidence::beat::empty_bins;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place};
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Cube, Evidence, Volume, denoised};
use crate::effects::{self, Stage};

/// Fewest clipped components.
const FEWEST: usize = 8;
/// Bins around zero beat frequency that a leakage fills, where its power is more than this share of the strongest return's.
const BOARD_BINS: usize = 8;
const LEAKING: f64 = 0.01;

/// What was sampled: without quadrature the real part alone.
fn parts(value: &Complex64, is_real: bool) -> impl Iterator<Item = f64> + use<> {
    [value.re, value.im].into_iter().take(if is_real { 1 } else { 2 })
}

/// Components at the converter's ends, and just within them.
struct Pile {
    /// Those at which components pile up, signed.
    ends: Vec<f64>,
    /// The nearer one to zero.
    least: f64,
    tolerance: f64,
    /// So many would be there by the values just within.
    expected: f64,
    /// Of each frame, at the ends.
    by_frame: Vec<usize>,
}

impl Pile {
    /// None where components pile up at neither end.
    fn find(evidence: &Evidence) -> Option<Self> {
        let piles = evidence.extremes.into_iter().filter_map(|end| Self::at(evidence, end));
        piles.reduce(|low, high| Self {
            ends: [low.ends, high.ends].concat(),
            least: low.least.min(high.least),
            tolerance: low.tolerance,
            expected: low.expected + high.expected,
            by_frame: low.by_frame.iter().zip(high.by_frame).map(|(low, high)| low + high).collect(),
        })
    }

    fn at(evidence: &Evidence, end: f64) -> Option<Self> {
        let [low, high] = evidence.extremes;
        let half = 0.5 * (high - low);
        let inward = if end == low { 1.0 } else { -1.0 };
        // Within half a code, or a hair of the range for samples that are no codes.
        let tolerance = 1e-6 * half;
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let frames = || evidence.cube.samples.par_chunks_exact(evidence.cube.channels() * loops * samples);
        let within = |value: &Complex64| parts(value, evidence.is_real()).map(move |part| inward * (part - end));
        // At the end, and the next value that there is: a converter may have fewer codes than its numbers say.
        let at_and_next = |values: &[Complex64]| {
            values.iter().flat_map(within).fold((0, f64::INFINITY), |(at, next), within| {
                if within <= tolerance { (at + 1, next) } else { (at, next.min(within)) }
            })
        };
        let (by_frame, next): (Vec<usize>, Vec<f64>) = frames().map(at_and_next).unzip();
        let count = by_frame.iter().sum::<usize>();
        if half <= 0.0 || count < FEWEST {
            return None;
        }
        let next = next.into_iter().fold(f64::INFINITY, f64::min);
        let step = if next.is_finite() { next.max(1.0) } else { 1.0 };
        let slab = (0.02 * half).max(step);
        let is_below = |within: &f64| *within > tolerance && *within <= slab;
        let below: usize = frames().map(|values| values.iter().flat_map(within).filter(is_below).count()).sum();
        // A density that falls towards its end has fewer values in the last code than in any code of the slab before it.
        let codes = (slab / step).max(1.0);
        let expected = (below as f64 / codes).max(0.2);
        (count as f64 >= 5.0 * expected).then(|| Self { ends: vec![end], least: end.abs(), tolerance, expected, by_frame })
    }

    /// Components at the ends.
    fn count(&self) -> usize {
        self.by_frame.iter().sum()
    }

    /// Whether all that lies as far from zero as the ends was cut: two's complement has one code more below than above.
    fn holds_all(&self, extremes: [f64; 2]) -> bool {
        let [low, high] = self.ends[..] else {
            return extremes.iter().all(|end| self.ends.contains(end) || end.abs() < self.least);
        };
        (low + high).abs() <= 1.0
    }

    /// The ends in words.
    fn place(&self) -> String {
        match self.ends[..] {
            [low, high] if low == -high => format!("±{high:.0}"),
            _ => self.ends.iter().map(|end| format!("{end:.0}")).collect::<Vec<_>>().join(" and "),
        }
    }

    /// How far the signal would have gone, over the clipping level, with its interval: from what the empty beat frequencies say of it,
    /// or else as for a Gaussian.
    fn level(&self, evidence: &Evidence, declip: Option<&Declip>) -> (f64, [f64; 2]) {
        if let Some(declip) = declip {
            // The strongest of many restored values is one of the worse restored ones, and the noise is restored with it.
            let beyond = strongest(evidence, declip, &self.by_frame) / self.least - 1.0;
            // What is below the clipping level without noise was there for moments, which say nothing of how far they went.
            let ci90 = if beyond > 0.0 { [1.0 + 0.5 * beyond, 1.0 + 1.25 * beyond + 0.05] } else { [1.0, FARTHEST] };
            return (1.0 + beyond.max(0.0), ci90);
        }
        let values = || evidence.cube.samples.iter().flat_map(|value| parts(value, evidence.is_real()));
        let count = values().count() as f64;
        let mean = values().sum::<f64>() / count;
        let rms = (values().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        let nearest = self.ends.iter().map(|end| (end - mean).abs()).fold(f64::INFINITY, f64::min);
        let level = (rms * (2.0 * count.ln()).sqrt() / nearest).max(1.0);
        (level, [0.6 * level, 1.8 * level])
    }

    /// Energy of what clipping adds to the signal, as of a Gaussian one in each frame, about the offset of each channel.
    fn distortion(&self, evidence: &Evidence) -> f64 {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let sampled = if evidence.is_real() { 1 } else { 2 } * evidence.cube.channels() * loops * samples;
        let varying = evidence.cube.by_channel(|frame, channel| {
            let values = evidence.cube.channel(frame, channel);
            let mean = values.iter().sum::<Complex64>() / values.len() as f64;
            values.iter().map(|value| (value - mean).norm_sqr()).sum::<f64>()
        });
        let share = |at: usize| distorted_share(at as f64 / sampled as f64);
        self.by_frame.iter().enumerate().map(|(frame, &at)| share(at) * varying.below([frame]).iter().sum::<f64>()).sum()
    }

    fn frames(&self) -> Option<Vec<usize>> {
        let frames: Vec<usize> = (0..self.by_frame.len()).filter(|&frame| self.by_frame[frame] > 0).collect();
        let everywhere = frames.len() == self.by_frame.len();
        (!everywhere).then_some(frames)
    }
}

/// Share of the power of a Gaussian signal, clipped, that is no copy of it (Bussgang's theorem): y = a x + d with d uncorrelated to x
/// and a = erf(c / √2), of which the share `clipped` = erfc(c / √2) lies at the levels ±c σ.
fn distorted_share(clipped: f64) -> f64 {
    // A square wave, in the end.
    if clipped >= 1.0 {
        return 1.0 - FRAC_2_PI;
    }
    if clipped <= 0.0 {
        return 0.0;
    }
    let level = SQRT_2 * erfc_inv(clipped);
    let copied = 1.0 - clipped;
    let power = copied - level * FRAC_2_PI.sqrt() * (-0.5 * level * level).exp() + level * level * clipped;
    1.0 - copied * copied / power
}

/// At most one candidate, from the samples as they were recorded: none once anything was accepted.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    // It is looked for once, in the samples as they were recorded.
    let untouched = evidence.accepted.is_empty() && evidence.accepted_unnamed.is_empty();
    if !untouched {
        return vec![];
    }
    Pile::find(evidence).map(|pile| candidate(evidence, &pile)).into_iter().collect()
}

fn candidate(evidence: &Evidence, pile: &Pile) -> Candidate {
    let &Pile { least, expected, .. } = pile;
    let at = pile.count();
    let excess = at as f64 * (at as f64 / expected).ln() - (at as f64 - expected);
    let held_at: usize = evidence.split.held_out.iter().map(|&frame| pile.by_frame[frame]).sum();
    let sampled = if evidence.is_real() { 1 } else { 2 } * evidence.cube.samples.len();
    // What was not sampled is made of what was cut.
    let can_restore = !evidence.is_real() && pile.holds_all(evidence.extremes);
    let declip = can_restore.then(|| Declip::new(&silent_bins(evidence), least, pile.tolerance)).flatten().map(Arc::new);
    let (level, ci90) = pile.level(evidence, declip.as_deref());
    let correction = match declip {
        // That a sample lies beyond the clipping level is likelier than any one value there: the density of what is restored is a bound.
        Some(declip) => {
            let restore = move |cube: &mut Cube| cube.each_chirp(|_, chirp| declip.restore(chirp));
            Correction::inverse(Volume::KEPT, restore)
        }
        None => Correction::None,
    };
    let place = Place { frames: pile.frames(), ..Place::at(Stage::Receiver) };
    Candidate {
        id: Some(effects::adc_saturation::ID),
        estimates: vec![Estimate { name: "level", values: vec![level], ci90: vec![ci90] }],
        statement: format!(
            "{at} of the recorded components ({:.3} %) lie exactly at {}, where {expected:.1} would by the values just \
             within: the converter is at its rail and cuts the signal",
            100.0 * at as f64 / sampled as f64,
            pile.place()
        ),
        energy: pile.distortion(evidence),
        correction,
        ..Candidate::new(Behaviour::Amplitude, place, corrected((-excess).exp(), 2.0), excess * (held_at as f64 / at as f64))
    }
}

/// Beat frequencies where nothing returns: neither room nor body, nor what leaks over the board.
fn silent_bins(evidence: &Evidence) -> Vec<bool> {
    let mut empty = empty_bins(evidence);
    let power = clutter_power(evidence);
    let samples = power.len();
    let near: Vec<usize> = (0..samples).filter(|&bin| bin.min(samples - bin) <= BOARD_BINS).collect();
    let most = |bins: &[usize]| bins.iter().map(|&bin| power[bin]).fold(0.0, f64::max);
    if most(&near) > LEAKING * power.iter().copied().fold(0.0, f64::max) {
        near.iter().for_each(|&bin| empty[bin] = false);
    }
    empty
}

/// Largest component of the signal as it was before it was cut, without most of its noise.
fn strongest(evidence: &Evidence, declip: &Declip, hits: &[usize]) -> f64 {
    let mut whole = evidence.clone().changed();
    whole.cube.each_chirp(|_, chirp| declip.restore(chirp));
    let channels = whole.cube.channels();
    let of = |index: usize| {
        let clean = denoised::channel(&whole, index / channels, index % channels);
        clean.iter().flat_map(|value| parts(value, false)).map(f64::abs).fold(0.0, f64::max)
    };
    (0..hits.len() * channels).into_par_iter().filter(|index| hits[index / channels] > 0).map(of).reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use statrs::distribution::{ContinuousCDF, Normal};

    use super::*;
    use crate::diagnosis::cube::{Loaded, analytic};
    use crate::radar::{Radar, Sampling};
    use crate::support;

    /// Codes of a receiver without quadrature: a strong tone about an offset, cut at two ends.
    fn evidence(offset: f32, ends: [f32; 2]) -> Evidence {
        let mut normal = support::normal(3);
        let wave = |i: usize| 200.0 * (TAU * 5.3 * (i % 64) as f64 / 64.0).sin();
        of_codes(|i| (offset + (wave(i) + 3.0 * normal()) as f32).round().clamp(ends[0], ends[1]))
    }

    fn of_codes(code: impl FnMut(usize) -> f32) -> Evidence {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, sampling: Sampling::Real, ..Radar::small(8) };
        let codes: Vec<f32> = (0..radar.dims().iter().product::<usize>()).map(code).collect();
        let extremes = [f32::min, f32::max].map(|pick| f64::from(codes.iter().copied().reduce(pick).unwrap()));
        Evidence::new(Loaded::of_samples(radar, analytic(&codes, 64), extremes), None, None)
    }

    #[test]
    fn codes_pile_up_at_either_end_whatever_their_middle_and_in_no_other_case() {
        let said = |offset: f32, ends: [f32; 2]| find(&evidence(offset, ends)).pop().map(|found| found.statement);
        for offset in [0.0, 2048.0] {
            let end = offset + 150.0;
            let found = said(offset, [-1e4, end]).expect("a pile");
            assert!(found.contains(&format!("exactly at {end:.0},")), "{found}");
            assert!(said(offset, [offset - 150.0, end]).expect("two piles").contains("exactly at "));
            assert!(said(offset, [-1e4, 1e4]).is_none());
        }
        assert!(said(0.0, [-150.0, 150.0]).expect("two piles").contains("exactly at ±150,"));
    }

    #[test]
    fn the_power_that_clipping_adds_is_that_of_a_clipped_gaussian() {
        let law = Normal::standard();
        let draws: Vec<f64> = (0..100_000).map(|i| law.inverse_cdf((f64::from(i) + 0.5) / 1e5)).collect();
        for level in [0.7, 1.5, 2.2] {
            let clipped: Vec<f64> = draws.iter().map(|x| x.clamp(-level, level)).collect();
            let mean = |of: &dyn Fn(usize) -> f64| (0..draws.len()).map(of).sum::<f64>() / draws.len() as f64;
            let copy = mean(&|i| draws[i] * clipped[i]) / mean(&|i| draws[i] * draws[i]);
            let added = mean(&|i| (clipped[i] - copy * draws[i]).powi(2)) / mean(&|i| clipped[i] * clipped[i]);
            let share = distorted_share(mean(&|i| f64::from(draws[i].abs() >= level)));
            assert!((share / added - 1.0).abs() < 0.03, "at {level}: {share} for {added}");
        }
        assert!(distorted_share(0.0) == 0.0 && (distorted_share(1.0) - distorted_share(1.0 - 1e-6)).abs() < 1e-3);
    }

    /// Every 64th code alone: the next one that there is holds more than the last.
    #[test]
    fn the_last_code_of_a_coarse_converter_is_no_pile() {
        let mut normal = support::normal(5);
        let coarse = of_codes(|_| (300.0 * normal() as f32 / 64.0).round() * 64.0);
        assert!(find(&coarse).is_empty(), "{:?}", find(&coarse));
        let mut normal = support::normal(5);
        let cut = of_codes(|_| ((300.0 * normal() as f32 / 64.0).round() * 64.0).clamp(-320.0, 320.0));
        assert!(find(&cut)[0].statement.contains("exactly at ±320,"));
    }
}
