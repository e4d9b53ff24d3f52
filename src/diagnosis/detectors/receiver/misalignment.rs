//! Samples that come later or earlier from some frame on, in all channels alike: a buffer that slipped, a converter that started
//! at another time.
//!
//! The mean chirp of a frame is that of the frame before but for what moves, unless its samples have slipped: then it is that of
//! the frame before so many samples on, which no change of gain or phase explains. A frame's even chirps propose, its odd
//! chirps judge.

use std::collections::BTreeMap;
use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;

use super::{
    field::distance,
    support::{dot, energy},
};
use crate::diagnosis::Cube;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::halves;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics::corrected;
use crate::effects::Stage;

/// Fewest frames, loops and samples from which a slip is estimable.
const FEWEST: [usize; 3] = [4, 4, 32];
/// Farthest slip, in samples and as a share of a chirp.
const MOST_SAMPLES: usize = 16;
const MOST_SHARE: usize = 8;
/// A slip leaves less than this share of what is left without it.
const LEAVES: f64 = 0.25;
/// Neighbouring samples of a mean chirp are alike: so many count as one.
const ALIKE: f64 = 4.0;

/// At most one candidate for all frames whose samples slipped. None of too short recordings, or where the radar may move within a
/// frame.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let enough = [frames, loops, samples].iter().zip(FEWEST).all(|(count, fewest)| *count >= fewest);
    if !enough || evidence.accepted_unnamed.contains(&Behaviour::SlippedSamples) {
        return vec![];
    }
    let means: Vec<Vec<[Vec<Complex64>; 2]>> = (0..frames)
        .into_par_iter()
        .map(|frame| (0..channels).map(|channel| halves(evidence.cube.channel(frame, channel), samples)).collect())
        .collect();
    let reach = MOST_SAMPLES.min(samples / MOST_SHARE);
    let independent = (channels * (samples - 2 * reach)) as f64 / ALIKE;
    // Of every frame against the one before: the lag, and what it gains.
    let steps: Vec<(i64, f64)> =
        (1..frames).into_par_iter().map(|frame| step(&means[frame - 1], &means[frame], evidence.noise(), reach)).collect();
    let nats: f64 = steps.iter().map(|step| step.1 * independent).sum();
    if nats <= 0.0 {
        return vec![];
    }
    let offsets: Vec<i64> = std::iter::once(0)
        .chain(steps.iter().scan(0, |offset, step| {
            *offset += step.0;
            Some(*offset)
        }))
        .collect();
    // Most frames are as they should be.
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    offsets.iter().for_each(|&offset| *counts.entry(offset).or_default() += 1);
    let usual = counts.into_iter().max_by_key(|entry| entry.1).map_or(0, |entry| entry.0);
    let late: Vec<i64> = offsets.iter().map(|offset| usual - offset).collect();
    let slipped: Vec<usize> = (0..frames).filter(|&frame| late[frame] != 0).collect();
    let (Some(&first), Some(&last)) = (slipped.first(), slipped.last()) else { return vec![] };
    // Where the radar moves, all returns come later or earlier by the way that it went.
    if evidence.may_move_in_a_frame() {
        return vec![];
    }
    let most = slipped.iter().map(|&frame| late[frame]).max_by_key(|late| late.abs()).unwrap_or(0);
    let tried = (2 * reach * (frames - 1)) as f64;
    let changed = slipped.iter().map(|&frame| moved(&evidence.cube, frame, late[frame])).sum();
    let p_value = corrected((-nats).exp(), tried).max(f64::MIN_POSITIVE);
    vec![Candidate {
        statement: format!(
            "Between frames {first} and {last} the samples of {} frames come up to {} {} than in the others, in all channels alike: \
             a buffer slipped, or the converter started at another time.",
            slipped.len(),
            most.abs(),
            if most > 0 { "later" } else { "earlier" }
        ),
        energy: changed,
        correction: Correction::samples(move |cube| cube.each_chirp(|[frame, ..], chirp| turn(chirp, late[frame]))),
        ..Candidate::new(Behaviour::SlippedSamples, Place { frames: Some(slipped), ..Place::at(Stage::Receiver) }, p_value, nats)
    }]
}

/// By how many samples a frame's mean chirps lag behind those of the frame before (0: none is detected), and what (nats) it gains for
/// one value.
fn step(before: &[[Vec<Complex64>; 2]], after: &[[Vec<Complex64>; 2]], noise: &[f64], reach: usize) -> (i64, f64) {
    let inner = reach..before[0][0].len() - reach;
    let over_channels = |of: &dyn Fn(usize) -> f64| -> f64 { (0..before.len()).map(|at| of(at) / noise[at].max(1e-300)).sum() };
    let left = |half: usize, lag: i64| over_channels(&|at| apart(&before[at][half], &after[at][half], inner.clone(), lag));
    let lags = (-(reach as i64)..=reach as i64).filter(|lag| *lag != 0);
    let Some(lag) = lags.min_by(|&a, &b| left(0, a).total_cmp(&left(0, b))) else { return (0, 0.0) };
    let otherwise = over_channels(&|at| scaled(&before[at][1], &after[at][1], inner.clone()));
    let slipped = left(1, lag);
    if slipped < LEAVES * otherwise { (lag, (otherwise / slipped.max(f64::MIN_POSITIVE)).ln()) } else { (0, 0.0) }
}

/// Energy by which `after` is not `before` so many samples on.
fn apart(before: &[Complex64], after: &[Complex64], inner: Range<usize>, lag: i64) -> f64 {
    let late = |n: usize| (n as i64 + lag) as usize;
    distance(&after[inner.clone()], &before[late(inner.start)..late(inner.end)])
}

/// Energy by which `after` is not `before` with another gain and phase.
fn scaled(before: &[Complex64], after: &[Complex64], inner: Range<usize>) -> f64 {
    let (before, after) = (&before[inner.clone()], &after[inner]);
    energy(after) - dot(before, after).norm_sqr() / energy(before).max(f64::MIN_POSITIVE)
}

/// Brings samples that come so many too late back to their place.
fn turn(chirp: &mut [Complex64], late: i64) {
    let turns = late.rem_euclid(chirp.len() as i64) as usize;
    chirp.rotate_left(turns);
}

/// Energy of what a frame's slip changes.
fn moved(cube: &Cube, frame: usize, late: i64) -> f64 {
    let chirps = (0..cube.channels()).flat_map(|channel| cube.channel(frame, channel).chunks_exact(cube.dims[4]));
    let change = |chirp: &[Complex64]| -> f64 {
        let mut right = chirp.to_vec();
        turn(&mut right, late);
        distance(&right, chirp)
    };
    chirps.map(change).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// Three static returns and a mover in noise; from frame 5 on as `change` has it: so many samples late, turned by a phase.
    fn evidence(late: usize, phase: f64) -> Evidence {
        let mut radar = Radar::small(8);
        (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
        Evidence::in_noise(radar, 4, |[frame, _, slow, n]| {
            let changed = frame >= 5;
            let n = n as f64 - if changed { late as f64 } else { 0.0 };
            let room = Complex64::cis(0.9 * n) * 30.0 + Complex64::cis(0.3 * n + 1.0) * 20.0 + Complex64::cis(1.7 * n) * 10.0;
            let mover = Complex64::cis(0.6 * n + 0.03 * slow as f64 + 1.9 * frame as f64) * 4.0;
            (room + mover) * Complex64::cis(if changed { phase } else { 0.0 })
        })
    }

    #[test]
    fn a_slip_is_found_and_undone_and_a_turned_phase_is_none() {
        let slipped = evidence(3, 0.0);
        let found = find(&slipped);
        assert_eq!(found[0].place.frames.as_deref(), Some(&[5, 6, 7][..]));
        assert!(found[0].p_value < 1e-9 && found[0].nats > 50.0, "{} {}", found[0].p_value, found[0].nats);
        let undone = slipped.with(&found[0]);
        let right = evidence(0, 0.0);
        let pairs = undone.cube.channel(6, 0).iter().zip(right.cube.channel(6, 0)).enumerate().filter(|(i, _)| i % 64 < 60);
        let apart: Vec<f64> = pairs.map(|(_, (a, b))| (a - b).norm_sqr()).collect();
        // Of two draws of noise, each with a variance of 2: exponential with mean 4, within four standard errors.
        let mean = apart.iter().sum::<f64>() / apart.len() as f64;
        let error = 4.0 * 4.0 / (apart.len() as f64).sqrt();
        assert!((mean - 4.0).abs() < error, "{mean} of {}, expected 4 ± {error}", apart.len());
        for other in [evidence(0, 0.0), evidence(0, 1.0)] {
            assert!(find(&other).is_empty());
        }
    }
}
