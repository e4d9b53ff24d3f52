//! A mean is worth its spread.

use std::fmt;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Mean, standard deviation and uncertainty of repeated numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub mean: f64,
    /// Of the numbers (n − 1 in the denominator; 0 for a single one).
    pub deviation: f64,
    /// Half the width of the mean's 95 % interval (Student's t with n − 1 degrees of freedom). `None` for a single
    /// number, and for numbers that depend on each other, such as those of a recording's frames.
    pub interval: Option<f64>,
    pub count: usize,
}

impl Spread {
    /// Of independent numbers; `None` without any.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let spread = Self::of_correlated(values)?;
        let count = spread.count as f64;
        let interval = (spread.count > 1).then(|| {
            let t = StudentsT::new(0.0, 1.0, count - 1.0).expect("at least one degree of freedom").inverse_cdf(0.975);
            t * spread.deviation / count.sqrt()
        });
        Some(Self { interval, ..spread })
    }

    /// Of numbers that depend on each other: how sure their mean is cannot be estimated. `None` without any.
    pub fn of_correlated(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().collect();
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = if count > 1 { (squares / (count - 1) as f64).sqrt() } else { 0.0 };
        Some(Self { mean, deviation, interval: None, count })
    }
}

impl fmt::Display for Spread {
    /// The mean and its 95 % interval, or the deviation of the numbers where there is none: `22.31 ± 1.02`, with as many
    /// places as asked for: `{:.3}`. What follows the ± must be said beside it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = f.precision().unwrap_or(2);
        write!(f, "{:.places$} ± {:.places$}", self.mean, self.interval.unwrap_or(self.deviation))
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
        assert_eq!(spread.count, 8);
    }

    #[test]
    fn the_interval_is_students() {
        // tables: t(0.975) is 12.706 with one degree of freedom, 2.365 with seven
        for (values, t) in [(vec![1.0, 3.0], 12.7062), (vec![2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0], 2.36462)] {
            let spread = Spread::of(values).unwrap();
            let wanted = t * spread.deviation / (spread.count as f64).sqrt();
            assert!((spread.interval.unwrap() / wanted - 1.0).abs() < 1e-5, "{:?}, wanted {wanted}", spread.interval);
        }
    }

    #[test]
    fn what_follows_the_mean_is_the_interval_where_there_is_one() {
        assert_eq!(format!("{:.1}", Spread::of([1.0, 3.0]).unwrap()), "2.0 ± 12.7");
        assert_eq!(format!("{:.1}", Spread::of_correlated([1.0, 3.0]).unwrap()), "2.0 ± 1.4");
    }

    #[test]
    fn one_number_has_no_interval_and_none_has_no_mean() {
        let one = Spread::of([3.0]).unwrap();
        assert_eq!((one.deviation, one.interval), (0.0, None));
        assert_eq!(Spread::of_correlated([1.0, 3.0]).unwrap().interval, None);
        assert_eq!(Spread::of([]), None);
    }
}
