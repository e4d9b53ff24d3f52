//! A region of ranges and Doppler frequencies, and what moves in it taken out of the samples.

use std::sync::{Arc, LazyLock};

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::Evidence;
use crate::diagnosis::cube::Cube;
use crate::diagnosis::evidence::spectrum;
use crate::diagnosis::finding::Correction;
use crate::diagnosis::statistics::median;

/// Bins (not whole numbers, ends included) that may be negative: an interval around the zero frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// From and to.
    pub range: [f64; 2],
    /// From and to.
    pub doppler: [f64; 2],
}

/// Doppler bins around zero where a Hann window leaves static clutter.
pub const CLUTTER_BINS: usize = 1;

/// Whether a Doppler bin is none of those.
pub fn moves(doppler: usize, loops: usize) -> bool {
    doppler.min(loops - doppler) > CLUTTER_BINS
}

/// Mean of a cell of the maps, `doppler · samples + range`, over some frames.
pub fn mean_power(evidence: &Evidence, frames: &[usize], cell: usize) -> f64 {
    let maps = evidence.maps();
    frames.iter().map(|&frame| f64::from(maps.below([frame])[cell])).sum::<f64>() / frames.len().max(1) as f64
}

/// The same of all cells.
pub fn mean_map(evidence: &Evidence, frames: &[usize]) -> Vec<f64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    (0..loops * samples).map(|cell| mean_power(evidence, frames, cell)).collect()
}

/// Doppler bins, of so many frames as one, that move at a range and were not taken out.
pub fn left(evidence: &Evidence, range: usize, run: usize) -> impl Iterator<Item = usize> + '_ {
    let loops = run * evidence.cube.dims[3];
    (0..loops).filter(move |&doppler| moves(doppler, loops) && !evidence.is_emptied(doppler / run, range))
}

/// Median of a map, `doppler · samples + range`, of so many frames as one, over what moves at a range and was not taken out, if anything.
pub fn floor(evidence: &Evidence, map: &[f64], range: usize, run: usize) -> Option<f64> {
    let samples = evidence.cube.dims[4];
    let mut left: Vec<f64> = left(evidence, range, run).map(|doppler| map[doppler * samples + range]).collect();
    (!left.is_empty()).then(|| median(&mut left))
}

/// Log-likelihood that a cell's power in a frame, a mean over the channels of exponential laws, gains by an expected mean over noise alone.
pub fn power_gain(evidence: &Evidence, frame: usize, cell: usize, expected: f64) -> f64 {
    let (power, expected) = (f64::from(evidence.maps().below([frame])[cell]), expected.max(1.0));
    evidence.cube.channels() as f64 * (power * (1.0 - 1.0 / expected) - expected.ln())
}

/// Share of its noise without which a cell says nothing of it: 1 dB.
const LOST: f64 = 0.2;
/// Bins beyond an interval's ends that its tones may leak into.
const MARGIN: f64 = 0.5;

/// Orthonormal basis, `[vector][sample]`, of all tones whose frequency lies in an interval of bins.
pub fn tones(length: usize, [low, high]: [f64; 2]) -> Vec<Vec<Complex64>> {
    let (low, high) = (low - MARGIN, high + MARGIN);
    let count = (((high - low) / 0.5).ceil() as usize + 1).min(2 * length);
    let mut basis: Vec<Vec<Complex64>> = vec![];
    for i in 0..count {
        let bin = low + (high - low) * i as f64 / (count - 1).max(1) as f64;
        let mut tone: Vec<Complex64> = (0..length)
            .map(|n| Complex64::cis(std::f64::consts::TAU * bin * n as f64 / length as f64) / (length as f64).sqrt())
            .collect();
        // Gram–Schmidt, twice for accuracy.
        for _ in 0..2 {
            for known in &basis {
                let share: Complex64 = known.iter().zip(&tone).map(|(k, t)| k.conj() * t).sum();
                tone.iter_mut().zip(known).for_each(|(t, k)| *t -= share * k);
            }
        }
        let norm = tone.iter().map(|t| t.norm_sqr()).sum::<f64>().sqrt();
        // Tones that the others contain already.
        if norm > 1e-3 {
            tone.iter_mut().for_each(|t| *t /= norm);
            basis.push(tone);
        }
    }
    basis
}

/// How many consecutive frames follow one another without a gap, as blocks of one long frame do.
pub fn run(evidence: &Evidence) -> usize {
    if evidence.split.block_loops.is_none() {
        return 1;
    }
    let loop_s = evidence.radar.loop_period_s();
    let length_s = evidence.cube.dims[3] as f64 * loop_s;
    let gap = |pair: &[f64]| pair[1] - pair[0] - length_s > 0.5 * loop_s;
    let run = 1 + evidence.starts_s.windows(2).take_while(|pair| !gap(pair)).count();
    if evidence.cube.dims[0].is_multiple_of(run) { run } else { 1 }
}

/// Consecutive frames of one channel as one, `[loop, sample]`, less static clutter over the training frames of this
/// cube.
pub fn joined(cube: &Cube, clutter: &[Complex64], frames: std::ops::Range<usize>, channel: usize) -> Vec<Complex64> {
    let samples = cube.dims[4];
    let mean = &clutter[channel * samples..][..samples];
    frames
        .flat_map(|frame| cube.channel(frame, channel).chunks_exact(samples))
        .flat_map(|chirp| chirp.iter().zip(mean).map(|(value, mean)| value - mean))
        .collect()
}

/// Takes a region out of the samples, as they are then.
pub fn removal(evidence: &Evidence, run: usize, region: Region) -> Correction {
    let training = evidence.split.training.clone();
    let [_, _, _, loops, samples] = evidence.cube.dims;
    // Not before it is accepted, and then once.
    let tones = Arc::new(LazyLock::new(move || Tones::new([loops, samples], run, region)));
    let emptied = tones.clone();
    let holds = move |doppler: usize, range: usize| emptied.doppler[doppler] * emptied.range[range] > LOST;
    Correction::Emptied(Arc::new(move |cube| remove(cube, &training, run, &tones)), Arc::new(holds))
}

/// Orthonormal bases of a region's tones along both axes, `[vector][sample]`, and what they hold of each bin of a frame's maps.
struct Tones {
    fast: Vec<Vec<Complex64>>,
    slow: Vec<Vec<Complex64>>,
    /// Share of the noise.
    doppler: Vec<f64>,
    range: Vec<f64>,
}

impl Tones {
    fn new([loops, samples]: [usize; 2], run: usize, region: Region) -> Self {
        let (fast, slow) = (tones(samples, region.range), tones(run * loops, region.doppler));
        let range = shares(&fast, samples);
        let doppler = shares(&slow, loops).into_iter().map(|sum| sum / run as f64).collect();
        Self { fast, slow, doppler, range }
    }
}

/// Of each bin under a Hann window over some samples, the share that lies in a basis; the sum over all stretches of so many.
fn shares(basis: &[Vec<Complex64>], length: usize) -> Vec<f64> {
    let mut sum = vec![0.0; length];
    for stretch in basis.iter().flat_map(|vector| vector.chunks_exact(length)) {
        sum.iter_mut().zip(spectrum(stretch)).for_each(|(sum, value)| *sum += value.norm_sqr());
    }
    sum
}

/// Subtracts from every run of frames what deviates, within the region, from static clutter over the training frames.
/// That is the mean of the cube at hand: other static returns may have been subtracted or may not.
fn remove(cube: &mut Cube, training: &[usize], run: usize, tones: &Tones) {
    let [frames, _, _, loops, samples] = cube.dims;
    let channels = cube.channels();
    let clutter = cube.clutter(training);
    let parts: Vec<(usize, usize)> = (0..frames / run).flat_map(|part| (0..channels).map(move |c| (part, c))).collect();
    let found: Vec<Vec<Complex64>> = parts
        .par_iter()
        .map(|&(part, channel)| {
            let moving = joined(cube, &clutter, part * run..(part + 1) * run, channel);
            within(&moving, samples, &tones.fast, &tones.slow)
        })
        .collect();
    cube.each_chirp(|[frame, channel, index], chirp| {
        if let Some(part) = found.get(frame / run * channels + channel) {
            let start = (frame % run * loops + index) * samples;
            chirp.iter_mut().zip(&part[start..start + samples]).for_each(|(value, moving)| *value -= moving);
        }
    });
}

/// Projection of `[loop, sample]` on tones of both axes.
fn within(values: &[Complex64], samples: usize, fast: &[Vec<Complex64>], slow: &[Vec<Complex64>]) -> Vec<Complex64> {
    // `[loop][fast tone]`
    let along: Vec<Vec<Complex64>> = values
        .chunks_exact(samples)
        .map(|chirp| fast.iter().map(|tone| chirp.iter().zip(tone).map(|(v, t)| v * t.conj()).sum()).collect())
        .collect();
    let mut part = vec![Complex64::ZERO; values.len()];
    for s in slow {
        let mut line = vec![Complex64::ZERO; samples];
        for (i, tone) in fast.iter().enumerate() {
            let share: Complex64 = along.iter().zip(s).map(|(a, s)| a[i] * s.conj()).sum();
            line.iter_mut().zip(tone).for_each(|(sum, t)| *sum += share * t);
        }
        for (chirp, s) in part.chunks_exact_mut(samples).zip(s) {
            chirp.iter_mut().zip(&line).for_each(|(sum, value)| *sum += value * s);
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_inside_goes_and_one_outside_stays() {
        let (loops, samples) = (16, 64);
        let tone = |range: f64, doppler: f64| -> Vec<Complex64> {
            (0..loops * samples)
                .map(|i| {
                    let turns = range * (i % samples) as f64 / samples as f64 + doppler * (i / samples) as f64 / loops as f64;
                    Complex64::cis(std::f64::consts::TAU * turns)
                })
                .collect()
        };
        let region = Region { range: [9.0, 12.0], doppler: [-4.0, -2.0] };
        let left = |range: f64, doppler: f64| {
            let mut values = tone(range, doppler);
            values.extend(vec![Complex64::ZERO; loops * samples]);
            // The second frame alone is for training: there is no static clutter.
            let mut cube = Cube::new([2, 1, 1, loops, samples], values);
            remove(&mut cube, &[1], 1, &Tones::new([loops, samples], 1, region));
            cube.samples.iter().map(|v| v.norm_sqr()).sum::<f64>() / (loops * samples) as f64
        };
        assert!(left(10.37, -2.81) < 1e-4, "{}", left(10.37, -2.81));
        // The basis holds tones between bins, whose side lobes reach far.
        assert!(left(30.0, -3.0) > 0.97, "{}", left(30.0, -3.0));
        assert!(left(10.0, 5.0) > 0.9, "{}", left(10.0, 5.0));
    }

    #[test]
    fn cells_that_are_taken_out_have_lost_their_noise_and_others_have_not() {
        for run in [1, 4] {
            let region = Region { range: [10.0, 13.0], doppler: [3.0 * run as f64, 6.0 * run as f64] };
            let Tones { doppler: slow, range: fast, .. } = Tones::new([16, 64], run, region);
            assert!(slow[4] > 0.99 && slow[5] > 0.99 && fast[11] > 0.99, "{run}: {slow:?}");
            assert!(slow[12] < 0.05 && fast[30] < 0.05, "{run}: {slow:?}");
        }
    }

    #[test]
    fn static_clutter_stays_whatever_was_known_of_it_before() {
        let (loops, samples) = (8, 32);
        let clutter = |i: usize| Complex64::cis(std::f64::consts::TAU * 4.3 * (i % samples) as f64 / samples as f64) * 1e3;
        let slow =
            |i: usize| Complex64::cis(std::f64::consts::TAU * 3.0 * (i / samples % (2 * loops)) as f64 / (2 * loops) as f64);
        let values: Vec<Complex64> = (0..4 * loops * samples).map(|i| clutter(i) + clutter(i) * 0.01 * slow(i)).collect();
        let mut cube = Cube::new([4, 1, 1, loops, samples], values);
        // The same mean over training frames as over all, because whole periods fit.
        let region = Region { range: [3.0, 6.0], doppler: [2.0, 4.0] };
        remove(&mut cube, &[0, 1], 2, &Tones::new([loops, samples], 2, region));
        let worst = cube.samples.iter().enumerate().map(|(i, v)| (v - clutter(i)).norm()).fold(0.0, f64::max);
        assert!(worst < 0.5, "{worst} of a mover of 10 is left, or static returns of 1000 are gone");
    }
}
