//! Tails of the laws by which the checks decide.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Chance of a mean as far above zero where the values are independent around zero (Student's t).
pub(super) fn student_tail(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let Ok(law) = StudentsT::new(0.0, 1.0, count - 1.0) else { return 1.0 };
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    law.sf(mean / (variance / count).sqrt().max(f64::MIN_POSITIVE))
}

/// Logarithm of the chance of at least so many heads where each has this chance.
pub(super) fn log_binomial_tail(heads: usize, tosses: usize, chance: f64) -> f64 {
    let odds = (chance / (1.0 - chance)).ln();
    let (mut term, mut tail) = (tosses as f64 * (1.0 - chance).ln(), f64::NEG_INFINITY);
    for k in 0..=tosses {
        if k >= heads {
            // ln(e^tail + e^term), without leaving the range of numbers.
            let high = f64::max(tail, term);
            tail = high + ((tail - high).exp() + (term - high).exp()).ln();
        }
        term += ((tosses - k) as f64 / (k + 1) as f64).ln() + odds;
    }
    tail.min(0.0)
}

/// The place that comes first most often among some, and how often.
pub(super) fn most_frequent(places: &[usize]) -> Option<(usize, usize)> {
    let count = |place: usize| places.iter().filter(|other| **other == place).count();
    places.iter().map(|&place| (place, count(place))).max_by_key(|&(place, count)| (count, std::cmp::Reverse(place)))
}

/// Logarithm of the chance that one of `places` comes first in at least `count` of `trials`, each being first as often as any other
/// (Bonferroni over the places).
pub(super) fn log_same_place(count: usize, trials: usize, places: usize) -> f64 {
    (places as f64).ln() + log_binomial_tail(count, trials, 1.0 / places.max(2) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_tables() {
        // 1 − 0.9^5, and all of ten coins.
        assert!((log_binomial_tail(1, 5, 0.1).exp() - 0.40951).abs() < 1e-9);
        assert!((log_binomial_tail(10, 10, 0.5).exp() - 1.0 / 1024.0).abs() < 1e-12);
        assert!(log_binomial_tail(0, 7, 0.3).abs() < 1e-12);
        // Far beyond the range of numbers.
        assert!((log_binomial_tail(5000, 5000, 0.5) + 5000.0 * std::f64::consts::LN_2).abs() < 1e-6);
        // Student's table: 2.776 at 2.5 % with four degrees of freedom.
        let step = 1.0 / (2.776 * (2.5f64 / 5.0).sqrt());
        let five = [1.0 - 2.0 * step, 1.0 - step, 1.0, 1.0 + step, 1.0 + 2.0 * step];
        assert!((student_tail(&five) - 0.025).abs() < 2e-5 && student_tail(&[1.0]) == 1.0);
        assert_eq!(most_frequent(&[4, 7, 7, 1]), Some((7, 2)));
        assert!((log_same_place(3, 3, 10).exp() - 0.01).abs() < 1e-12);
    }
}
