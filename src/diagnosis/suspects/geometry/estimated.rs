//! Numbers estimated from groups of cells, with errors that come from leaving out one after the other.

use nalgebra::{DMatrix, DVector};

use super::channels::Sums;
use crate::diagnosis::cube::folds;
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
        let gain = |parts: [Vec<usize>; 2]| {
            let [rest, held] = parts.map(|part| part.iter().flat_map(|&index| frames[index].to_vec()).collect::<Vec<Sums>>());
            if rest.is_empty() || held.is_empty() {
                return None;
            }
            let [expected, seen] = [of(&Sums::together(&rest))?, of(&Sums::together(&held))?];
            let share = held.len() as f64 / self.groups;
            Some(0.5 * share * (self.square(&seen)? - self.square(&(&seen - &expected))?))
        };
        folds(frames.len()).map(gain).sum()
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

/// Cells of a body that walks across, after the declared steering, by frame and group; `change`: what a receiver makes of what
/// comes from a sine.
#[cfg(test)]
pub fn walking(radar: &crate::radar::Radar, seed: u64, change: impl Fn(usize, f64) -> num_complex::Complex64) -> Vec<Vec<Sums>> {
    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use super::places::{Moments, neighbours};

    const CELLS: usize = 12;
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let wave = std::f64::consts::TAU / radar.wavelength_m();
    let pairs = neighbours(radar);
    let receivers = radar.rx_m.len();
    let mut group = |middle: f64| {
        let mut along = vec![Moments::default(); pairs.len()];
        let mut products = vec![Complex64::ZERO; receivers * receivers];
        for _ in 0..CELLS {
            let sine = middle + 0.1 * (random.random::<f64>() - 0.5);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let field = Complex64::new(normal(), normal());
            // Errors of the prediction turn all pairs alike.
            let aside = 0.05 * normal();
            let heard: Vec<Complex64> = (0..receivers)
                .map(|rx| {
                    let turn = Complex64::cis(-wave * radar.rx_m[rx][0] * aside);
                    field * turn * change(rx, sine) + Complex64::new(normal(), normal()) * 0.3
                })
                .collect();
            products.iter_mut().enumerate().for_each(|(i, sum)| *sum += heard[i / receivers] * heard[i % receivers].conj());
            for (along, &[far, near]) in along.iter_mut().zip(&pairs) {
                let mut cross = heard[far] * heard[near].conj();
                for moment in along.iter_mut() {
                    *moment += cross;
                    cross *= sine;
                }
            }
        }
        Sums { products, along, cells: CELLS as f64, range_m: 3.0, sine: middle }
    };
    (0..12).map(|frame| (0..5).map(|_| group(0.05 * f64::from(frame) - 0.25)).collect()).collect()
}
