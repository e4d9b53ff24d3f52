//! Filters over the beat frequency: multiplications of chirps' DFTs.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::Complex64;

/// One factor for every beat frequency.
pub struct Filter {
    response: Vec<Complex64>,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Filter {
    /// `response`: a factor for each bin of a chirp's DFT.
    pub fn new(response: &[Complex64]) -> Self {
        let mut planner = FftPlanner::new();
        let samples = response.len();
        Self {
            response: response.iter().map(|h| h / samples as f64).collect(),
            forward: planner.plan_fft_forward(samples),
            inverse: planner.plan_fft_inverse(samples),
        }
    }

    /// Lets through the bins that `passes` says, of chirps of so many samples.
    pub fn pass(samples: usize, passes: impl Fn(usize) -> bool) -> Self {
        Self::new(&(0..samples).map(|bin| Complex64::from(if passes(bin) { 1.0 } else { 0.0 })).collect::<Vec<_>>())
    }

    /// Filters chirps, one after the other, in place.
    pub fn apply(&self, chirps: &mut [Complex64]) {
        self.forward.process(chirps);
        for chirp in chirps.chunks_exact_mut(self.response.len()) {
            chirp.iter_mut().zip(&self.response).for_each(|(value, h)| *value *= h);
        }
        self.inverse.process(chirps);
    }
}
