//! Which antenna is which, and on which side: left and right, up and down, receivers in reverse, transmitters in another order.
//!
//! Where the body moves, the phases of the channels follow from its direction. Every reading of the antennas predicts them; the one
//! that is stated is held against the others. The measure of a cell of range and Doppler is its alignment, the sum over channels of the
//! cosine between what a channel has in common with the first one and its constant phase, after the predicted phase is taken out: a
//! constant phase of its own (receivers that differ) does not lower it, but directions that change do where the reading is wrong. Of two
//! readings the right one gains Σ (1 − cos Δ) over the other in a cell, in the mean and times the coherence, where Δ is by how much more
//! they differ there than elsewhere; the parts of a body interfere, so each cell deviates from that. The test is the ratio estimator of
//! the one over the other, with Student's law over cells, two bins wide along either axis (such cells correlate by 1/6 under a Hann
//! window: Harris 1978). Where the body stays in one direction, only the constant phases themselves decide, which receivers that differ
//! make by chance: they must then agree with the other reading nearly as a whole, over three channels at least.

use std::collections::BTreeMap;

use num_complex::Complex64;

use super::Check;
use super::cells::{aligned, moving_cells};
use crate::diagnosis::evidence::{Evidence, HANN_LOBE};
use crate::diagnosis::prediction::{BodyPrediction, Point};
use crate::diagnosis::statistics::ratio_tail;
use crate::integrity::ALARM;
use crate::paths::distance;

/// Mean phasor of the channels from which on their phases agree: receivers that differ by chance do not.
const ALIGNED: f64 = 0.93;
/// Share of that mean phasor that the stated reading must fall short of.
const LESS: f64 = 0.75;
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

/// What each channel of a cell has in common with the first one, as a share of their amplitudes, by reading: the phase that it predicts is
/// taken out.
struct Cell {
    observed: Vec<Vec<Complex64>>,
    /// What the stated reading would leave of it, were this one right.
    otherwise: Vec<Vec<Complex64>>,
}

/// What the cells say of a reading.
struct Agreement {
    /// Each channel's constant phase.
    phasors: Vec<Complex64>,
    coherence: f64,
    /// Of each cell, the alignment beyond that of the stated reading, and what that is in the mean and without losses where this one is
    /// right.
    gains: Vec<f64>,
    apart: Vec<f64>,
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
    let alarm = ALARM / others.len() as f64;
    let better = |other: &Agreement| -> bool {
        let losses: Vec<f64> = other.gains.iter().map(|gain| -gain).collect();
        let [for_it, against_it] = [&other.gains, &losses].map(|gains| ratio_tail(gains, &other.apart).1);
        let mean = |agreement: &Agreement| agreement.phasors.iter().sum::<Complex64>().norm() / agreement.phasors.len() as f64;
        let turned = by_phases && other.phasors.len() >= 3 && mean(other) >= ALIGNED && mean(as_is) < LESS * mean(other);
        for_it < alarm || turned && against_it >= alarm
    };
    let wrong: Vec<(&Reading, &Agreement)> = others.iter().zip(rest).filter(|(_, other)| better(other)).collect();
    let Some(best) = wrong.iter().map(|(_, agreement)| agreement.coherence).reduce(f64::max) else {
        return Some(("array phases do not contradict it".into(), true));
    };
    // Readings that predict the same phases are reported together.
    let names: Vec<String> = wrong
        .iter()
        .filter(|(_, agreement)| agreement.coherence > best - 1e-3)
        .map(|(reading, _)| match reading.description {
            "" => format!("the order {:?}", reading.tx),
            description => description.into(),
        })
        .collect();
    Some((format!("array phases fit {} (coherence {best:.2}, as stated {:.2})", names.join(", or "), as_is.coherence), false))
}

/// The stated reading comes first. None where nothing of the body is observed. Cells are visited twice, for the constant phases and for the
/// alignment to them: all of them by reading and channel would not be bounded.
fn agreements(evidence: &Evidence, readings: &[&Reading]) -> Option<Vec<Agreement>> {
    let channels = evidence.cube.channels();
    let body = evidence.body.as_ref().filter(|_| channels > 1)?;
    let mut count = 0;
    let zero = || vec![vec![Complex64::ZERO; channels]; readings.len()];
    let (mut observed, mut otherwise) = (zero(), zero());
    each_cell(evidence, body, readings, &mut |cell| {
        count += 1;
        for (sums, of_cell) in [(&mut observed, &cell.observed), (&mut otherwise, &cell.otherwise)] {
            let values = of_cell.iter().flatten();
            sums.iter_mut().flatten().zip(values).for_each(|(sum, value)| *sum += value);
        }
    });
    if observed[0].contains(&Complex64::ZERO) {
        return None;
    }
    let phasors = |sums: &[Complex64]| sums.iter().map(|sum| sum / sum.norm().max(f64::MIN_POSITIVE)).collect::<Vec<_>>();
    let mut agreements: Vec<Agreement> = (observed.iter())
        .map(|sums| Agreement {
            phasors: phasors(sums),
            coherence: sums[1..].iter().map(|sum| sum.norm()).sum::<f64>() / (count * (channels - 1)) as f64,
            gains: vec![],
            apart: vec![],
        })
        .collect();
    let expected: Vec<Vec<Complex64>> = otherwise.iter().map(|sums| phasors(sums)).collect();
    let alignment = |of_cell: &[Complex64], phasors: &[Complex64]| -> f64 {
        of_cell.iter().zip(phasors).map(|(own, phasor)| (own * phasor.conj()).re).sum()
    };
    each_cell(evidence, body, readings, &mut |cell| {
        let as_stated = alignment(&cell.observed[0], &agreements[0].phasors);
        for (index, agreement) in agreements.iter_mut().enumerate() {
            let apart = channels as f64 - alignment(&cell.otherwise[index], &expected[index]);
            agreement.gains.push(alignment(&cell.observed[index], &agreement.phasors) - as_stated);
            // Readings that predict the same differ by rounding.
            agreement.apart.push(if apart > 1e-9 { apart } else { 0.0 });
        }
    });
    Some(agreements)
}

/// Visits the body's cells, two bins wide along either axis.
fn each_cell(evidence: &Evidence, body: &BodyPrediction, readings: &[&Reading], see: &mut dyn FnMut(&Cell)) {
    let ([_, _, receivers, ..], channels, radar) = (evidence.cube.dims, evidence.cube.channels(), &evidence.radar);
    let all: Vec<usize> = (0..channels).collect();
    // By how much the path of each channel is longer than the first one's.
    let longer = |reading: &Reading, point: &Point, velocity: f64| -> Vec<f64> {
        let at = mirrored(point, reading.mirrored, radar.position_m);
        let path = |channel: usize| {
            let (slot, lane) = (channel / receivers, channel % receivers);
            let moved = 2.0 * velocity * slot as f64 * radar.chirp_period_s;
            distance(at, radar.tx_position_m(reading.tx[slot])) + distance(at, radar.rx_position_m(reading.rx[lane])) + moved
        };
        let first = path(0);
        (0..channels).map(|channel| path(channel) - first).collect()
    };
    let mut now = 0;
    let mut cells: BTreeMap<[usize; 2], (Cell, Vec<f64>)> = BTreeMap::new();
    let mut finished = |cells: &mut BTreeMap<[usize; 2], (Cell, Vec<f64>)>| {
        for (mut cell, scales) in std::mem::take(cells).into_values() {
            for of_reading in cell.observed.iter_mut().chain(&mut cell.otherwise) {
                of_reading.iter_mut().zip(&scales).for_each(|(value, scale)| *value /= scale.max(f64::MIN_POSITIVE));
            }
            see(&cell);
        }
    };
    moving_cells(evidence, body, &all, |[frame, row, bin], point, velocity, seen| {
        if frame != now {
            finished(&mut cells);
            now = frame;
        }
        let zero = || vec![vec![Complex64::ZERO; channels]; readings.len()];
        let new = || (Cell { observed: zero(), otherwise: zero() }, vec![0.0; channels]);
        let (cell, scales) = cells.entry([row, bin].map(|index| index / HANN_LOBE)).or_insert_with(new);
        scales.iter_mut().zip(seen).for_each(|(scale, own)| *scale += (own * seen[0].conj()).norm());
        let as_stated = longer(readings[0], point, velocity);
        for (index, reading) in readings.iter().enumerate() {
            for (channel, longer) in longer(reading, point, velocity).into_iter().enumerate() {
                let observed = aligned(seen[channel], seen[0], longer, radar);
                let phase = std::f64::consts::TAU * (longer - as_stated[channel]) / radar.wavelength_m();
                cell.observed[index][channel] += observed;
                cell.otherwise[index][channel] += Complex64::from_polar(observed.norm(), phase);
            }
        }
    });
    finished(&mut cells);
}

fn mirrored(point: &Point, axis: Option<usize>, at: [f64; 3]) -> [f64; 3] {
    let mut position = point.position_m;
    if let Some(axis) = axis {
        position[axis] = 2.0 * at[axis] - position[axis];
    }
    position
}
