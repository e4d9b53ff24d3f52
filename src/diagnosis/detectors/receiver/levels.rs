//! Variances that are estimated from few values each, drawn towards what they have in common (Smyth 2004, Linear models and empirical Bayes
//! methods, section 6).
//!
//! A variance is σ₀² d₀ / χ²(d₀), and its estimate σ² χ²(d) / d. The variance of the estimates' logarithms is ψ'(d/2) + ψ'(d₀/2), which
//! gives d₀; a value over its posterior mean has the law of Fisher and Snedecor with d + d₀ degrees of freedom below.

use statrs::function::gamma::digamma;

/// More degrees of freedom than anything here tells from infinitely many.
const MANY: f64 = 1e4;

/// Posterior means, and the degrees of freedom of each.
pub struct Levels {
    pub values: Vec<f64>,
    pub freedom: f64,
}

impl Levels {
    /// Of estimates with so many degrees of freedom each.
    pub fn of(estimates: &[f64], freedom: f64) -> Self {
        let logarithms: Vec<f64> = estimates.iter().filter(|value| **value > 0.0).map(|value| value.ln()).collect();
        let count = logarithms.len() as f64;
        if count < 2.0 {
            return Self { values: estimates.to_vec(), freedom };
        }
        let mean = logarithms.iter().sum::<f64>() / count;
        let variance = logarithms.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let of_variances = variance - trigamma(0.5 * freedom);
        let prior = if of_variances > 0.0 { (2.0 * inverse_trigamma(of_variances)).min(MANY) } else { MANY };
        let expected = |freedom: f64| digamma(0.5 * freedom) - (0.5 * freedom).ln();
        let middle = (mean - expected(freedom) + expected(prior)).exp();
        let values = estimates.iter().map(|value| (prior * middle + freedom * value) / (prior + freedom)).collect();
        Self { values, freedom: prior + freedom }
    }
}

/// Second derivative of the logarithm of the gamma function: its recurrence and its asymptotic series (Abramowitz and Stegun, 6.4.6 and 6.4.12).
fn trigamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < 12.0 {
        sum += x.powi(-2);
        x += 1.0;
    }
    let square = x.powi(-2);
    sum + x.recip() + 0.5 * square + square / x * (1.0 / 6.0 - square * (1.0 / 30.0 - square / 42.0))
}

/// By bisection of its logarithm: it falls.
fn inverse_trigamma(value: f64) -> f64 {
    let (mut low, mut high) = (1e-3f64.ln(), (0.5 * MANY).ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if trigamma(middle.exp()) > value { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support;

    #[test]
    fn trigamma_of_one_and_a_half() {
        use std::f64::consts::PI;
        assert!((trigamma(1.0) - PI * PI / 6.0).abs() < 1e-9 && (trigamma(0.5) - PI * PI / 2.0).abs() < 1e-9);
        assert!((inverse_trigamma(trigamma(3.7)) - 3.7).abs() < 1e-6);
    }

    /// Estimates of 12 degrees of freedom each, of variances that are alike or drawn with 6.
    #[test]
    fn what_variances_have_in_common_is_learned() {
        let mut normal = support::normal(8);
        let mut square = |freedom: usize| (0..freedom).map(|_| normal().powi(2)).sum::<f64>() / freedom as f64;
        let alike: Vec<f64> = (0..400).map(|_| 3.0 * square(12)).collect();
        let levels = Levels::of(&alike, 12.0);
        assert!(levels.freedom > 100.0 && levels.values.iter().all(|value| (value - 3.0).abs() < 0.5), "{}", levels.freedom);
        let apart: Vec<f64> = (0..400).map(|_| 3.0 * square(12) / square(6)).collect();
        let freedom = Levels::of(&apart, 12.0).freedom;
        assert!((15.0..22.0).contains(&freedom), "{freedom} for 18");
    }
}
