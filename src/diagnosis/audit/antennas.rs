//! Which antenna is which, and on which side: left and right, up and down, receivers in reverse, transmitters in another order.
//!
//! Where the body moves, the phases of the channels follow from its direction. Every reading of the antennas predicts them; the one
//! that is stated is held against the others. The measure of a channel is its coherence with the first channel after that phase is
//! taken out: a constant phase of its own (receivers that differ) does not lower it, but directions that change do where the
//! reading is wrong. With a coherence γ, a share 1 − γ² of a channel's power is left (Carter, Knapp and Nuttall 1973), so Σ ln((1 −
//! γ²) / (1 − γ'²)) over channels and frames is the log of a likelihood ratio; a frame counts once, however many cells the body
//! fills in it. Where the body stays in one direction, only the constant phases themselves decide, which receivers that differ
//! make by chance: they must then agree with the other reading nearly as a whole, over three channels at least.

use num_complex::Complex64;

use super::Check;
use super::cells::{aligned, moving_cells};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::prediction::Point;
use crate::paths::distance;

/// Chance that one of the readings beats the stated one where that is right, at most (each check).
const ALARM: f64 = 1e-3;
/// Mean phasor of the channels from which on their phases agree: receivers that differ by chance do not.
const ALIGNED: f64 = 0.93;
/// Share of that mean phasor that the stated reading must fall short of.
const LESS: f64 = 0.75;
/// Coherence that is taken for complete: a tenth of a percent of the power is always left.
const COMPLETE: f64 = 0.999;
/// Most transmitters whose orders are all tried.
const MOST_TRANSMITTERS: usize = 4;

/// How the antennas may be meant.
struct Reading {
    description: &'static str,
    /// Antenna of each transmitter's slot, and of each receiver's lane.
    tx: Vec<usize>,
    rx: Vec<usize>,
    /// Axis along which the body's place is mirrored at the radar.
    mirrored: Option<usize>,
}

/// What the channels have in common with the first one under a reading.
struct Agreement {
    coherence: Vec<f64>,
    phasors: Vec<Complex64>,
    frames: usize,
}

/// Left and right, up and down.
pub(super) fn sides(evidence: &Evidence) -> Option<Check> {
    let [_, transmitters, receivers, ..] = evidence.cube.dims;
    let stated = Reading { description: "", tx: (0..transmitters).collect(), rx: (0..receivers).collect(), mirrored: None };
    let backwards: Vec<usize> = (0..receivers).rev().collect();
    let readings = [
        Reading { description: "the receivers in reverse order", rx: backwards, tx: stated.tx.clone(), mirrored: None },
        Reading { description: "left and right exchanged", mirrored: Some(0), tx: stated.tx.clone(), rx: stated.rx.clone() },
        Reading { description: "up and down exchanged", mirrored: Some(2), tx: stated.tx.clone(), rx: stated.rx.clone() },
    ];
    let (found, ok) = compared(evidence, &stated, &readings, true)?;
    Some(Check::new("sides", "antennas and body on the sides as stated", found, ok))
}

/// The order in which the transmitters fire. Phases that stay the same say nothing of it where there are two: any constant phase between two
/// transmitters fits one of the orders.
pub(super) fn transmitter_order(evidence: &Evidence) -> Option<Check> {
    let [_, transmitters, receivers, ..] = evidence.cube.dims;
    if !(2..=MOST_TRANSMITTERS).contains(&transmitters) {
        return None;
    }
    let rx: Vec<usize> = (0..receivers).collect();
    let mut readings = orders(transmitters).into_iter().map(|tx| Reading { description: "", tx, rx: rx.clone(), mirrored: None });
    let stated = readings.next()?;
    let others: Vec<Reading> = readings.collect();
    let (found, ok) = compared(evidence, &stated, &others, transmitters > 2)?;
    Some(Check::new("tx_order", "transmitters fire in the order of tx_m", found, ok))
}

/// All orders, the ascending one first.
fn orders(count: usize) -> Vec<Vec<usize>> {
    let mut orders = vec![vec![]];
    for _ in 0..count {
        let longer = |order: Vec<usize>| {
            let open: Vec<usize> = (0..count).filter(|antenna| !order.contains(antenna)).collect();
            open.into_iter().map(move |antenna| order.iter().copied().chain([antenna]).collect::<Vec<_>>())
        };
        orders = orders.into_iter().flat_map(longer).collect();
    }
    orders
}

/// What was found, and whether the stated reading stands. None where nothing of the body is observed.
fn compared(evidence: &Evidence, stated: &Reading, others: &[Reading], by_phases: bool) -> Option<(String, bool)> {
    let all: Vec<&Reading> = std::iter::once(stated).chain(others).collect();
    let agreements = agreements(evidence, &all)?;
    let (as_is, rest) = agreements.split_first()?;
    let least = (others.len() as f64 / ALARM).ln();
    let better = |other: &Agreement| -> bool {
        let changes = ratio(as_is, other);
        let mean = |agreement: &Agreement| agreement.phasors.iter().sum::<Complex64>().norm() / agreement.phasors.len() as f64;
        let turned = by_phases && other.phasors.len() >= 3 && mean(other) >= ALIGNED && mean(as_is) < LESS * mean(other);
        changes > least || turned && changes > -least
    };
    let wrong: Vec<(&Reading, &Agreement)> = others.iter().zip(rest).filter(|(_, other)| better(other)).collect();
    let Some(best) = wrong.iter().map(|(_, agreement)| strength(agreement)).reduce(f64::max) else {
        return Some(("array phases do not contradict it".into(), true));
    };
    // Readings that predict the same phases are reported together.
    let names: Vec<String> = wrong
        .iter()
        .filter(|(_, agreement)| strength(agreement) > best - 1e-3)
        .map(|(reading, _)| match reading.description {
            "" => format!("the order {:?}", reading.tx),
            description => description.into(),
        })
        .collect();
    Some((format!("array phases fit {} (coherence {best:.2}, as stated {:.2})", names.join(", or "), strength(as_is)), false))
}

/// Mean coherence.
fn strength(agreement: &Agreement) -> f64 {
    agreement.coherence.iter().sum::<f64>() / agreement.coherence.len().max(1) as f64
}

/// Log of the likelihood ratio of another reading against the stated one, constant phases free.
fn ratio(stated: &Agreement, other: &Agreement) -> f64 {
    let left = |coherence: &f64| 1.0 - coherence.min(COMPLETE).powi(2);
    let channels = stated.coherence.iter().zip(&other.coherence);
    stated.frames as f64 * channels.map(|(stated, other)| (left(stated) / left(other)).ln()).sum::<f64>()
}

fn agreements(evidence: &Evidence, readings: &[&Reading]) -> Option<Vec<Agreement>> {
    let [_, transmitters, receivers, ..] = evidence.cube.dims;
    let channels = transmitters * receivers;
    let (body, radar) = (evidence.body.as_ref().filter(|_| channels > 1)?, &evidence.radar);
    let mut sums = vec![vec![Complex64::ZERO; channels]; readings.len()];
    let mut scales = vec![0.0; channels];
    let mut frames = std::collections::BTreeSet::new();
    let all: Vec<usize> = (0..channels).collect();
    moving_cells(evidence, body, &all, |frame, point, velocity, seen| {
        frames.insert(frame);
        for (scale, own) in scales.iter_mut().zip(seen) {
            *scale += (own * seen[0].conj()).norm();
        }
        for (reading, sums) in readings.iter().zip(&mut sums) {
            let path = |channel: usize| {
                let (slot, lane) = (channel / receivers, channel % receivers);
                let at = mirrored(point, reading.mirrored, radar.position_m);
                let moved = 2.0 * velocity * slot as f64 * radar.chirp_period_s;
                distance(at, radar.tx_position_m(reading.tx[slot])) + distance(at, radar.rx_position_m(reading.rx[lane])) + moved
            };
            let first = path(0);
            for (channel, sum) in sums.iter_mut().enumerate() {
                *sum += aligned(seen[channel], seen[0], path(channel) - first, radar);
            }
        }
    });
    if frames.is_empty() || scales.iter().any(|scale| *scale <= 0.0) {
        return None;
    }
    let agreement = |sums: Vec<Complex64>| Agreement {
        coherence: sums.iter().zip(&scales).skip(1).map(|(sum, scale)| sum.norm() / scale).collect(),
        phasors: sums.iter().map(|sum| sum / sum.norm().max(f64::MIN_POSITIVE)).collect(),
        frames: frames.len(),
    };
    Some(sums.into_iter().map(agreement).collect())
}

fn mirrored(point: &Point, axis: Option<usize>, at: [f64; 3]) -> [f64; 3] {
    let mut position = point.position_m;
    if let Some(axis) = axis {
        position[axis] = 2.0 * at[axis] - position[axis];
    }
    position
}
