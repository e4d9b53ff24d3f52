//! The range grid: what a return near a cell's centre looks like in every sample.
//!
//! A return v = (g + r·x)·N/C turns, g a cell of C, x in −1 … 1 its offset in units of the reach r, is in sample k
//! exp(j2π v k/N) = exp(j2π g k/C) · exp(jκx) with κ = 2π r k/C, and exp(jκx) ≈ Σ_d j^d f_d(k) x^d. So d moments of the
//! offset spread onto the grid, a transform of each, and N numbers f_d give the sum. The expansion is in Legendre
//! polynomials, which is the best in the least squares over x.

use std::f64::consts::TAU;

#[derive(Clone, Copy, Debug)]
pub struct RangeGrid {
    pub samples: usize,
    pub cells: usize,
    /// Number of moments.
    pub orders: usize,
    /// Largest offset from a cell's centre, in cells.
    pub reach: f64,
}

impl RangeGrid {
    /// Grid cells per turn of sweep.
    pub fn cells_per_turn(&self) -> f64 {
        self.cells as f64 / self.samples as f64
    }

    /// k of a sample: the grid's transform needs whole numbers, so that cells repeat after C.
    pub fn bin(&self, sample: usize) -> i64 {
        sample as i64 - (self.samples / 2) as i64
    }

    /// Samples are at (k − offset)/N of the window: half a sample for an odd number of them, in turns per turn of sweep.
    pub fn phase_per_sweep(&self) -> f64 {
        if self.samples % 2 == 1 { -0.5 / self.samples as f64 } else { 0.0 }
    }

    /// f_d(k), `[order][sample]`; the factor j^d is left to the caller.
    pub fn moments(&self) -> Vec<Vec<f64>> {
        let legendre = legendre(self.orders);
        let mut moments = vec![vec![0.0; self.samples]; self.orders];
        for (degree, polynomial) in legendre.iter().enumerate() {
            let weights: Vec<f64> = (0..self.samples)
                .map(|sample| TAU * self.reach * self.bin(sample) as f64 / self.cells as f64)
                .map(|kappa| (2 * degree + 1) as f64 * spherical_bessel(degree, kappa))
                .collect();
            for (power, coefficient) in polynomial.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                let sign = if (degree - power) / 2 % 2 == 0 { 1.0 } else { -1.0 };
                moments[power].iter_mut().zip(&weights).for_each(|(moment, weight)| *moment += sign * weight * coefficient);
            }
        }
        moments
    }
}

/// Coefficients of the Legendre polynomials of degree below `count`, lowest power first.
fn legendre(count: usize) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = vec![vec![1.0], vec![0.0, 1.0]];
    for l in 1..count.max(2) - 1 {
        let mut next = vec![0.0; l + 2];
        for (power, c) in all[l].iter().enumerate() {
            next[power + 1] += (2 * l + 1) as f64 * c / (l + 1) as f64;
        }
        for (power, c) in all[l - 1].iter().enumerate() {
            next[power] -= l as f64 * c / (l + 1) as f64;
        }
        all.push(next);
    }
    all.truncate(count);
    all
}

/// j_l(x) by its series, for |x| of the order of one.
fn spherical_bessel(l: usize, x: f64) -> f64 {
    let mut term = (1..=l).fold(1.0, |product, i| product * x / (2 * i + 1) as f64);
    let mut sum = term;
    for k in 1..20 {
        term *= -0.5 * x * x / (k * (2 * (l + k) + 1)) as f64;
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_rebuild_the_exponential_within_the_reach() {
        for (orders, tolerance) in [(5, 3e-5), (6, 2e-6), (11, 1e-13)] {
            let grid = RangeGrid { samples: 16, cells: 64, orders, reach: 0.5 };
            let moments = grid.moments();
            for sample in 0..16 {
                for x in [-1.0f64, -0.3, 0.0, 0.7, 1.0] {
                    let kappa = TAU * 0.5 * grid.bin(sample) as f64 / 64.0;
                    let (mut re, mut im) = (0.0, 0.0);
                    for (d, f) in moments.iter().enumerate() {
                        let value = f[sample] * x.powi(d as i32);
                        match d % 4 {
                            0 => re += value,
                            1 => im += value,
                            2 => re -= value,
                            _ => im -= value,
                        }
                    }
                    let error = ((kappa * x).cos() - re).hypot((kappa * x).sin() - im);
                    assert!(error < tolerance, "{orders} orders, sample {sample}, x {x}: {error:.1e} not below {tolerance:.0e}");
                }
            }
        }
    }
}
