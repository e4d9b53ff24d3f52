//! The coherent sum as tensor operations for GPUs, where scatter-add competes with matrix products.
//!
//! With n = a·h + b and h ≈ √N, exp(j2π(phase + sweep s_n)) is a factor of (point, a) times one of (point, b): 2√N sines
//! for N samples, and the sum over the points is a matrix product for every chirp. Exact up to rounding.

use burn::tensor::{Tensor, TensorData};

use crate::complex::{Complex, wrap};
use crate::paths::Phasors;

/// Elements of one factor of a block of points.
const BLOCK: usize = 1 << 24;

pub fn sum(phasors: &Phasors, samples: usize) -> Complex<2> {
    let [points, chirps] = phasors.dims();
    let (device, dtype) = (phasors.device(), phasors.dtype());
    let fine = (samples as f64).sqrt().ceil() as usize;
    let coarse = samples.div_ceil(fine);
    let row = |count: usize, of: &dyn Fn(usize) -> f64, shape: [usize; 3]| -> Tensor<3> {
        let values: Vec<f64> = (0..count).map(of).collect();
        Tensor::from_data(TensorData::new(values, shape).convert_dtype(dtype), (&device, dtype))
    };
    let at_coarse = row(coarse, &|a| ((a * fine) as f64 - 0.5 * samples as f64) / samples as f64, [1, coarse, 1]);
    let at_fine = row(fine, &|b| b as f64 / samples as f64, [1, fine, 1]);

    let step = (BLOCK / (chirps * coarse.max(fine))).max(1);
    let mut total: Option<Complex<3>> = None;
    for start in (0..points).step_by(step) {
        let count = step.min(points - start);
        // [chirp, 1, point]
        let block = |tensor: &Tensor<2>| -> Tensor<3> { tensor.clone().narrow(0, start, count).swap_dims(0, 1).unsqueeze_dim(1) };
        let sweep = block(&phasors.sweep_turns);
        let unit = Complex::unit(sweep.clone() * at_coarse.clone() + wrap(block(&phasors.phase_turns)));
        let re = block(&phasors.amplitude);
        let left = match &phasors.amplitude_im {
            Some(im) => unit.mul(Complex::new(re, block(im))),
            None => Complex::new(unit.re * re.clone(), unit.im * re),
        };
        let right = Complex::unit(sweep * at_fine.clone()).swap_dims(1, 2);
        let part = left.matmul(right);
        total = Some(match total {
            Some(total) => total.add(part),
            None => part,
        });
    }
    let total = total.expect("at least one point");
    total.reshape([chirps, coarse * fine]).narrow(1, 0, samples)
}
