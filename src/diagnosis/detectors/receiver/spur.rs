//! A continuous tone in the intermediate frequency: one beat frequency, one phase advance from chirp to chirp, in all
//! frames alike.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rayon::prelude::*;

use super::line::{Line, Strongest, along, in_chirps, tone, turned_back};
use super::slow_spur::{self, SlowSpur};
use super::wandering::{self, Wandering, deviation_bins};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::{spectrum, transform};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place};
use crate::diagnosis::statistics::{corrected, mean_power_tail, median};
use crate::diagnosis::{Cube, Evidence, denoised};
use crate::effects::{self, Stage};
use crate::grid::Grid;

/// Share of the power around a tone that it may leave, where little else is: a mover's Doppler changes, and it leaves more.
const LEFT_OVER: f64 = 0.2;
/// Standard deviations by which noise may add to that.
const CHANCE: f64 = 2.0;
/// Coherence (squared) of static clutter at other ranges with its line there, from which on the line is its sideband.
const SIDEBAND: f64 = 0.15;
/// Samples in which its frequencies are looked for.
const SEARCHED: usize = 1 << 17;
/// Cells around the tone to each side, in both axes.
const AROUND: i64 = 4;

/// Chance above which nothing is said.
const UNLIKELY: f64 = 1e-4;

/// At most one tone: away from all returns, else among the slow ones, else one that wanders. None after three were accepted.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.accepted.iter().filter(|id| **id == effects::spur::ID).count() > 2 {
        return vec![];
    }
    aside(evidence).or_else(|| among_the_slow(evidence)).or_else(|| wanders(evidence)).into_iter().collect()
}

/// A line where nothing of the room or the body can stay.
fn aside(evidence: &Evidence) -> Option<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let training = &evidence.split.training;
    let channels = evidence.cube.channels();
    let line = Line::new(evidence);
    let places = line.strongest();
    let looked_at: usize = places.iter().map(|place| place.1).sum();
    let Strongest { power, at } = places.into_iter().filter_map(|place| place.0).max_by(|a, b| a.power.total_cmp(&b.power))?;
    // The median exceeds a bound only if half of the frames do.
    let each = mean_power_tail(power, channels as f64).max(1e-300);
    let half = 0.5 * training.len() as f64;
    let p_value = corrected((half * (each.ln() + 2.0 * std::f64::consts::LN_2)).exp().min(1.0), looked_at as f64);
    if p_value > UNLIKELY || power < 3.0 {
        return None;
    }
    let (slow, fast) = refined(evidence, at);
    if is_sideband(evidence, slow, fast) {
        return None;
    }
    let amplitudes = amplitudes_of(&evidence.cube, slow, fast);
    let Around { before, after, deviation } = around(evidence, (slow, fast), &amplitudes);
    if after > LEFT_OVER * before + CHANCE * deviation {
        return None;
    }
    let noise = evidence.noise();
    let count = (loops * samples) as f64;
    let gain: f64 = evidence
        .split
        .held_out
        .iter()
        .map(|&frame| {
            let of_frame = amplitudes.below([frame]);
            // An amplitude per frame and channel is fitted: one nat each is chance.
            of_frame.iter().zip(noise).map(|(a, noise)| a.norm_sqr() * count / noise.max(1e-300) - 1.0).sum::<f64>()
        })
        .sum();
    let correction = Correction::samples(move |cube| {
        let amplitudes = amplitudes_of(cube, slow, fast);
        subtract(cube, |frame, channel| (slow, fast, amplitudes[[frame, channel]]));
    });
    let how = "where nothing of the room or the body can stay";
    let amplitudes = amplitudes.into_values();
    Some(candidate(evidence, Tone { slow, fast, amplitudes, p_value, gain, how, correction }))
}

/// One that hardly turns from chirp to chirp, and goes on from frame to frame.
fn among_the_slow(evidence: &Evidence) -> Option<Candidate> {
    let SlowSpur { turns, fast, starts, amplitudes, p_value, gain } = slow_spur::find(evidence)?;
    let slow = turns.per_loop.rem_euclid(1.0);
    if p_value > UNLIKELY || is_sideband(evidence, slow, fast) {
        return None;
    }
    let correction = Correction::samples(move |cube| {
        let amplitudes = slow_spur::amplitudes(cube, &starts, turns, fast);
        let start = |frame: usize| Complex64::cis(TAU * turns.per_frame * starts[frame]);
        subtract(cube, |frame, channel| (slow, fast, start(frame) * amplitudes[channel]));
    });
    let how =
        "in step from frame to frame, at one beat frequency, where whatever turns like that and moves would have left its range";
    Some(candidate(evidence, Tone { slow, fast, amplitudes, p_value, gain, how, correction }))
}

/// One whose Doppler frequency wanders from frame to frame, where nobody is tracked.
fn wanders(evidence: &Evidence) -> Option<Candidate> {
    let Wandering { slow, fast, amplitudes, p_value, gain } = wandering::find(evidence)?;
    if p_value > UNLIKELY {
        return None;
    }
    let turns = slow.clone();
    let correction = Correction::samples(move |cube| {
        let amplitudes = wandering::amplitudes(cube, &turns, fast);
        subtract(cube, |frame, channel| (turns[frame], fast, amplitudes[[frame, channel]]));
    });
    let how = "at one beat frequency, where whatever turns like that and moves would have left its range";
    let mean = slow.iter().sum::<f64>() / slow.len() as f64;
    let amplitudes = amplitudes.into_values();
    Some(candidate(evidence, Tone { slow: mean, fast, amplitudes, p_value, gain, how, correction }))
}

/// Takes a tone out of a cube; `of` says, by frame and channel, its turns per chirp and per sample and its amplitude.
fn subtract(cube: &mut Cube, of: impl Fn(usize, usize) -> (f64, f64, Complex64) + Sync) {
    cube.each_chirp(|[frame, channel, chirp], values| {
        let (slow, fast, amplitude) = of(frame, channel);
        values.iter_mut().enumerate().for_each(|(n, value)| *value -= amplitude * tone(slow, fast, chirp, n));
    });
}

/// A tone that was found.
struct Tone {
    /// Turns per chirp and per sample.
    slow: f64,
    fast: f64,
    /// By channel, or by frame and channel.
    amplitudes: Vec<Complex64>,
    p_value: f64,
    gain: f64,
    how: &'static str,
    correction: Correction,
}

fn candidate(evidence: &Evidence, tone: Tone) -> Candidate {
    let Tone { slow, fast, amplitudes, p_value, gain, how, correction } = tone;
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let strength = (amplitudes.iter().map(Complex64::norm_sqr).sum::<f64>() / amplitudes.len() as f64).sqrt();
    let peak = evidence.peak();
    let level_db = 20.0 * (strength / (peak - strength).max(1e-300)).log10();
    let rate = evidence.radar.sample_rate_hz;
    let wrapped = if fast > 0.5 { fast - 1.0 } else { fast };
    // The frequency nearest to zero that samples so.
    let frequency_hz = wrapped * rate;
    Candidate {
        id: Some(effects::spur::ID),
        estimates: vec![
            Estimate::normal("frequency_hz", frequency_hz, deviation_bins(gain) * rate / samples as f64),
            Estimate::normal("level_db", level_db, denoised::PEAK_DB),
        ],
        statement: format!(
            "a continuous tone at {:.4} MHz (or {:.4} MHz, as sampled), {level_db:.1} dB relative to the peak sample, runs through all frames \
             {how}; its phase advances by {:.3} turns per chirp",
            frequency_hz * 1e-6,
            (wrapped - wrapped.signum()) * rate * 1e-6,
            slow
        ),
        energy: strength * strength * (frames * evidence.cube.channels() * loops * samples) as f64,
        correction,
        ..Candidate::new(Behaviour::Tone, Place::at(Stage::Receiver), p_value, gain)
    }
}

/// Power around a tone over the noise in the quieter half of the held-out frames, with it and once it is taken away.
struct Around {
    before: f64,
    after: f64,
    /// Of either, by the noise alone.
    deviation: f64,
}

fn around(evidence: &Evidence, (slow, fast): (f64, f64), amplitudes: &Grid<Complex64, 2>) -> Around {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let near = |turns: f64, length: usize| -> Vec<usize> {
        let middle = (turns * length as f64).round() as i64;
        (-AROUND..=AROUND).map(|step| (middle + step).rem_euclid(length as i64) as usize).collect()
    };
    let (dopplers, ranges) = (near(slow, loops), near(fast, samples));
    let cells: Vec<usize> =
        dopplers.iter().flat_map(|doppler| ranges.iter().map(move |range| doppler * samples + range)).collect();
    let tone: Vec<Complex64> = (0..loops * samples).map(|i| tone(slow, fast, i / samples, i % samples)).collect();
    let tone = transform(&tone, samples);
    // A line is in all frames; a mover that comes near it is not.
    let mut frames: Vec<[f64; 2]> = (evidence.split.held_out.par_iter())
        .map(|&frame| {
            let of_channel = |channel: usize| {
                let map = evidence.range_doppler(frame, channel);
                let (amplitude, noise) = (amplitudes[[frame, channel]], evidence.noise()[channel]);
                [0.0, 1.0].map(|share| -> f64 {
                    let powers = cells.iter().map(|&cell| (map[cell] - share * amplitude * tone[cell]).norm_sqr() - noise);
                    powers.sum::<f64>() / noise.max(1e-300)
                })
            };
            (0..channels).map(of_channel).fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
        })
        .collect();
    frames.sort_by(|a, b| a[0].total_cmp(&b[0]));
    frames.truncate(frames.len().div_ceil(2));
    let deviation = ((frames.len() * channels * cells.len()) as f64).sqrt();
    let [before, after] = frames.into_iter().fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
    Around { before, after, deviation }
}

/// Whether static clutter at other ranges has the same line, in proportion to what it is: then everything is modulated.
fn is_sideband(evidence: &Evidence, slow: f64, fast: f64) -> bool {
    let samples = evidence.cube.dims[4];
    let own = fast * samples as f64;
    let apart = |bin: usize| (bin as f64 - own + 0.5 * samples as f64).rem_euclid(samples as f64) - 0.5 * samples as f64;
    let elsewhere: Vec<usize> = (0..samples).filter(|&bin| apart(bin).abs() > AROUND as f64).collect();
    let clutter: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(samples).map(spectrum).collect();
    // The window's side lobes of static clutter are in proportion to it, too.
    let line = |frame: usize, channel: usize| spectrum(&turned_back(&evidence.moving(frame, channel), samples, slow));
    // All channels are modulated alike.
    let coherence = |&frame: &usize| {
        let (mut shared, mut lines, mut clutters) = (Complex64::ZERO, 0.0, 0.0);
        for (channel, clutter) in clutter.iter().enumerate() {
            let line = line(frame, channel);
            for &bin in &elsewhere {
                shared += clutter[bin].conj() * line[bin];
                lines += line[bin].norm_sqr();
                clutters += clutter[bin].norm_sqr();
            }
        }
        shared.norm_sqr() / (lines * clutters).max(f64::MIN_POSITIVE)
    };
    median(&mut evidence.split.training.par_iter().map(coherence).collect::<Vec<f64>>()) > SIDEBAND
}

/// Least squares of the tone in every frame and channel, once static clutter is away.
fn amplitudes_of(cube: &Cube, slow: f64, fast: f64) -> Grid<Complex64, 2> {
    let samples = cube.dims[4];
    cube.by_channel(|frame, channel| along(&in_chirps(cube.channel(frame, channel), samples, fast), slow))
}

/// Frequencies over slow and fast time, turns per chirp and per sample, where the tone is strongest.
fn refined(evidence: &Evidence, start: (f64, f64)) -> (f64, f64) {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let frames = (SEARCHED / (channels * loops * samples)).clamp(2, evidence.split.training.len().max(2));
    let searched = evidence.split.training.iter().take(frames);
    let few: Vec<Complex64> = searched
        .flat_map(|&frame| (0..channels).flat_map(move |channel| evidence.cube.channel(frame, channel).to_vec()))
        .collect();
    let few = Cube::new([few.len() / (channels * loops * samples), 1, channels, loops, samples], few);
    let power = |slow: f64, fast: f64| amplitudes_of(&few, slow, fast).values().iter().map(Complex64::norm_sqr).sum::<f64>();
    let mut best = start;
    let mut step = (0.25 / loops as f64, 0.25 / samples as f64);
    for _ in 0..9 {
        let centre = best;
        let mut highest = f64::NEG_INFINITY;
        for i in -2..=2 {
            for j in -2..=2 {
                let at = (centre.0 + f64::from(i) * step.0, centre.1 + f64::from(j) * step.1);
                let found = power(at.0, at.1);
                if found > highest {
                    (highest, best) = (found, at);
                }
            }
        }
        step = (0.5 * step.0, 0.5 * step.1);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    #[test]
    fn a_line_is_a_sideband_where_static_clutter_has_it_too() {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::small(6) };
        let clutter =
            |n: usize| [9.0, 14.0, 23.0].map(|bin| 30.0 * Complex64::cis(TAU * bin * n as f64 / 64.0)).iter().sum::<Complex64>();
        let (slow, fast) = (0.5, 23.0 / 64.0);
        let alternating = |chirp: usize| if chirp.is_multiple_of(2) { 1.02 } else { 0.98 };
        let modulated = Evidence::in_noise(radar.clone(), 3, |[_, _, chirp, n]| clutter(n) * alternating(chirp));
        assert!(is_sideband(&modulated, slow, fast));
        // Near static clutter, whose side lobes are no sidebands, and far from it.
        for slow in [4.4 / 32.0, slow] {
            let spur = Evidence::in_noise(radar.clone(), 4, |[_, _, chirp, n]| clutter(n) + 0.6 * tone(slow, fast, chirp, n));
            assert!(!is_sideband(&spur, slow, fast), "{slow}");
        }
    }
}
