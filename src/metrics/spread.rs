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

    /// Of numbers that two things decide, such as recordings and draws of what learned: `rows` are the first, with a number for each
    /// of the second. Both are taken at random, y_ij = μ + a_i + b_j + e_ij, and each one's means have an interval of their own
    /// (Student's t); the squares of the two half widths add up (Zou & Donner, Statistics in Medicine 27, 2008). The rest e_ij is in
    /// both, so the interval is rather too wide than too narrow. One column is [`Self::of`] its numbers; one row of several numbers
    /// has no interval. The deviation is that of the rows' means. `None` without any number.
    ///
    /// # Panics
    /// When rows differ in length.
    pub fn crossed(rows: &[Vec<f64>]) -> Option<Self> {
        let (count, columns) = (rows.len(), rows.first()?.len());
        assert!(rows.iter().all(|row| row.len() == columns), "crossed: rows of different length");
        if columns == 0 {
            return None;
        }
        let over_rows = Self::of(rows.iter().map(|row| row.iter().sum::<f64>() / columns as f64))?;
        if columns == 1 {
            return Some(over_rows);
        }
        let column_mean = |column: usize| rows.iter().map(|row| row[column]).sum::<f64>() / count as f64;
        let over_columns = Self::of((0..columns).map(column_mean))?;
        let interval = over_rows.interval.zip(over_columns.interval).map(|(rows, columns)| rows.hypot(columns));
        Some(Self { interval, ..over_rows })
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
    /// places as asked for: `{:.3}`. What follows the ± must be said beside it. Of one number, that number alone.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = f.precision().unwrap_or(2);
        if self.count == 1 {
            return write!(f, "{:.places$}", self.mean);
        }
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
        assert_eq!(format!("{:.1}", Spread::of_correlated([1.0]).unwrap()), "1.0");
    }

    #[test]
    fn draws_that_agree_change_nothing_and_draws_that_differ_widen_the_interval() {
        let recordings = [20.0, 22.0, 21.0, 25.0, 19.0];
        let rows = |draws: &[f64]| -> Vec<Vec<f64>> {
            recordings.iter().map(|value| draws.iter().map(|draw| value + draw).collect()).collect()
        };
        let once = Spread::of(recordings).unwrap();
        assert_eq!(Spread::crossed(&rows(&[0.0])).unwrap(), once);
        let same = Spread::crossed(&rows(&[0.0, 0.0, 0.0])).unwrap();
        assert_eq!((same.mean, same.count), (once.mean, 5));
        assert!((same.interval.unwrap() / once.interval.unwrap() - 1.0).abs() < 1e-9);
        // Draws alone: t with two degrees of freedom times 1 / √3.
        let alike: Vec<Vec<f64>> = vec![vec![-1.0, 0.0, 1.0]; 5];
        let draws = Spread::crossed(&alike).unwrap().interval.unwrap();
        assert!((draws - 4.30265 / 3f64.sqrt()).abs() < 1e-4, "{draws}");
        let both = Spread::crossed(&rows(&[-1.0, 0.0, 1.0])).unwrap().interval.unwrap();
        assert!(both > once.interval.unwrap(), "{both}");
        assert_eq!(Spread::crossed(&rows(&[0.0, 1.0])[..1]).unwrap().interval, None);
        assert_eq!(Spread::crossed(&[]), None);
    }

    /// Drawn from the model, the interval holds the true mean at least as often as it says.
    #[test]
    fn the_interval_over_two_things_covers() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        for [rows, columns, cells] in [[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.3, 1.0, 0.3]] {
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let trials = 1000;
            let held = (0..trials).filter(|_| {
                let draws: [f64; 3] = std::array::from_fn(|_| columns * normal());
                let table: Vec<Vec<f64>> = (0..16)
                    .map(|_| {
                        let row = rows * normal();
                        draws.iter().map(|draw| row + draw + cells * normal()).collect()
                    })
                    .collect();
                let found = Spread::crossed(&table).unwrap();
                found.mean.abs() < found.interval.unwrap()
            });
            let share = held.count() as f64 / f64::from(trials);
            // Three standard errors of a share of 95 % in a thousand are 2 %.
            assert!(share > 0.93, "{rows} {columns} {cells}: {share}");
        }
    }

    #[test]
    fn one_number_has_no_interval_and_none_has_no_mean() {
        let one = Spread::of([3.0]).unwrap();
        assert_eq!((one.deviation, one.interval), (0.0, None));
        assert_eq!(Spread::of_correlated([1.0, 3.0]).unwrap().interval, None);
        assert_eq!(Spread::of([]), None);
    }
}
