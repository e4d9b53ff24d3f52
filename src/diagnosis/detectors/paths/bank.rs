//! A bank of sinusoidal motions: what each of them would gain over all frames, from a table of what a tone in every cell gains.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use rayon::prelude::*;

use super::coloured::FINE;
use super::oscillation::{Law, at};
use super::scene::Scene;
use crate::grid::Grid;

/// Energies of the motion in a frame over the noise that are tried: up to those of a body that is near.
pub const LEVELS: [f32; 6] = [3.0, 12.0, 60.0, 600.0, 6e3, 6e4];
/// Rates are tried up to this, as far as every turn has so many frames (with fewer, a motion is but a few places that come again
/// and again), and from so many steps on.
const FASTEST_HZ: f64 = 4.0;
const FRAMES_PER_TURN: f64 = 5.0;
const FIRST_STEP: usize = 4;
/// Excursions that are tried: the smallest, the ratio to the next, how many.
const EXCURSIONS: (f64, f64, usize) = (0.02, 1.25, 13);
/// Fewest and most phases that are tried.
const PHASES: (f64, f64) = (8.0, 48.0);
/// Doppler bins that a motion must move by.
pub const LEAST_BINS: f64 = 0.4;
/// Between two laws of the bank there are so many that differ.
const BETWEEN: f64 = 16.0;
/// Laws of every rate that are fitted, and of all that are fitted exactly.
const KEPT: usize = 16;
const FITTED: usize = 16;
/// Steps by which the fit closes in.
const STEPS: usize = 24;

/// A sinusoidal motion with its direction and strength.
#[derive(Clone, Copy, Debug)]
pub struct SinusoidalMotion {
    pub law: Law,
    /// Direction: x over range.
    pub sine: f64,
    /// Of the energy in a frame over the noise.
    pub log_power: f64,
}

/// Log-likelihoods gained by a motion's energy in a place, frame by frame, for each level.
pub struct Table {
    pub sines: Vec<f64>,
    /// Of the middle of every frame.
    pub times_s: Vec<f64>,
    pub cells: Vec<Grid<Gains, 3>>,
    /// The same, of the best of the cells around.
    pub around: Vec<Grid<Gains, 3>>,
}

/// Axes of a table's frames, on the fine grid.
pub const CELLS: [&str; 3] = ["beam", "doppler", "range"];

pub type Gains = [f32; LEVELS.len()];

impl Table {
    /// Doppler and range cells of the fine grid.
    fn size(&self) -> [usize; 2] {
        self.cells.first().map_or([0, 0], |cells| [cells.shape()[1], cells.shape()[2]])
    }

    fn gain(&self, places: &[(i64, i64)], beam: usize) -> (f32, usize) {
        let mut sums = [0.0f32; LEVELS.len()];
        let [rows, columns] = self.size().map(|length| length as i64);
        for (cells, &(doppler, range)) in self.cells.iter().zip(places) {
            if (0..columns).contains(&range) {
                let cell = &cells[[beam, doppler.rem_euclid(rows) as usize, range as usize]];
                sums.iter_mut().zip(cell).for_each(|(sum, gain)| *sum += gain);
            }
        }
        strongest_level(&sums)
    }

    /// Of a law at every range that it may be laid to.
    fn along(&self, places: &[(i64, i64)], beam: usize, sums: &mut [Gains]) {
        sums.fill([0.0; LEVELS.len()]);
        let rows = self.size()[0] as i64;
        for (cells, &(doppler, step)) in self.around.iter().zip(places) {
            let row = cells.below([beam, doppler.rem_euclid(rows) as usize]);
            let (from, to) = (step.max(0) as usize, (-step).max(0) as usize);
            for (sum, gain) in sums.iter_mut().skip(to).zip(row.iter().skip(from)) {
                sum.iter_mut().zip(gain).for_each(|(sum, gain)| *sum += gain);
            }
        }
    }

    pub fn places(&self, scene: &Scene, law: Law) -> Vec<(i64, i64)> {
        let place = |&time: &f64| {
            let (range_m, velocity) = at(law, time);
            let (doppler, range) = scene.model.cells.place(range_m, velocity);
            ((FINE as f64 * doppler).round() as i64, (FINE as f64 * range).round() as i64)
        };
        self.times_s.iter().map(place).collect()
    }

    /// The best laws, and how many were tried.
    pub fn bank(&self, scene: &Scene, length_s: f64) -> (Vec<SinusoidalMotion>, f64) {
        let rates: Vec<f64> = rates(scene, length_s).collect();
        let of_rate = |&rate_hz: &f64| -> (Vec<(f32, SinusoidalMotion)>, f64) {
            let (mut kept, mut tried): (Vec<(f32, SinusoidalMotion)>, f64) = (vec![], 0.0);
            let mut sums = vec![[0.0; LEVELS.len()]; self.size()[1]];
            for (excursion_m, bins) in excursions(scene, rate_hz, 1) {
                // Neighbours are two cells of the fine grid apart.
                let phases = (0.5 * TAU * FINE as f64 * bins.max(excursion_m * scene.model.cells.bins_per_m)).ceil();
                for law in phased([0.0, excursion_m, rate_hz], phases.clamp(PHASES.0, PHASES.1) as usize) {
                    let places = self.places(scene, law);
                    for beam in 0..self.sines.len() {
                        self.along(&places, beam, &mut sums);
                        tried += sums.len() as f64;
                        for (range, sums) in sums.iter().enumerate() {
                            let (gain, level) = strongest_level(sums);
                            if kept.len() < KEPT || gain > kept[KEPT - 1].0 {
                                let mean_m = scene.range_m(range as f64 / FINE as f64);
                                let law = [mean_m, law[1], law[2], rate_hz];
                                let found =
                                    SinusoidalMotion { law, sine: self.sines[beam], log_power: f64::from(LEVELS[level]).ln() };
                                let at = kept.partition_point(|other| other.0 >= gain);
                                kept.insert(at, (gain, found));
                                kept.truncate(KEPT);
                            }
                        }
                    }
                }
            }
            let climbed = kept.into_iter().map(|(_, motion)| self.climbed(scene, motion, length_s)).collect();
            (climbed, tried)
        };
        // In one order, so that sums round alike in every run.
        let of_rates: Vec<(Vec<(f32, SinusoidalMotion)>, f64)> = rates.par_iter().map(of_rate).collect();
        let tried: f64 = of_rates.iter().map(|rate| rate.1).sum();
        let mut best: Vec<(f32, SinusoidalMotion)> = of_rates.into_iter().flat_map(|rate| rate.0).collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<(f32, SinusoidalMotion)> = vec![];
        for (gain, motion) in best {
            // Several climbs end on one summit.
            if chosen.len() < FITTED && chosen.iter().all(|other| (other.0 - gain).abs() > 1e-3) {
                chosen.push((gain, motion));
            }
        }
        (chosen.into_iter().map(|(_, motion)| motion).collect(), tried * BETWEEN * LEVELS.len() as f64)
    }

    /// Moved as long as that helps, then by less.
    fn climbed(&self, scene: &Scene, motion: SinusoidalMotion, length_s: f64) -> (f32, SinusoidalMotion) {
        let beam = self.sines.iter().position(|sine| *sine == motion.sine).unwrap_or(0);
        let gain = |law: Law| self.gain(&self.places(scene, law), beam);
        let start = gain(motion.law);
        let widths = widths(scene, motion.law, length_s);
        let (law, (gain, level)) = climb(motion.law, start, &widths, gain, |a, b| a.0 > b.0);
        (gain, SinusoidalMotion { law, log_power: f64::from(LEVELS[level]).ln(), ..motion })
    }

    /// The best power that comes at one range and one Doppler in every frame, near a motion's ranges, and how many were tried: the
    /// fluctuation of a static target, which never moves.
    pub fn static_target(&self, ranges: RangeInclusive<i64>) -> Option<(StaticTarget, f64)> {
        let places = |doppler: i64, range: i64| vec![(doppler, range); self.times_s.len()];
        let [rows, columns] = self.size().map(|length| length as i64);
        let mut best: Option<StaticTarget> = None;
        let mut tried = 0.0;
        for range in ranges.filter(|range| (0..columns).contains(range)) {
            for doppler in 0..rows {
                for (beam, &sine) in self.sines.iter().enumerate() {
                    tried += LEVELS.len() as f64;
                    let (gain, level) = self.gain(&places(doppler, range), beam);
                    if best.as_ref().is_none_or(|best| f64::from(gain) > best.gain) {
                        let place = (doppler as f64 / FINE as f64, range as f64 / FINE as f64);
                        best = Some(StaticTarget { gain: gain.into(), place, sine, power: LEVELS[level].into() });
                    }
                }
            }
        }
        best.map(|best| (best, tried))
    }
}

pub struct StaticTarget {
    pub gain: f64,
    /// Doppler and range in cells.
    pub place: (f64, f64),
    pub sine: f64,
    pub power: f64,
}

/// Which level explains most.
fn strongest_level(sums: &Gains) -> (f32, usize) {
    let mut best = (sums[0], 0);
    for (level, &sum) in sums.iter().enumerate().skip(1) {
        if sum > best.0 {
            best = (sum, level);
        }
    }
    best
}

/// Laws of all rates and every second excursion about one range, in the fewest phases.
pub fn laws(scene: &Scene, mean_m: f64, length_s: f64) -> Vec<Law> {
    let of_rate = |rate_hz: f64| {
        excursions(scene, rate_hz, 2).flat_map(move |(excursion_m, _)| phased([mean_m, excursion_m, rate_hz], PHASES.0 as usize))
    };
    rates(scene, length_s).flat_map(of_rate).collect()
}

/// Laws of one mean, excursion and rate, in so many phases.
fn phased([mean_m, excursion_m, rate_hz]: [f64; 3], phases: usize) -> impl Iterator<Item = Law> {
    (0..phases).map(move |phase| {
        let (sine, cosine) = (TAU * phase as f64 / phases as f64).sin_cos();
        [mean_m, excursion_m * sine, excursion_m * cosine, rate_hz]
    })
}

fn rates(scene: &Scene, length_s: f64) -> impl Iterator<Item = f64> + use<> {
    let step_hz = 0.1 / length_s;
    let fastest_hz = FASTEST_HZ.min(1.0 / (FRAMES_PER_TURN * scene.evidence.radar.frame_period_s));
    (FIRST_STEP..=(fastest_hz / step_hz) as usize).map(move |step| step as f64 * step_hz)
}

/// Every so many-th excursion, with the Doppler bins by which it moves, as far as these are unambiguous.
fn excursions(scene: &Scene, rate_hz: f64, every: usize) -> impl Iterator<Item = (f64, f64)> + use<> {
    let (per_m, most) = (TAU * rate_hz, 0.5 * scene.loops as f64);
    let doppler_per_mps = scene.model.cells.doppler_per_mps;
    (0..EXCURSIONS.2)
        .step_by(every)
        .map(|step| EXCURSIONS.0 * EXCURSIONS.1.powi(step as i32))
        .map(move |excursion_m| (excursion_m, per_m * excursion_m * doppler_per_mps))
        .filter(move |(_, bins)| (LEAST_BINS..most).contains(bins))
}

/// First steps of mean, sine, cosine and rate.
pub fn widths(scene: &Scene, law: Law, length_s: f64) -> Law {
    let excursion = law[1].hypot(law[2]);
    [0.5 * scene.range_m(1.0), 0.2 * excursion, 0.2 * excursion, 0.05 / length_s]
}

/// One number after another is moved as long as that helps, then by less.
pub fn climb<const N: usize, T: Copy>(
    mut now: [f64; N],
    mut best: T,
    widths: &[f64; N],
    gain: impl Fn([f64; N]) -> T,
    better: impl Fn(T, T) -> bool,
) -> ([f64; N], T) {
    let mut widths = *widths;
    for _ in 0..STEPS {
        let mut moved = false;
        for axis in 0..N {
            for sign in [-1.0, 1.0] {
                let mut other = now;
                other[axis] += sign * widths[axis];
                let found = gain(other);
                if better(found, best) {
                    (now, best, moved) = (other, found, true);
                }
            }
        }
        if !moved {
            widths.iter_mut().for_each(|width| *width *= 0.6);
        }
    }
    (now, best)
}

/// By level, the best of every cell and its neighbours.
pub fn around(cells: &Grid<Gains, 3>) -> Grid<Gains, 3> {
    let [_, rows, columns] = cells.shape();
    let best = |mut best: Gains, other: &Gains| {
        best.iter_mut().zip(other).for_each(|(best, gain)| *best = best.max(*gain));
        best
    };
    let along = Grid::from_fn(CELLS, cells.shape(), |[beam, row, column]| {
        let near = column.saturating_sub(1)..(column + 2).min(columns);
        cells.below([beam, row])[near].iter().fold(cells[[beam, row, column]], best)
    });
    Grid::from_fn(CELLS, cells.shape(), |[beam, row, column]| {
        let near = [(row + 1) % rows, (row + rows - 1) % rows];
        near.into_iter().fold(along[[beam, row, column]], |now, near| best(now, &along[[beam, near, column]]))
    })
}
