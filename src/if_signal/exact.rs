//! The coherent sum by its definition.

use burn::tensor::{Tensor, TensorData};

use crate::complex::{Complex, wrap};
use crate::paths::Phasors;

/// Elements of one block's phases.
const BLOCK: usize = 1 << 21;

pub fn sum(phasors: &Phasors, samples: usize) -> Complex<2> {
    let [points, chirps] = phasors.dims();
    let (device, dtype) = (phasors.device(), phasors.dtype());
    let s: Vec<f64> = (0..samples).map(|n| (n as f64 - 0.5 * samples as f64) / samples as f64).collect();
    let s: Tensor<3> = Tensor::from_data(TensorData::new(s, [1, 1, samples]).convert_dtype(dtype), (&device, dtype));
    let step = (BLOCK / (chirps * samples)).max(1);
    let mut total: Option<Complex<2>> = None;
    for start in (0..points).step_by(step) {
        let count = step.min(points - start);
        let block = |tensor: &Tensor<2>| -> Tensor<3> { tensor.clone().narrow(0, start, count).unsqueeze_dim(2) };
        // Whole turns of the phase would cost digits of the sum.
        let turns = block(&phasors.sweep_turns) * s.clone() + wrap(block(&phasors.phase_turns));
        let unit = Complex::unit(turns);
        let re = block(&phasors.amplitude);
        let terms = match &phasors.amplitude_im {
            Some(im) => {
                let im = block(im);
                Complex::new(unit.re.clone() * re.clone() - unit.im.clone() * im.clone(), unit.re * im + unit.im * re)
            }
            None => Complex::new(unit.re * re.clone(), unit.im * re),
        };
        let part = terms.sum_dim(0).reshape([chirps, samples]);
        total = Some(match total {
            Some(total) => total.add(part),
            None => part,
        });
    }
    total.expect("at least one point")
}
