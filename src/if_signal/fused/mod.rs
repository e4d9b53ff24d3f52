//! The coherent sum as operations of flex and of GPUs in f32, with their own backward passes.
//!
//! Burn's backend extension: a trait of operations, implemented for flex, for GPUs, and for the autodiff decorator around both. The
//! tape keeps the inputs only. One operation takes phasors; the other takes displacements and does all of
//! [`crate::paths`] on the way, because as tensor operations that would cost several times more than the sum itself.

mod extension;
mod fourier;
#[cfg(any(feature = "wgpu", feature = "cuda"))]
mod gpu;
mod kernel;
mod lanes;
mod machine;
mod moving;
mod phasors;
mod plan;
mod scratch;

use std::ops::Range;
use std::sync::Arc;

use burn::backend::Dispatch;
use burn::tensor::{Device, Tensor};

use crate::complex::Complex;
use crate::device::is_gpu;
use crate::paths::{Phasors, Points, Waveform};
use extension::RadarOps;
use moving::Geometry;

/// Numbers of one tensor that a GPU writes at most: WebGPU's default `maxStorageBufferBindingSize`, 128 MiB.
const LARGEST: usize = 1 << 25;

/// Flex or a GPU in f32 only; the caller sees to it. `[chirp, sample]`.
pub fn sum(phasors: &Phasors, samples: usize) -> Complex<2> {
    let [_, chirps] = phasors.dims();
    let complex = phasors.amplitude_im.is_some();
    let im = phasors.amplitude_im.as_ref().unwrap_or(&phasors.amplitude);
    let input = |tensor: &Tensor<2>| tensor.clone().into_dispatch();
    let both = <Dispatch as RadarOps>::sum_of_phasors(
        input(&phasors.amplitude),
        input(im),
        input(&phasors.phase_turns),
        input(&phasors.sweep_turns),
        complex,
        samples,
    );
    let signal = parts(Tensor::from_dispatch(both));
    signal.reshape([chirps, samples])
}

/// From positions to samples of the receivers of an array, `[rx, chirp, sample]`. Flex or a GPU in f32 only.
pub fn array_signal(
    points: &Points,
    tx_m: [f64; 3],
    receivers_m: &[[f64; 3]],
    waveform: &Waveform,
    samples: usize,
) -> Complex<3> {
    let [count, chirps] = points.displacement.dims();
    let at_once = receivers_at_once(&points.displacement.x.device(), count * chirps, chirps * samples);
    let parts = receivers_m
        .chunks(at_once)
        .map(|receivers_m| signal(points, Geometry::array(points.reference_m, tx_m, receivers_m, waveform), samples));
    Complex::cat(parts.collect(), 0)
}

/// From positions to samples of receivers that see some points each, and together all of them once, `[receiver, chirp, sample]`. Flex or a
/// GPU in f32 only.
pub fn signals_apart(
    points: &Points,
    tx_m: [f64; 3],
    receivers: &[(Range<usize>, [f64; 3], &Waveform)],
    samples: usize,
) -> Complex<3> {
    signal(points, Geometry::apart(points.reference_m, tx_m, receivers), samples)
}

/// A GPU holds the phasors of all receivers at once: of so many that a tensor stays within its bound.
fn receivers_at_once(device: &Device, phasors: usize, samples: usize) -> usize {
    match is_gpu(device) {
        true => (LARGEST / phasors.max(2 * samples).max(1)).max(1),
        false => usize::MAX,
    }
}

/// `[output, chirp, sample]`
fn signal(points: &Points, geometry: Geometry, samples: usize) -> Complex<3> {
    let (displacement, amplitude) = (points.displacement, points.amplitude);
    let input = |tensor: &Tensor<2>| tensor.clone().into_dispatch();
    let both = <Dispatch as RadarOps>::sum_of_moving(
        input(&displacement.x),
        input(&displacement.y),
        input(&displacement.z),
        input(&amplitude.re),
        input(amplitude.im.as_ref().unwrap_or(&amplitude.re)),
        Arc::new(geometry),
        amplitude.im.is_some(),
        samples,
    );
    parts(Tensor::from_dispatch(both))
}

/// `[2, output, chirp, sample]` → complex `[output, chirp, sample]`.
fn parts(both: Tensor<4>) -> Complex<3> {
    let part = |index: usize| both.clone().narrow(0, index, 1).squeeze_dim(0);
    Complex::new(part(0), part(1))
}
