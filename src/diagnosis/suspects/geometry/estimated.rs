//! Numbers estimated from groups of cells, with errors that come from leaving out one after the other.

use nalgebra::{DMatrix, DVector};

use super::channels::Sums;
use crate::diagnosis::cube::FOLDS;
use crate::diagnosis::statistics::fisher_tail;

/// Groups of cells that are needed for an error, and how many more per number.
const FEWEST: [usize; 2] = [12, 2];

pub struct Estimated {
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    pub groups: f64,
}

impl Estimated {
    /// With the errors that come from leaving out one group after the other, or one frame, whichever is more: what is wrong of a
    /// frame's body is wrong of all its groups. None from too few.
    ///
    /// `frames`: groups of cells, by frame; `of`: the numbers; `floors`: what the power model's errors do to each.
    pub fn new(frames: &[&[Sums]], floors: &[f64], of: impl Fn(&Sums) -> Option<DVector<f64>>) -> Option<Self> {
        let groups: Vec<Sums> = frames.iter().flat_map(|groups| groups.iter().cloned()).collect();
        if groups.len() < FEWEST[0] + FEWEST[1] * floors.len() {
            return None;
        }
        let all = Sums::together(&groups);
        let values = of(&all)?;
        let without = |parts: &[Sums]| parts.iter().map(|part| of(&all.without(part))).collect::<Option<Vec<_>>>();
        let by_frame: Vec<Sums> =
            frames.iter().filter(|groups| !groups.is_empty()).map(|groups| Sums::together(groups)).collect();
        let mut covariance = jackknife(&without(&groups)?);
        let of_frames = jackknife(&without(&by_frame)?);
        covariance *= (of_frames.trace() / covariance.trace().max(f64::MIN_POSITIVE)).max(1.0);
        floors.iter().enumerate().for_each(|(i, floor)| covariance[(i, i)] += floor * floor);
        Some(Self { values, covariance, groups: groups.len() as f64 })
    }

    /// How much better each fold of the frames is foretold by the others than by zeros, nats: its own numbers have the same
    /// covariance but for how many groups they are from.
    pub fn foretold(&self, frames: &[&[Sums]], of: impl Fn(&Sums) -> Option<DVector<f64>>) -> Option<f64> {
        let gain = |fold: usize| {
            let part = |inside: bool| -> Vec<Sums> {
                let of_fold = |index: &usize| (index % FOLDS == fold) == inside;
                (0..frames.len()).filter(of_fold).flat_map(|index| frames[index].to_vec()).collect()
            };
            let (rest, held) = (part(false), part(true));
            if rest.is_empty() || held.is_empty() {
                return None;
            }
            let [expected, seen] = [of(&Sums::together(&rest))?, of(&Sums::together(&held))?];
            let share = held.len() as f64 / self.groups;
            Some(0.5 * share * (self.square(&seen)? - self.square(&(&seen - &expected))?))
        };
        (0..FOLDS).map(gain).sum()
    }

    /// Squared length in units of the covariance.
    pub fn square(&self, values: &DVector<f64>) -> Option<f64> {
        Some(values.dot(&self.covariance.clone().cholesky()?.solve(values)))
    }

    /// Chance that all are zero: Hotelling's law of a mean whose covariance comes from as many groups.
    pub fn p_value(&self) -> Option<f64> {
        let freedom = self.values.len() as f64;
        let below = self.groups - freedom;
        let ratio = self.square(&self.values)? * below / (freedom * (self.groups - 1.0));
        Some(fisher_tail(ratio, freedom, below))
    }
}

/// Covariance, from the numbers without one part after the other.
fn jackknife(without: &[DVector<f64>]) -> DMatrix<f64> {
    let count = without.len() as f64;
    let mean = without.iter().sum::<DVector<f64>>() / count;
    let mut covariance = DMatrix::zeros(mean.len(), mean.len());
    for other in without {
        let off = other - &mean;
        covariance += &off * off.transpose() * ((count - 1.0) / count);
    }
    covariance
}
