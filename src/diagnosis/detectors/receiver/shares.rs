//! Whether something that noise has everywhere is everywhere: in most of the groups into which cells fall.

use crate::diagnosis::statistics::{chi2_tail, median};

/// Share of what is found that the middle one of all Doppler rows, of all beat frequencies, and of all frames must have: what a mover's
/// sidelobes or some bursts share lies in a few of them.
const EVERYWHERE: f64 = 0.4;

/// Share of the mean by which places may differ whatever chance does.
const LEVEL: f64 = 0.1;

/// Along each of several axes, for every place of it: what cells have of what was found, and what they would have if all had as much.
pub struct Shares<const AXES: usize>([Vec<[f64; 2]>; AXES]);

impl<const AXES: usize> Shares<AXES> {
    pub fn new(places: [usize; AXES]) -> Self {
        Self(places.map(|places| vec![[0.0; 2]; places]))
    }

    /// Of a cell at a place of every axis.
    pub fn add(&mut self, at: [usize; AXES], has: f64, expected: f64) {
        for (sums, place) in self.0.iter_mut().zip(at) {
            sums[place] = [sums[place][0] + has, sums[place][1] + expected];
        }
    }

    /// Whether the middle one of every axis has its share.
    pub fn are_everywhere(&self) -> bool {
        self.0.iter().all(|sums| {
            let of = |sums: &[f64; 2]| (sums[1] > 0.0).then(|| sums[0] / sums[1]);
            median(&mut sums.iter().filter_map(of).collect::<Vec<_>>()) > EVERYWHERE
        })
    }

    /// Chance that the places of an axis differ as much where all have the same share, by a chi-squared test. `variance`: of what a place
    /// has, over what it would have.
    pub fn chance_of_level(&self, axis: usize, variance: f64) -> f64 {
        let known = || self.0[axis].iter().filter(|sums| sums[1] > 0.0);
        let count = known().count();
        let [has, expected] = known().fold([0.0; 2], |[has, expected], sums| [has + sums[0], expected + sums[1]]);
        let mean = has / expected.max(f64::MIN_POSITIVE);
        let deviation = |sums: &[f64; 2]| (sums[0] / sums[1] - mean).powi(2) / (variance / sums[1] + (LEVEL * mean).powi(2));
        if count < 2 { 1.0 } else { chi2_tail(known().map(deviation).sum(), count as f64 - 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_places_have_is_level_and_what_some_have_more_of_is_not() {
        let chance = |of: fn(usize) -> f64| {
            let mut shares = Shares::new([6]);
            (0..600).for_each(|at| shares.add([at % 6], of(at), 1.0));
            shares.chance_of_level(0, 1.0)
        };
        assert!(chance(|at| 1.0 + 0.1 * (at as f64).sin()) > 0.05);
        assert!(chance(|at| if at % 6 < 2 { 2.0 } else { 0.5 }) < 1e-6);
    }

    #[test]
    fn what_a_few_places_of_an_axis_have_is_not_everywhere() {
        let shares = |of: fn(usize) -> f64| {
            let mut shares = Shares::new([8, 5]);
            (0..40).for_each(|at| shares.add([at % 8, at / 8], of(at), 1.0));
            shares.are_everywhere()
        };
        assert!(shares(|at| if at % 2 == 0 { 0.9 } else { 0.5 }));
        // All of it in three of eight, and in two of five.
        assert!(!shares(|at| if at % 8 < 3 { 8.0 } else { 0.0 }));
        assert!(!shares(|at| if at / 8 < 2 { 8.0 } else { 0.0 }));
    }
}
