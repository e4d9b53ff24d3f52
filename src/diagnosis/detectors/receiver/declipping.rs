//! Declipping: what the converter cut off. Values at full scale are those that leave no energy in the beat frequencies where
//! neither the room nor the body can be, through a window: without one, the side lobes of what returns lie there.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// A chirp with more clipped components, as a share of the empty frequencies, is not restored.
const MOST: f64 = 0.5;
/// Of the equations' diagonal, so that clipped neighbours stay solvable.
const RIDGE: f64 = 1e-3;
/// Clipping may hide so much and not more, as a factor of the clipping level.
pub const FARTHEST: f64 = 8.0;

/// Restores the chirps of one recording.
pub struct Declip {
    clipping_level: f64,
    tolerance: f64,
    empty: usize,
    /// Autocorrelation of the projection onto the empty frequencies, by distance in samples (cyclic).
    kernel: Vec<Complex64>,
    /// A sine: weak enough at the ends for the side lobes, and strong enough to restore most of them.
    window: Vec<f64>,
}

impl Declip {
    /// `empty`: by beat frequency in FFT order, what can hold no return. `None` where there is too little of it.
    pub fn new(empty: &[bool], clipping_level: f64, tolerance: f64) -> Option<Self> {
        let count = empty.iter().filter(|&&empty| empty).count();
        if count < 8 {
            return None;
        }
        let samples = empty.len() as f64;
        let kernel = (0..empty.len())
            .map(|distance| {
                let turns = |bin: usize| std::f64::consts::TAU * (bin * distance % empty.len()) as f64 / samples;
                let chosen = (0..empty.len()).filter(|&bin| empty[bin]);
                chosen.map(|bin| Complex64::cis(turns(bin))).sum::<Complex64>() / samples
            })
            .collect();
        let window = (0..empty.len()).map(|sample| (PI * (sample as f64 + 0.5) / samples).sin()).collect();
        Some(Self { clipping_level, tolerance, empty: count, kernel, window })
    }

    fn is_clipped(&self, part: f64) -> bool {
        part.abs() >= self.clipping_level - self.tolerance
    }

    /// The chirp as it would have been, or as it is where too much of it is lost.
    pub fn restore(&self, chirp: &mut [Complex64]) {
        // Unknown components: sample, and whether it is the imaginary one.
        let unknown: Vec<(usize, bool)> = chirp
            .iter()
            .enumerate()
            .flat_map(|(n, value)| [(n, false, value.re), (n, true, value.im)])
            .filter(|&(_, _, part)| self.is_clipped(part))
            .map(|(n, imaginary, _)| (n, imaginary))
            .collect();
        if unknown.is_empty() || unknown.len() as f64 > MOST * 2.0 * self.empty as f64 {
            return;
        }
        let unit = |imaginary: bool| if imaginary { Complex64::I } else { Complex64::ONE };
        let samples = chirp.len();
        let kernel = |n: usize, m: usize| self.kernel[(n + samples - m) % samples] * self.window[n] * self.window[m];
        // Least squares over the empty frequencies for real additions: Re(uᴴ P u') x = −Re(uᴴ P y).
        let size = unknown.len();
        let normal = DMatrix::from_fn(size, size, |i, j| {
            let ((n, a), (m, b)) = (unknown[i], unknown[j]);
            (unit(a).conj() * kernel(n, m) * unit(b)).re + if i == j { RIDGE * self.kernel[0].re } else { 0.0 }
        });
        let right = DVector::from_fn(size, |i, _| {
            let (n, a) = unknown[i];
            let rest: Complex64 = chirp.iter().enumerate().map(|(m, value)| kernel(n, m) * value).sum();
            -(unit(a).conj() * rest).re
        });
        let Some(solved) = normal.cholesky() else { return };
        for (&(n, imaginary), addition) in unknown.iter().zip(solved.solve(&right).iter()) {
            let part = if imaginary { chirp[n].im } else { chirp[n].re };
            // Clipping only ever makes smaller.
            let restored = part + (addition * part.signum()).clamp(0.0, (FARTHEST - 1.0) * self.clipping_level) * part.signum();
            if imaginary {
                chirp[n].im = restored;
            } else {
                chirp[n].re = restored;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    #[test]
    fn a_cut_tone_is_whole_again() {
        let samples = 64;
        let turn = |cells: f64| Complex64::cis(std::f64::consts::TAU * cells / 64.0);
        // Between the bins, so that the side lobes of a chirp without a window are everywhere.
        let tones: Vec<Complex64> =
            (0..samples).map(|n| turn(4.4 * n as f64) * 100.0 + turn(11.3 * n as f64 + 10.0) * 70.0).collect();
        let clipping_level = 120.0;
        let cut = |part: f64| part.clamp(-clipping_level, clipping_level);
        let mut chirp: Vec<Complex64> = tones.iter().map(|value| Complex64::new(cut(value.re), cut(value.im))).collect();
        let wrong = |chirp: &[Complex64], of: Range<usize>| {
            chirp[of.clone()].iter().zip(&tones[of]).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>()
        };
        // Through the window, the ends say little.
        let (all, middle) = (0..samples, samples / 4..3 * samples / 4);
        // the upper half of the spectrum holds nothing but the tones' skirts
        let empty: Vec<bool> = (0..samples).map(|bin| (20..60).contains(&bin)).collect();
        let before = [wrong(&chirp, all.clone()), wrong(&chirp, middle.clone())];
        Declip::new(&empty, clipping_level, 1e-9).unwrap().restore(&mut chirp);
        let after = [wrong(&chirp, all), wrong(&chirp, middle)];
        assert!(before[1] > 1000.0 && after[1] < 1e-3 * before[1] && after[0] < 0.1 * before[0], "{before:?} to {after:?}");
        // What was not clipped is not touched.
        for (value, tone) in chirp.iter().zip(&tones) {
            assert!(tone.re.abs() >= clipping_level || value.re == tone.re);
        }
        assert!(Declip::new(&[false; 64], clipping_level, 1e-9).is_none());
    }
}
