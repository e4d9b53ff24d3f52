//! The information that a Gaussian field has of numbers that change its covariance.
//!
//! What a cell holds of a moving body is speckle: a complex Gaussian vector (over receivers, or along the chirp) whose covariance
//! comes from the points in that cell, which are predicted, and from a power that is not. So every cell counts with the
//! information that its own covariance has: scores and Fisher's information of a complex Gaussian law.

use std::ops::AddAssign;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Levels that a cell's power is sought at, decibels from the expected one, and how much it deviates from it.
const LEVELS_DB: i32 = 15;
const LEVEL_DEVIATION_DB: f64 = 5.0;

/// Some cells' slope and curvature of the likelihood by some numbers.
#[derive(Clone, Debug)]
pub struct Look {
    pub score: DVector<f64>,
    pub information: DMatrix<f64>,
    /// Looks of one such place may err together in all frames.
    pub place: Option<usize>,
}

impl Look {
    /// Of nothing yet.
    pub fn new(numbers: usize, place: Option<usize>) -> Self {
        Self { score: DVector::zeros(numbers), information: DMatrix::zeros(numbers, numbers), place }
    }

    /// Of all of them, which have so many numbers.
    pub fn sum<'a>(looks: impl Iterator<Item = &'a Self>, numbers: usize) -> Self {
        let mut sum = Self::new(numbers, None);
        looks.for_each(|look| sum += look);
        sum
    }

    /// Adds a cell.
    ///
    /// `shape`: covariance that the body is expected to have, in units of the noise; `observed`: independent draws; `changes`: how
    /// the body's covariance, at the level found, changes with every number.
    pub fn add(
        &mut self,
        shape: DMatrix<Complex64>,
        observed: &[DVector<Complex64>],
        changes: impl FnOnce(&DMatrix<Complex64>) -> Vec<DMatrix<Complex64>>,
    ) {
        let finite = |value: &Complex64| value.is_finite();
        if !(shape.iter().all(finite) && observed.iter().flatten().all(finite)) {
            return;
        }
        let size = shape.nrows();
        let eigen = shape.symmetric_eigen();
        let powers: Vec<f64> = eigen.eigenvalues.iter().map(|power| power.max(0.0)).collect();
        let axes = &eigen.eigenvectors;
        let mut energies = vec![0.0; size];
        for observed in observed {
            (axes.adjoint() * observed).iter().zip(&mut energies).for_each(|(value, energy)| *energy += value.norm_sqr());
        }
        let count = observed.len() as f64;
        let level = level(&powers, &energies, count);
        let of_powers = |of: &dyn Fn(f64) -> f64| {
            let diagonal = DVector::from_iterator(size, powers.iter().map(|power| Complex64::from(of(level * power))));
            axes * DMatrix::from_diagonal(&diagonal) * axes.adjoint()
        };
        let inverse = of_powers(&|power| 1.0 / (1.0 + power));
        let changes = changes(&of_powers(&|power| power));
        let weighed: Vec<DVector<Complex64>> = observed.iter().map(|observed| &inverse * observed).collect();
        let relative: Vec<DMatrix<Complex64>> = changes.iter().map(|change| &inverse * change).collect();
        for (a, change) in changes.iter().enumerate() {
            let seen: f64 = weighed.iter().map(|weighed| weighed.dotc(&(change * weighed)).re).sum();
            self.score[a] += seen - count * relative[a].trace().re;
            let turned = relative[a].transpose();
            for (b, other) in relative.iter().enumerate().skip(a) {
                let value = count * turned.dot(other).re;
                self.information[(a, b)] += value;
                if a != b {
                    self.information[(b, a)] += value;
                }
            }
        }
    }

    /// The efficient score: without what free changes explain of it. `free`: `[number, change]`.
    pub fn without(self, free: &DMatrix<f64>) -> Self {
        let Self { score, information, place } = self;
        let Ok(inverse) = (free.transpose() * &information * free).pseudo_inverse(1e-9) else {
            return Self::new(score.len(), place);
        };
        let explained = &information * free * inverse * free.transpose();
        Self { score: &score - &explained * &score, information: &information - &explained * &information, place }
    }
}

/// Neighbours in groups of nearly equal numbers, in their order.
pub fn groups<T>(mut all: Vec<T>, count: usize) -> Vec<Vec<T>> {
    let length = all.len();
    let mut groups: Vec<Vec<T>> = (0..count).rev().map(|group| all.split_off(group * length / count)).collect();
    groups.reverse();
    groups
}

impl AddAssign<&Self> for Look {
    fn add_assign(&mut self, other: &Self) {
        self.score += &other.score;
        self.information += &other.information;
    }
}

/// The power that a cell has, over the expected one.
fn level(powers: &[f64], energies: &[f64], count: f64) -> f64 {
    let log_likelihood = |db: i32| {
        let level = 10f64.powf(f64::from(db) / 10.0);
        let fit: f64 = powers
            .iter()
            .zip(energies)
            .map(|(power, energy)| -count * (1.0 + level * power).ln() - energy / (1.0 + level * power))
            .sum();
        fit - 0.5 * (f64::from(db) / LEVEL_DEVIATION_DB).powi(2)
    };
    let best = (-LEVELS_DB..=LEVELS_DB).map(|db| (db, log_likelihood(db))).max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(1.0, |(db, _)| 10f64.powf(f64::from(db) / 10.0))
}
