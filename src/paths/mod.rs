//! From geometry to phasors: the amplitude and the delay of every path (paper, eq. 1 and the three-segment delay).
//!
//! The carrier's phase is thousands of turns, which f32 cannot hold. So the host keeps the reference length of every
//! leg in f64 and drops its whole turns, and the device holds the few centimetres by which the leg changes. For
//! displacements of 3 cm along each axis the phase is then right to 4·10⁻⁵ rad, typically 6·10⁻⁶ rad, where f32 alone
//! errs by 4·10⁻³ rad (tested here against f64).

pub mod direct;
pub mod indirect;
mod leg;
mod waveform;

pub use crate::body::Displacement;
pub use direct::DirectPaths;
pub use indirect::WallReceiver;
pub(crate) use leg::SOFTENING_M;
pub use leg::{Leg, Motion, leg};
pub use waveform::{Amplitude, Dechirp, Waveform, phasors};
pub(crate) use waveform::{AtRest, NEAR_FIELD_M2, difference};

use burn::tensor::{DType, Device, Tensor, TensorData};

/// What a coherent sum adds up; every tensor `[point, chirp]`.
///
/// X\[chirp, sample\] = Σ_point A exp(j2π(phase + sweep · s_n)), s_n = (n − N/2)/N for n in 0 … N.
#[derive(Clone, Debug)]
pub struct Phasors {
    /// Linear amplitude (its real part), spreading included.
    pub amplitude: Tensor<2>,
    /// Imaginary part of the amplitude; absent: zero.
    pub amplitude_im: Option<Tensor<2>>,
    /// Phase at the middle of the sampling window, in turns.
    pub phase_turns: Tensor<2>,
    /// By how many turns the phase grows across the window: the beat frequency in range bins.
    pub sweep_turns: Tensor<2>,
}

impl Phasors {
    /// `[point, chirp]`.
    pub fn dims(&self) -> [usize; 2] {
        self.phase_turns.dims()
    }

    /// The device of the tensors.
    pub fn device(&self) -> Device {
        self.phase_turns.device()
    }

    /// Kind of number of the tensors.
    pub fn dtype(&self) -> DType {
        self.phase_turns.dtype()
    }
}

/// Scatterers as seen from one transmitter: where they are, how they move, how strongly they answer.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Reference positions `[point]`, metres, radar frame.
    pub reference_m: &'a [[f64; 3]],
    /// From the references, at the middle of every chirp's sampling window.
    pub displacement: &'a Displacement,
    pub amplitude: &'a Amplitude,
}

/// One value per point as a column `[point, 1]`, rounded to the dtype only here.
fn column(values: impl Iterator<Item = f64>, device: &Device, dtype: DType) -> Tensor<2> {
    let values: Vec<f64> = values.collect();
    let count = values.len();
    Tensor::from_data(TensorData::new(values, [count, 1]).convert_dtype(dtype), (device, dtype))
}

pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
pub(crate) mod tests;
