//! White noise.

use num_complex::Complex64;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::radar::Sampling;

/// A sample of this deviation per component; without quadrature its imaginary part is zero.
pub fn deviate(sampling: Sampling, deviation: f64, rng: &mut ChaCha8Rng) -> Complex64 {
    let mut draw = || -> f64 { StandardNormal.sample(rng) };
    Complex64::new(draw(), if sampling == Sampling::Complex { draw() } else { 0.0 }) * deviation
}
