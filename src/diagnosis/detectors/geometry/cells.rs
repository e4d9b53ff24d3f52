//! The cells of range and Doppler that the body fills, with what the receivers observe there and what is predicted.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::numbers::Numbers;
use crate::diagnosis::power::PowerModel;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::speckle;
use crate::diagnosis::vector::sine;
use crate::diagnosis::{BodyPrediction, Evidence};
use crate::paths::distance;
use crate::radar::Radar;

/// Expected power over the noise, noise included, from which on a cell is used.
const LEAST_POWER: f32 = 3.0;
/// Share of the static returns that may be left at low Doppler when they were taken out.
const CLUTTER_LEFT: f64 = 1e-3;
/// Fewest cells of a frame.
const FEWEST_CELLS: usize = 10;
/// Cells of a group that errors are taken from, at least, and groups of a frame, at most.
const GROUP_CELLS: usize = 8;
const MOST_GROUPS: usize = 6;
/// Ranges that what hardly moves is taken together of.
const SLOW_RANGES: usize = 2;

/// Neighbouring cells of a frame.
#[derive(Clone, Debug)]
pub struct Group {
    pub cells: Vec<Cell>,
    /// Where what hardly moves is the same in all frames: its ranges.
    pub place: Option<usize>,
}

/// One cell. Powers are in units of the noise, mean over the channels.
#[derive(Clone, Debug)]
pub struct Cell {
    /// By transmitter, `[rx]`.
    pub observed: Vec<DVector<Complex64>>,
    /// What the body is expected to have, `[rx, rx]`, the second one conjugated.
    pub expected: DMatrix<Complex64>,
    /// Mean sine of the body's direction there.
    pub sine: f64,
}

/// The cells that the body fills, by frame and group of neighbours.
pub struct Cells {
    pub radar: Radar,
    pub frames: Vec<Vec<Group>>,
    /// Of every receiver, in the same units.
    pub noise: Vec<f64>,
}

impl Cells {
    /// `clutter_power`: power of static clutter, by range.
    pub fn new(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, clutter_power: &[f64]) -> Self {
        let radar = &evidence.radar;
        let noise = evidence.noise();
        let mean = noise.iter().sum::<f64>() / noise.len() as f64;
        let receivers = radar.rx_m.len();
        let of_receiver = |rx: usize| {
            let own = noise.iter().skip(rx).step_by(receivers).sum::<f64>() / radar.tx_m.len() as f64;
            (own / mean.max(f64::MIN_POSITIVE)).max(1e-6)
        };
        let frames = (0..evidence.cube.dims[0])
            .into_par_iter()
            .map(|frame| groups(cells(evidence, model, body, clutter_power, frame, mean)))
            .collect();
        Self { radar: radar.clone(), frames, noise: (0..receivers).map(of_receiver).collect() }
    }

    pub fn numbers(&self) -> Numbers {
        Numbers { receivers: self.radar.rx_m.len() }
    }
}

/// `moving`, `slow`: cells of the body away from zero Doppler, and near it, with their ranges.
fn groups([moving, mut slow]: [Vec<(usize, Cell)>; 2]) -> Vec<Group> {
    let count = (moving.len() / GROUP_CELLS).clamp(1, MOST_GROUPS);
    // The last ones first.
    let mut groups: Vec<Group> = speckle::groups(moving, count)
        .into_iter()
        .rev()
        .map(|cells| Group { cells: cells.into_iter().map(|(_, cell)| cell).collect(), place: None })
        .collect();
    slow.sort_by_key(|(range, _)| range / SLOW_RANGES);
    groups.extend(slow.chunk_by(|a, b| a.0 / SLOW_RANGES == b.0 / SLOW_RANGES).map(|chunk| Group {
        cells: chunk.iter().map(|(_, cell)| cell.clone()).collect(),
        place: Some(chunk[0].0 / SLOW_RANGES),
    }));
    groups.retain(|group| !group.cells.is_empty());
    groups
}

/// Cells of a frame in which the body is expected to be stronger than `least`, noise included, and seen. None where these are too few.
pub fn used(evidence: &Evidence, model: &PowerModel, clutter_power: &[f64], frame: usize, least: f32) -> Option<Vec<usize>> {
    let expected = model.expected(frame);
    let map = evidence.maps().below([frame]);
    let samples = evidence.cube.dims[4];
    // A body that hardly moves is known by what it leaves of itself where static clutter was taken out.
    let of_the_body = |cell: usize| model.usable()[cell] || f64::from(map[cell]) > CLUTTER_LEFT * clutter_power[cell % samples];
    let used: Vec<usize> = (0..model.size()).filter(|&cell| expected[cell] > least && of_the_body(cell)).collect();
    (used.len() >= FEWEST_CELLS).then_some(used)
}

fn cells(
    evidence: &Evidence,
    model: &PowerModel,
    body: &BodyPrediction,
    clutter_power: &[f64],
    frame: usize,
    noise: f64,
) -> [Vec<(usize, Cell)>; 2] {
    let radar = &evidence.radar;
    let (receivers, samples) = (radar.rx_m.len(), evidence.cube.dims[4]);
    let Some(used) = used(evidence, model, clutter_power, frame, LEAST_POWER) else { return [vec![], vec![]] };
    let mut slots = vec![usize::MAX; model.size()];
    used.iter().enumerate().for_each(|(slot, &cell)| slots[cell] = slot);
    let mut sums = vec![(DMatrix::<Complex64>::zeros(receivers, receivers), [0.0; 2]); used.len()];
    let wave = TAU / radar.wavelength_m();
    let centre = radar.centre_m();
    for point in body.with_echoes(radar, body.frames[frame].clone(), None) {
        let (range_m, velocity_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let peak = model.peak(radar, point);
        let sine = sine(point.position_m, centre);
        let turns: Vec<Complex64> =
            (0..receivers).map(|rx| Complex64::cis(wave * distance(point.position_m, radar.rx_position_m(rx)))).collect();
        model.cells.each(range_m, velocity_mps, |cell, share| {
            let power = peak * f64::from(share);
            if slots[cell] == usize::MAX || power <= 0.0 {
                return;
            }
            let (sum, [weight, aslant]) = &mut sums[slots[cell]];
            *weight += power;
            *aslant += power * sine;
            for column in 0..receivers {
                let other = turns[column].conj() * power;
                for row in 0..receivers {
                    sum[(row, column)] += turns[row] * other;
                }
            }
        });
    }
    let maps: Vec<_> = (0..evidence.cube.channels()).map(|channel| evidence.range_doppler(frame, channel)).collect();
    let scale = 1.0 / noise.max(f64::MIN_POSITIVE).sqrt();
    let observed = |cell: usize| {
        maps.chunks_exact(receivers).map(|maps| DVector::from_fn(receivers, |rx, _| maps[rx][cell] * scale)).collect()
    };
    let mut parts = [vec![], vec![]];
    for (&cell, (expected, [weight, aslant])) in used.iter().zip(sums) {
        let part = usize::from(!model.usable()[cell]);
        let sine = if weight > 0.0 { aslant / weight } else { 0.0 };
        parts[part].push((cell % samples, Cell { observed: observed(cell), expected, sine }));
    }
    parts
}
