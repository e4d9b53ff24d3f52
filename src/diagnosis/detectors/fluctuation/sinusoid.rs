//! A sinusoid of one frequency, separated from what is constant during a frame.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};
use num_complex::Complex64;

/// The cosine and the sine of a frequency in the chirps of the training frames, each without its frame's mean: short frames see so
/// little of a turn that these are not orthogonal.
pub struct Sinusoid<'a> {
    pub training: &'a [usize],
    /// Of the cosine and the sine over all frames: what is seen of a turn may always be the same part of it, whose mean is then
    /// part of the static return.
    pub means: [f64; 2],
    /// `[frame · loop]`
    pub basis: Vec<[f64; 2]>,
    inverse: Matrix2<f64>,
}

impl<'a> Sinusoid<'a> {
    /// Frames' middles, and loops relative to them. None where cosine and sine are not separately estimable.
    pub fn new(training: &'a [usize], middles_s: &[f64], loops_s: &[f64], frequency_hz: f64) -> Option<Self> {
        let mut means = [0.0; 2];
        let mut basis = vec![];
        for &frame in training {
            let turn = |time: &f64| (TAU * frequency_hz * (middles_s[frame] + time)).sin_cos();
            let turns: Vec<[f64; 2]> = loops_s.iter().map(turn).map(|(sine, cosine)| [cosine, sine]).collect();
            let mean: [f64; 2] =
                std::array::from_fn(|part| turns.iter().map(|turn| turn[part]).sum::<f64>() / turns.len() as f64);
            means.iter_mut().zip(mean).for_each(|(sum, mean)| *sum += mean / training.len() as f64);
            basis.extend(turns.iter().map(|turn| [turn[0] - mean[0], turn[1] - mean[1]]));
        }
        let normal: Matrix2<f64> = basis.iter().map(|basis| Vector2::from(*basis)).map(|basis| basis * basis.transpose()).sum();
        Some(Self { training, means, basis, inverse: normal.try_inverse()? })
    }

    /// Of what is given by frame and loop, with either.
    pub fn sums(&self, value: impl Fn(usize, usize) -> Complex64) -> [Complex64; 2] {
        let loops = self.basis.len() / self.training.len();
        let mut sums = [Complex64::ZERO; 2];
        for (&frame, basis) in self.training.iter().zip(self.basis.chunks_exact(loops)) {
            for (index, basis) in basis.iter().enumerate() {
                let value = value(frame, index);
                sums.iter_mut().zip(basis).for_each(|(sum, basis)| *sum += value * basis);
            }
        }
        sums
    }

    /// Least squares.
    pub fn fitted(&self, sums: [Complex64; 2]) -> [Complex64; 2] {
        std::array::from_fn(|row| (0..2).map(|column| sums[column] * self.inverse[(row, column)]).sum())
    }
}
