//! Static returns at delays where no reflector can be: the frames' mean chirps, projected on the directions of fast time that the
//! room's delays do not reach, and linear models of what is there.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::support::{Support, dot, energy, ranges_m, support};
use crate::diagnosis::Evidence;

/// Mean chirps of the frames outside the support.
pub struct Field {
    pub support: Support,
    /// `[frame][channel][direction]`
    coordinates: Vec<Vec<Vec<Complex64>>>,
    /// Over the training frames, `[channel][direction]`.
    pub mean: Vec<Vec<Complex64>>,
    /// Over the training frames, `[channel][sample]`.
    pub clutter: Vec<Vec<Complex64>>,
    /// Of a coordinate of a frame's mean chirp, by channel.
    pub variance: Vec<f64>,
    training: Vec<usize>,
    held_out: Vec<usize>,
}

/// Templates in fast time: `own` have an amplitude in every channel, `common` (`[template][channel]`) only one.
#[derive(Clone, Default)]
pub struct Templates {
    /// `[template][sample]`.
    pub own: Vec<Vec<Complex64>>,
    /// `[template][channel][sample]`.
    pub common: Vec<Vec<Vec<Complex64>>>,
}

/// Amplitudes of templates, and what they predict.
pub struct Fitted {
    /// `[channel][template]`
    pub own: Vec<Vec<Complex64>>,
    /// `[template]`.
    pub common: Vec<Complex64>,
    /// `[channel][direction]`
    pub predicted: Vec<Vec<Complex64>>,
    /// Log-likelihood that the training frames gain.
    pub likelihood: f64,
}

impl Field {
    /// The field of a recording's static returns; none where no room is known, or its delays leave no direction free.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        Self::beside(evidence, ranges_m(evidence)?)
    }

    /// The same beside ranges in which static surfaces are, m.
    pub fn beside(evidence: &Evidence, ranges_m: [f64; 2]) -> Option<Self> {
        let [frames, .., loops, samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let training = evidence.split.training.clone();
        let white: Vec<f64> = evidence.noise().iter().map(|variance| variance / loops as f64).collect();
        let clutter: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(samples).map(<[Complex64]>::to_vec).collect();
        let strongest =
            clutter.iter().zip(&white).map(|(clutter, white)| energy(clutter) / white.max(1e-300)).fold(0.0, f64::max);
        let support = support(evidence, ranges_m, strongest * training.len() as f64)?;
        // Of scaled directions: how many whole ones they are worth.
        let worth: f64 = support.outside.iter().map(|direction| energy(direction)).sum();
        let coordinates: Vec<Vec<Vec<Complex64>>> = (0..frames)
            .into_par_iter()
            .map(|frame| {
                evidence.cube.clutter(&[frame]).chunks_exact(samples).map(|chirp| project(&support.outside, chirp)).collect()
            })
            .collect();
        let mean: Vec<Vec<Complex64>> = clutter.iter().map(|chirp| project(&support.outside, chirp)).collect();
        let variance = (0..channels)
            .map(|channel| {
                let scatter: f64 =
                    training.iter().map(|&frame| distance(&coordinates[frame][channel], &mean[channel])).sum::<f64>();
                let measured = scatter / ((training.len() as f64 - 1.0).max(1.0) * worth);
                measured.max(white[channel]).max(1e-300)
            })
            .collect();
        let held_out = evidence.split.held_out.clone();
        Some(Self { support, coordinates, mean, clutter, variance, training, held_out })
    }

    /// Transmitters times receivers.
    pub fn channels(&self) -> usize {
        self.mean.len()
    }

    /// Real numbers that the mean holds.
    pub fn freedom(&self) -> f64 {
        2.0 * (self.channels() * self.support.outside.len()) as f64
    }

    /// Weight of a squared coordinate of the training mean in the log-likelihood.
    pub fn weight(&self, channel: usize) -> f64 {
        self.training.len() as f64 / self.variance[channel]
    }

    /// Log-likelihood of the training mean's coordinates over that of noise, if they are all taken as they are.
    pub fn free_likelihood(&self) -> f64 {
        (0..self.channels()).map(|channel| self.weight(channel) * energy(&self.mean[channel])).sum()
    }

    /// Log-likelihood that held-out frames gain from one prediction over another (`[channel][direction]`).
    pub fn gain(&self, without: Option<&[Vec<Complex64>]>, with: &[Vec<Complex64>]) -> f64 {
        let mut gain = 0.0;
        for &frame in &self.held_out {
            for channel in 0..self.channels() {
                let found = &self.coordinates[frame][channel];
                let before = without.map_or_else(|| energy(found), |without| distance(found, &without[channel]));
                gain += (before - distance(found, &with[channel])) / self.variance[channel];
            }
        }
        gain
    }

    /// Mean chirps of held-out frames are not kept: only their coordinates.
    pub fn held_out(&self) -> &[usize] {
        &self.held_out
    }

    /// Coordinates of a chirp, `[direction]`, along the directions outside the support.
    pub fn project(&self, chirp: &[Complex64]) -> Vec<Complex64> {
        project(&self.support.outside, chirp)
    }

    /// Least squares of the training mean.
    pub fn fit(&self, templates: &Templates) -> Fitted {
        let (channels, directions) = (self.channels(), self.support.outside.len());
        let own: Vec<Vec<Complex64>> = templates.own.iter().map(|template| self.project(template)).collect();
        let basis = orthonormal(&own);
        let clean = |vector: &[Complex64]| {
            let mut vector = vector.to_vec();
            remove(&mut vector, &basis);
            vector
        };
        // Common amplitudes from what the channels' own templates cannot be.
        let common: Vec<Vec<Vec<Complex64>>> =
            templates.common.iter().map(|template| template.iter().map(|chirp| self.project(chirp)).collect()).collect();
        let count = common.len();
        let mut amplitudes = vec![Complex64::ZERO; count];
        if count > 0 {
            let mut normal = DMatrix::<Complex64>::zeros(count, count);
            let mut right = DVector::<Complex64>::zeros(count);
            for channel in 0..channels {
                let columns: Vec<Vec<Complex64>> = common.iter().map(|template| clean(&template[channel])).collect();
                let found = clean(&self.mean[channel]);
                for i in 0..count {
                    right[i] += dot(&columns[i], &found) * self.weight(channel);
                    for j in 0..count {
                        normal[(i, j)] += dot(&columns[i], &columns[j]) * self.weight(channel);
                    }
                }
            }
            if let Ok(solved) = normal.svd(true, true).solve(&right, 1e-12) {
                amplitudes = solved.iter().copied().collect();
            }
        }
        let matrix = DMatrix::from_fn(directions, own.len(), |row, column| own[column][row]);
        let decomposed = (!own.is_empty()).then(|| matrix.svd(true, true));
        let mut predicted = vec![];
        let mut own_amplitudes = vec![];
        let mut likelihood = 0.0;
        for channel in 0..channels {
            let mut sum = vec![Complex64::ZERO; directions];
            for (template, amplitude) in common.iter().zip(&amplitudes) {
                add(&mut sum, &template[channel], *amplitude);
            }
            let rest: Vec<Complex64> = self.mean[channel].iter().zip(&sum).map(|(found, sum)| found - sum).collect();
            let mut solved = vec![Complex64::ZERO; own.len()];
            if let Some(decomposed) = &decomposed {
                let largest = decomposed.singular_values.max();
                if let Ok(solution) = decomposed.solve(&DVector::from_vec(rest), 1e-4 * largest) {
                    solved = solution.iter().copied().collect();
                }
            }
            for (template, amplitude) in own.iter().zip(&solved) {
                add(&mut sum, template, *amplitude);
            }
            likelihood += self.weight(channel) * (energy(&self.mean[channel]) - distance(&self.mean[channel], &sum));
            predicted.push(sum);
            own_amplitudes.push(solved);
        }
        Fitted { own: own_amplitudes, common: amplitudes, predicted, likelihood }
    }
}

fn project(directions: &[Vec<Complex64>], chirp: &[Complex64]) -> Vec<Complex64> {
    directions.iter().map(|direction| dot(direction, chirp)).collect()
}

/// Σ |a − b|².
pub fn distance(a: &[Complex64], b: &[Complex64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm_sqr()).sum()
}

/// sum + factor · term, in place.
pub fn add(sum: &mut [Complex64], term: &[Complex64], factor: Complex64) {
    sum.iter_mut().zip(term).for_each(|(sum, term)| *sum += term * factor);
}

/// Takes the part along an orthonormal basis away.
pub fn remove(vector: &mut [Complex64], basis: &[Vec<Complex64>]) {
    for direction in basis {
        let part = dot(direction, vector);
        add(vector, direction, -part);
    }
}

/// Gram–Schmidt, twice for accuracy; columns that depend on the others are dropped.
pub fn orthonormal(columns: &[Vec<Complex64>]) -> Vec<Vec<Complex64>> {
    let mut basis: Vec<Vec<Complex64>> = vec![];
    for column in columns {
        let (mut rest, before) = (column.clone(), energy(column));
        remove(&mut rest, &basis);
        remove(&mut rest, &basis);
        let length = energy(&rest);
        if length > 1e-8 * before && length > 0.0 {
            let scale = length.sqrt().recip();
            rest.iter_mut().for_each(|value| *value *= scale);
            basis.push(rest);
        }
    }
    basis
}
