//! The coherent sum as operations of the flex backend in f32, with their own backward passes.
//!
//! Burn's backend extension: a trait of operations, implemented for flex and for the autodiff decorator around it. The
//! tape keeps the inputs only. One operation takes phasors; the other takes displacements and does all of
//! [`crate::paths`] on the way, because as tensor operations that would cost several times more than the sum itself.

mod extension;
mod fourier;
mod kernel;
mod lanes;
mod machine;
mod moving;
mod phasors;
mod plan;
mod scratch;

use std::sync::Arc;

use burn::backend::Dispatch;
use burn::tensor::Tensor;

use crate::complex::Complex;
use crate::paths::{Phasors, Points, Waveform};
use extension::RadarOps;
use moving::Geometry;

/// Flex in f32 only; the caller sees to it. `[chirp, sample]`.
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

/// From positions to samples, `[rx, chirp, sample]`; the receivers are antennas or a wall's. Flex in f32 only.
pub fn signal(points: &Points, tx_m: [f64; 3], receivers_m: &[[f64; 3]], waveform: &Waveform, samples: usize) -> Complex<3> {
    let geometry = Arc::new(Geometry::new(points.reference_m, tx_m, receivers_m, waveform));
    let (displacement, amplitude) = (points.displacement, points.amplitude);
    let input = |tensor: &Tensor<2>| tensor.clone().into_dispatch();
    let both = <Dispatch as RadarOps>::sum_of_moving(
        input(&displacement.x),
        input(&displacement.y),
        input(&displacement.z),
        input(&amplitude.re),
        input(amplitude.im.as_ref().unwrap_or(&amplitude.re)),
        geometry,
        amplitude.im.is_some(),
        samples,
    );
    parts(Tensor::from_dispatch(both))
}

/// `[2, rx, chirp, sample]` → complex `[rx, chirp, sample]`.
fn parts(both: Tensor<4>) -> Complex<3> {
    let part = |index: usize| both.clone().narrow(0, index, 1).squeeze_dim(0);
    Complex::new(part(0), part(1))
}
