//! Numbers estimated from the slopes of the likelihood of groups of cells, with errors that come from how the groups disagree.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::cube::folds;
use super::speckle::Look;
use super::statistics::{chi2_tail, fisher_tail};

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
    /// How much better each fold of the frames is predicted by the others than by zeros, nats; and the part of it that errors of
    /// the prediction cannot make.
    pub likelihood: f64,
    pub nats: f64,
}

/// Steps to the most likely numbers, at most, and a step that is none.
const STEPS: usize = 20;
const CONVERGED: f64 = 1e-4;

impl Estimated {
    /// Step by step from zeros, where the model is not linear. None where the numbers leave what can be undone, or still move by more
    /// than their deviation after the last step.
    ///
    /// `first`: looks as [`Self::new`] takes them, with all numbers zero; `looks`: the same with the numbers at some values.
    pub fn converged(
        first: &[Vec<Look>],
        directions: &DMatrix<f64>,
        floors: &[f64],
        looks: impl Fn(&DVector<f64>) -> Option<Vec<Vec<Look>>>,
    ) -> Option<Self> {
        let mut found = Self::new(first, &DVector::zeros(directions.ncols()), directions, floors)?;
        let mut step = found.values.clone();
        for _ in 1..STEPS {
            if step.amax() < CONVERGED {
                break;
            }
            let next = Self::new(&looks(&found.values)?, &found.values, directions, floors)?;
            step = &next.values - &found.values;
            found = next;
        }
        if (0..step.len()).any(|i| step[i].abs() > CONVERGED.max(found.covariance[(i, i)].sqrt())) {
            return None;
        }
        let (end, half) = (looks(&found.values)?, looks(&(&found.values * 0.5))?);
        Self::between(&end, Some([first, &half]), &found.values, directions, floors)
    }

    /// None from too few groups, or where nothing shows these numbers.
    ///
    /// `frames`: looks of groups of cells, by frame, as the numbers are `at`; `directions`: `[number, direction]`,
    /// orthonormal; `floors`: what errors of the prediction do to each.
    pub fn new(frames: &[Vec<Look>], at: &DVector<f64>, directions: &DMatrix<f64>, floors: &[f64]) -> Option<Self> {
        Self::between(frames, None, at, directions, floors)
    }

    /// `before`: the looks with the numbers at zero and half way from there, by which zeros are compared where the likelihood is no
    /// parabola (Simpson's rule over its slopes).
    fn between(
        frames: &[Vec<Look>],
        before: Option<[&[Vec<Look>]; 2]>,
        at: &DVector<f64>,
        directions: &DMatrix<f64>,
        floors: &[f64],
    ) -> Option<Self> {
        let count = directions.ncols();
        let along = |look: &Look| Look {
            score: directions.transpose() * &look.score,
            information: directions.transpose() * &look.information * directions,
            place: look.place,
        };
        let filled = |frames: &[Vec<Look>]| -> Vec<Vec<Look>> {
            frames.iter().map(|looks| looks.iter().map(along).collect::<Vec<Look>>()).filter(|looks| !looks.is_empty()).collect()
        };
        let (frames, before) = (filled(frames), before.map(|before| before.map(filled)));
        // What errs together is one group.
        let by_group = summed(&frames, |frame, index, look| match look.place {
            Some(place) => (true, place, 0),
            None => (false, frame, index),
        });
        let groups = by_group.len();
        if count == 0 || groups < FEWEST[0] + FEWEST[1] * count {
            return None;
        }
        let all = Look::sum(frames.iter().flatten(), count);
        let inverse = all.information.clone().cholesky()?.inverse();
        let step = &inverse * &all.score;
        let values = at + &step;
        let (mut covariance, inflation) = scattered(&frames, &by_group, &inverse, &step);
        let square_by = |covariance: &DMatrix<f64>| Some(values.dot(&covariance.clone().cholesky()?.solve(&values)));
        let without_floors = square_by(&covariance)?;
        floors.iter().enumerate().for_each(|(i, floor)| covariance[(i, i)] += floor * floor);
        let square = square_by(&covariance)?;
        let (groups, freedom) = (groups as f64, count as f64);
        // Hotelling's law of a mean whose covariance comes from as many groups.
        let below = groups - freedom;
        let p_value = fisher_tail(square * below / (freedom * (groups - 1.0)), freedom, below);
        let gain = |[rest, held]: [Vec<usize>; 2]| gained(&frames, before.as_ref(), at, [&rest, &held], count);
        // What errors of the prediction may be is none.
        let own = square / without_floors.max(f64::MIN_POSITIVE);
        // Scaled to what the groups really scatter.
        let likelihood = folds(frames.len()).map(gain).sum::<Option<f64>>()? / inflation.max(1.0);
        let gain = own * likelihood;
        (p_value.is_finite() && gain.is_finite()).then_some(Self { values, covariance, square, p_value, likelihood, nats: gain })
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

/// The covariance of what was estimated, from how groups of cells, whole frames and the same groups of all frames disagree; and how much
/// more they do than the likelihood says.
fn scattered(frames: &[Vec<Look>], by_group: &[Look], inverse: &DMatrix<f64>, step: &DVector<f64>) -> (DMatrix<f64>, f64) {
    let count = step.len() as f64;
    // What is left of the slopes of each part.
    let left = |look: &Look| &look.score - &look.information * step;
    let scatter = |parts: &[Look], lost: f64| -> DMatrix<f64> {
        let parts_count = parts.len() as f64;
        let squares: DMatrix<f64> = parts.iter().map(|look| left(look) * left(look).transpose()).sum();
        squares * (parts_count / (parts_count - lost).max(1.0))
    };
    let by_frame = summed(frames, |frame, _, _| frame);
    // Groups of all frames that are the same one of their frame's.
    let by_place = summed(frames, |_, index, look| (look.place.is_some(), look.place.unwrap_or(index)));
    let spread = scatter(by_group, count);
    // What is wrong of a frame's body is wrong of all its groups; and one that stays where it is shows the same speckle in all
    // frames.
    let size = |spread: &DMatrix<f64>| (inverse * spread).trace() / count;
    let inflation = size(&spread).max(size(&scatter(&by_frame, 1.0))).max(size(&scatter(&by_place, count)));
    (inverse * &spread * inverse * (inflation / size(&spread).max(f64::MIN_POSITIVE)), inflation)
}

/// How much likelier held-out frames are by the estimate of the rest than by zeros.
fn gained(
    frames: &[Vec<Look>],
    before: Option<&[Vec<Vec<Look>>; 2]>,
    at: &DVector<f64>,
    [rest, held]: [&[usize]; 2],
    count: usize,
) -> Option<f64> {
    let of = |frames: &[Vec<Look>], part: &[usize]| Look::sum(part.iter().flat_map(|&frame| &frames[frame]), count);
    let rest = of(frames, rest);
    let predicted = rest.information.cholesky()?.solve(&rest.score);
    let end = of(frames, held);
    // The likelihood near the estimate.
    let likelihood = |from: &DVector<f64>| end.score.dot(from) - 0.5 * from.dot(&(&end.information * from));
    let of_zeros = match before {
        Some([zero, half]) => -(of(zero, held).score + of(half, held).score * 4.0 + &end.score).dot(at) / 6.0,
        None => likelihood(&-at),
    };
    Some(likelihood(&predicted) - of_zeros)
}

/// Sums of the looks of one key, in the keys' order. `key`: of the frame, the look's index in it, and the look.
fn summed<K: Ord>(frames: &[Vec<Look>], key: impl Fn(usize, usize, &Look) -> K) -> Vec<Look> {
    let mut sums: BTreeMap<K, Vec<&Look>> = BTreeMap::new();
    for (frame, looks) in frames.iter().enumerate() {
        for (index, look) in looks.iter().enumerate() {
            sums.entry(key(frame, index, look)).or_default().push(look);
        }
    }
    sums.into_values().map(|looks| Look::sum(looks.iter().copied(), looks[0].score.len())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A likelihood of period 2π, 10 cos x: one that is a turn away is as good as zeros, whatever a parabola through its end says.
    #[test]
    fn zeros_are_compared_along_the_way_and_not_by_a_parabola() {
        let looks = |x: f64| -> Vec<Vec<Look>> {
            let look = || Look {
                score: DVector::from_element(1, -10.0 * x.sin()),
                information: DMatrix::from_element(1, 1, 10.0),
                place: None,
            };
            (0..8).map(|_| vec![look()]).collect()
        };
        let (rest, held) = ([0, 1, 2, 3], [4, 5, 6, 7]);
        let gain = |at: f64, by_parabola: bool| {
            let before = [looks(0.0), looks(0.5 * at)];
            let before = if by_parabola { None } else { Some(&before) };
            gained(&looks(at), before, &DVector::from_element(1, at), [&rest, &held], 1).unwrap()
        };
        let turn = std::f64::consts::TAU;
        assert!(gain(turn, false).abs() < 1e-6 && gain(turn, true) > 100.0, "{} {}", gain(turn, false), gain(turn, true));
        // Half a turn is the worst there is: 4 · 10 · (cos π − cos 0), within Simpson's error.
        assert!((gain(0.5 * turn, false) + 80.0).abs() < 5.0, "{}", gain(0.5 * turn, false));
    }
}
