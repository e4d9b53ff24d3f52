//! What the receivers observe of the body in common, cell by cell, and how an array that is not as declared changes that.
//!
//! What a cell of range and Doppler holds of the body is speckle: a Gaussian field over the receivers whose covariance comes
//! from the directions of the points in that cell, which are predicted, and from a power that is not. Where these points lie
//! close together the receivers observe nearly the same, and what an array changes shows in the little that they do not have in
//! common. So every cell counts with the information that its own covariance has (scores and Fisher's information of a
//! complex Gaussian law), not like any other.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::bearing::Bearing;
use crate::diagnosis::power::PowerModel;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::speckle::{self, Look};
use crate::diagnosis::{BodyPrediction, Evidence};
use crate::radar::Radar;

/// Expected power over the noise, noise included, from which on a cell is used.
const LEAST_POWER: f32 = 3.0;
/// Share of the static returns that may be left at low Doppler when they were taken out.
const STILL_LEFT: f64 = 1e-3;
/// Fewest cells of a frame.
const FEWEST_CELLS: usize = 10;
/// Cells of a group that errors are taken from, at least, and groups of a frame, at most.
const GROUP_CELLS: usize = 8;
const MOST_GROUPS: usize = 6;
/// Ranges that what hardly moves is taken together of.
const STILL_RANGES: usize = 2;
/// Share of a cell's power that is independent from receiver to receiver: what the prediction does not know of the directions.
const OWN_SHARE: f64 = 0.005;

/// The numbers that an array may differ by, one after the other: logarithmic gains, phases, and displacements along x in radian per
/// unit of the sine, of every receiver; real and imaginary part of the coupling from the one before, and from the one after.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    pub receivers: usize,
}

impl Numbers {
    pub fn count(self) -> usize {
        3 * self.receivers + 4
    }

    pub fn gain(self, rx: usize) -> usize {
        rx
    }

    pub fn phase(self, rx: usize) -> usize {
        self.receivers + rx
    }

    pub fn place(self, rx: usize) -> usize {
        2 * self.receivers + rx
    }

    /// Of the one before, then of the one after; real, then imaginary part.
    pub fn coupling(self, part: usize) -> usize {
        3 * self.receivers + part
    }

    /// Changes of these numbers that the body makes as well, or that nothing shows: one gain and one phase of all, another
    /// direction, and directions wider apart. `[number, change]`
    pub fn of_the_body(self, radar: &Radar) -> DMatrix<f64> {
        let mut changes = vec![];
        let mut change = |of: &dyn Fn(usize) -> (usize, f64)| {
            let mut column = DVector::zeros(self.count());
            (0..self.receivers).map(of).for_each(|(number, value)| column[number] = value);
            if column.norm() > 1e-9 {
                changes.push(column.normalize());
            }
        };
        change(&|rx| (self.gain(rx), 1.0));
        change(&|rx| (self.phase(rx), 1.0));
        for places in centred(radar) {
            change(&|rx| (self.phase(rx), places[rx]));
        }
        change(&|rx| (self.place(rx), 1.0));
        change(&|rx| (self.place(rx), centred(radar)[0][rx]));
        DMatrix::from_columns(&changes)
    }

    /// Orthonormal directions among some kinds of these numbers, each identified by its first one, that no such change has a part
    /// in. `[number, direction]`, one kind after the other.
    pub fn own(self, radar: &Radar, kinds: &[usize]) -> DMatrix<f64> {
        let of_the_body = self.of_the_body(radar);
        let columns: Vec<DVector<f64>> = kinds
            .iter()
            .flat_map(|&first| {
                let free = beside(&of_the_body.rows(first, self.receivers).into_owned());
                free.into_iter().map(move |direction| {
                    let mut column = DVector::zeros(self.count());
                    column.rows_mut(first, self.receivers).copy_from(&direction);
                    column
                })
            })
            .collect();
        if columns.is_empty() { DMatrix::zeros(self.count(), 0) } else { DMatrix::from_columns(&columns) }
    }
}

/// Orthonormal columns that make up everything that is no combination of some columns.
fn beside(columns: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let squares = (columns * columns.transpose()).symmetric_eigen();
    let each = squares.eigenvalues.iter().zip(squares.eigenvectors.column_iter());
    each.filter(|(value, _)| **value < 1e-6).map(|(_, column)| column.into_owned()).collect()
}

/// Places of the receivers by axis, from their middle, wavelengths.
fn centred(radar: &Radar) -> [Vec<f64>; 3] {
    std::array::from_fn(|axis| {
        let middle = radar.rx_m.iter().map(|at| at[axis]).sum::<f64>() / radar.rx_m.len() as f64;
        radar.rx_m.iter().map(|at| (at[axis] - middle) / radar.wavelength_m()).collect()
    })
}

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
    /// The same, every point weighted with the sine of its direction.
    pub aslant: DMatrix<Complex64>,
}

/// What all ways in which receivers may differ are sought in.
pub struct Array {
    pub cells: Cells,
    pub bearing: Bearing,
    /// What turns the body back to where it stands, `[rx, rx]`.
    back: DMatrix<Complex64>,
    /// After that, and if the receivers were alike.
    pub looks: Vec<Vec<Look>>,
}

impl Array {
    pub fn new(cells: Cells, bearing: Bearing) -> Self {
        let back = bearing.turned_back(&cells.radar);
        let looks = cells.looks(&back);
        Self { cells, bearing, back, looks }
    }

    /// What undoes a difference between receivers, `[rx, rx]`, applied to what they observed.
    pub fn looks_after(&self, undo: &DMatrix<Complex64>) -> Vec<Vec<Look>> {
        self.cells.looks(&(&self.back * undo))
    }
}

/// The cells that the body fills, by frame and group of neighbours.
pub struct Cells {
    pub radar: Radar,
    pub frames: Vec<Vec<Group>>,
    /// Of every receiver, in the same units.
    pub noise: Vec<f64>,
}

impl Cells {
    /// `still`: power of the static returns, by range.
    pub fn new(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, still: &[f64]) -> Self {
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
            .map(|frame| groups(cells(evidence, model, body, still, frame, mean)))
            .collect();
        Self { radar: radar.clone(), frames, noise: (0..receivers).map(of_receiver).collect() }
    }

    pub fn numbers(&self) -> Numbers {
        Numbers { receivers: self.radar.rx_m.len() }
    }

    /// By frame and group, after what the receivers observed was multiplied by a matrix `[rx, rx]`.
    pub fn looks(&self, undo: &DMatrix<Complex64>) -> Vec<Vec<Look>> {
        let of_the_body = self.numbers().of_the_body(&self.radar);
        // What the matrix makes of independent noise has neighbours in common; that is little.
        let noise: Vec<f64> =
            undo.row_iter().map(|row| row.iter().zip(&self.noise).map(|(value, noise)| value.norm_sqr() * noise).sum()).collect();
        self.frames
            .par_iter()
            .map(|groups| groups.iter().map(|group| look(group, undo, &noise, &of_the_body)).collect())
            .collect()
    }
}

/// `moving`, `still`: cells that move, and cells that hardly do, with their ranges.
fn groups([moving, mut still]: [Vec<(usize, Cell)>; 2]) -> Vec<Group> {
    let count = (moving.len() / GROUP_CELLS).clamp(1, MOST_GROUPS);
    // The last ones first.
    let mut groups: Vec<Group> = speckle::groups(moving, count)
        .into_iter()
        .rev()
        .map(|cells| Group { cells: cells.into_iter().map(|(_, cell)| cell).collect(), place: None })
        .collect();
    still.sort_by_key(|(range, _)| range / STILL_RANGES);
    groups.extend(still.chunk_by(|a, b| a.0 / STILL_RANGES == b.0 / STILL_RANGES).map(|chunk| Group {
        cells: chunk.iter().map(|(_, cell)| cell.clone()).collect(),
        place: Some(chunk[0].0 / STILL_RANGES),
    }));
    groups.retain(|group| !group.cells.is_empty());
    groups
}

/// Cells of a frame in which the body is expected to be stronger than `least`, noise included, and seen. None where these are too few.
pub fn used(evidence: &Evidence, model: &PowerModel, still: &[f64], frame: usize, least: f32) -> Option<Vec<usize>> {
    let expected = model.expected(frame);
    let map = &evidence.maps()[frame * model.size()..(frame + 1) * model.size()];
    let samples = evidence.cube.dims[4];
    // A body that hardly moves is known by what it leaves of itself where static clutter was taken out.
    let of_the_body = |cell: usize| model.usable()[cell] || f64::from(map[cell]) > STILL_LEFT * still[cell % samples];
    let used: Vec<usize> = (0..model.size()).filter(|&cell| expected[cell] > least && of_the_body(cell)).collect();
    (used.len() >= FEWEST_CELLS).then_some(used)
}

fn cells(
    evidence: &Evidence,
    model: &PowerModel,
    body: &BodyPrediction,
    still: &[f64],
    frame: usize,
    noise: f64,
) -> [Vec<(usize, Cell)>; 2] {
    let radar = &evidence.radar;
    let (receivers, samples) = (radar.rx_m.len(), evidence.cube.dims[4]);
    let Some(used) = used(evidence, model, still, frame, LEAST_POWER) else { return [vec![], vec![]] };
    let mut slots = vec![usize::MAX; model.size()];
    used.iter().enumerate().for_each(|(slot, &cell)| slots[cell] = slot);
    let mut sums = vec![[DMatrix::<Complex64>::zeros(receivers, receivers), DMatrix::zeros(receivers, receivers)]; used.len()];
    let wave = TAU / radar.wavelength_m();
    let centre = radar.centre_m();
    for point in body.with_echoes(radar, body.frames[frame].clone(), None) {
        let (range_m, velocity_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let peak = model.peak(radar, point);
        let distance = |from: [f64; 3]| (0..3).map(|axis| (point.position_m[axis] - from[axis]).powi(2)).sum::<f64>().sqrt();
        let sine = (point.position_m[0] - centre[0]) / distance(centre).max(1e-6);
        let turns: Vec<Complex64> = radar
            .rx_m
            .iter()
            .map(|rx| Complex64::cis(wave * distance(std::array::from_fn(|axis| rx[axis] + radar.position_m[axis]))))
            .collect();
        model.cells.each(range_m, velocity_mps, |cell, share| {
            let power = peak * f64::from(share);
            if slots[cell] == usize::MAX || power <= 0.0 {
                return;
            }
            let [sum, aslant] = &mut sums[slots[cell]];
            for column in 0..receivers {
                let other = turns[column].conj() * power;
                for row in 0..receivers {
                    let value = turns[row] * other;
                    sum[(row, column)] += value;
                    aslant[(row, column)] += value * sine;
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
    for (&cell, [expected, aslant]) in used.iter().zip(sums) {
        let part = usize::from(!model.usable()[cell]);
        parts[part].push((cell % samples, Cell { observed: observed(cell), expected, aslant }));
    }
    parts
}

/// Of cells together. `noise`: of every receiver; `of_the_body`: changes of the numbers that do not count.
fn look(group: &Group, undo: &DMatrix<Complex64>, noise: &[f64], of_the_body: &DMatrix<f64>) -> Look {
    let numbers = Numbers { receivers: noise.len() };
    let mut look = Look::new(numbers.count(), group.place);
    for cell in &group.cells {
        add(cell, undo, noise, numbers, &mut look);
    }
    look.without(of_the_body)
}

fn add(cell: &Cell, undo: &DMatrix<Complex64>, noise: &[f64], numbers: Numbers, look: &mut Look) {
    let receivers = numbers.receivers;
    let white: Vec<f64> = noise.iter().map(|noise| 1.0 / noise.sqrt()).collect();
    let own = OWN_SHARE * (0..receivers).map(|rx| cell.expected[(rx, rx)].re).sum::<f64>() / receivers as f64;
    let shape = DMatrix::from_fn(receivers, receivers, |i, j| {
        let value = cell.expected[(i, j)] * (1.0 - OWN_SHARE) + if i == j { own } else { 0.0 };
        value * (white[i] * white[j])
    });
    let observed: Vec<DVector<Complex64>> = cell
        .observed
        .iter()
        .map(|observed| {
            let mut observed = undo * observed;
            observed.iter_mut().zip(&white).for_each(|(value, white)| *value *= *white);
            observed
        })
        .collect();
    look.add(shape, &observed, |level, body| {
        let aslant = DMatrix::from_fn(receivers, receivers, |i, j| cell.aslant[(i, j)] * (level * white[i] * white[j]));
        changes(body, &aslant, &white, numbers)
    });
}

/// How the covariance changes with every number.
fn changes(body: &DMatrix<Complex64>, aslant: &DMatrix<Complex64>, white: &[f64], numbers: Numbers) -> Vec<DMatrix<Complex64>> {
    let receivers = numbers.receivers;
    // What a matrix of the array makes of it, and the same conjugated.
    let by = |array: DMatrix<Complex64>| {
        let one = array * body;
        let other = one.adjoint();
        one + other
    };
    let alone = |rx: usize, value: Complex64| {
        let mut array = DMatrix::zeros(receivers, receivers);
        array[(rx, rx)] = value;
        by(array)
    };
    // A receiver farther along x receives what comes from there earlier.
    let moved = |rx: usize| {
        DMatrix::from_fn(receivers, receivers, |i, j| {
            aslant[(i, j)] * -Complex64::I * (f64::from(u8::from(i == rx)) - f64::from(u8::from(j == rx)))
        })
    };
    let coupled = |step: isize, value: Complex64| {
        by(DMatrix::from_fn(receivers, receivers, |i, j| {
            if i as isize == j as isize + step { value * (white[i] / white[j]) } else { Complex64::ZERO }
        }))
    };
    (0..receivers)
        .map(|rx| alone(rx, Complex64::ONE))
        .chain((0..receivers).map(|rx| alone(rx, Complex64::I)))
        .chain((0..receivers).map(moved))
        .chain([1, -1].into_iter().flat_map(|step| [coupled(step, Complex64::ONE), coupled(step, Complex64::I)]))
        .collect()
}

/// A body that walks across in front of four receivers half a wavelength apart, a little beside where it is predicted. What comes
/// from a sine reaches a receiver `turned`, and the receivers observe `array` times that.
#[cfg(test)]
pub fn walking(seed: u64, turned: impl Fn(usize, f64) -> Complex64, array: &DMatrix<Complex64>) -> Cells {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    let receivers = array.nrows();
    let mut radar = four_receivers();
    radar.rx_m.truncate(receivers);
    let wave = TAU / radar.wavelength_m();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut cell = |middle: f64, aside: f64| {
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let [mut expected, mut aslant] = [(); 2].map(|()| DMatrix::zeros(receivers, receivers));
        let mut observed = DVector::from_fn(receivers, |_, _| Complex64::new(normal(), normal()) * 0.5f64.sqrt());
        let mut field = DVector::zeros(receivers);
        for _ in 0..8 {
            let power: f64 = 10.0;
            let amplitude = Complex64::new(normal(), normal()) * (0.5 * power).sqrt();
            let sine = middle + 0.05 * normal();
            let from = |sine: f64| DVector::from_fn(receivers, |rx, _| Complex64::cis(-wave * radar.rx_m[rx][0] * sine));
            let predicted = from(sine);
            expected += &predicted * predicted.adjoint() * Complex64::from(power);
            aslant += &predicted * predicted.adjoint() * Complex64::from(power * sine);
            let real = from(sine + aside);
            field += DVector::from_fn(receivers, |rx, _| amplitude * real[rx] * turned(rx, sine + aside));
        }
        observed += array * field;
        Cell { observed: vec![observed], expected, aslant }
    };
    let mut errors = rand_chacha::ChaCha8Rng::seed_from_u64(seed + 1000);
    let frames = (0..12)
        .map(|frame| {
            let aside = 0.01 * (errors.random::<f64>() - 0.5);
            let mut group = || (0..12).map(|_| cell(0.05 * f64::from(frame) - 0.25, aside)).collect();
            (0..5).map(|_| Group { cells: group(), place: None }).collect()
        })
        .collect();
    Cells { radar, frames, noise: vec![1.0; receivers] }
}

#[cfg(test)]
pub fn four_receivers() -> Radar {
    let mut radar = Radar::small(12);
    radar.tx_m = vec![[0.0; 3]];
    radar.rx_m = (0..4).map(|rx| [0.5 * f64::from(rx) * radar.wavelength_m(), 0.0, 0.0]).collect();
    radar
}
