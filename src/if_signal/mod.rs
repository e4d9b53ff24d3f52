//! The IF signal: coherent sum of all paths (paper, eq. 2 and 3), and noise.
//!
//! The sum is X\[chirp, sample\] = Σ_point A exp(j2π(phase + sweep · s_n)). Its definition costs a sine per point, chirp
//! and sample. The fast forms put every return on the nearest cell of a range grid four times finer than the range
//! bins, with a few moments of its offset from the cell's centre, and transform the grid:
//!
//! - `exact`: the definition, in blocks; slow; the reference of tests.
//! - `spread`: the tensor form on CPUs: moments by scatter-add, transform by a DFT matrix.
//! - `split`: the tensor form on GPUs: exp(j2π sweep s_n) split over n = a·√N + b, then a batched matrix product.
//! - `fused`: all of it as kernels in f32, on flex over a range grid, on GPUs of the definition, with their own backward passes; from
//!   displacements on, where [`direct_signal`] and [`indirect_signal`] are called, so that no phase becomes a tensor.

mod cis;
mod exact;
mod fused;
mod grid;
pub mod noise;
pub(crate) mod signals;
mod split;
mod spread;

pub use crate::paths::Phasors;
pub use noise::{Noise, NoiseConfig, NoiseLaw};
pub use signals::{ToWalls, direct_signal, indirect_signal};

use burn::tensor::{DType, Tensor};
use serde::{Deserialize, Serialize};

use crate::complex::Complex;
use crate::device::{is_cpu, is_flex, is_gpu};

/// How the coherent sum is computed (setting `sum`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SumForm {
    /// The fastest for the device and the precision.
    #[default]
    Auto,
    /// Tensor operations only; works everywhere, in f32 and f64.
    Tensor,
    /// The fused kernels on flex and GPUs in f32; elsewhere the tensor form.
    Fused,
    /// The definition.
    Exact,
}

impl SumForm {
    /// Whether the fused kernel takes tensors like this one.
    fn is_fused(self, like: &Tensor<2>) -> bool {
        matches!(self, Self::Auto | Self::Fused)
            && (is_flex(&like.device()) || is_gpu(&like.device()))
            && like.dtype() == DType::F32
    }
}

/// Complex samples of one receiver.
///
/// # Shapes
/// phasors `[point, chirp]`; result `[chirp, sample]`. Any number of samples; no points give zeros.
///
/// # Gradient
/// Flows to amplitude, phase and sweep in every form. Relative error in f32 (tested): values below
/// 3·10⁻⁵, gradients below 10⁻⁴, and in f64 below 10⁻¹¹.
pub fn coherent_sum(phasors: &Phasors, samples: usize, form: SumForm) -> Complex<2> {
    let [points, chirps] = phasors.dims();
    let (device, dtype) = (phasors.device(), phasors.dtype());
    if points == 0 {
        let zeros = || Tensor::zeros([chirps, samples], (&device, dtype));
        return Complex::new(zeros(), zeros());
    }
    match form {
        SumForm::Exact => exact::sum(phasors, samples),
        _ if form.is_fused(&phasors.phase_turns) => fused::sum(phasors, samples),
        _ if is_cpu(&device) => spread::sum(phasors, samples),
        _ => split::sum(phasors, samples),
    }
}

#[cfg(test)]
pub(crate) mod tests;
