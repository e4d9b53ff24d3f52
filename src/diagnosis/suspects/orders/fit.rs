//! Least squares of every sample of a chirp on the orders of a phase that all static returns had and that was undone:
//! `z_t(n) = s(n) + d(n) e^{−jθ_t} + i(n) e^{−2jθ_t}`, where a return has order 0 now, what is added behind the mixer −1 and an image −2.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::course::{Course, powers};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::statistics::fisher_tail;

/// Orders that are fitted together: static returns, what is added, its image.
pub const ORDERS: usize = 3;

/// `[order][lower]`: coefficients by which an order is predicted from lower ones.
type Prediction = [[Complex64; ORDERS]; ORDERS];

pub struct Fit {
    pub course: Arc<Course>,
    /// `[order]`, each `[channel][sample]`.
    pub parts: [Vec<Vec<Complex64>>; ORDERS],
    /// `[tx][order]`: energy of an order beside all others; noise of a variance errs in a part by that variance over this.
    pub own: Vec<[f64; ORDERS]>,
    /// `[tx]`: predictions from the first order alone and from the first two.
    predicted: Vec<[Prediction; ORDERS - 1]>,
    tx: usize,
    loops: usize,
}

impl Fit {
    pub fn new(evidence: &Evidence, course: &Arc<Course>) -> Option<Self> {
        let [_, tx, rx, loops, samples] = evidence.cube.dims;
        let training = &evidence.split.training;
        let phase = |frame: usize, t: usize, index: usize| course.turned[frame * tx * loops + t * loops + index];
        let mut own = vec![];
        let mut predicted = vec![];
        let mut grams = vec![];
        for t in 0..tx {
            let mut gram = Matrix3::<Complex64>::zeros();
            for (frame, index) in training.iter().flat_map(|&frame| (0..loops).map(move |index| (frame, index))) {
                let row = Vector3::from(powers(phase(frame, t, index).conj()));
                gram += row.conjugate() * row.transpose();
            }
            let inverse = gram.try_inverse()?;
            own.push(std::array::from_fn(|order| inverse[(order, order)].re.recip()));
            predicted.push([first(&gram), first_two(&gram)?]);
            grams.push(gram.lu());
        }
        let of_channel = |channel: usize| -> Option<[Vec<Complex64>; ORDERS]> {
            let t = channel / rx;
            let mut right = vec![Vector3::<Complex64>::zeros(); samples];
            for &frame in training {
                for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                    let row = Vector3::from(powers(phase(frame, t, index).conj())).conjugate();
                    right.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += row * *value);
                }
            }
            let solved: Option<Vec<Vector3<Complex64>>> = right.iter().map(|right| grams[t].solve(right)).collect();
            let solved = solved?;
            Some(std::array::from_fn(|order| solved.iter().map(|solution| solution[order]).collect()))
        };
        let channels: Vec<[Vec<Complex64>; ORDERS]> = (0..tx * rx).into_par_iter().map(of_channel).collect::<Option<Vec<_>>>()?;
        let parts = std::array::from_fn(|order| channels.iter().map(|parts| parts[order].clone()).collect());
        Some(Self { course: course.clone(), parts, own, predicted, tx, loops })
    }

    /// e^{jθ} of a chirp.
    pub fn phase(&self, frame: usize, tx: usize, index: usize) -> Complex64 {
        self.course.turned[frame * self.tx * self.loops + tx * self.loops + index]
    }

    /// What of an order in a chirp the lower ones do not predict.
    fn beside(&self, order: usize, frame: usize, tx: usize, index: usize) -> Complex64 {
        let all = powers(self.phase(frame, tx, index).conj());
        let known: Complex64 = (0..order).map(|lower| self.predicted[tx][order - 1][order][lower] * all[lower]).sum();
        all[order] - known
    }

    /// Log-likelihood that held-out chirps gain by `part` (`[channel][sample]`) of an order, beside a free mean and the lower orders as
    /// the training frames have them.
    pub fn held_out_gain(&self, evidence: &Evidence, order: usize, part: &[Vec<Complex64>]) -> f64 {
        let [_, _, rx, _, samples] = evidence.cube.dims;
        // Lower orders alone: what the highest was in the joint fit is shared out to them.
        let lower = |channel: usize, n: usize, k: usize| {
            let shared: Complex64 =
                (order..ORDERS).map(|high| self.predicted[channel / rx][order - 1][high][k] * self.parts[high][channel][n]).sum();
            self.parts[k][channel][n] + shared
        };
        let of_channel = |channel: usize| -> f64 {
            let t = channel / rx;
            let known: Vec<Vec<Complex64>> = (0..order).map(|k| (0..samples).map(|n| lower(channel, n, k)).collect()).collect();
            let mut gain = 0.0;
            for &frame in &evidence.split.held_out {
                for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                    let (all, beside) = (powers(self.phase(frame, t, index).conj()), self.beside(order, frame, t, index));
                    for (n, value) in chirp.iter().enumerate() {
                        let rest = value - (0..order).map(|k| known[k][n] * all[k]).sum::<Complex64>();
                        gain += rest.norm_sqr() - (rest - part[channel][n] * beside).norm_sqr();
                    }
                }
            }
            gain / evidence.noise()[channel].max(f64::MIN_POSITIVE)
        };
        (0..self.parts[0].len()).into_par_iter().map(of_channel).sum()
    }
}

/// From a Gram matrix of conj(order i) · order j: what the first order says of the others.
fn first(gram: &Matrix3<Complex64>) -> Prediction {
    let mut shares = Prediction::default();
    for order in 1..ORDERS {
        shares[order][0] = gram[(0, order)] / gram[(0, 0)];
    }
    shares
}

/// What the first two say of the last.
fn first_two(gram: &Matrix3<Complex64>) -> Option<Prediction> {
    let pair = gram.fixed_view::<2, 2>(0, 0).into_owned();
    let found = pair.lu().solve(&nalgebra::Vector2::new(gram[(0, 2)], gram[(1, 2)]))?;
    let mut shares = Prediction::default();
    (shares[2][0], shares[2][1]) = (found[0], found[1]);
    Some(shares)
}

/// What is found over the noise in so many complex values, against what is found at other beat frequencies, where a phase that is not
/// quite known leaves something of all returns: the chance (F-test), and how much more than noise is left.
pub fn against(found: f64, others: &[f64], values: usize) -> (f64, f64) {
    let values = values as f64;
    let left = (others.iter().sum::<f64>() / others.len() as f64).max(values);
    (fisher_tail(found / left, 2.0 * values, 2.0 * values * others.len() as f64), left / values)
}
