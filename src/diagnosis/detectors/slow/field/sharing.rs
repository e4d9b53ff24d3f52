//! Whether a deviation is most ranges' or that of a few.

use num_complex::Complex64;

use super::Field;
use super::part::Group;
use crate::diagnosis::evidence::Evidence;

/// What a range would gain (nats) by a deviation that it shares, for its absence to be informative.
pub const INFORMATIVE_GAIN: f64 = 10.0;

/// Whether most ranges, of which each gains and could gain so much (nats), gain more than a share of that; nothing
/// contradicts where none is informative.
pub fn most_have(gains: &[[f64; 2]], share: f64) -> bool {
    2 * gains.iter().filter(|[gain, most]| *gain > share * most).count() > gains.len() || gains.is_empty()
}

impl Field {
    /// Whether most of the ranges that could contradict a deviation share it: one that is far stronger than the others (a
    /// body that stands still for a while) must not speak for all. So must the one that could contradict it most where the body is not:
    /// slow parts of the body change its ranges. `predicted` gives it for frame, loop and group.
    pub fn shared(&self, predicted: impl Fn(usize, usize, &Group) -> Complex64) -> bool {
        let free = self.log_likelihood_gains(&predicted, |at| self.free[at]);
        let clearest = free.iter().max_by(|a, b| a[1].total_cmp(&b[1]));
        clearest.is_none_or(|[gain, _]| *gain > 0.0) && most_have(&self.log_likelihood_gains(&predicted, |_| true), 0.0)
    }

    /// The same of a deviation that was read from these ranges chirp by chirp, in which the strongest one finds itself: most of the
    /// others must have most of it, and one of them at least must be informative. The body's ranges are not, while it is there: its
    /// own slow returns move with it.
    pub fn shared_by_others(&self, predicted: impl Fn(usize, usize, &Group) -> Complex64) -> bool {
        let mut gains = self.log_likelihood_gains(predicted, |at| self.free[at]);
        let strongest = gains.iter().enumerate().max_by(|(_, a), (_, b)| a[1].total_cmp(&b[1])).map(|(index, _)| index);
        strongest.map(|index| gains.swap_remove(index));
        !gains.is_empty() && most_have(&gains, 0.5)
    }

    /// Whether the radar's own leakage has a deviation, too; none where nothing of it is informative, or something that moves is as near.
    pub fn is_of_leakage(&self, evidence: &Evidence, predicted: impl Fn(usize, usize, &Group) -> Complex64) -> Option<bool> {
        let is_leakage = |group: &Group| group.is_own() && evidence.are_whole(group.bins.clone());
        let leakage: Vec<bool> = self.groups.iter().map(is_leakage).collect();
        let gains = self.log_likelihood_gains(predicted, |[_, group]| leakage[group]);
        (!gains.is_empty()).then(|| most_have(&gains, 0.5))
    }

    /// What ranges gain by a deviation, and what they would if all of it were theirs (nats): the informative ones. `wanted`:
    /// of frame and group.
    fn log_likelihood_gains(
        &self,
        predicted: impl Fn(usize, usize, &Group) -> Complex64,
        wanted: impl Fn([usize; 2]) -> bool,
    ) -> Vec<[f64; 2]> {
        let of_group = |(g, group): (usize, &Group)| {
            let (mut gain, mut most) = (0.0, 0.0);
            for frame in (0..self.frames).filter(|frame| wanted([*frame, g])) {
                let weight = self.weights(frame)[g];
                for index in 0..self.loops {
                    let (value, model) = (self.deviations(frame, index)[g], predicted(frame, index, group));
                    gain += weight * (2.0 * (value * model.conj()).re - model.norm_sqr());
                    most += weight * model.norm_sqr();
                }
            }
            [gain, most]
        };
        self.groups.iter().enumerate().map(of_group).filter(|[_, most]| *most > INFORMATIVE_GAIN).collect()
    }
}
