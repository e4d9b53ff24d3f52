//! Values of a chirp between its samples: windowed-sinc interpolation in the band where beats lie.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use crate::radar::Sampling;

/// Samples on either side that an interpolated value needs.
pub const HALF: usize = 16;
/// Of the kernel's window exp(β (√(1 − z²) − 1)): side lobes near −100 dB.
const BETA: f64 = 10.0;

/// Interpolates tones within 0.4 turns per sample of `centre`.
#[derive(Clone, Copy, Debug)]
pub struct Resampler {
    /// Turns per sample.
    centre: f64,
}

impl Resampler {
    /// Beats are positive; a quadrature receiver holds them up to one turn per sample, the far end of which stays empty.
    pub fn new(sampling: Sampling) -> Self {
        Self { centre: if sampling == Sampling::Complex { 0.35 } else { 0.25 } }
    }

    /// Weights of the samples `1 − HALF ..= HALF` around a value `fraction` of a sample (0 to 1) after sample 0.
    pub fn weights(&self, fraction: f64) -> [Complex64; 2 * HALF] {
        let sine = (PI * fraction).sin();
        let step = Complex64::cis(-TAU * self.centre);
        let mut phase = Complex64::cis(TAU * self.centre * (fraction + HALF as f64 - 1.0));
        std::array::from_fn(|tap| {
            let m = tap as f64 - (HALF as f64 - 1.0);
            let x = fraction - m;
            // sin π(f − m) = ± sin πf
            let sign = if (tap + HALF - 1).is_multiple_of(2) { 1.0 } else { -1.0 };
            let sinc = if x.abs() < 1e-9 { 1.0 } else { sign * sine / (PI * x) };
            let z = x / HALF as f64;
            let window = if z.abs() < 1.0 { (BETA * ((1.0 - z * z).sqrt() - 1.0)).exp() } else { 0.0 };
            let weight = phase * (sinc * window);
            phase *= step;
            weight
        })
    }

    /// Σ of the samples around `index` with weights from [`Resampler::weights`]; samples beyond the ends count as zero.
    pub fn apply(signal: &[Complex64], index: isize, weights: &[Complex64; 2 * HALF]) -> Complex64 {
        let first = index - (HALF as isize - 1);
        if first >= 0 && first as usize + 2 * HALF <= signal.len() {
            return signal[first as usize..].iter().zip(weights).map(|(value, weight)| value * weight).sum();
        }
        let inside = |tap: usize| usize::try_from(first + tap as isize).ok().and_then(|at| signal.get(at));
        (0..2 * HALF).filter_map(|tap| Some(inside(tap)? * weights[tap])).sum()
    }

    /// The value at any place, in samples.
    pub fn at(&self, signal: &[Complex64], position: f64) -> Complex64 {
        let index = position.floor();
        Self::apply(signal, index as isize, &self.weights(position - index))
    }

    /// `[sample]`: the values `shift` samples later.
    pub fn shifted(&self, signal: &[Complex64], shift: f64) -> Vec<Complex64> {
        let whole = shift.floor();
        let weights = self.weights(shift - whole);
        (0..signal.len()).map(|n| Self::apply(signal, n as isize + whole as isize, &weights)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_in_the_band_are_interpolated_to_minus_ninety_decibels() {
        let resampler = Resampler::new(Sampling::Complex);
        for frequency in [0.0, 0.05, 0.3, 0.7] {
            let tone = |position: f64| Complex64::cis(TAU * frequency * position);
            let signal: Vec<Complex64> = (0..80).map(|n| tone(n as f64)).collect();
            for position in [16.0, 30.0, 30.007, 40.5, 62.93] {
                let error = (resampler.at(&signal, position) - tone(position)).norm();
                assert!(error < 3e-5, "{frequency} at {position}: {error:e}");
            }
            let shifted = resampler.shifted(&signal, -1.3);
            assert!((shifted[40] - tone(38.7)).norm() < 3e-5);
        }
    }
}
