//! Noise with the body in it: a frame's samples as white noise and tones of known mean powers.
//!
//! What arrives from the body at every range and velocity is a tone of random amplitude. The covariance of a frame's samples is
//! then the unit matrix and the sum over a grid of tones, A P Aᴴ: a Fourier transform to twice as many cells as there are samples
//! along both axes, the powers, and back. What a tone explains of a frame against that is |aᴴ C⁻¹ y|² / (aᴴ C⁻¹ a) (the matched
//! filter in coloured noise; Kay, Detection Theory, 1998, 13.8); C⁻¹ y by conjugate gradients.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftDirection, FftPlanner};
use num_complex::Complex64;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::diagnosis::evidence::fft_2d;

/// Cells of the grid per cell of the transform.
pub const FINE: usize = 2;
/// Conjugate gradients stop when the residual is so small a share of the noise, or after so many steps: a body far above the noise is
/// then undone in part, which costs sight of what is beside it, but no more (what stays of a tone is measured in the same steps).
const TOLERANCE: f64 = 0.1;
const MOST_STEPS: usize = 100;

/// Samples are `[loop, sample]`, cells of the grid `[range, doppler]`, both in the transforms' order.
pub struct Coloured {
    dims: [usize; 2],
    /// Mean power of a tone, over the noise's variance.
    power: Vec<f64>,
    /// Ranges where any tone is.
    some: Vec<usize>,
    /// Of the nearest circulant matrix (T. Chan 1988), the eigenvalues' inverses over the count of samples, `[doppler, range]`.
    near: Vec<f64>,
    fast: [Arc<dyn Fft<f64>>; 2],
    slow: [Arc<dyn Fft<f64>>; 2],
    close: [[Arc<dyn Fft<f64>>; 2]; 2],
}

impl Coloured {
    /// `power`: mean of every tone of the grid over the noise's variance.
    pub fn new(loops: usize, samples: usize, power: Vec<f64>) -> Self {
        let mut planner = FftPlanner::new();
        let any = |(_, powers): &(usize, &[f64])| powers.iter().any(|power| *power > 0.0);
        let some: Vec<usize> = power.chunks_exact(FINE * loops).enumerate().filter(any).map(|(range, _)| range).collect();
        let mut both = |length| [planner.plan_fft_forward(length), planner.plan_fft_inverse(length)];
        let (fast, slow, close) = (both(FINE * samples), both(FINE * loops), [both(samples), both(loops)]);
        let near = if some.is_empty() { vec![] } else { nearest_circulant(loops, samples, &power) };
        Self { dims: [loops, samples], power, some, near, fast, slow, close }
    }

    /// Aᴴ y in all cells of the grid.
    pub fn cells(&self, frame: &[Complex64]) -> Vec<Complex64> {
        let [loops, samples] = self.dims;
        let mut work = self.work();
        let mut cells = vec![Complex64::ZERO; FINE * FINE * loops * samples];
        let every: Vec<usize> = (0..FINE * samples).collect();
        self.analyse(frame, &every, &mut cells, &mut work);
        cells
    }

    fn work(&self) -> Work {
        let [loops, samples] = self.dims;
        let plans = self.fast.iter().chain(&self.slow).chain(self.close.iter().flatten());
        let scratch = plans.map(|plan| plan.get_inplace_scratch_len()).max().unwrap_or(0);
        Work { padded: vec![Complex64::ZERO; loops * FINE * samples], scratch: vec![Complex64::ZERO; scratch] }
    }

    /// Aᴴ y: the transform to the cells of some ranges, one after the other.
    fn analyse(&self, frame: &[Complex64], ranges: &[usize], cells: &mut [Complex64], work: &mut Work) {
        let [loops, samples] = self.dims;
        let (rows, columns) = (FINE * loops, FINE * samples);
        for (row, chirp) in work.padded.chunks_exact_mut(columns).zip(frame.chunks_exact(samples)) {
            row[..samples].copy_from_slice(chirp);
            row[samples..].fill(Complex64::ZERO);
        }
        self.fast[0].process_with_scratch(&mut work.padded, &mut work.scratch);
        for (&range, cells) in ranges.iter().zip(cells.chunks_exact_mut(rows)) {
            (0..loops).for_each(|row| cells[row] = work.padded[row * columns + range]);
            cells[loops..].fill(Complex64::ZERO);
        }
        self.slow[0].process_with_scratch(cells, &mut work.scratch);
    }

    /// A x of the ranges where there are tones, added to some samples.
    fn synthesise(&self, cells: &mut [Complex64], frame: &mut [Complex64], work: &mut Work) {
        let [loops, samples] = self.dims;
        let (rows, columns) = (FINE * loops, FINE * samples);
        self.slow[1].process_with_scratch(cells, &mut work.scratch);
        work.padded.fill(Complex64::ZERO);
        for (&range, cells) in self.some.iter().zip(cells.chunks_exact(rows)) {
            (0..loops).for_each(|row| work.padded[row * columns + range] = cells[row]);
        }
        self.fast[1].process_with_scratch(&mut work.padded, &mut work.scratch);
        for (chirp, row) in frame.chunks_exact_mut(samples).zip(work.padded.chunks_exact(columns)) {
            chirp.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Powers of the cells of the ranges where there are tones.
    fn powers(&self) -> impl Iterator<Item = &f64> {
        let rows = FINE * self.dims[0];
        self.some.iter().flat_map(move |range| &self.power[range * rows..(range + 1) * rows])
    }

    /// C y.
    fn times(&self, frame: &[Complex64], cells: &mut [Complex64], result: &mut [Complex64], work: &mut Work) {
        self.analyse(frame, &self.some, cells, work);
        cells.iter_mut().zip(self.powers()).for_each(|(value, power)| *value *= power);
        result.copy_from_slice(frame);
        self.synthesise(cells, result, work);
    }

    /// What the inverse of the nearest circulant matrix makes of samples.
    fn nearly(&self, frame: &[Complex64], result: &mut [Complex64], work: &mut Work) {
        let [loops, samples] = self.dims;
        let turned = &mut work.padded[..loops * samples];
        let transpose = |from: &[Complex64], to: &mut [Complex64], rows: usize| {
            let columns = from.len() / rows;
            for (row, values) in from.chunks_exact(columns).enumerate() {
                values.iter().enumerate().for_each(|(column, value)| to[column * rows + row] = *value);
            }
        };
        result.copy_from_slice(frame);
        self.close[0][0].process_with_scratch(result, &mut work.scratch);
        transpose(result, turned, loops);
        self.close[1][0].process_with_scratch(turned, &mut work.scratch);
        turned.iter_mut().zip(&self.near).for_each(|(value, near)| *value *= near);
        self.close[1][1].process_with_scratch(turned, &mut work.scratch);
        transpose(turned, result, samples);
        self.close[0][1].process_with_scratch(result, &mut work.scratch);
    }

    /// C⁻¹ y.
    pub fn whitened(&self, frame: &[Complex64]) -> Vec<Complex64> {
        if self.some.is_empty() {
            return frame.to_vec();
        }
        let size = frame.len();
        let mut work = self.work();
        let mut cells = vec![Complex64::ZERO; self.some.len() * FINE * self.dims[0]];
        let (mut solution, mut residual) = (vec![Complex64::ZERO; size], frame.to_vec());
        let (mut nearly, mut times) = (vec![Complex64::ZERO; size], vec![Complex64::ZERO; size]);
        self.nearly(&residual, &mut nearly, &mut work);
        let mut step = nearly.clone();
        let mut along = product(&residual, &nearly);
        let enough = TOLERANCE * TOLERANCE * size as f64;
        for _ in 0..MOST_STEPS {
            if energy(&residual) <= enough {
                break;
            }
            self.times(&step, &mut cells, &mut times, &mut work);
            let length = along / product(&step, &times).max(f64::MIN_POSITIVE);
            for ((solution, residual), (step, times)) in solution.iter_mut().zip(&mut residual).zip(step.iter().zip(&times)) {
                *solution += step * length;
                *residual -= times * length;
            }
            self.nearly(&residual, &mut nearly, &mut work);
            let before = std::mem::replace(&mut along, product(&residual, &nearly));
            let conjugate = along / before.max(f64::MIN_POSITIVE);
            step.iter_mut().zip(&nearly).for_each(|(step, nearly)| *step = nearly + *step * conjugate);
        }
        solution
    }

    /// White noise, and the same with tones of random amplitudes.
    pub fn draw(&self, random: &mut ChaCha8Rng) -> [Vec<Complex64>; 2] {
        let mut normal = || -> Complex64 {
            let mut part = || -> f64 { StandardNormal.sample(random) };
            Complex64::new(part(), part()) * std::f64::consts::FRAC_1_SQRT_2
        };
        let white: Vec<Complex64> = (0..self.dims[0] * self.dims[1]).map(|_| normal()).collect();
        let tone = |power: &f64| if *power > 0.0 { normal() * power.sqrt() } else { Complex64::ZERO };
        let mut cells: Vec<Complex64> = self.powers().map(tone).collect();
        let mut coloured = white.clone();
        self.synthesise(&mut cells, &mut coloured, &mut self.work());
        [white, coloured]
    }
}

struct Work {
    padded: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

/// Inverse eigenvalues, over the count of samples, of the circulant matrix that is nearest to the covariance: the powers seen
/// through a rectangular window. `[range, doppler]`.
fn nearest_circulant(loops: usize, samples: usize, power: &[f64]) -> Vec<f64> {
    let (rows, columns) = (FINE * loops, FINE * samples);
    // Covariances of samples so many samples and loops apart.
    let mut lags: Vec<Complex64> = power.iter().map(|&power| power.into()).collect();
    fft_2d(&mut lags, rows, FftDirection::Inverse);
    let wrapped = |lag: usize, length: usize| -> [(usize, f64); 2] {
        let share = lag as f64 / length as f64;
        [(lag, 1.0 - share), ((lag + (FINE - 1) * length) % (FINE * length), share)]
    };
    let mut circulant = vec![Complex64::ZERO; loops * samples];
    for (cell, value) in circulant.iter_mut().enumerate() {
        for (fast, near) in wrapped(cell / loops, samples) {
            for (slow, close) in wrapped(cell % loops, loops) {
                *value += lags[(fast % columns) * rows + slow % rows] * near * close;
            }
        }
    }
    fft_2d(&mut circulant, loops, FftDirection::Forward);
    let size = (loops * samples) as f64;
    circulant.iter().map(|value| 1.0 / (size * (1.0 + value.re.max(0.0)))).collect()
}

fn energy(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum()
}

/// Real part of the inner product.
fn product(a: &[Complex64], b: &[Complex64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.conj() * b).re).sum()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn whitened_noise_undoes_the_covariance_and_a_strong_tone_hides_nothing_beside_it() {
        let (loops, samples) = (16, 32);
        let mut power = vec![0.0; FINE * loops * FINE * samples];
        for range in 20..24 {
            (6..12).for_each(|doppler| power[range * FINE * loops + doppler] = 1.0);
        }
        let coloured = Coloured::new(loops, samples, power);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let [white, drawn] = coloured.draw(&mut random);
        let whitened = coloured.whitened(&drawn);
        let mut cells = vec![Complex64::ZERO; coloured.some.len() * FINE * loops];
        let mut coloured_back = whitened.clone();
        coloured.times(&whitened, &mut cells, &mut coloured_back, &mut coloured.work());
        let residual: Vec<Complex64> = coloured_back.iter().zip(&drawn).map(|(a, b)| a - b).collect();
        assert!(energy(&drawn) > 10.0 * energy(&white) && energy(&residual) < 0.02 * energy(&white), "{}", energy(&residual));
        // Far from the tones noise stays what it was.
        let (before, after) = (coloured.cells(&white), coloured.cells(&whitened));
        let far = |cells: &[Complex64]| cells[50 * FINE * loops..].iter().map(Complex64::norm_sqr).sum::<f64>();
        assert!((far(&after) / far(&before) - 1.0).abs() < 0.1, "{}", far(&after) / far(&before));
    }
}
