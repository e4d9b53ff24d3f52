//! A tone that keeps its beat frequency while its Doppler frequency says that it moves, where nobody is tracked.
//!
//! What moves leaves its range, by the integral of its velocity; a frequency that wanders from frame to frame beside the chirps does
//! not. A return that oscillates about its place has both Doppler frequencies, and a tone has one.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rayon::prelude::*;

use super::line::{along, in_chirps, turned_back};
use crate::diagnosis::cube::Cube;
use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::evidence::{Evidence, hann};
use crate::diagnosis::power::CLUTTER_BINS;
use crate::diagnosis::statistics::{corrected, mean_power_tail, median, normal_tails};
use crate::grid::Grid;

/// Fewest loops and training frames that show a Doppler frequency and a way.
const FEWEST_LOOPS: usize = 8;
const FEWEST_FRAMES: usize = 3;
/// Chance at which what lies at the opposite Doppler frequency is no noise.
const OPPOSITE: f64 = 1e-3;
/// Share of the power at its range that a tone may leave: as in `spur`.
const LEFT_OVER: f64 = 0.2;
/// Standard deviations within which a tone stays at its beat frequency, between the halves of a recording and in its median frame:
/// 0.3 % of normal errors lie beyond.
const STAYS: f64 = 3.0;

/// One Doppler frequency for each frame, at one beat frequency.
#[derive(Clone)]
pub struct Wandering {
    /// Turns per loop, by frame; per sample.
    pub slow: Vec<f64>,
    /// Turns per sample.
    pub fast: f64,
    /// `[frame, channel]`.
    pub amplitudes: Grid<Complex64, 2>,
    pub p_value: f64,
    pub gain: f64,
}

/// The steadiest line that does not move as its Doppler frequency says. None where somebody is tracked, or of too few loops or
/// frames.
pub fn find(evidence: &Evidence) -> Option<Wandering> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    if evidence.body.is_some() || loops < FEWEST_LOOPS || training.len() < FEWEST_FRAMES || held_out.is_empty() {
        return None;
    }
    let (bin, p_line) = most_steady(evidence)?;
    let slow: Vec<f64> = (0..frames).map(|frame| strongest_doppler(evidence, frame, bin) as f64 / loops as f64).collect();
    let (slow, fast) = refined(evidence, slow, bin as f64 / samples as f64);
    let amplitudes = amplitudes(&evidence.cube, &slow, fast);
    let way = Way::of(evidence, &slow, fast, &amplitudes);
    let stays = way.measured.abs() < STAYS * way.deviation;
    if !stays
        || !is_in_each(evidence, &slow, fast, &amplitudes)
        || leaves_much(evidence, &slow, fast, &amplitudes)
        || has_opposite(evidence, &slow, fast, &amplitudes)
    {
        return None;
    }
    let count = (loops * samples) as f64;
    let of_frame = |&frame: &usize| -> f64 {
        let own = amplitudes.below([frame]);
        // A frequency per frame and an amplitude per frame and channel are fitted: one nat each is chance.
        own.iter().zip(evidence.noise()).map(|(a, noise)| a.norm_sqr() * count / noise.max(1e-300) - 1.0).sum::<f64>() - 1.0
    };
    let gain = held_out.iter().map(of_frame).sum();
    let p_moves = normal_tails(way.apart() / way.deviation);
    Some(Wandering { slow, fast, amplitudes, p_value: p_line.max(p_moves), gain })
}

impl Wandering {
    /// Whether a cell of the range-Doppler maps is its own in some frame.
    pub fn is_at(&self, [doppler, range]: [usize; 2], [loops, samples]: [usize; 2]) -> bool {
        let apart = |turns: f64, bin: usize, count: usize| {
            let off = turns - bin as f64 / count as f64;
            (off - off.round()).abs() * count as f64
        };
        let near = self.slow.iter().filter(|slow| apart(**slow, doppler, loops) < 2.0).count();
        apart(self.fast, range, samples) < 2.0 && near > 0
    }
}

/// The range whose strongest Doppler frequency beside zero stands out most in the median frame, and the chance of that.
fn most_steady(evidence: &Evidence) -> Option<(usize, f64)> {
    let loops = evidence.cube.dims[3];
    let (maps, training) = (evidence.maps(), &evidence.split.training);
    let power = |bin: usize| {
        let of_frame = |&frame: &usize| f64::from(maps[[frame, strongest_doppler(evidence, frame, bin), bin]]);
        median(&mut training.iter().map(of_frame).collect::<Vec<f64>>())
    };
    let bins = evidence.range_bins();
    let (bin, power) = (2..bins).into_par_iter().map(|bin| (bin, power(bin))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let each = corrected(mean_power_tail(power, evidence.cube.channels() as f64), loops as f64).max(1e-300);
    // The median exceeds a bound only if half of the frames do.
    let half = 0.5 * training.len() as f64;
    let p_value = corrected((half * (each.ln() + 2.0 * std::f64::consts::LN_2)).exp().min(1.0), bins as f64);
    (p_value < 0.5).then_some((bin, p_value))
}

fn strongest_doppler(evidence: &Evidence, frame: usize, bin: usize) -> usize {
    let loops = evidence.cube.dims[3];
    let power = |doppler: usize| evidence.maps()[[frame, doppler, bin]];
    let moving = (0..loops).filter(|&doppler| doppler.min(loops - doppler) > CLUTTER_BINS);
    moving.max_by(|&a, &b| power(a).total_cmp(&power(b))).unwrap_or(0)
}

/// The frequencies at which most power lies: of every frame beside the chirps, and of all together along them.
fn refined(evidence: &Evidence, mut slow: Vec<f64>, mut fast: f64) -> (Vec<f64>, f64) {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    for _ in 0..2 {
        slow = slow
            .par_iter()
            .enumerate()
            .map(|(frame, &start)| {
                let chirps: Vec<Vec<Complex64>> =
                    (0..channels).map(|channel| of_chirps(evidence.cube.channel(frame, channel), samples, fast)).collect();
                let power = |slow: f64| chirps.iter().map(|chirps| along(chirps, slow).norm_sqr()).sum::<f64>();
                climb(power, start, 0.5 / loops as f64, 1e-3 / loops as f64).0
            })
            .collect();
        fast = beat(evidence, &evidence.split.training, &slow, fast);
    }
    (slow, fast)
}

/// Turns per sample at which some frames have most power.
fn beat(evidence: &Evidence, frames: &[usize], slow: &[f64], start: f64) -> f64 {
    let (channels, samples) = (evidence.cube.channels(), evidence.cube.dims[4]);
    // One chirp for each frame and channel.
    let of = |(frame, channel): (usize, usize)| turned_back(&evidence.moving(frame, channel), samples, slow[frame]);
    let all: Vec<(usize, usize)> = frames.iter().flat_map(|&frame| (0..channels).map(move |channel| (frame, channel))).collect();
    let sums = all.into_par_iter().map(of).collect::<Vec<_>>().concat();
    let power = |fast: f64| in_chirps(&sums, samples, fast).iter().map(Complex64::norm_sqr).sum::<f64>();
    climb(power, start, 0.5 / samples as f64, 1e-4 / samples as f64).0
}

/// How far it went between the halves of the training frames, in range bins.
struct Way {
    measured: f64,
    deviation: f64,
    /// What its Doppler frequencies say, and how far apart their aliases are.
    said: f64,
    alias: f64,
}

impl Way {
    fn of(evidence: &Evidence, slow: &[f64], fast: f64, tone: &Grid<Complex64, 2>) -> Self {
        let samples = evidence.cube.dims[4];
        let training = &evidence.split.training;
        let halves = training.split_at(training.len() / 2);
        let [early, late] = [halves.0, halves.1].map(|frames| beat(evidence, frames, slow, fast) * samples as f64);
        let energy = |frames: &[usize]| frames.iter().map(|&frame| energy(evidence, tone, frame)).sum::<f64>();
        let radar = &evidence.radar;
        let bins_per_turn = 0.5 * radar.wavelength_m() / radar.range_resolution_m() / radar.loop_period_s();
        let wrapped = |turns: f64| turns - turns.round();
        // The way from the first frame on, by the trapezoid rule, and its means over both halves.
        let mut at = vec![0.0];
        for pair in training.windows(2) {
            let step_s = evidence.starts_s[pair[1]] - evidence.starts_s[pair[0]];
            let speed = 0.5 * (wrapped(slow[pair[0]]) + wrapped(slow[pair[1]])) * bins_per_turn;
            at.push(at[at.len() - 1] + speed * step_s);
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let time = |frames: &[usize]| mean(&frames.iter().map(|&frame| evidence.starts_s[frame]).collect::<Vec<f64>>());
        let (first, second) = at.split_at(halves.0.len());
        Self {
            measured: late - early,
            deviation: deviation_bins(energy(halves.0)).hypot(deviation_bins(energy(halves.1))),
            said: mean(second) - mean(first),
            alias: bins_per_turn * (time(halves.1) - time(halves.0)),
        }
    }

    /// Range bins by which the nearest alias of what its Doppler frequencies say is off.
    fn apart(&self) -> f64 {
        let off = self.said - self.measured;
        (off - self.alias * (off / self.alias).round()).abs()
    }
}

/// Of the tone in a frame, over the noise.
fn energy(evidence: &Evidence, tone: &Grid<Complex64, 2>, frame: usize) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let own = tone.below([frame]).iter().zip(evidence.noise());
    own.map(|(a, noise)| a.norm_sqr() / noise.max(1e-300)).sum::<f64>() * (loops * samples) as f64
}

/// Of a frequency, in bins, from a tone's energy over the noise: Cramér and Rao's bound with a Hann window's loss, and a fiftieth of a bin
/// for all else.
pub fn deviation_bins(energy: f64) -> f64 {
    0.02f64.hypot(1.3 * (6.0 / energy.max(1.0)).sqrt() / TAU)
}

/// Whether half of the frames or more have the tone at its beat frequency. Limbs that swing about a range are found at one Doppler
/// frequency or another in every frame, and anywhere in the cell.
fn is_in_each(evidence: &Evidence, slow: &[f64], fast: f64, tone: &Grid<Complex64, 2>) -> bool {
    let of_frame = |&frame: &usize| {
        let off = (beat(evidence, &[frame], slow, fast) - fast) * evidence.cube.dims[4] as f64;
        off.abs() / deviation_bins(energy(evidence, tone, frame))
    };
    median(&mut evidence.split.training.iter().map(of_frame).collect::<Vec<f64>>()) < STAYS
}

/// Whether the range has much of other velocities, as what turns or walks has.
fn leaves_much(evidence: &Evidence, slow: &[f64], fast: f64, tone: &Grid<Complex64, 2>) -> bool {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let weight: f64 = hann(samples).iter().sum();
    let (mut left, mut all) = (0.0, 0.0);
    for (frame, channel) in evidence.split.training.iter().flat_map(|&frame| (0..channels).map(move |channel| (frame, channel))) {
        let amplitude = tone[[frame, channel]];
        let noise = evidence.noise()[channel] / (weight * weight);
        for (index, value) in of_chirps(evidence.cube.channel(frame, channel), samples, fast).into_iter().enumerate() {
            left += (value - amplitude * Complex64::cis(TAU * slow[frame] * index as f64)).norm_sqr() - noise;
        }
        all += amplitude.norm_sqr() * loops as f64;
    }
    left > LEFT_OVER * all
}

/// Whether more than noise lies at the opposite Doppler frequency of the same range once the tone is away.
fn has_opposite(evidence: &Evidence, slow: &[f64], fast: f64, tone: &Grid<Complex64, 2>) -> bool {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let (window, taper) = (hann(loops), hann(samples));
    let weight = window.iter().sum::<f64>() * taper.iter().sum::<f64>();
    let power = |&frame: &usize| -> f64 {
        let turn = slow[frame];
        // What the window leaves of the tone itself there.
        let leak: Complex64 =
            window.iter().enumerate().map(|(i, w)| Complex64::cis(2.0 * TAU * turn * i as f64) * w).sum::<Complex64>()
                / window.iter().sum::<f64>();
        let of_channel = |channel: usize| {
            let chirps = of_chirps(evidence.cube.channel(frame, channel), samples, fast);
            let left = along(&chirps, -turn) - tone[[frame, channel]] * leak;
            left.norm_sqr() * weight * weight / evidence.noise()[channel].max(1e-300)
        };
        (0..channels).map(of_channel).sum()
    };
    let frames = &evidence.split.training;
    let count = (frames.len() * channels) as f64;
    mean_power_tail(frames.par_iter().map(power).collect::<Vec<f64>>().into_iter().sum::<f64>() / count, count) < OPPOSITE
}

/// Of each chirp, the amplitude at a beat frequency, without their mean.
fn of_chirps(signal: &[Complex64], samples: usize, fast: f64) -> Vec<Complex64> {
    let mut chirps = in_chirps(signal, samples, fast);
    let mean = chirps.iter().sum::<Complex64>() / chirps.len() as f64;
    chirps.iter_mut().for_each(|value| *value -= mean);
    chirps
}

/// Of the tone in every frame and channel, beside static clutter.
pub fn amplitudes(cube: &Cube, slow: &[f64], fast: f64) -> Grid<Complex64, 2> {
    let samples = cube.dims[4];
    cube.by_channel(|frame, channel| along(&of_chirps(cube.channel(frame, channel), samples, fast), slow[frame]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// A wall, and something at a range that turns by a frequency (Hz, of each frame) and goes away by bins per second;
    /// `oscillates`: its phase is sinusoidal instead.
    fn evidence(frequency_hz: impl Fn(usize) -> f64, bins_per_s: f64, oscillates: bool) -> Evidence {
        let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, ..Radar::small(16) };
        radar.frame_period_s = 0.1;
        let clock = radar.clone();
        Evidence::in_noise(radar, 3, |[frame, rx, index, n]| {
            let (time_s, within_s) = (clock.chirp_time_s(frame, 0, index), clock.chirp_time_s(0, 0, index));
            let turns = frequency_hz(frame) * within_s + 0.37 * frame as f64;
            let phase = if oscillates { 1.0 * (TAU * turns).sin() } else { TAU * turns };
            let wall = Complex64::cis(TAU * 20.0 * n as f64 / 64.0) * 50.0;
            wall + Complex64::cis(TAU * (12.3 + bins_per_s * time_s) * n as f64 / 64.0 + phase + rx as f64) * 2.0
        })
    }

    #[test]
    fn what_keeps_its_range_is_a_tone_and_what_leaves_it_or_oscillates_is_none() {
        let radar = evidence(|_| 0.0, 0.0, false).radar;
        let loops_hz = radar.loop_period_s().recip();
        let wanders = |frame: usize| loops_hz * (0.2 + 0.004 * (frame as f64).sin());
        let bins_per_s = 0.5 * radar.wavelength_m() * 0.2 * loops_hz / radar.range_resolution_m();
        let found = find(&evidence(wanders, 0.0, false)).expect("a tone");
        assert!((found.fast * 64.0 - 12.3).abs() < 0.02, "{}", found.fast * 64.0);
        assert!(found.p_value < 1e-6 && found.gain > 100.0, "{} {}", found.p_value, found.gain);
        assert!(found.is_at([6, 12], [32, 64]) && !found.is_at([6, 20], [32, 64]) && !found.is_at([26, 12], [32, 64]));
        // What moves as its Doppler frequency says, or nearly.
        let sure = |found: Option<Wandering>| found.filter(|found| found.p_value < 1e-3);
        for share in [1.0, 0.9] {
            assert!(sure(find(&evidence(wanders, share * bins_per_s, false))).is_none(), "{share}");
        }
        assert!(sure(find(&evidence(wanders, 0.0, true))).is_none());
        assert!(sure(find(&evidence(|_| 0.0, 0.0, false))).is_none());
        // Elsewhere within the cell in each frame, and on average where it was.
        let swings = Evidence::in_noise(radar.clone(), 4, |[frame, rx, index, n]| {
            let turns = wanders(frame) * radar.chirp_time_s(0, 0, index) + 0.37 * frame as f64;
            let bin = 12.0 + [0.3, -0.2, -0.3, 0.2][frame % 4];
            Complex64::cis(TAU * (bin * n as f64 / 64.0 + turns) + rx as f64) * 2.0
        });
        assert!(sure(find(&swings)).is_none());
    }
}
