//! A swing at one frequency, told from what is constant.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

/// What is constant, the cosine and the sine of a frequency in the chirps of the training frames: short frames see so little of a turn
/// that these are not orthogonal.
pub struct Swings<'a> {
    pub training: &'a [usize],
    /// Of the cosine and the sine: what is seen of a turn may always be the same part of it, whose mean is as well what stands still.
    pub means: [f64; 2],
    /// `[frame · loop]`, the means taken out.
    pub basis: Vec<[f64; 3]>,
    pub normal: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl<'a> Swings<'a> {
    /// Frames' middles, and loops relative to them. None where the three cannot be told apart.
    pub fn new(training: &'a [usize], middles_s: &[f64], loops_s: &[f64], frequency_hz: f64) -> Option<Self> {
        let times = training.iter().flat_map(|&frame| loops_s.iter().map(move |time| middles_s[frame] + time));
        let turns: Vec<(f64, f64)> = times.map(|time| (TAU * frequency_hz * time).sin_cos()).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| turns.iter().map(of).sum::<f64>() / turns.len() as f64;
        let means = [mean(&|turn| turn.1), mean(&|turn| turn.0)];
        let basis: Vec<[f64; 3]> = turns.iter().map(|(sine, cosine)| [1.0, cosine - means[0], sine - means[1]]).collect();
        let mut normal = Matrix3::zeros();
        basis.iter().map(|basis| Vector3::from(*basis)).for_each(|basis| normal += basis * basis.transpose());
        Some(Self { training, means, basis, normal, inverse: normal.try_inverse()? })
    }

    /// Of what is given by frame and loop, with each of the three.
    pub fn sums(&self, value: impl Fn(usize, usize) -> Complex64) -> [Complex64; 3] {
        let loops = self.basis.len() / self.training.len();
        let mut sums = [Complex64::ZERO; 3];
        for (&frame, basis) in self.training.iter().zip(self.basis.chunks_exact(loops)) {
            for (index, basis) in basis.iter().enumerate() {
                let value = value(frame, index);
                sums.iter_mut().zip(basis).for_each(|(sum, basis)| *sum += value * basis);
            }
        }
        sums
    }

    /// Least squares.
    pub fn fitted(&self, sums: [Complex64; 3]) -> [Complex64; 3] {
        std::array::from_fn(|row| (0..3).map(|column| sums[column] * self.inverse[(row, column)]).sum())
    }
}
