//! Sparse samples that do not belong to their chirp: another radar's crossings and impulses.
//!
//! What moves between neighbouring chirps of a channel is small, since Doppler turns phases slowly beside white noise:
//! a chirp less the mean of its two neighbours is mostly noise, and a burst in one chirp stands out by its power.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::burst::Burst;
use super::crossings::{self, Crossings};
use super::levels::Levels;
use super::support::energy;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::description::Description;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, OfSample, Place};
use crate::diagnosis::statistics::{corrected, fisher_tail, median, poisson_tail};
use crate::diagnosis::{Cube, Evidence, Volume};
use crate::effects::{Stage, adc_saturation, impulsive_noise, interference};

/// A sample's power over that of its surroundings, beyond which it is a burst's: e^−25 for noise of a known power.
const HIGH: f64 = 25.0;
/// Chance above which crossings that no single sample shows are none.
const LEAST_LIKELY: f64 = 1e-3;
/// For each crossing that hardly stands out there may be so many that do not.
const UNSEEN: f64 = 5.0;
/// Degrees of freedom of a median of powers, for each chirp: 2 ln² 2 for one that is independent, and those of differences to the mean of
/// both neighbours have correlations of 4/9 and 1/36.
const MEDIAN_FREEDOM: f64 = 0.494;
/// Part of a chirp, at either end.
const EDGES: usize = 16;
/// Samples next to it that count once it is known to be hit.
const NEXT: f64 = 6.0;

/// At most one candidate for all bursts together. None of fewer than eight loops, or once bursts or clipping were accepted.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let known = evidence.accepted.iter().any(|id| [interference::ID, impulsive_noise::ID, adc_saturation::ID].contains(id))
        || evidence.accepted_unnamed.contains(&Behaviour::SparseAdditive);
    if loops < 8 || known {
        return vec![];
    }
    let channels = evidence.cube.channels();
    // What was taken out of ranges is fitted by tones over the whole chirp, and errs at its ends.
    let edge = if evidence.emptied.is_empty() { 0 } else { samples.div_ceil(EDGES) };
    let is_inside = |burst: &Burst| burst.last >= edge && burst.first + edge < samples;
    let (mut bursts, chances): (Vec<Burst>, Vec<f64>) = (0..frames * channels)
        .into_par_iter()
        .flat_map_iter(|index| of_channel(evidence, index / channels, index % channels))
        .filter(|(burst, _)| is_inside(burst))
        .unzip();
    let are_there = |crossings: &Crossings| crossings.p_value < LEAST_LIKELY && crossings.bursts.iter().any(is_inside);
    let crossings = crossings::find(evidence).filter(are_there);
    if let Some(crossings) = &crossings {
        // What one channel shows on its own has its extent from there.
        let weak = crossings.bursts.iter().filter(|weak| bursts.iter().all(|burst| !burst.overlaps(weak)));
        bursts.extend(weak.copied().collect::<Vec<_>>());
    }
    let total = (frames * channels * loops * samples) as f64;
    // Bursts are rare: what hits every chirp is something else.
    let hit: usize = bursts.iter().map(|burst| burst.last + 1 - burst.first).sum();
    if bursts.is_empty() || hit as f64 > 0.05 * total {
        return vec![];
    }
    let alone = chance_of_all(chances, total);
    let p_value = crossings.as_ref().map_or(alone, |crossings| alone.min(crossings.p_value));
    let powers: Vec<Vec<f64>> = bursts.iter().map(|burst| powers(&evidence.cube, burst)).collect();
    let (mut nats, mut removed) = (0.0, 0.0);
    for (burst, powers) in bursts.iter().zip(&powers) {
        let energy: f64 = powers.iter().sum();
        removed += energy;
        let unforeseen = stencil_noise(burst.chirp, loops);
        nats += energy / (unforeseen * evidence.noise()[burst.channel]).max(1e-300) - powers.len() as f64;
    }
    // Few bursts may all be in training frames. Each is judged by what its neighbours predict, in whatever frame it is: the
    // gain is what held-out frames would show in the mean over which of them are held out.
    nats *= evidence.split.held_out_share();
    if nats <= 0.0 {
        return vec![];
    }
    let (description, look_alikes, place) = claim(evidence, &bursts, hit, crossings.as_ref());
    let volume = Volume { of_samples: Some(Arc::new(spread(evidence, &bursts, &powers))), ..Volume::KEPT };
    vec![Candidate {
        look_alikes,
        energy: removed,
        correction: Correction::inverse(volume, move |cube| repair_all(cube, &bursts)),
        ..description.candidate(Behaviour::SparseAdditive, place, p_value, nats)
    }]
}

/// Another radar, or impulses, or what the library has no name for, with what looks like it, and its place; `hit`: samples of all bursts.
fn claim(
    evidence: &Evidence,
    bursts: &[Burst],
    hit: usize,
    crossings: Option<&Crossings>,
) -> (Description, Vec<&'static str>, Place) {
    let rx = evidence.cube.dims[2];
    // Hits of one chirp in all receivers at once are one burst.
    let places: BTreeSet<(usize, usize, usize)> =
        bursts.iter().map(|burst| (burst.frame, burst.channel / rx, burst.chirp)).collect();
    let seen_by_all = rx > 1 && together(bursts, rx) > 0.5;
    let list = |values: BTreeSet<usize>| Some(values.into_iter().collect::<Vec<_>>());
    let place = Place {
        frames: list(bursts.iter().map(|burst| burst.frame).collect()),
        chirps: list(bursts.iter().map(|burst| burst.chirp).collect()),
        samples: list(bursts.iter().flat_map(|burst| burst.first..=burst.last).collect()),
        rx: (!seen_by_all).then(|| bursts.iter().map(|b| b.channel % rx).collect::<BTreeSet<_>>().into_iter().collect()),
        ..Place::at(if seen_by_all { Stage::Receiver } else { Stage::Noise })
    };
    let lengths: f64 = hit as f64 / bursts.len() as f64;
    let single = lengths < 2.0;
    // Where there is one receiver, only its extent says what a burst is.
    let (id, look_alikes) = match (seen_by_all || rx == 1 && !single, single) {
        (true, false) => (interference::ID, if rx == 1 { vec![impulsive_noise::ID] } else { vec![] }),
        (true, true) => (interference::ID, vec![impulsive_noise::ID]),
        (false, true) => (impulsive_noise::ID, if rx == 1 { vec![interference::ID] } else { vec![] }),
        (false, false) => (impulsive_noise::ID, vec![interference::ID]),
    };
    let (count, number) = (places.len() as f64, bursts.len());
    let estimates = if id == interference::ID { vec![bursts_in_all(count, crossings)] } else { vec![] };
    let (observed, cause) = if id == interference::ID {
        let all = if rx > 1 { "that all receivers see at once and " } else { "" };
        let observed =
            format!("{count} chirps hold a burst of {lengths:.0} samples {all}that neither the chirp before nor after has");
        (observed, "another radar crosses the band")
    } else {
        (format!("{number} single samples of {count} chirps stand far above the noise, each in one receiver"), "impulses")
    };
    (Description::named(evidence, id, estimates, [observed, cause.into()]), look_alikes, place)
}

/// Share of the other receivers that a burst hits too, at the same samples: mean over the bursts.
fn together(bursts: &[Burst], rx: usize) -> f64 {
    let mut of_chirp: BTreeMap<(usize, usize, usize), Vec<&Burst>> = BTreeMap::new();
    for burst in bursts {
        of_chirp.entry((burst.frame, burst.channel / rx, burst.chirp)).or_default().push(burst);
    }
    let hit_by = |burst: &Burst, all: &[&Burst]| {
        let meets = |other: &&&Burst| other.channel != burst.channel && other.first <= burst.last && burst.first <= other.last;
        all.iter().filter(meets).map(|other| other.channel).collect::<BTreeSet<_>>().len()
    };
    let hits: usize = of_chirp.values().flat_map(|all| all.iter().map(move |burst| hit_by(burst, all))).sum();
    hits as f64 / (bursts.len() * (rx - 1)).max(1) as f64
}

/// How unlikely it is that a sample is hit, and by so much, where another would have had noise: each burst's samples are measured
/// in its own frame, and predicted by the training frames' rate and mean power only.
fn spread(evidence: &Evidence, bursts: &[Burst], powers: &[Vec<f64>]) -> Vec<OfSample> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let hits = || bursts.iter().zip(powers);
    let known: Vec<f64> = hits()
        .filter(|(burst, _)| evidence.split.training.contains(&burst.frame))
        .flat_map(|(_, powers)| powers.iter().copied())
        .collect();
    let total = evidence.split.training.len() * evidence.cube.channels() * loops * samples;
    // One more than there are, as strong as the signal: training frames may have none.
    let rate = (known.len() + 1) as f64 / (total + 1) as f64;
    let mean = (known.iter().sum::<f64>() + evidence.peak().powi(2)) / (known.len() + 1) as f64;
    let of_burst = |(burst, powers): (&Burst, &Vec<f64>)| {
        let noise = evidence.noise()[burst.channel].max(f64::MIN_POSITIVE);
        let (mean, start) = (mean.max(noise), start_of(&evidence.cube, burst));
        let nats = |power: &f64| (rate * noise / mean).ln() - power / mean;
        powers.iter().enumerate().map(|(n, power)| OfSample { index: start + n, nats: nats(power) }).collect::<Vec<_>>()
    };
    hits().flat_map(of_burst).collect()
}

/// How many there are: beside those that hardly stand out, and where things move too fast to look, are others.
fn bursts_in_all(count: f64, crossings: Option<&Crossings>) -> Estimate {
    let (seen, faint) = crossings.map_or((1.0, 0.0), |crossings| (crossings.seen, crossings.faint));
    let value = count * (1.0 + faint * (1.0 / seen.max(0.1) - 1.0));
    let error = 1.645 * (0.1 * count + 0.6);
    let most = value * (1.0 + UNSEEN * faint) + error;
    Estimate { name: "bursts", values: vec![value], ci90: vec![[count - error, most]] }
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

/// What its neighbours predict of a chirp, by sample: at the ends a straight line is continued, in the middle it is halved.
fn weights(chirp: usize, loops: usize) -> [f64; 2] {
    if chirp == 0 || chirp + 1 == loops { [2.0, -1.0] } else { [0.5, 0.5] }
}

/// Variance of the noise in a [`difference`], over that in a sample.
fn stencil_noise(chirp: usize, loops: usize) -> f64 {
    1.0 + weights(chirp, loops).iter().map(|weight| weight * weight).sum::<f64>()
}

/// A chirp less what its neighbours let expect of it.
fn difference(signal: &[Complex64], chirp: usize, loops: usize, samples: usize) -> Vec<Complex64> {
    let [a, b] = neighbours(chirp, loops);
    let [from_a, from_b] = weights(chirp, loops);
    (0..samples)
        .map(|n| signal[chirp * samples + n] - signal[a * samples + n] * from_a - signal[b * samples + n] * from_b)
        .collect()
}

/// Chance that some of `total` samples without bursts stand out as much, from the chance of each that does: that as many of them or more do
/// as much or more as the k-th, over all k (Poisson's law; Bonferroni).
fn chance_of_all(mut chances: Vec<f64>, total: f64) -> f64 {
    chances.sort_by(f64::total_cmp);
    let of_first = |(index, chance): (usize, &f64)| poisson_tail(index + 1, total * chance);
    let least = chances.iter().enumerate().map(of_first).fold(1.0, f64::min);
    corrected(least, chances.len() as f64)
}

/// With the chance of each that noise stands out as much.
fn of_channel(evidence: &Evidence, frame: usize, channel: usize) -> Vec<(Burst, f64)> {
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
    let Levels { values: usual, freedom } = Levels::of(&usual, MEDIAN_FREEDOM * loops as f64);
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
                    let highest = powers[first..=last].iter().copied().fold(0.0, f64::max);
                    bursts.push((Burst { frame, channel, chirp, first, last }, fisher_tail(highest, 2.0, freedom)));
                }
                n = last;
            }
            n += 1;
        }
    }
    bursts
}

/// Place in the cube of its first sample.
fn start_of(cube: &Cube, burst: &Burst) -> usize {
    ((burst.frame * cube.channels() + burst.channel) * cube.dims[3] + burst.chirp) * cube.dims[4] + burst.first
}

/// All from what was recorded: neighbours may be hit, too.
fn repair_all(cube: &mut Cube, bursts: &[Burst]) {
    let repaired: Vec<Vec<Complex64>> = bursts.iter().map(|burst| repair(cube, burst)).collect();
    for (burst, values) in bursts.iter().zip(repaired) {
        let start = start_of(cube, burst);
        cube.samples[start..start + values.len()].copy_from_slice(&values);
    }
}

/// Of what a burst adds to each of its samples.
fn powers(cube: &Cube, burst: &Burst) -> Vec<f64> {
    let (usual, start) = (repair(cube, burst), start_of(cube, burst));
    usual.iter().zip(&cube.samples[start..]).map(|(usual, value)| (value - usual).norm_sqr()).collect()
}

/// What the neighbours let expect of the hit samples.
fn repair(cube: &Cube, burst: &Burst) -> Vec<Complex64> {
    let [_, _, _, loops, samples] = cube.dims;
    let signal = cube.channel(burst.frame, burst.channel);
    let difference = difference(signal, burst.chirp, loops, samples);
    (burst.first..=burst.last).map(|n| signal[burst.chirp * samples + n] - difference[n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::misfit::Misfit;
    use crate::radar::Radar;

    /// A wall in noise, and bursts that all receivers see.
    fn evidence(amplitude: f64) -> Evidence {
        let mut radar = Radar::small(12);
        (radar.loops_per_frame, radar.samples_per_chirp) = (32, 64);
        Evidence::in_noise(radar, 6, |[frame, _, chirp, n]| {
            let hit = chirp == 5 + 7 * frame % 20 && (20..26).contains(&n);
            let burst = if hit { Complex64::cis(1.7 * n as f64 + frame as f64) * amplitude } else { Complex64::ZERO };
            Complex64::cis(0.8 * n as f64) * 30.0 + burst
        })
    }

    #[test]
    fn what_hits_few_samples_is_taken_out_at_the_price_of_where_it_was_and_how_strong() {
        let (with, clean) = (evidence(100.0), Misfit::of(&evidence(0.0)).loglik_per_sample);
        let found = find(&with).pop().expect("bursts");
        assert_eq!(found.id, Some(interference::ID));
        let before = Misfit::of(&with).loglik_per_sample;
        let after = Misfit::after(&with, &with.with(&found)).loglik_per_sample;
        let recovered = (after - before) / (clean - before);
        assert!((0.7..0.99).contains(&recovered), "{recovered} of {}", clean - before);
        // Six of 2048 samples: that one in 341 is hit, and with a power 37 dB over the noise's, costs 15.3 nats each; the windows let
        // them through three times.
        let price = clean - after;
        assert!((price - 0.135).abs() < 0.02, "{price}");
    }

    #[test]
    fn one_sample_of_many_that_stands_out_a_little_is_no_burst() {
        let total = 3e5;
        assert!(chance_of_all(vec![fisher_tail(30.0, 2.0, 20.0)], total) > 0.1);
        assert!(chance_of_all(vec![fisher_tail(30.0, 2.0, 1e4)], total) < 1e-6);
        // Where others stand out as much it is the less likely.
        let [one, many] = [1, 40].map(|count| chance_of_all(vec![fisher_tail(30.0, 2.0, 30.0); count], total));
        assert!(one > 1e-3 && many < 1e-12, "{one} {many}");
    }

    #[test]
    fn bursts_are_observed_where_the_library_has_no_name_for_them() {
        let evidence = evidence(100.0).lacking(&[interference::ID]);
        let found = find(&evidence).pop().expect("bursts");
        assert!(found.id.is_none() && found.behaves_like == Behaviour::SparseAdditive && found.estimates.is_empty());
        assert!(find(&evidence.with(&found)).is_empty());
    }
}
