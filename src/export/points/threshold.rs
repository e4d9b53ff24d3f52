//! By how much a cell must exceed the noise around it, so that white noise does so with a given chance.
//!
//! The power of a cell of white noise, averaged over K antennas, follows a gamma law of shape K: for one antenna the
//! exponential law. Training cells that a window correlates count as fewer independent ones (Welch, The use of fast Fourier
//! transform for the estimation of power spectra, 1967: the variance of a mean of correlated periodograms).

use statrs::function::beta::{beta_reg, ln_beta};
use statrs::function::gamma::{gamma_lr, gamma_ur};

/// CA-CFAR: the factor on the mean of `cells` independent training cells.
///
/// The ratio of the two powers follows the F law with 2K and 2KN degrees of freedom. For K = 1 this is the known
/// N (P^(−1/N) − 1) (Finn & Johnson, RCA Review 29,
/// 1968).
pub fn cell_averaging(rate: f64, antennas: f64, cells: f64) -> f64 {
    factor(rate, |factor| beta_reg(antennas * cells, antennas, cells / (cells + factor)))
}

/// OS-CFAR: the factor on the ordered cell of number `rank` (from 1) of `cells` independent training cells.
///
/// The mean over that cell's law of the chance to exceed it `factor` times. For K = 1 it is the product
/// Π (N − i) / (N − i + factor) over i from 0 to rank − 1 (Rohling, Radar CFAR thresholding in clutter and multiple target
/// situations, IEEE Trans. AES 19(4), 1983).
pub fn order_statistic(rate: f64, antennas: f64, cells: f64, rank: f64) -> f64 {
    let law = Ordered::new(antennas, cells, rank);
    factor(rate, |factor| law.exceeded(factor))
}

/// The median of that ordered cell, in units of the noise power: what turns it into an estimate of the noise.
pub fn ordered_level(antennas: f64, cells: f64, rank: f64) -> f64 {
    let share = ((rank - 1.0 / 3.0) / (cells + 1.0 / 3.0)).clamp(1e-9, 1.0 - 1e-9);
    quantile(antennas, share)
}

/// The law of an ordered cell, as nodes of a quadrature: its power in units of the noise, and the node's weight.
struct Ordered {
    antennas: f64,
    nodes: Vec<(f64, f64)>,
}

impl Ordered {
    /// The cell's share u of the noise's law follows Beta(rank, N − rank + 1). In t = ln(u / (1 − u)) that law is smooth and
    /// falls exponentially on both sides, so that the trapezoid rule converges fast.
    fn new(antennas: f64, cells: f64, rank: f64) -> Self {
        const STEP: f64 = 0.1;
        let (a, b) = (rank, cells - rank + 1.0);
        let node = |index: i32| {
            let t = f64::from(index) * STEP;
            let (log_u, log_rest) = (-(-t).exp().ln_1p(), -t.exp().ln_1p());
            (quantile(antennas, log_u.exp()), STEP * (a * log_u + b * log_rest - ln_beta(a, b)).exp())
        };
        let nodes: Vec<(f64, f64)> = (-300..=300).map(node).filter(|(_, weight)| *weight > 1e-18).collect();
        Self { antennas, nodes }
    }

    fn exceeded(&self, factor: f64) -> f64 {
        self.nodes.iter().map(|(level, weight)| weight * gamma_ur(self.antennas, self.antennas * factor * level)).sum()
    }
}

/// The power that a cell of noise stays below with this chance, in units of its mean.
fn quantile(antennas: f64, chance: f64) -> f64 {
    if antennas == 1.0 {
        return -(-chance).ln_1p();
    }
    bisect(|level| gamma_lr(antennas, antennas * level) >= chance)
}

/// The factor at which a chance that falls with it has come down to `rate`.
fn factor(rate: f64, chance: impl Fn(f64) -> f64) -> f64 {
    bisect(|factor| chance(factor) <= rate)
}

/// Where a condition begins to hold, from 1e-12 to 1e12, to the last digits.
fn bisect(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (1e-12_f64.ln(), 1e12_f64.ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle.exp()) { high = middle } else { low = middle }
    }
    high.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_antenna_gives_the_known_factors() {
        for (rate, cells) in [(1e-3, 16.0), (1e-6, 32.0), (0.1, 4.0)] {
            let wanted = cells * (f64::powf(rate, -1.0 / cells) - 1.0);
            let found = cell_averaging(rate, 1.0, cells);
            assert!((found / wanted - 1.0).abs() < 1e-9, "{found} against {wanted}");
            let rank = 0.75 * cells;
            let found = order_statistic(rate, 1.0, cells, rank);
            let chance: f64 = (0..rank as usize).map(|i| (cells - i as f64) / (cells - i as f64 + found)).product();
            assert!((chance / rate - 1.0).abs() < 1e-6, "{chance} against {rate}");
        }
    }

    #[test]
    fn more_antennas_need_a_smaller_factor() {
        let of = |antennas| [cell_averaging(1e-4, antennas, 20.0), order_statistic(1e-4, antennas, 20.0, 15.0)];
        let (one, four) = (of(1.0), of(4.0));
        assert!(four[0] < one[0] && four[1] < one[1] && four[0] > 1.0, "{one:?} {four:?}");
    }

    #[test]
    fn many_cells_know_the_noise() {
        // A threshold on a known noise: exp(−factor).
        assert!((cell_averaging(1e-4, 1.0, 1e6) - 1e4f64.ln()).abs() < 1e-3);
    }
}
