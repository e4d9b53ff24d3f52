//! One frame of one channel that is not like the others: samples that slipped, a frame that was written over.
//!
//! Static clutter is alike in all frames. Movers leave remains in it, which all channels of a frame share in power,
//! range by range; so the odd one stands out from its frame's other channels, by more than any other does. A frame is
//! all there is of it, so its even chirps propose and its odd chirps judge.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::Cube;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::halves;
use crate::diagnosis::evidence::{Evidence, spectrum};
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics::{corrected, median};
use crate::effects::Stage;

/// Fewest frames and channels among which one can be odd.
const FEWEST_FRAMES: usize = 6;
const FEWEST_CHANNELS: usize = 2;
/// Deviations of the scores' law that the odd one's is out at least, and how many times the next one's.
const STANDS_OUT: f64 = 10.0;
const FROM_THE_NEXT: f64 = 2.0;
/// Of the scores, which are sums of logarithms: without noise they would all be alike.
const LEAST_SPREAD: f64 = 1e-3;
/// Median absolute deviation to standard deviation of a normal law.
const TO_DEVIATION: f64 = 1.4826;

/// Mean chirps of the even and of the odd loops less the channel's mean over the other frames.
struct Deviation {
    halves: [Vec<Complex64>; 2],
    /// |spectrum|² of both halves' mean over the noise's expectation, by range.
    power: Vec<f64>,
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [frames, _, receivers, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    if frames < FEWEST_FRAMES
        || channels < FEWEST_CHANNELS
        || loops < 4
        || evidence.accepted_unnamed.contains(&Behaviour::SingleFrame)
    {
        return vec![];
    }
    let means: Vec<[Vec<Complex64>; 2]> = (0..frames * channels)
        .into_par_iter()
        .map(|at| halves(evidence.cube.channel(at / channels, at % channels), samples))
        .collect();
    let deviations = |without: Option<usize>| -> Vec<Deviation> {
        let of = |at: usize| {
            let (frame, channel) = (at / channels, at % channels);
            let others: Vec<usize> = (0..frames).filter(|&other| other != frame && Some(other) != without).collect();
            let mut rest = vec![Complex64::ZERO; samples];
            for half in others.iter().flat_map(|other| &means[other * channels + channel]) {
                rest.iter_mut().zip(half).for_each(|(sum, value)| *sum += value / (2 * others.len()) as f64);
            }
            let halves = [0, 1].map(|half| means[at][half].iter().zip(&rest).map(|(a, b)| a - b).collect::<Vec<_>>());
            let mean: Vec<Complex64> = halves[0].iter().zip(&halves[1]).map(|(a, b)| (a + b) / 2.0).collect();
            let noise = evidence.noise()[channel].max(1e-300) / loops as f64;
            Deviation { power: spectrum(&mean).iter().map(|value| value.norm_sqr() / noise).collect(), halves }
        };
        (0..frames * channels).into_par_iter().map(of).collect()
    };
    let largest = |scores: &[f64]| (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
    // The odd one is in all others' means, too: it is judged against what they are without it.
    let Some(odd) = largest(&scores(&deviations(None), channels)) else { return vec![] };
    let (frame, channel) = (odd / channels, odd % channels);
    let deviations = deviations(Some(frame));
    let scores = scores(&deviations, channels);
    let next = (0..scores.len()).filter(|&at| at != odd).map(|at| scores[at]).fold(0.0, f64::max);
    if scores[odd] < STANDS_OUT.max(FROM_THE_NEXT * next) {
        return vec![];
    }
    // Scores of remains of movers have a longer tail than a normal law's.
    let p_value = corrected((-scores[odd]).exp(), scores.len() as f64).max(f64::MIN_POSITIVE);
    let total = |at: usize| deviations[at].power.iter().sum::<f64>();
    let usual = (0..deviations.len()).filter(|&at| at != odd).map(total).sum::<f64>() / (deviations.len() - 1) as f64;
    let ratio = total(odd) / usual.max(f64::MIN_POSITIVE);
    // What the even chirps deviate by predicts the odd ones.
    let [even, uneven] = &deviations[odd].halves;
    let floor = (usual / samples as f64).max(1.0);
    let noise = floor * evidence.noise()[channel].max(1e-300) / (0.5 * loops as f64);
    let gain = uneven.iter().zip(even).map(|(a, b)| a.norm_sqr() - (a - b).norm_sqr()).sum::<f64>() / noise;
    let change: Vec<Complex64> = even.iter().zip(uneven).map(|(a, b)| (a + b) / 2.0).collect();
    let energy = change.iter().map(|value| value.norm_sqr()).sum::<f64>() * loops as f64;
    let size = loops * samples;
    vec![Candidate {
        id: None,
        behaves_like: Behaviour::SingleFrame,
        estimates: vec![],
        choice: None,
        place: Place {
            frames: Some(vec![frame]),
            rx: Some(vec![channel % receivers]),
            tx: (channels > receivers).then(|| vec![channel / receivers]),
            ..Place::at(Stage::Receiver)
        },
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "In frame {frame} receiver {} sees the room otherwise than in all other frames, with {:.1} times the power of \
             the usual deviation, and no other receiver does at those ranges: that frame of that receiver was corrupted or shifted.",
            channel % receivers,
            ratio
        ),
        curve: None,
        energy,
        correction: Correction::Samples(Arc::new(move |cube: &mut Cube| {
            let start = odd * size;
            for chirp in cube.samples[start..start + size].chunks_exact_mut(change.len()) {
                chirp.iter_mut().zip(&change).for_each(|(value, change)| *value -= change);
            }
        })),
    }]
}

/// How far every deviation is out of its frame's other channels', over the ranges, in deviations from the median:
/// `[frame, channel]`.
fn scores(deviations: &[Deviation], channels: usize) -> Vec<f64> {
    let others = (channels - 1) as f64;
    let raw = |at: usize| -> f64 {
        let frame = at / channels * channels..(at / channels + 1) * channels;
        let out = |(range, own): (usize, &f64)| {
            let all: f64 = deviations[frame.clone()].iter().map(|deviation| deviation.power[range]).sum();
            // The likelihood ratio of one power against so many others of one law, which is never below the noise's.
            (own / (all - own).max(others)).ln_1p()
        };
        deviations[at].power.iter().enumerate().map(out).sum()
    };
    let scores: Vec<f64> = (0..deviations.len()).map(raw).collect();
    let middle = median(&mut scores.clone());
    let mut apart: Vec<f64> = scores.iter().map(|score| (score - middle).abs()).collect();
    let spread = TO_DEVIATION * median(&mut apart);
    scores.iter().map(|score| (score - middle) / spread.max(LEAST_SPREAD)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// Two static returns and a slow mover in noise.
    fn evidence(slip: usize) -> Evidence {
        let mut radar = Radar::small(8);
        (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
        Evidence::in_noise(radar, 4, |[frame, rx, slow, n]| {
            let n = if (frame, rx) == (3, 1) { n + slip } else { n } as f64;
            let mover = Complex64::cis(0.6 * n + 0.03 * slow as f64 + 1.9 * frame as f64) * 4.0;
            Complex64::cis(0.9 * n + 0.4 * rx as f64) * 30.0 + mover
        })
    }

    #[test]
    fn a_slipped_frame_is_found_where_it_is_and_nothing_is_nothing() {
        let found = find(&evidence(3));
        let place = &found[0].place;
        assert_eq!((place.frames.as_deref(), place.rx.as_deref()), (Some(&[3][..]), Some(&[1][..])));
        assert!(found[0].p_value < 1e-6 && found[0].gain > 15.0, "{} {}", found[0].p_value, found[0].gain);
        assert!(find(&evidence(3).with(&found[0])).is_empty());
        assert!(find(&evidence(0)).is_empty());
    }
}
