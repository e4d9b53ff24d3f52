//! Something that fluctuates at one range while the others are constant, too little or too slowly to be seen within a frame: a
//! curtain, a plant.
//!
//! What it changes need not look across the receivers as all that is at that range does, for it is a part of that. Its course is
//! judged by how well every frame is predicted by the others.

use std::ops::RangeInclusive;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::course::{Course, Data, Frames};
use super::returns::{Returns, SPACING};
use super::{Free, LEAST_LIKELY, around};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::evidence::{Evidence, blackman_harris};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::effects::Stage;

/// So many times as much, as a share, as the other returns change together: else it is what all of them do.
const ALONE: f64 = 4.0;
/// Bins over which the taper spreads what is independent.
const BINS_PER_VALUE: f64 = 2.0;
/// Ranges that are judged by their course.
const MOST_JUDGED: usize = 8;

/// How a range changes beyond what the others predict.
struct Change {
    bin: usize,
    p_value: f64,
    /// Power beyond the noise.
    excess: f64,
    /// Of all frames, each predicted by the others, nats.
    gain: f64,
    /// Weights by which the training frames predict every frame, of what changes most.
    weights: DMatrix<f64>,
}

pub fn find(evidence: &Evidence, free: &Free) -> Option<Candidate> {
    let frames = super::frames(evidence);
    let Free { returns, strong, quiet, bin_m, .. } = free;
    let mut looks: Vec<(usize, f64, f64)> = quiet
        .iter()
        .filter_map(|&bin| {
            let (chance, excess) = significance(returns, bin, strong, frames)?;
            Some((bin, corrected(chance, quiet.len() as f64), excess))
        })
        .collect();
    looks.sort_by(|a, b| b.2.total_cmp(&a.2));
    let likely = looks.iter().filter(|look| look.1 < LEAST_LIKELY).take(MOST_JUDGED);
    let judged = likely.filter_map(|&(bin, p_value, excess)| judged(returns, bin, strong, frames, (p_value, excess)));
    let judged: Vec<Change> = judged.collect();
    let best = judged.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).filter(|change| change.gain > 0.0)?;
    let patch = patch(&looks, best.bin);
    let all = judged.iter().filter(|change| patch.contains(&change.bin)).map(|change| change.gain).sum::<f64>() / BINS_PER_VALUE;
    let gain = evidence.split.held_out_share() * best.gain.max(all);
    // What fluctuates must not count among what the others are compared with.
    let others: Vec<usize> =
        strong.iter().copied().filter(|bin| !patch.contains(bin) && bin.abs_diff(best.bin) >= SPACING).collect();
    let of = |bin: usize| significance(returns, bin, &others, frames).map_or(0.0, |(_, excess)| excess.max(0.0));
    let [changed, power] =
        others.iter().fold([0.0, 0.0], |[changed, power], &bin| [changed + of(bin), power + returns.power(bin)]);
    let alone = best.excess * power > ALONE * changed * returns.power(best.bin);
    alone.then(|| candidate(evidence, best, gain, [patch.start(), patch.end()].map(|bin| *bin as f64 * bin_m), *bin_m, patch))
}

/// The ranges around one that change without a gap.
fn patch(looks: &[(usize, f64, f64)], bin: usize) -> RangeInclusive<usize> {
    let changes = |bin: usize| looks.iter().any(|look| look.0 == bin && look.1 < LEAST_LIKELY);
    let (mut first, mut last) = (bin, bin);
    while first > 0 && changes(first - 1) {
        first -= 1;
    }
    while changes(last + 1) {
        last += 1;
    }
    first..=last
}

/// Chance that the noise alone makes what changes at a range, and the power of that beyond the noise.
fn significance(returns: &Returns, bin: usize, others: &[usize], frames: Frames) -> Option<(f64, f64)> {
    let series = returns.relative(bin, others)?;
    let (mut square, mut power) = (0.0, 0.0);
    for &frame in frames.training {
        let variance = returns.variance(frame, bin);
        let beside: f64 = returns.beside(frame, bin).iter().map(|value| value.norm_sqr()).sum();
        square += 2.0 * beside / variance;
        power += beside + returns.power(bin) * (series.change[frame].norm_sqr() - series.variance[frame].iter().sum::<f64>())
            - (returns.channels - 1) as f64 * variance;
    }
    let [re, im] = series.excess(frames.training);
    let (numbers, count) = (2.0 * returns.channels as f64, frames.training.len() as f64);
    Some((chi2_tail(square + re + im, numbers * (count - 1.0)), power / count))
}

fn judged(returns: &Returns, bin: usize, others: &[usize], frames: Frames, (p_value, excess): (f64, f64)) -> Option<Change> {
    let series = returns.relative(bin, others)?;
    let own = series.courses(frames);
    let parts: Vec<Vec<Complex64>> = (0..series.change.len()).map(|frame| returns.beside(frame, bin)).collect();
    let beside: Vec<Vec<f64>> = (0..2 * returns.channels)
        .map(|part| parts.iter().map(|values| if part % 2 == 0 { values[part / 2].re } else { values[part / 2].im }).collect())
        .collect();
    let noise: Vec<f64> = (0..parts.len()).map(|frame| 0.5 * returns.variance(frame, bin)).collect();
    let data = Data { series: &beside, numbers: 2.0 * (returns.channels - 1) as f64, noise: &noise };
    let course = Course::new(frames, &data);
    let gain = course.predicted + own.iter().map(|course| course.predicted).sum::<f64>();
    let most = own.iter().fold(&course, |most, course| if course.training > most.training { course } else { most });
    Some(Change { bin, p_value, excess, gain, weights: most.weights(frames, &data) })
}

fn candidate(
    evidence: &Evidence,
    change: &Change,
    gain: f64,
    [near_m, far_m]: [f64; 2],
    bin_m: f64,
    patch: RangeInclusive<usize>,
) -> Candidate {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let deviations = deviations(evidence, patch);
    let fluctuations: Vec<Vec<Complex64>> = (change.weights.row_iter())
        .map(|weights| {
            let mut sum = vec![Complex64::ZERO; deviations[0].len()];
            for (weight, deviation) in weights.iter().zip(&deviations) {
                sum.iter_mut().zip(deviation).for_each(|(sum, value)| *sum += value * weight);
            }
            sum
        })
        .collect();
    let power = |values: &Vec<Complex64>| values.iter().map(|value| value.norm_sqr()).sum::<f64>();
    let largest = fluctuations.iter().max_by(|a, b| power(a).total_cmp(&power(b))).cloned().unwrap_or_default();
    let shown = |fluctuation: &Vec<Complex64>| -> f64 {
        fluctuation.iter().zip(&largest).map(|(a, b)| (a * b.conj()).re).sum::<f64>() / power(&largest).max(f64::MIN_POSITIVE)
    };
    let course: Vec<f64> = fluctuations.iter().map(shown).collect();
    let range_m = change.bin as f64 * bin_m;
    let place = Place {
        range_m: Some([near_m - 1.5 * bin_m, far_m + 1.5 * bin_m]),
        velocity_mps: Some([0.0, 0.0]),
        ..Place::at(Stage::Scene)
    };
    Candidate {
        statement: format!(
            "The static return {range_m:.2} m away changes from frame to frame while the other static returns stay{}: something moves \
             there, or passes in front of it.",
            if evidence.body.is_some() { ", and the body's silhouette alone does not explain it" } else { "" }
        ),
        curve: Some(Curve::new(
            format!("Change {range_m:.2} m away"),
            ["time, s", "share of its largest change"],
            [("predicted by the training frames", evidence.starts_s.clone(), course)],
        )),
        energy: fluctuations.iter().map(power).sum::<f64>() * loops as f64,
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|[frame, channel, _], chirp| {
                let fluctuation = &fluctuations[frame][channel * samples..][..samples];
                chirp.iter_mut().zip(fluctuation).for_each(|(value, change)| *value -= change);
            });
        }),
        ..Candidate::new(Behaviour::ChangingAtOneRange, place, change.p_value.max(f64::MIN_POSITIVE), gain)
    }
}

/// What the training frames' mean chirps have around some bins beyond the mean of all of them, `[training frame][channel · sample]`.
fn deviations(evidence: &Evidence, patch: RangeInclusive<usize>) -> Vec<Vec<Complex64>> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let slow = blackman_harris(loops);
    let sum: f64 = slow.iter().sum();
    let mean_chirps = |frame: usize| -> Vec<Complex64> {
        (0..evidence.cube.channels())
            .flat_map(|channel| {
                let mut mean = vec![Complex64::ZERO; samples];
                for (chirp, weight) in evidence.cube.channel(frame, channel).chunks_exact(samples).zip(&slow) {
                    mean.iter_mut().zip(chirp).for_each(|(mean, value)| *mean += value * (weight / sum));
                }
                mean
            })
            .collect()
    };
    let training = &evidence.split.training;
    let mut deviations: Vec<Vec<Complex64>> =
        training.iter().map(|&frame| around(mean_chirps(frame), samples, patch.clone())).collect();
    let mean = mean_chirp(deviations.iter().map(Vec::as_slice), deviations[0].len());
    for deviation in &mut deviations {
        deviation.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
    }
    deviations
}
