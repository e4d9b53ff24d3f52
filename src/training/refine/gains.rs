//! The gains of a body's parts where its pose is fixed: expected power is then linear in them.

use burn::tensor::{DType, Tensor, TensorData};
use nalgebra::{DMatrix, DVector};

use super::{expected::Comparison, parameters::GAIN};
use crate::heatmap::power_db;

/// Most steps of a fit; it takes about ten.
const MOST_STEPS: usize = 50;

/// A step that gains less is the last, nats: far below what a comparison of corrections resolves.
const LEAST_NATS: f64 = 1e-3;

/// Marquardt's first damping, its factor, and the damping at which there is no way down (Marquardt 1963).
const DAMPING: [f64; 3] = [1e-3, 10.0, 1e9];

/// A frame's blurred maps.
pub struct Linear {
    /// Power of a gain of zero nepers, `[gain, cell]`.
    basis: Tensor<2>,
    /// `[1, cell]`
    measured_db: Tensor<2>,
    floor: f64,
    variance_db2: f64,
}

impl Linear {
    /// `basis`: `[gain, doppler, range]`; `level`: nepers of power that all of it is raised by.
    pub fn new(comparison: &Comparison<'_>, basis: Tensor<3>, level: f64, measured: Tensor<2>) -> Self {
        let [gains, doppler, range] = basis.dims();
        let basis = comparison.blurred(basis) * level.exp();
        let measured = comparison.blurred(measured.unsqueeze()).reshape([1, doppler * range]);
        Self {
            basis: basis.reshape([gains, doppler * range]),
            measured_db: power_db(measured, 0.0),
            floor: comparison.noise.floor,
            variance_db2: comparison.variance_db2(),
        }
    }

    /// Power of every gain, `[gain, cell]`, that of all with noise, and the error in its standard deviations, both `[1, cell]`.
    fn parts(&self, gains: &[f64]) -> [Tensor<2>; 3] {
        let factors: Vec<f64> = gains.iter().map(|gain| (GAIN * gain).exp()).collect();
        let factors: Tensor<2> =
            Tensor::from_data(TensorData::new(factors, [gains.len(), 1]), (&self.basis.device(), DType::F32));
        let each = self.basis.clone() * factors;
        let all = each.clone().sum_dim(0) + self.floor;
        let error = (power_db(all.clone(), 0.0) - self.measured_db.clone()) / self.variance_db2.sqrt();
        [each, all, error]
    }

    /// As [`Comparison::nats`]; `gains` in standard deviations of their prior.
    pub fn nats(&self, gains: &[f64]) -> f64 {
        let [.., error] = self.parts(gains);
        0.5 * error.square().sum().into_scalar::<f64>()
    }

    /// Normal matrix and gradient of the nats.
    fn normal(&self, gains: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let count = gains.len();
        let [each, all, error] = self.parts(gains);
        let slope = each / all * (GAIN * 10.0 / std::f64::consts::LN_10 / self.variance_db2.sqrt());
        let matrix = slope.clone().matmul(slope.clone().transpose()).into_data().iter::<f64>().collect::<Vec<_>>();
        let gradient = slope.matmul(error.transpose()).into_data().iter::<f64>().collect::<Vec<_>>();
        (DMatrix::from_row_slice(count, count, &matrix), DVector::from_vec(gradient))
    }
}

/// The gains that lose fewest nats with their prior, from a start; all in standard deviations of their prior (Levenberg-Marquardt).
pub fn fit(frames: &[Linear], start: &[f64]) -> Vec<f64> {
    let cost = |gains: &[f64]| -> f64 {
        let prior: f64 = gains.iter().map(|gain| 0.5 * gain * gain).sum();
        prior + frames.iter().map(|frame| frame.nats(gains)).sum::<f64>()
    };
    let mut gains = start.to_vec();
    let mut best = cost(&gains);
    let [mut damping, factor, most] = DAMPING;
    for _ in 0..MOST_STEPS {
        let mut matrix = DMatrix::identity(gains.len(), gains.len());
        let mut gradient = DVector::from_column_slice(&gains);
        for frame in frames {
            let (part, slope) = frame.normal(&gains);
            matrix += part;
            gradient += slope;
        }
        let before = best;
        while damping < most {
            let mut damped = matrix.clone();
            (0..gains.len()).for_each(|at| damped[(at, at)] *= 1.0 + damping);
            let Some(step) = damped.cholesky().map(|factors| factors.solve(&gradient)) else { return gains };
            let moved: Vec<f64> = gains.iter().zip(step.iter()).map(|(gain, step)| gain - step).collect();
            let found = cost(&moved);
            if found < best {
                (gains, best) = (moved, found);
                damping /= factor;
                break;
            }
            damping *= factor;
        }
        if before - best < LEAST_NATS {
            break;
        }
    }
    gains
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn gains_are_found_from_a_map_that_they_made() {
        let device = Device::flex();
        let cells = 200;
        let hump = |cell: usize, middle: f64| 1e3 * (-0.5 * ((cell as f64 - middle) / 12.0).powi(2)).exp();
        let basis: Vec<f64> =
            [50.0, 90.0, 150.0].iter().flat_map(|&middle| (0..cells).map(move |cell| hump(cell, middle))).collect();
        let basis: Tensor<2> = Tensor::from_data(TensorData::new(basis, [3, cells]), (&device, DType::F32));
        let still = Tensor::zeros([1, cells], &device);
        let mut frame = Linear { basis, measured_db: still, floor: 1.0, variance_db2: 18.9 };
        let truth = [0.8, -1.0, 0.3];
        let [_, all, _] = frame.parts(&truth);
        frame.measured_db = power_db(all, 0.0);
        let found = fit(std::slice::from_ref(&frame), &[0.0; 3]);
        // The prior pulls them towards zero by less than a hundredth of their slopes' information.
        for (found, truth) in found.iter().zip(truth) {
            assert!((found - truth).abs() < 0.02, "{found} for {truth}");
        }
    }
}
