//! A mean is worth its spread.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Mean, standard deviation and uncertainty of repeated numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub mean: f64,
    /// Of the numbers (n − 1 in the denominator; 0 for a single one).
    pub deviation: f64,
    /// Half the width of the 95 % interval of the mean: 1.96 standard errors, for independent numbers.
    pub interval: f64,
    pub count: usize,
}

impl Spread {
    /// `None` without numbers.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().collect();
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = if count > 1 { (squares / (count - 1) as f64).sqrt() } else { 0.0 };
        Some(Self { mean, deviation, interval: 1.96 * deviation / (count as f64).sqrt(), count })
    }
}

impl fmt::Display for Spread {
    /// `22.31 ± 1.02`, with as many places as asked for: `{:.3}`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = f.precision().unwrap_or(2);
        write!(f, "{:.places$} ± {:.places$}", self.mean, self.deviation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_are_those_of_the_textbook() {
        let spread = Spread::of([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        assert_eq!(spread.mean, 5.0);
        assert!((spread.deviation - (32.0f64 / 7.0).sqrt()).abs() < 1e-15);
        assert!((spread.interval - 1.96 * (32.0f64 / 7.0 / 8.0).sqrt()).abs() < 1e-15);
        assert_eq!(format!("{spread:.1}"), "5.0 ± 2.1");
    }

    #[test]
    fn one_number_has_no_spread_and_none_has_no_mean() {
        assert_eq!(Spread::of([3.0]).unwrap().deviation, 0.0);
        assert_eq!(Spread::of([]), None);
    }
}
