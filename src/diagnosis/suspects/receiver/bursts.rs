//! Sparse samples that do not belong to their chirp: another radar's crossings and impulses (cards I1, V3).
//!
//! What moves between neighbouring chirps of a channel is small, since Doppler turns phases slowly beside white noise:
//! a chirp less the mean of its two neighbours is mostly noise, and a burst in one chirp stands out by its power.

use std::collections::BTreeSet;
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::support::energy;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Rung};
use crate::diagnosis::statistics::{corrected, median};
use crate::diagnosis::{Cube, Evidence};

/// A sample's power over that of its surroundings, beyond which it is a burst's: e^−25 for noise.
const HIGH: f64 = 25.0;
/// Samples next to it that count once it is known to be hit.
const NEXT: f64 = 6.0;

/// A hit stretch of one chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Burst {
    frame: usize,
    channel: usize,
    chirp: usize,
    first: usize,
    last: usize,
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [frames, _, rx, loops, samples] = evidence.cube.dims;
    if loops < 8 || evidence.accepted.iter().any(|id| ["interference", "impulsive_noise", "adc_saturation"].contains(id)) {
        return vec![];
    }
    let channels = evidence.cube.channels();
    let bursts: Vec<Burst> = (0..frames * channels)
        .into_par_iter()
        .flat_map_iter(|index| of_channel(evidence, index / channels, index % channels))
        .collect();
    let total = (frames * channels * loops * samples) as f64;
    // Bursts are rare: what hits every chirp is something else.
    let hit: usize = bursts.iter().map(|burst| burst.last + 1 - burst.first).sum();
    if bursts.is_empty() || hit as f64 > 0.05 * total {
        return vec![];
    }
    // Hits of one chirp in all receivers at once are one burst.
    let places: BTreeSet<(usize, usize, usize)> =
        bursts.iter().map(|burst| (burst.frame, burst.channel / rx, burst.chirp)).collect();
    let together = bursts.len() as f64 / places.len() as f64;
    let seen_by_all = rx > 1 && together > 0.5 * rx as f64;
    let p_value = corrected((-HIGH * bursts.len() as f64).exp(), total);
    let held: BTreeSet<usize> = evidence.split.held_out.iter().copied().collect();
    let mut gain = 0.0;
    let mut removed = 0.0;
    for burst in &bursts {
        let repaired = repair(&evidence.cube, burst);
        let chirp = chirp_of(&evidence.cube, burst);
        let energy: f64 = repaired.iter().zip(&chirp[burst.first..]).map(|(a, b)| (a - b).norm_sqr()).sum();
        removed += energy;
        if held.contains(&burst.frame) {
            gain += energy / evidence.noise()[burst.channel].max(1e-300);
        }
    }
    // Few bursts may all be in training frames; then the training frames' own say is worth its share.
    if gain <= 0.0 {
        return vec![];
    }
    let list = |values: BTreeSet<usize>| Some(values.into_iter().collect::<Vec<_>>());
    let place = Place {
        frames: list(bursts.iter().map(|burst| burst.frame).collect()),
        chirps: list(bursts.iter().map(|burst| burst.chirp).collect()),
        samples: list(bursts.iter().flat_map(|burst| burst.first..=burst.last).collect()),
        rx: (!seen_by_all).then(|| bursts.iter().map(|b| b.channel % rx).collect::<BTreeSet<_>>().into_iter().collect()),
        ..Place::at(if seen_by_all { "receiver" } else { "noise" })
    };
    let lengths: f64 = hit as f64 / bursts.len() as f64;
    let single = lengths < 2.0;
    let (id, look_alikes) = match (seen_by_all, single) {
        (true, false) => ("interference", vec![]),
        (true, true) => ("interference", vec!["impulsive_noise"]),
        (false, true) => ("impulsive_noise", vec![]),
        (false, false) => ("impulsive_noise", vec!["interference"]),
    };
    let count = places.len() as f64;
    let estimates = if id == "interference" { vec![Estimate::normal("bursts", count, 0.1 * count + 0.6)] } else { vec![] };
    let statement = if id == "interference" {
        format!(
            "{count} chirps hold a burst of {lengths:.0} samples that all receivers see at once and that neither the chirp before \
             nor after has: another radar crosses the band",
        )
    } else {
        format!("{} single samples of {count} chirps stand far above the noise, each in one receiver: impulses", bursts.len())
    };
    vec![Candidate {
        id: Some(id),
        behaves_like: "sparse additive",
        estimates,
        choice: None,
        place,
        p_value,
        gain,
        rung: Rung::F,
        look_alikes,
        statement,
        curve: None,
        energy: removed,
        correction: Correction::Samples(Arc::new(move |cube: &mut Cube| {
            let repaired: Vec<Vec<Complex64>> = bursts.iter().map(|burst| repair(cube, burst)).collect();
            for (burst, values) in bursts.iter().zip(repaired) {
                let start = ((burst.frame * cube.channels() + burst.channel) * cube.dims[3] + burst.chirp) * cube.dims[4];
                cube.samples[start + burst.first..=start + burst.last].copy_from_slice(&values);
            }
        })),
    }]
}

fn chirp_of<'a>(cube: &'a Cube, burst: &Burst) -> &'a [Complex64] {
    let samples = cube.dims[4];
    &cube.channel(burst.frame, burst.channel)[burst.chirp * samples..][..samples]
}

/// The chirps before and after, or the two on the side that there is.
fn neighbours(chirp: usize, loops: usize) -> [usize; 2] {
    if chirp == 0 {
        [1, 2]
    } else if chirp + 1 == loops {
        [loops - 2, loops - 3]
    } else {
        [chirp - 1, chirp + 1]
    }
}

/// A chirp less what its neighbours let expect of it.
fn difference(signal: &[Complex64], chirp: usize, loops: usize, samples: usize) -> Vec<Complex64> {
    let [a, b] = neighbours(chirp, loops);
    // At the ends a straight line is continued, in the middle it is halved.
    let (from_a, from_b) = if chirp == 0 || chirp + 1 == loops { (2.0, -1.0) } else { (0.5, 0.5) };
    (0..samples)
        .map(|n| signal[chirp * samples + n] - signal[a * samples + n] * from_a - signal[b * samples + n] * from_b)
        .collect()
}

fn of_channel(evidence: &Evidence, frame: usize, channel: usize) -> Vec<Burst> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let signal = evidence.cube.channel(frame, channel);
    let differences: Vec<Vec<Complex64>> = (0..loops).map(|chirp| difference(signal, chirp, loops, samples)).collect();
    // What is usual at this fast-time sample in this frame (movers and clutter that changes), by its median, and what is
    // usual in this chirp; a burst must stand above both.
    let usual: Vec<f64> = (0..samples)
        .map(|n| {
            let mut powers: Vec<f64> = differences.iter().map(|difference| difference[n].norm_sqr()).collect();
            median(&mut powers) / std::f64::consts::LN_2
        })
        .collect();
    let mut bursts = vec![];
    for chirp in 0..loops {
        let ends = if chirp == 0 || chirp + 1 == loops { 4.0 } else { 1.0 };
        let mut powers: Vec<f64> = differences[chirp].iter().map(Complex64::norm_sqr).collect();
        let own = median(&mut powers.clone()) / std::f64::consts::LN_2;
        powers.iter_mut().zip(&usual).for_each(|(power, usual)| *power /= (ends * usual).max(own).max(1e-300));
        let [a, b] = neighbours(chirp, loops);
        let mut n = 0;
        while n < samples {
            if powers[n] > HIGH {
                let (mut first, mut last) = (n, n);
                while first > 0 && powers[first - 1] > NEXT {
                    first -= 1;
                }
                while last + 1 < samples && powers[last + 1] > NEXT {
                    last += 1;
                }
                // A hit neighbour makes this chirp look hit with half the amplitude: the strongest of them is it.
                let here = energy(&differences[chirp][first..=last]);
                let strongest = [a, b].iter().all(|&other| here >= energy(&differences[other][first..=last]));
                if strongest {
                    bursts.push(Burst { frame, channel, chirp, first, last });
                }
                n = last;
            }
            n += 1;
        }
    }
    bursts
}

/// What the neighbours let expect of the hit samples.
fn repair(cube: &Cube, burst: &Burst) -> Vec<Complex64> {
    let [_, _, _, loops, samples] = cube.dims;
    let signal = cube.channel(burst.frame, burst.channel);
    let difference = difference(signal, burst.chirp, loops, samples);
    (burst.first..=burst.last).map(|n| signal[burst.chirp * samples + n] - difference[n]).collect()
}
