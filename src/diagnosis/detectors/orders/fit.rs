//! Least squares of every sample of a chirp on the orders of a phase that all static returns had and that was undone:
//! `z_t(n) = s(n) + d(n) e^{−jθ_t}`, where a return has order 0 now and what is added behind the mixer −1.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::course::Course;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::statistics::fisher_tail;

pub struct Fit {
    pub course: Arc<Course>,
    /// What is added behind the mixer, `[channel][sample]`.
    pub added: Vec<Vec<Complex64>>,
    /// Static returns, `[channel][sample]`.
    clutter: Vec<Vec<Complex64>>,
    /// `[tx]`: energy of e^{−jθ} beside a constant; noise of a variance errs in what is added by that variance over this.
    pub own: Vec<f64>,
    /// `[tx]`: mean of e^{−jθ}, which a constant predicts of it.
    share: Vec<Complex64>,
    tx: usize,
    loops: usize,
}

impl Fit {
    pub fn new(evidence: &Evidence, course: &Arc<Course>) -> Option<Self> {
        let [_, tx, rx, loops, samples] = evidence.cube.dims;
        let training = &evidence.split.training;
        let row = |frame: usize, t: usize, index: usize| {
            Vector2::new(Complex64::ONE, course.turned[frame * tx * loops + t * loops + index].conj())
        };
        let (mut own, mut share, mut grams) = (vec![], vec![], vec![]);
        for t in 0..tx {
            let mut gram = Matrix2::<Complex64>::zeros();
            for (frame, index) in training.iter().flat_map(|&frame| (0..loops).map(move |index| (frame, index))) {
                let row = row(frame, t, index);
                gram += row.conjugate() * row.transpose();
            }
            own.push(gram.try_inverse()?[(1, 1)].re.recip());
            share.push(gram[(0, 1)] / gram[(0, 0)]);
            grams.push(gram.lu());
        }
        let of_channel = |channel: usize| -> Option<[Vec<Complex64>; 2]> {
            let t = channel / rx;
            let mut right = vec![Vector2::<Complex64>::zeros(); samples];
            for &frame in training {
                for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                    let row = row(frame, t, index).conjugate();
                    right.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += row * *value);
                }
            }
            let solved: Option<Vec<Vector2<Complex64>>> = right.iter().map(|right| grams[t].solve(right)).collect();
            let solved = solved?;
            Some(std::array::from_fn(|order| solved.iter().map(|solution| solution[order]).collect()))
        };
        let channels: Vec<[Vec<Complex64>; 2]> = (0..tx * rx).into_par_iter().map(of_channel).collect::<Option<Vec<_>>>()?;
        let (clutter, added) = channels.into_iter().map(|[clutter, added]| (clutter, added)).unzip();
        Some(Self { course: course.clone(), added, clutter, own, share, tx, loops })
    }

    /// e^{jθ} of a chirp.
    fn phase(&self, frame: usize, tx: usize, index: usize) -> Complex64 {
        self.course.turned[frame * self.tx * self.loops + tx * self.loops + index]
    }

    /// Log-likelihood that held-out chirps gain by something added (`[channel][sample]`), beside a free mean.
    pub fn held_out_gain(&self, evidence: &Evidence, added: &[Vec<Complex64>]) -> f64 {
        let [_, _, rx, _, samples] = evidence.cube.dims;
        let of_channel = |channel: usize| -> f64 {
            let t = channel / rx;
            // A mean alone has its share of what is added.
            let parts = self.clutter[channel].iter().zip(&self.added[channel]);
            let mean: Vec<Complex64> = parts.map(|(clutter, added)| clutter + self.share[t] * added).collect();
            let mut gain = 0.0;
            for &frame in &evidence.split.held_out {
                for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                    let beside = self.phase(frame, t, index).conj() - self.share[t];
                    for (n, value) in chirp.iter().enumerate() {
                        let rest = value - mean[n];
                        gain += rest.norm_sqr() - (rest - added[channel][n] * beside).norm_sqr();
                    }
                }
            }
            gain / evidence.noise()[channel].max(f64::MIN_POSITIVE)
        };
        (0..self.added.len()).into_par_iter().map(of_channel).sum()
    }
}

/// What is found over the noise in so many complex values, against what is found at other beat frequencies, where a phase that is not
/// quite known leaves something of all returns: the chance (F-test), and how much more than noise is left.
pub fn against(found: f64, others: &[f64], values: usize) -> (f64, f64) {
    let values = values as f64;
    let left = (others.iter().sum::<f64>() / others.len() as f64).max(values);
    (fisher_tail(found / left, 2.0 * values, 2.0 * values * others.len() as f64), left / values)
}
