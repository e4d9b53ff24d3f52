//! What the receivers observe of the body in common, cell by cell, and how an array that is not as declared changes that.
//!
//! What a cell of range and Doppler holds of the body is speckle: a Gaussian field over the receivers whose covariance comes
//! from the directions of the points in that cell, which are predicted, and from a power that is not. Where these points lie
//! close together the receivers observe nearly the same, and what an array changes shows in the little that they do not have in
//! common. So every cell counts with the information that its own covariance has (scores and Fisher's information of a
//! complex Gaussian law), not like any other.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::bearing::Bearing;
use super::cells::{Cell, Cells, Group};
use super::numbers::Numbers;
use crate::diagnosis::speckle::Look;

/// Share of a cell's power that is independent from receiver to receiver: what the prediction does not know of the directions.
const OWN_SHARE: f64 = 0.005;

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
        let looks = looks(&cells, |_| back.clone());
        Self { cells, bearing, back, looks }
    }

    /// `undo`: what undoes a difference between receivers, `[rx, rx]`, applied to what they observed of a cell at a sine of its direction.
    pub fn looks_after(&self, undo: impl Fn(f64) -> DMatrix<Complex64> + Sync) -> Vec<Vec<Look>> {
        looks(&self.cells, |sine| &self.back * undo(sine))
    }
}

/// By frame and group, after what the receivers observed of each cell was multiplied by a matrix `[rx, rx]`.
fn looks(cells: &Cells, undo: impl Fn(f64) -> DMatrix<Complex64> + Sync) -> Vec<Vec<Look>> {
    let numbers = cells.numbers();
    let of_the_body = numbers.of_the_body(&cells.radar);
    let look = |group: &Group| {
        let mut look = Look::new(numbers.count(), group.place);
        for cell in &group.cells {
            add(cell, &undo(cell.sine), &cells.noise, numbers, &mut look);
        }
        look.without(&of_the_body)
    };
    cells.frames.par_iter().map(|groups| groups.iter().map(look).collect()).collect()
}

/// `noise`: of every receiver, before `undo`.
fn add(cell: &Cell, undo: &DMatrix<Complex64>, noise: &[f64], numbers: Numbers, look: &mut Look) {
    let receivers = numbers.receivers;
    // What the matrix makes of independent noise has neighbours in common; that is little.
    let mixed = undo.row_iter().map(|row| row.iter().zip(noise).map(|(value, noise)| value.norm_sqr() * noise).sum::<f64>());
    let white: Vec<f64> = mixed.map(|noise| 1.0 / noise.sqrt()).collect();
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
    look.add(shape, &observed, |body| changes(body, cell.sine, &white, numbers));
}

/// How the covariance changes with every number.
fn changes(body: &DMatrix<Complex64>, sine: f64, white: &[f64], numbers: Numbers) -> Vec<DMatrix<Complex64>> {
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
    // A receiver farther along x receives what comes from there earlier: a phase by the cell's mean direction, as it is undone. How the
    // directions within a cell spread is left out.
    let moved = |rx: usize| {
        DMatrix::from_fn(receivers, receivers, |i, j| {
            body[(i, j)] * (-Complex64::I * sine) * (f64::from(u8::from(i == rx)) - f64::from(u8::from(j == rx)))
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
