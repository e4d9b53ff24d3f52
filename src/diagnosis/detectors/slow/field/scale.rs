//! Large phases are read as angles, and variances are scaled to what is left.

use num_complex::Complex64;

use super::Field;

/// Root mean square of a phase, in radians, up to which it is read as its sine.
const SMALL: f64 = 0.2;
/// Radians up to which a phase can be read as its sine, and as an angle that must not be taken for one beyond half a turn.
pub const FARTHEST: [f64; 2] = [1.0, 2.0];
/// Information (inverse variance) of all groups from which on a chirp's angle is sure.
const SURE: f64 = 100.0;

impl Field {
    /// What all groups of a chirp share: their mean gain. None where it is not sure.
    fn common(&self, frame: usize, index: usize) -> Option<Complex64> {
        let weights = self.weights(frame);
        let sure: f64 = weights.iter().sum();
        let sum: Complex64 = self.deviations(frame, index).iter().zip(weights).map(|(value, weight)| value * weight).sum();
        (sure > SURE).then(|| Complex64::ONE + sum / sure)
    }

    /// Where phase excursions are large, reads them as angles, and gains as they are without that: a mean over time of what turns
    /// is shorter than it.
    pub(super) fn unroll(&mut self, training: &[usize]) {
        let chirps = training.iter().flat_map(|&frame| (0..self.loops).map(move |index| (frame, index)));
        let common: Vec<Complex64> = chirps.filter_map(|(frame, index)| self.common(frame, index)).collect();
        let mean = |of: &dyn Fn(&Complex64) -> f64| common.iter().map(of).sum::<f64>() / common.len() as f64;
        if common.is_empty() || mean(&|gain| gain.arg().powi(2)).sqrt() < SMALL {
            return;
        }
        self.farthest = FARTHEST[1];
        let (strength, angle) = (mean(&|gain| gain.norm()), mean(&|gain| gain.arg()));
        for frame in 0..self.frames {
            for index in 0..self.loops {
                let Some(common) = self.common(frame, index) else { continue };
                for value in self.deviation.below_mut([frame, index]) {
                    // Each group beside what all share is small.
                    let own = (Complex64::ONE + *value) / common;
                    *value = Complex64::new(own.re * common.norm() / strength - 1.0, own.im + common.arg() - angle);
                }
            }
        }
    }

    /// Scales the variances to what is left after a common gain and a phase in proportion to the delay: the noise need
    /// not be as white as it was taken for.
    pub(super) fn calibrate(&mut self) {
        let count = self.groups.len();
        let (mut sums, mut freedoms) = (vec![0.0; count], vec![0.0; count]);
        for frame in 0..self.frames {
            let weights = self.weights(frame).to_vec();
            let moments = self.moments(&weights);
            let determinant = moments[0] * moments[2] - moments[1] * moments[1];
            if weights.iter().filter(|w| **w > 0.0).count() < 4 || determinant <= 1e-9 * moments[0] * moments[2] {
                continue;
            }
            // Share of a group's variance that the fit takes away.
            let leverage: Vec<f64> = (0..count)
                .map(|g| {
                    let tau = self.groups[g].delay_s;
                    weights[g] * (moments[2] - 2.0 * tau * moments[1] + tau * tau * moments[0]) / determinant
                })
                .collect();
            for index in 0..self.loops {
                let values = self.deviations(frame, index);
                let (mut zero, mut first) = (Complex64::ZERO, Complex64::ZERO);
                for g in 0..count {
                    zero += values[g] * weights[g];
                    first += values[g] * (weights[g] * self.groups[g].delay_s);
                }
                let constant = (zero * moments[2] - first * moments[1]) / determinant;
                let slope = (first * moments[0] - zero * moments[1]) / determinant;
                for g in 0..count {
                    if weights[g] > 0.0 {
                        sums[g] += (values[g] - constant - slope * self.groups[g].delay_s).norm_sqr() * weights[g];
                        freedoms[g] += (1.0 - leverage[g]).max(0.0);
                    }
                }
            }
        }
        for frame in 0..self.frames {
            for g in 0..count {
                if freedoms[g] > 30.0 {
                    self.weight[[frame, g]] /= (sums[g] / freedoms[g]).max(0.5);
                }
            }
        }
    }

    fn moments(&self, weights: &[f64]) -> [f64; 3] {
        let mut moments = [0.0; 3];
        for (weight, group) in weights.iter().zip(&self.groups) {
            for (power, moment) in moments.iter_mut().enumerate() {
                *moment += weight * group.delay_s.powi(power as i32);
            }
        }
        moments
    }
}
