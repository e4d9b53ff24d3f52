//! Numbers estimated from the slopes of the likelihood of groups of cells, with errors that come from how the groups disagree.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::covariance::Look;
use crate::diagnosis::cube::folds;
use crate::diagnosis::statistics::{chi2_tail, fisher_tail};

/// Groups of cells that are needed for an error, and how many more per number.
const FEWEST: [usize; 2] = [8, 2];

/// Of a few directions among the numbers that an array may differ by.
pub struct Estimated {
    /// In the directions that were asked for, as their covariance.
    pub values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Their squared length in units of it.
    pub square: f64,
    /// Chance that all are zero.
    pub p_value: f64,
    /// How much better each fold of the frames is foretold by the others than by zeros, nats; and the part of it that errors of
    /// the prediction cannot make.
    pub likelihood: f64,
    pub gain: f64,
}

impl Estimated {
    /// None from too few groups, or where nothing shows these numbers.
    ///
    /// `frames`: looks of groups of cells, by frame, as the numbers are `at`; `directions`: `[number, direction]`,
    /// orthonormal; `floors`: what errors of the prediction do to each.
    pub fn new(frames: &[Vec<Look>], at: &DVector<f64>, directions: &DMatrix<f64>, floors: &[f64]) -> Option<Self> {
        let count = directions.ncols();
        let along = |look: &Look| Look {
            score: directions.transpose() * &look.score,
            information: directions.transpose() * &look.information * directions,
            place: look.place,
        };
        let frames: Vec<Vec<Look>> =
            frames.iter().map(|looks| looks.iter().map(along).collect::<Vec<Look>>()).filter(|looks| !looks.is_empty()).collect();
        // What errs together is one group.
        let by_group = grouped(&frames, count);
        let groups = by_group.len();
        if count == 0 || groups < FEWEST[0] + FEWEST[1] * count {
            return None;
        }
        let all = together(frames.iter().flatten(), count);
        let inverse = all.information.clone().cholesky()?.inverse();
        let step = &inverse * &all.score;
        let values = at + &step;
        // What is left of the slopes of each part.
        let left = |look: &Look| &look.score - &look.information * &step;
        let scatter = |parts: &[Look], lost: f64| -> DMatrix<f64> {
            let parts_count = parts.len() as f64;
            let squares: DMatrix<f64> = parts.iter().map(|look| left(look) * left(look).transpose()).sum();
            squares * (parts_count / (parts_count - lost).max(1.0))
        };
        let by_frame: Vec<Look> = frames.iter().map(|looks| together(looks.iter(), count)).collect();
        let by_place = placed(&frames, count);
        let spread = scatter(&by_group, count as f64);
        // What is wrong of a frame's body is wrong of all its groups; and one that stays where it is shows the same speckle in all
        // frames.
        let size = |spread: &DMatrix<f64>| (&inverse * spread).trace() / count as f64;
        let inflation = size(&spread).max(size(&scatter(&by_frame, 1.0))).max(size(&scatter(&by_place, count as f64)));
        let mut covariance = &inverse * &spread * &inverse * (inflation / size(&spread).max(f64::MIN_POSITIVE));
        let square_by = |covariance: &DMatrix<f64>| Some(values.dot(&covariance.clone().cholesky()?.solve(&values)));
        let without_floors = square_by(&covariance)?;
        floors.iter().enumerate().for_each(|(i, floor)| covariance[(i, i)] += floor * floor);
        let square = square_by(&covariance)?;
        let (groups, freedom) = (groups as f64, count as f64);
        // Hotelling's law of a mean whose covariance comes from as many groups.
        let below = groups - freedom;
        let p_value = fisher_tail(square * below / (freedom * (groups - 1.0)), freedom, below);
        // The likelihood near the estimate, scaled to what the groups really scatter, by the others' estimate and by zeros.
        let gain = |[rest, held]: [Vec<usize>; 2]| {
            let of = |part: &[usize]| together(part.iter().flat_map(|&frame| &frames[frame]), count);
            let [rest, held] = [of(&rest), of(&held)];
            let foretold = rest.information.cholesky()?.solve(&rest.score);
            let likelihood = |from: &DVector<f64>| held.score.dot(from) - 0.5 * from.dot(&(&held.information * from));
            Some((likelihood(&foretold) - likelihood(&-at)) / inflation.max(1.0))
        };
        // What errors of the prediction may be is none.
        let own = square / without_floors.max(f64::MIN_POSITIVE);
        let likelihood = folds(frames.len()).map(gain).sum::<Option<f64>>()?;
        let gain = own * likelihood;
        (p_value.is_finite() && gain.is_finite()).then_some(Self { values, covariance, square, p_value, likelihood, gain })
    }

    /// Chance that some combinations of the values, `[value, combination]`, are zero.
    pub fn chance(&self, combinations: &DMatrix<f64>) -> f64 {
        let values = combinations.transpose() * &self.values;
        let covariance = combinations.transpose() * &self.covariance * combinations;
        let square = covariance.cholesky().map_or(0.0, |factors| values.dot(&factors.solve(&values)));
        chi2_tail(square, values.len() as f64)
    }

    /// Deviation of a linear combination of the values.
    pub fn deviation(&self, weights: &DVector<f64>) -> f64 {
        weights.dot(&(&self.covariance * weights)).max(0.0).sqrt()
    }
}

fn grouped(frames: &[Vec<Look>], count: usize) -> Vec<Look> {
    let (still, moving): (Vec<&Look>, Vec<&Look>) = frames.iter().flatten().partition(|look| look.place.is_some());
    let places: BTreeSet<Option<usize>> = still.iter().map(|look| look.place).collect();
    let of_place = |place| together(still.iter().copied().filter(|look| look.place == place), count);
    moving.into_iter().cloned().chain(places.into_iter().map(of_place)).collect()
}

/// Groups of all frames that are the same one of their frame's.
fn placed(frames: &[Vec<Look>], count: usize) -> Vec<Look> {
    let mut places: BTreeMap<(bool, usize), Look> = BTreeMap::new();
    for (index, look) in frames.iter().flat_map(|looks| looks.iter().enumerate()) {
        let place = (look.place.is_some(), look.place.unwrap_or(index));
        let sum = places.entry(place).or_insert_with(|| together([].into_iter(), count));
        sum.score += &look.score;
        sum.information += &look.information;
    }
    places.into_values().collect()
}

fn together<'a>(looks: impl Iterator<Item = &'a Look>, count: usize) -> Look {
    let mut sum = Look { score: DVector::zeros(count), information: DMatrix::zeros(count, count), place: None };
    for look in looks {
        sum.score += &look.score;
        sum.information += &look.information;
    }
    sum
}
