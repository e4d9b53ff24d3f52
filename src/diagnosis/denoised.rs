//! The signal without most of its noise: a product of a signal with itself, as non-linear effects make it, would
//! otherwise hold the noise times the strongest return wherever nothing else is.

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::FftDirection;

use super::evidence::{Evidence, fft_2d};

/// Power over the noise's mean from which on a cell holds signal.
const SIGNAL: f64 = 12.0;

/// What stands still and the range-Doppler cells that stand out, `[loop, sample]` of one frame and channel.
pub fn channel(evidence: &Evidence, frame: usize, channel: usize) -> Vec<Complex64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let still = &evidence.still()[channel * samples..][..samples];
    let mut moving: Vec<Complex64> =
        evidence.cube.channel(frame, channel).iter().enumerate().map(|(i, value)| value - still[i % samples]).collect();
    // Without a window, so that the transform can be taken back; a cell's noise is the sum over the samples.
    let count = (loops * samples) as f64;
    let least = SIGNAL * evidence.noise()[channel] * count;
    fft_2d(&mut moving, samples, FftDirection::Forward);
    moving.iter_mut().filter(|value| value.norm_sqr() < least).for_each(|value| *value = Complex64::ZERO);
    fft_2d(&mut moving, samples, FftDirection::Inverse);
    moving.iter().enumerate().map(|(i, value)| value / count + still[i % samples]).collect()
}

/// All channels of a frame, `[tx · rx][loop · sample]`.
pub fn frame(evidence: &Evidence, frame: usize) -> Vec<Vec<Complex64>> {
    (0..evidence.cube.channels()).into_par_iter().map(|index| channel(evidence, frame, index)).collect()
}
