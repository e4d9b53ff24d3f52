//! From a coarse place to the likelihood's maximum, and how well it is known.
//!
//! Newton's method on the profile of the reflectivities, with central differences: the cells, windows and visibility of a body are host
//! geometry, so the gradient is not Burn's. The covariance is the sandwich of curvature and of the scores' scatter between frames
//! (Newey and West 1987: neighbouring frames show nearly one pose), so that a likelihood that is too sure of itself does not narrow it.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::fit::{Fitter, Score};
use super::place::{AZIMUTH, CLOCK, COUNT, FACING, HEIGHT, Place, RANGE};

/// Differences, and unit of all steps: seconds, radians, metres, radians, metres. A small part of what a cell or a beam resolves.
pub const UNIT: [f64; COUNT] = [0.012, 3.0 * PI / 180.0, 0.015, 1.0 * PI / 180.0, 0.03];
/// Standard deviation of what is known without the recording: keeps what it does not determine from running away.
pub const PRIOR: [f64; COUNT] = [1.0, PI, 3.0, 1.0, 1.0];
/// Largest step, units.
const LONGEST: f64 = 6.0;
/// Steps shorter than this end the climb, units.
const SHORTEST: f64 = 0.05;
/// Lags of the correlation between frames (Bartlett weights).
const LAGS: usize = 2;

/// A maximum of the likelihood.
#[derive(Clone)]
pub struct Maximum<'a> {
    pub fitter: Fitter<'a>,
    pub place: Place,
    pub score: Score,
    /// Of the place's numbers (zero for those that were kept), without floors.
    pub covariance: DMatrix<f64>,
    /// Informative frames, less the numbers that were fitted.
    pub freedom: f64,
}

/// Curvature and scores at a place, in units.
struct Slopes {
    base: Score,
    gradient: DVector<f64>,
    /// Negative Hessian with the prior.
    information: DMatrix<f64>,
    /// `[frame]`
    scores: Vec<DVector<f64>>,
}

impl<'a> Fitter<'a> {
    /// Climbs along some numbers of the place; `rounds` at most.
    pub fn climb(&self, start: Place, active: &[usize], rounds: usize) -> Maximum<'a> {
        let training = &self.readings.split.training;
        let mut place = start;
        let mut weights = None;
        for _ in 0..rounds {
            let sight = self.sight(&place, UNIT[CLOCK]);
            let slopes = self.slopes(&place, &sight, active, weights.as_ref());
            weights = Some(slopes.base.weights);
            let step = slopes.step();
            let mut taken = 0.0;
            for share in [1.0, 0.5, 0.25, 0.1] {
                let next = moved(&place, active, &(&step * share));
                let score = self.score(&next, &sight, weights.as_ref());
                if score.over(training) > slopes.base.over(training) {
                    (place, weights, taken) = (next, Some(score.weights), share);
                    break;
                }
            }
            if taken * step.amax() < SHORTEST {
                break;
            }
        }
        let slopes = self.slopes(&place, &self.sight(&place, UNIT[CLOCK]), active, weights.as_ref());
        let (covariance, freedom) = slopes.covariance(active, training);
        Maximum { fitter: *self, place, score: self.score_at(&place), covariance, freedom }
    }

    fn slopes(
        &self,
        place: &Place,
        sight: &super::fit::Sight,
        active: &[usize],
        near: Option<&[f64; super::likelihood::WEIGHTS]>,
    ) -> Slopes {
        let training = &self.readings.split.training;
        let base = self.score(place, sight, near);
        let at = |steps: &[(usize, f64)]| {
            let mut unit = DVector::zeros(active.len());
            steps.iter().for_each(|&(number, step)| unit[number] = step);
            self.score(&moved(place, active, &unit), sight, Some(&base.weights))
        };
        let count = active.len();
        let sides: Vec<[Score; 2]> = (0..count).map(|number| [at(&[(number, -1.0)]), at(&[(number, 1.0)])]).collect();
        let total = |score: &Score| score.over(training);
        let gradient = DVector::from_fn(count, |number, _| 0.5 * (total(&sides[number][1]) - total(&sides[number][0])));
        let mut information = DMatrix::zeros(count, count);
        for i in 0..count {
            information[(i, i)] = 2.0 * total(&base) - total(&sides[i][0]) - total(&sides[i][1]);
            for j in 0..i {
                let both = total(&at(&[(i, 1.0), (j, 1.0)])) + total(&at(&[(i, -1.0), (j, -1.0)]));
                let single: f64 = [i, j].iter().flat_map(|&number| &sides[number]).map(total).sum();
                let mixed = -0.5 * (both - single + 2.0 * total(&base));
                information[(i, j)] = mixed;
                information[(j, i)] = mixed;
            }
        }
        for (index, &number) in active.iter().enumerate() {
            information[(index, index)] += (UNIT[number] / PRIOR[number]).powi(2);
        }
        let score = |frame: usize| {
            DVector::from_fn(count, |number, _| 0.5 * (sides[number][1].by_frame[frame] - sides[number][0].by_frame[frame]))
        };
        let scores = (0..self.readings.frames()).map(score).collect();
        Slopes { base, gradient, information, scores }
    }
}

impl Slopes {
    /// The information with its directions of ascent (negative eigenvalues) taken as steep as descents.
    fn definite(&self) -> DMatrix<f64> {
        let mut eigen = self.information.clone().symmetric_eigen();
        let least = 1e-9 * eigen.eigenvalues.amax().max(1e-9);
        eigen.eigenvalues.iter_mut().for_each(|value| *value = value.abs().max(least));
        eigen.recompose()
    }

    fn step(&self) -> DVector<f64> {
        let step = self.definite().try_inverse().map_or_else(|| self.gradient.clone(), |inverse| inverse * &self.gradient);
        let longest = step.amax();
        if longest > LONGEST { step * (LONGEST / longest) } else { step }
    }

    /// Covariance of all numbers of a place, and degrees of freedom.
    fn covariance(&self, active: &[usize], training: &[usize]) -> (DMatrix<f64>, f64) {
        let count = active.len();
        let informative: Vec<&DVector<f64>> =
            training.iter().map(|&frame| &self.scores[frame]).filter(|score| score.amax() > 0.0).collect();
        let frames = informative.len() as f64;
        let freedom = (frames - count as f64).max(1.0);
        let mean = informative.iter().fold(DVector::zeros(count), |sum, score| sum + *score) / frames.max(1.0);
        let mut scatter = DMatrix::zeros(count, count);
        for lag in 0..=LAGS {
            let weight = 1.0 - lag as f64 / (LAGS + 1) as f64;
            for pair in informative.windows(lag + 1) {
                let (a, b) = (pair[0] - &mean, pair[lag] - &mean);
                scatter += match lag {
                    0 => &a * a.transpose(),
                    _ => (&a * b.transpose() + &b * a.transpose()) * weight,
                };
            }
        }
        scatter *= frames / freedom;
        for (index, &number) in active.iter().enumerate() {
            scatter[(index, index)] += (UNIT[number] / PRIOR[number]).powi(2);
        }
        let mut all = DMatrix::zeros(COUNT, COUNT);
        let mut definite = self.information.clone().symmetric_eigen();
        // Where the likelihood does not bend down, only the prior holds.
        let floor = active.iter().map(|&number| (UNIT[number] / PRIOR[number]).powi(2)).fold(f64::INFINITY, f64::min);
        definite.eigenvalues.iter_mut().for_each(|value| *value = value.max(floor));
        let Some(inverse) = definite.recompose().try_inverse() else { return (all, freedom) };
        let units = &inverse * scatter * &inverse;
        for (i, &a) in active.iter().enumerate() {
            for (j, &b) in active.iter().enumerate() {
                all[(a, b)] = units[(i, j)] * UNIT[a] * UNIT[b];
            }
        }
        (all, freedom)
    }
}

fn moved(place: &Place, active: &[usize], units: &DVector<f64>) -> Place {
    let mut values = place.values();
    active.iter().zip(units).for_each(|(&number, step)| values[number] += step * UNIT[number]);
    Place::of(values)
}

/// Numbers that are estimable at all: directions only across the array's extent.
pub fn active(readings: &super::readings::Readings) -> Vec<usize> {
    let estimable = |number: &usize| match *number {
        AZIMUTH => readings.resolves(0),
        HEIGHT => readings.resolves(2),
        _ => true,
    };
    [CLOCK, FACING, RANGE, AZIMUTH, HEIGHT].into_iter().filter(estimable).collect()
}
