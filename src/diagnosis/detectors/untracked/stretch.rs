//! The longest stretch of frames without a gap, transformed as one: where its cells stand out and hang together.

use std::collections::HashSet;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::detectors::region::{CLUTTER_BINS, floor, joined};
use crate::diagnosis::evidence::{Evidence, transform};

/// Nearer ones belong to leakage, offsets and low-frequency noise.
pub const NEAREST_BIN: usize = 3;
/// A mover's cells are those above this, over their range's floor.
const FAINTEST: f64 = 6.3;
/// Range bins between them that may be empty.
const LARGEST_GAP: usize = 3;

/// Runs of frames transformed as one, static clutter removed; cells are signed Doppler bins and range bins.
pub struct Stretch {
    pub loops: usize,
    samples: usize,
    /// `[run][channel]`, each `[doppler, range]`.
    pub maps: Vec<Vec<Vec<Complex64>>>,
    /// Mean over runs and channels, over the noise.
    power: Vec<f64>,
    /// Median over velocities by range, and no less than the noise.
    floor: Vec<f64>,
}

pub type Cell = [i64; 2];

impl Stretch {
    pub fn new(evidence: &Evidence, run: usize) -> Self {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let maps: Vec<Vec<Vec<Complex64>>> = (0..frames / run)
            .into_par_iter()
            .filter(|part| run > 1 || evidence.split.training.contains(part))
            .map(|part| {
                let frames = part * run..(part + 1) * run;
                let map = |c| transform(&joined(&evidence.cube, evidence.clutter(), frames.clone(), c), samples);
                (0..channels).map(map).collect()
            })
            .collect();
        let mut power = vec![0.0; run * loops * samples];
        for part in &maps {
            for (map, noise) in part.iter().zip(evidence.noise()) {
                let weight = 1.0 / (noise.max(f64::MIN_POSITIVE) * (channels * maps.len()) as f64);
                power.iter_mut().zip(map).for_each(|(sum, value)| *sum += weight * value.norm_sqr());
            }
        }
        let loops = run * loops;
        let floor = |r: usize| floor(evidence, &power, r, run).map_or(1.0, |floor| floor.max(1.0));
        let floor = (0..samples).map(floor).collect();
        Self { loops, samples, maps, power, floor }
    }

    pub fn index(&self, [doppler, range]: Cell) -> usize {
        doppler.rem_euclid(self.loops as i64) as usize * self.samples + range.rem_euclid(self.samples as i64) as usize
    }

    pub fn at(&self, cell: Cell) -> f64 {
        self.power[self.index(cell)]
    }

    /// Whether a cell moves in a direction (+1 or −1).
    fn moves(&self, doppler: i64, sign: i64) -> bool {
        doppler * sign > CLUTTER_BINS as i64 && 2 * doppler.abs() <= self.loops as i64
    }

    /// Strongest cell near another that moves the same way.
    pub fn peak(&self, [doppler, range]: Cell, reach: i64, sign: i64) -> Cell {
        (doppler - reach..=doppler + reach)
            .filter(|&d| self.moves(d, sign))
            .flat_map(|d| (range - 2..=range + 2).map(move |r| [d, r]))
            .filter(|cell| cell[1] >= NEAREST_BIN as i64 && cell[1] < self.samples as i64)
            .max_by(|&a, &b| self.at(a).total_cmp(&self.at(b)))
            .unwrap_or([doppler, range])
    }

    /// Whether the power at the edge of static clutter rises towards it.
    pub fn is_flank(&self, [doppler, range]: Cell) -> bool {
        let nearer = [doppler - doppler.signum(), range];
        !self.moves(nearer[0], doppler.signum()) && self.at(nearer) > self.at([doppler, range])
    }

    /// By how many times it exceeds its range's floor.
    fn above(&self, cell: Cell) -> f64 {
        self.at(cell) / self.floor[cell[1].rem_euclid(self.samples as i64) as usize]
    }

    /// Cells that hang together with the peak, nearly, and move the same way.
    pub fn around(&self, top: Cell, sign: i64, reach: i64, bins: usize) -> Vec<Cell> {
        let mut region = vec![top];
        let mut known = HashSet::from([top]);
        let gap = LARGEST_GAP as i64;
        let mut next = 0;
        while next < region.len() {
            let [d, r] = region[next];
            next += 1;
            for cell in (-1..=1).flat_map(|i| (-gap..=gap).map(move |j| [d + i, r + j])) {
                let near = (cell[1] - top[1]).abs() <= reach && cell[1] >= NEAREST_BIN as i64 && cell[1] < bins as i64;
                if near && self.moves(cell[0], sign) && self.above(cell) > FAINTEST && known.insert(cell) {
                    region.push(cell);
                }
            }
        }
        region
    }

    /// Top of the parabola through a peak's logarithms along an axis, in bins from it.
    pub fn summit(&self, top: Cell, step: Cell) -> f64 {
        let at = |k: i64| self.at([top[0] + k * step[0], top[1] + k * step[1]]).max(1e-9).ln();
        let (left, middle, right) = (at(-1), at(0), at(1));
        let bend = left - 2.0 * middle + right;
        if bend < 0.0 { (0.5 * (left - right) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    }
}
