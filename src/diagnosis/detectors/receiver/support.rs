//! Where in beat frequency the static scene can be, and the directions of fast time in which it cannot be.
//!
//! Tones between two beat frequencies span, over N samples, a space of about N · bandwidth / sample rate dimensions; its
//! best orthonormal basis are the discrete prolate spheroidal sequences (Slepian 1978). Beyond that number their share λ
//! of energy within the band falls fast: there, static clutter and a body leave λ times their density and thermal noise.

use std::f64::consts::TAU;

use hybridsim_fft::FftPlanner;
use nalgebra::{DMatrix, SymmetricEigen};
use num_complex::Complex64;

use crate::diagnosis::Evidence;
pub use crate::diagnosis::evidence::beat::{beat_hz, range_m, ranges_m};
use crate::diagnosis::evidence::hann;

/// Chirps longer than this would take too long.
const MOST_SAMPLES: usize = 512;

/// The scene's density may exceed its mean over the band by this.
const UNEVEN: f64 = 10.0;

/// Level of a goodness-of-fit test: what a law leaves is so unlikely under it that it is another law, or more than one.
pub const UNLIKELY: f64 = 1e-3;

/// Fast-time directions of the static scene's beat frequencies, `[direction][sample]`, orthogonal.
pub struct Support {
    /// Where the scene exceeds the noise, of unit length.
    pub inside: Vec<Vec<Complex64>>,
    /// Where noise counts; of length √(noise / (noise + scene)), so that coordinates have the noise's variance at most.
    pub outside: Vec<Vec<Complex64>>,
    pub low_m: f64,
    pub high_m: f64,
}

/// exp(j2π f n) with the frequency in turns per sample.
pub fn tone(turns_per_sample: f64, samples: usize) -> Vec<Complex64> {
    (0..samples).map(|n| Complex64::cis(TAU * (turns_per_sample * n as f64).fract())).collect()
}

/// Σ conj(a) b.
pub fn dot(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

/// Σ |a|².
pub fn energy(a: &[Complex64]) -> f64 {
    a.iter().map(Complex64::norm_sqr).sum()
}

/// Powers of a chirp's DFT under a Hann window of unit energy, zero-padded to so many times its length.
pub fn powers(chirp: &[Complex64], padding: usize) -> Vec<f64> {
    let mut padded: Vec<Complex64> = chirp.iter().zip(hann(chirp.len())).map(|(value, weight)| value * weight).collect();
    padded.resize(padding * chirp.len(), Complex64::ZERO);
    FftPlanner::new().plan_fft_forward(padded.len()).process(&mut padded);
    padded.iter().map(Complex64::norm_sqr).collect()
}

/// `ranges_m`: of static surfaces; `contrast`: energy of a mean chirp over the variance of the noise in a sample of it.
pub fn support(evidence: &Evidence, [low_m, high_m]: [f64; 2], contrast: f64) -> Option<Support> {
    let samples = evidence.cube.dims[4];
    if evidence.is_real() || !(16..=MOST_SAMPLES).contains(&samples) || evidence.radar.slope_hz_per_s <= 0.0 {
        return None;
    }
    let rate = evidence.radar.sample_rate_hz;
    let (low, high) = (beat_hz(evidence, low_m) / rate, beat_hz(evidence, high_m) / rate);
    let width = high - low;
    if width >= 0.85 {
        return None;
    }
    let (real, share_of) = prolate(samples, 0.5 * width);
    let carrier = tone(0.5 * (low + high), samples);
    let density = UNEVEN * contrast / (width * samples as f64);
    let mut inside = vec![];
    let mut outside = vec![];
    for (vector, within) in real.into_iter().zip(share_of) {
        let complex: Vec<Complex64> = vector.iter().zip(&carrier).map(|(value, carrier)| carrier * *value).collect();
        let scene = density * within.max(0.0);
        if scene < 1e4 {
            let length = (1.0 + scene).sqrt().recip();
            outside.push(complex.iter().map(|value| value * length).collect());
        }
        if scene > 1.0 {
            inside.push(complex);
        }
    }
    (outside.len() >= 4).then_some(Support { inside, outside, low_m, high_m })
}

/// Discrete prolate spheroidal sequences of a half bandwidth in turns per sample, and their energy within it.
fn prolate(samples: usize, half: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
    // The tridiagonal matrix that commutes with the sinc kernel has the same eigenvectors, well separated.
    let mut matrix = DMatrix::zeros(samples, samples);
    for n in 0..samples {
        matrix[(n, n)] = (0.5 * (samples as f64 - 1.0) - n as f64).powi(2) * (TAU * half).cos();
        if n + 1 < samples {
            let off = 0.5 * (n + 1) as f64 * (samples - n - 1) as f64;
            matrix[(n, n + 1)] = off;
            matrix[(n + 1, n)] = off;
        }
    }
    let eigen = SymmetricEigen::new(matrix);
    let kernel: Vec<f64> = (0..samples)
        .map(|lag| if lag == 0 { 2.0 * half } else { (TAU * half * lag as f64).sin() / (std::f64::consts::PI * lag as f64) })
        .collect();
    let vectors: Vec<Vec<f64>> = (0..samples).map(|k| eigen.eigenvectors.column(k).iter().copied().collect()).collect();
    let within = vectors
        .iter()
        .map(|vector| {
            (0..samples).map(|n| vector[n] * (0..samples).map(|m| kernel[n.abs_diff(m)] * vector[m]).sum::<f64>()).sum::<f64>()
        })
        .collect();
    (vectors, within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_of_the_band_do_not_reach_the_directions_outside() {
        let (vectors, within) = prolate(64, 0.2);
        let tone = tone(0.15, 64);
        let (mut inside, mut outside) = (0.0, 0.0);
        for (vector, share) in vectors.iter().zip(&within) {
            let value: Complex64 = vector.iter().zip(&tone).map(|(v, t)| t * *v).sum();
            if *share < 1e-8 { outside += value.norm_sqr() } else { inside += value.norm_sqr() }
        }
        assert!((inside + outside - 64.0).abs() < 1e-9);
        assert!(outside < 64.0 * 1e-5, "{outside}");
        let count = within.iter().filter(|share| **share < 1e-8).count();
        assert!((24..38).contains(&count), "{count}");
    }
}
