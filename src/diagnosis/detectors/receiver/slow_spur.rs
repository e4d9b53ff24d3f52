//! A continuous tone whose phase advances so little from chirp to chirp that it stands among what hardly moves.
//!
//! No single frame distinguishes it from a slow limb. But its phase goes on from frame to frame through the whole recording, by one
//! number of turns a chirp and another one a frame (a frame's period need not be a multiple of a chirp's, and whole turns do not
//! show), and its beat frequency stays: what turns so evenly and moves would have left its range.

use std::f64::consts::TAU;

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use rayon::prelude::*;

use super::line::in_chirps;
use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::evidence::hann;
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Cube, Evidence};

/// Frames that are looked at, at most; and at least.
const MOST_FRAMES: usize = 16;
const FEWEST_FRAMES: usize = 6;
/// Power over the noise that three quarters of the frames must exceed.
const LEAST_POWER: f32 = 10.0;
/// Numbers of turns a frame that are tried, per frame of the recording.
const FINE: usize = 4;
/// Cells of Doppler by which a tone may be beside the strongest one, and steps in which it is sought.
const BESIDE: f64 = 1.0;
const STEPS: usize = 16;
/// Share of the power there that must go on from frame to frame, and that this must predict of the held-out frames.
const COHERENT: f64 = 0.95;
const PREDICTED: f64 = 0.9;
/// Range bins that what turns so, and moves, leaves during the recording at least, and up to which share of that a tone may seem to.
const LEAST_BINS: f64 = 0.8;
const STAYS: f64 = 0.3;
/// Chance at which what goes on at the opposite Doppler frequency is none: what is modulated, or oscillates about its place, has
/// both.
const OPPOSITE: f64 = 1e-3;

/// How a tone turns from loop to loop, and from one frame's beginning to the next.
#[derive(Clone, Copy, Debug)]
pub struct Turns {
    pub per_loop: f64,
    pub per_frame: f64,
}

impl Turns {
    fn opposite(self) -> Self {
        Self { per_loop: -self.per_loop, per_frame: -self.per_frame }
    }

    /// Phase of every chirp, `[frame · loops + loop]`; `frames`: when each begins, in frame periods.
    fn of_chirps(self, frames: &[f64], loops: usize) -> Vec<Complex64> {
        let of = |i: usize| self.per_frame * frames[i / loops] + self.per_loop * (i % loops) as f64;
        (0..frames.len() * loops).map(|i| Complex64::cis(TAU * of(i))).collect()
    }
}

/// A tone through the whole recording.
pub struct SlowSpur {
    pub turns: Turns,
    /// Turns per sample.
    pub fast: f64,
    /// When each frame begins, in frame periods.
    pub starts: Vec<f64>,
    /// By channel.
    pub amplitudes: Vec<Complex64>,
    pub p_value: f64,
    pub gain: f64,
}

/// What of a tone each frame of a channel holds, `[channel][frame]`.
type Held = Vec<Vec<Complex64>>;

/// Spectra over the samples of all chirps of some frames, without static clutter.
struct Spectra<'a> {
    evidence: &'a Evidence,
    /// That are looked at, those to train on first, and how many these are.
    frames: Vec<usize>,
    training: usize,
    /// `[frame that is looked at][channel][loop · sample]`
    values: Vec<Vec<Vec<Complex64>>>,
    /// When each frame of the recording begins, in frame periods.
    starts: Vec<f64>,
    /// Over a frame's loops.
    window: Vec<f64>,
}

pub fn find(evidence: &Evidence) -> Option<SlowSpur> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let first = |frames: &[usize]| frames.iter().copied().take(MOST_FRAMES).collect::<Vec<usize>>();
    let (training, held_out) = (first(&evidence.split.training), first(&evidence.split.held_out));
    if training.len() < FEWEST_FRAMES || held_out.is_empty() || loops < 8 {
        return None;
    }
    let cells: Vec<[usize; 2]> = (2..evidence.range_bins()).filter_map(|bin| steadiest(evidence, &training, bin)).collect();
    if cells.is_empty() {
        return None;
    }
    let spectra = Spectra::new(evidence, &training, &held_out);
    let found: Vec<Tone> = cells.par_iter().map(|&cell| spectra.tone(cell)).collect();
    let Tone { bin, turns, coherence } = found.into_iter().max_by(|a, b| a.coherence.total_cmp(&b.coherence))?;
    let walk = spectra.walk_bins(turns);
    if coherence < COHERENT || walk < LEAST_BINS || spectra.predicted(turns, bin) < PREDICTED {
        return None;
    }
    // Half of the recording is half of the way.
    let halves = training.split_at(training.len() / 2);
    let [early, late] = [halves.0, halves.1].map(|frames| spectra.beat(frames, turns, bin));
    if (late - early).abs() > STAYS * 0.5 * walk {
        return None;
    }
    let fast = spectra.beat(&training, turns, bin) / samples as f64;
    if spectra.opposite(turns, bin) < OPPOSITE {
        return None;
    }
    let tried = (cells.len() * STEPS * FINE * evidence.cube.dims[0]) as f64;
    let p_value = corrected((1.0 - coherence).max(1e-16).powi(training.len() as i32 - 1), tried);
    let amplitudes = amplitudes(&evidence.cube, &spectra.starts, turns, fast);
    let count = (loops * samples * held_out.len()) as f64;
    let gain = amplitudes.iter().zip(evidence.noise()).map(|(a, noise)| a.norm_sqr() * count / noise.max(1e-300) - 1.0).sum();
    Some(SlowSpur { turns, fast, starts: spectra.starts, amplitudes, p_value, gain })
}

/// At a range, what goes on from frame to frame most.
struct Tone {
    bin: usize,
    turns: Turns,
    /// Share of the training frames' power that is their mean's.
    coherence: f64,
}

/// The Doppler frequency at which a range is strong in most frames.
fn steadiest(evidence: &Evidence, training: &[usize], bin: usize) -> Option<[usize; 2]> {
    let maps = evidence.maps();
    let [_, loops, _] = maps.shape();
    let quartile = |doppler: usize| {
        let of_frame = |&frame: &usize| maps[[frame, doppler, bin]];
        let mut powers: Vec<f32> = training.iter().map(of_frame).collect();
        powers.sort_by(f32::total_cmp);
        powers[powers.len() / 4]
    };
    let (doppler, power) = (0..loops).map(|doppler| (doppler, quartile(doppler))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (power > LEAST_POWER).then_some([doppler, bin])
}

impl<'a> Spectra<'a> {
    fn new(evidence: &'a Evidence, training: &[usize], held_out: &[usize]) -> Self {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let (window, fft) = (hann(samples), FftPlanner::new().plan_fft_forward(samples));
        let of_channel = |frame: usize, channel: usize| {
            let mut chirps = evidence.moving(frame, channel);
            chirps.iter_mut().zip(window.iter().cycle()).for_each(|(value, weight)| *value *= weight);
            fft.process(&mut chirps);
            chirps
        };
        let frames = [training, held_out].concat();
        let values = frames
            .par_iter()
            .map(|&frame| (0..evidence.cube.channels()).map(|channel| of_channel(frame, channel)).collect())
            .collect();
        let starts = evidence.starts_s.iter().map(|start_s| start_s / evidence.radar.frame_period_s).collect();
        Self { evidence, frames, training: training.len(), values, starts, window: hann(loops) }
    }

    /// Power of the frames to train on.
    fn energy(&self, held: &Held) -> f64 {
        held.iter().flat_map(|channel| &channel[..self.training]).map(Complex64::norm_sqr).sum()
    }

    /// Near a Doppler cell: the turns from loop to loop that hold most, and those from frame to frame that go on best.
    fn tone(&self, [doppler, bin]: [usize; 2]) -> Tone {
        let loops = self.evidence.cube.dims[3] as f64;
        let power = |per_loop: f64| self.energy(&self.held(per_loop, bin));
        let step = 2.0 * BESIDE / (STEPS as f64 * loops);
        let centre = wrapped(doppler as f64 / loops);
        let first = (0..=STEPS).map(|index| centre - BESIDE / loops + index as f64 * step);
        let first = first.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(centre);
        let per_loop = climb(power, first, 0.5 * step, 1e-3 * step).0;
        let held = self.held(per_loop, bin);
        let energy = self.energy(&held).max(f64::MIN_POSITIVE);
        let coherence = |per_frame: f64| self.goes_on(&held, per_frame) / energy;
        let count = FINE * self.evidence.cube.dims[0];
        let best = (0..count).map(|index| index as f64 / count as f64).max_by(|a, b| coherence(*a).total_cmp(&coherence(*b)));
        let (per_frame, coherence) = climb(coherence, best.unwrap_or(0.0), 0.5 / count as f64, 1e-3 / count as f64);
        Tone { bin, turns: Turns { per_loop, per_frame }, coherence }
    }

    /// What each frame holds of something that turns so from loop to loop, at a range.
    fn held(&self, per_loop: f64, bin: usize) -> Held {
        let samples = self.evidence.cube.dims[4];
        let turns: Vec<Complex64> =
            self.window.iter().enumerate().map(|(i, weight)| Complex64::cis(-TAU * per_loop * i as f64) * weight).collect();
        let of = |values: &Vec<Complex64>| -> Complex64 {
            values.iter().skip(bin).step_by(samples).zip(&turns).map(|(value, turn)| value * turn).sum()
        };
        let of_channel = |channel: usize| self.values.iter().map(|frame| of(&frame[channel])).collect();
        (0..self.evidence.cube.channels()).map(of_channel).collect()
    }

    /// Turned back to the recording's beginning, by channel.
    fn turned_back(&self, held: &Held, per_frame: f64) -> Held {
        let turn = |&frame: &usize| Complex64::cis(-TAU * per_frame * self.starts[frame]);
        let frames: Vec<Complex64> = self.frames.iter().map(turn).collect();
        held.iter().map(|channel| channel.iter().zip(&frames).map(|(value, turn)| value * turn).collect()).collect()
    }

    /// Power of the frames to train on that is their mean's.
    fn goes_on(&self, held: &Held, per_frame: f64) -> f64 {
        let mean =
            |channel: &Vec<Complex64>| channel[..self.training].iter().sum::<Complex64>().norm_sqr() / self.training as f64;
        self.turned_back(held, per_frame).iter().map(mean).sum()
    }

    /// Chance that so much of what lies at the opposite Doppler frequency goes on from frame to frame, once the tone is away.
    fn opposite(&self, turns: Turns, bin: usize) -> f64 {
        let opposite = turns.opposite();
        let own = self.turned_back(&self.held(turns.per_loop, bin), turns.per_frame);
        let leak = |frame: &usize| {
            let turned = |(i, weight): (usize, &f64)| Complex64::cis(2.0 * TAU * turns.per_loop * i as f64) * weight;
            let within = self.window.iter().enumerate().map(turned).sum::<Complex64>() / self.window.iter().sum::<f64>();
            within * Complex64::cis(TAU * turns.per_frame * self.starts[*frame])
        };
        let leaks: Vec<Complex64> = self.frames.iter().map(leak).collect();
        let mut left = self.held(opposite.per_loop, bin);
        for (channel, own) in left.iter_mut().zip(own) {
            let mean = own[..self.training].iter().sum::<Complex64>() / self.training as f64;
            channel.iter_mut().zip(&leaks).for_each(|(value, leak)| *value -= mean * leak);
        }
        let coherence = self.goes_on(&left, opposite.per_frame) / self.energy(&left).max(f64::MIN_POSITIVE);
        (1.0 - coherence).clamp(1e-16, 1.0).powi(self.training as i32 - 1)
    }

    /// Share of the held-out frames' power that the training frames' mean predicts.
    fn predicted(&self, turns: Turns, bin: usize) -> f64 {
        let (mut left, mut all) = (0.0, 0.0);
        for channel in self.turned_back(&self.held(turns.per_loop, bin), turns.per_frame) {
            let (training, held_out) = channel.split_at(self.training);
            let mean = training.iter().sum::<Complex64>() / training.len() as f64;
            left += held_out.iter().map(|value| (value - mean).norm_sqr()).sum::<f64>();
            all += held_out.iter().map(Complex64::norm_sqr).sum::<f64>();
        }
        1.0 - left / f64::max(all, f64::MIN_POSITIVE)
    }

    /// Range bins that something with that Doppler frequency passes during the recording.
    fn walk_bins(&self, turns: Turns) -> f64 {
        let radar = &self.evidence.radar;
        let [first, last] = [0, self.training - 1].map(|index| self.evidence.starts_s[self.frames[index]]);
        let duration_s = last - first;
        let velocity_mps = 0.5 * radar.wavelength_m() * turns.per_loop.abs() / radar.loop_period_s();
        velocity_mps * duration_s / radar.range_resolution_m()
    }

    /// Beat frequency of what goes on from frame to frame, in bins: the top of its spectrum near one.
    fn beat(&self, frames: &[usize], turns: Turns, bin: usize) -> f64 {
        let [_, _, _, loops, samples] = self.evidence.cube.dims;
        let phases = turns.of_chirps(&self.starts, loops);
        let of_channel = |channel: usize| {
            let mut mean = vec![Complex64::ZERO; samples];
            for &frame in frames {
                for (index, chirp) in self.evidence.moving(frame, channel).chunks_exact(samples).enumerate() {
                    let turn = phases[frame * loops + index].conj() * self.window[index];
                    mean.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * turn);
                }
            }
            mean
        };
        let means: Vec<Complex64> = (0..self.evidence.cube.channels()).flat_map(of_channel).collect();
        let power = |at: f64| in_chirps(&means, samples, at / samples as f64).iter().map(Complex64::norm_sqr).sum::<f64>();
        climb(power, bin as f64, 0.25, 1e-3).0
    }
}

/// Turns between −½ and ½.
fn wrapped(turns: f64) -> f64 {
    turns - turns.round()
}

/// Least squares over the whole recording, beside static clutter, by channel.
pub fn amplitudes(cube: &Cube, starts: &[f64], turns: Turns, fast: f64) -> Vec<Complex64> {
    let [frames, _, _, loops, samples] = cube.dims;
    let phases = turns.of_chirps(starts, loops);
    // What a mean over all chirps takes of the tone.
    let mean = phases.iter().sum::<Complex64>() / phases.len() as f64;
    let square: f64 = phases.iter().map(|turn| (turn - mean).norm_sqr()).sum();
    let of_channel = |channel: usize| {
        let chirps = (0..frames).flat_map(|frame| in_chirps(cube.channel(frame, channel), samples, fast));
        chirps.zip(&phases).map(|(value, turn)| value * (turn - mean).conj()).sum::<Complex64>() / square.max(f64::MIN_POSITIVE)
    };
    (0..cube.channels()).into_par_iter().map(of_channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// A wall, and something at a range that turns by a frequency and goes away by so many bins per second.
    fn evidence(frequency_hz: f64, bins_per_s: f64) -> Evidence {
        let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::small(12) };
        radar.frame_period_s = 0.1;
        let clock = radar.clone();
        Evidence::in_noise(radar, 3, |[frame, rx, index, n]| {
            let time_s = clock.chirp_time_s(frame, 0, index);
            let bin = 12.3 + bins_per_s * time_s;
            let wall = Complex64::cis(TAU * 20.0 * n as f64 / 64.0) * 50.0;
            wall + Complex64::cis(TAU * (bin * n as f64 / 64.0 + frequency_hz * time_s) + rx as f64) * 2.0
        })
    }

    #[test]
    fn a_tone_that_goes_on_from_frame_to_frame_is_distinguished_from_what_goes_away() {
        let radar = evidence(0.0, 0.0).radar;
        let bins_per_s = |frequency_hz: f64| 0.5 * radar.wavelength_m() * frequency_hz / radar.range_resolution_m();
        // Far enough that what moves leaves its range.
        let frequency_hz = 2.0 / bins_per_s(1.0);
        let found = find(&evidence(frequency_hz, 0.0)).expect("a tone");
        let off = |turns: f64, wanted: f64| wrapped(turns - wanted).abs();
        let [per_loop, per_frame] = [radar.loop_period_s(), radar.frame_period_s].map(|period_s| frequency_hz * period_s);
        assert!(off(found.turns.per_loop, per_loop) < 1e-3, "{:?} of {per_loop}", found.turns);
        assert!(off(found.turns.per_frame, per_frame) < 2e-3, "{:?} of {per_frame}", found.turns);
        assert!((found.fast * 64.0 - 12.3).abs() < 0.02, "{}", found.fast * 64.0);
        assert!(found.p_value < 1e-9 && found.gain > 100.0, "{} {}", found.p_value, found.gain);
        assert!(find(&evidence(frequency_hz, 2.0)).is_none());
        // Too slow for that: it may be anything.
        assert!(find(&evidence(0.1 * frequency_hz, 0.0)).is_none());
    }
}
