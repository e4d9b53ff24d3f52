//! The signal without most of its noise: a product of a signal with itself, as non-linear effects make it, would
//! otherwise hold the noise times the strongest return wherever nothing else is.

use hybridsim_fft::FftDirection;
use num_complex::Complex64;
use rayon::prelude::*;

use super::{Evidence, fft_2d};

/// Power over the noise's mean from which on a cell holds signal.
const SIGNAL: f64 = 12.0;

/// How well the peak sample is known (standard deviation): it is one sample of the strongest frame's speckle.
pub const PEAK_DB: f64 = 0.7;

/// Static clutter and the range-Doppler cells that stand out, `[loop, sample]` of one frame and channel.
pub fn channel(evidence: &Evidence, frame: usize, channel: usize) -> Vec<Complex64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let clutter = &evidence.clutter()[channel * samples..][..samples];
    let mut moving = evidence.moving(frame, channel);
    // Without a window, so that the transform can be taken back; a cell's noise is the sum over the samples.
    let count = (loops * samples) as f64;
    let least = SIGNAL * evidence.noise()[channel] * count;
    fft_2d(&mut moving, samples, FftDirection::Forward);
    moving.iter_mut().filter(|value| value.norm_sqr() < least).for_each(|value| *value = Complex64::ZERO);
    fft_2d(&mut moving, samples, FftDirection::Inverse);
    moving.iter().enumerate().map(|(i, value)| value / count + clutter[i % samples]).collect()
}

/// All channels of a frame, `[tx · rx][loop · sample]`.
pub fn frame(evidence: &Evidence, frame: usize) -> Vec<Vec<Complex64>> {
    (0..evidence.cube.channels()).into_par_iter().map(|index| channel(evidence, frame, index)).collect()
}

/// Largest magnitude of what the samples hold besides a term, which is given by channel and sample; where it is none they do
/// not count. Of many samples the noise's own largest may be above that of the signal.
pub fn peak_beside(evidence: &Evidence, term: impl Fn(usize, usize) -> Option<Complex64> + Sync) -> f64 {
    let ([frames, .., samples], channels) = (evidence.cube.dims, evidence.cube.channels());
    let of = |index: usize| {
        let (frame, channel) = (index / channels, index % channels);
        let terms: Vec<Option<Complex64>> = (0..samples).map(|sample| term(channel, sample)).collect();
        let clean = self::channel(evidence, frame, channel);
        let rest = clean.iter().enumerate().filter_map(|(i, value)| terms[i % samples].map(|term| (value - term).norm_sqr()));
        rest.fold(0.0, f64::max)
    };
    (0..frames * channels).into_par_iter().map(of).reduce(|| 0.0, f64::max).sqrt()
}
