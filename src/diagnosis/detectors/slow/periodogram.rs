//! The coherent periodogram of a series that is sampled in frames that are apart, with a free constant.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use rayon::prelude::*;

use super::field::{Field, Series};

/// Points per resolution cell of a frame's own spectrum.
const PADDING: usize = 16;

/// Of the training frames with weight; frequencies in Hz.
pub(super) struct Periodogram<'a> {
    series: &'a Series,
    frames: &'a [usize],
    loops: usize,
    loop_s: f64,
    /// From the start of a frame to that of the next, s.
    period_s: f64,
    /// Sum of weights over all chirps.
    total: f64,
    mean: f64,
    /// Of each frame, s.
    middles_s: Vec<f64>,
    padded: usize,
    /// Of each frame, phases relative to its middle.
    spectra: Vec<Vec<Complex64>>,
}

impl<'a> Periodogram<'a> {
    pub fn new(field: &Field, series: &'a Series, frames: &'a [usize]) -> Self {
        let loops = field.loops;
        let padded = (loops * PADDING).next_power_of_two();
        let spectra = frame_spectra(loops, padded, series, frames);
        let total: f64 = frames.iter().map(|&f| series.weight[f] * loops as f64).sum();
        let middle = |f: &usize| 0.5 * (field.times_s[f * loops] + field.times_s[f * loops + loops - 1]);
        Self {
            series,
            frames,
            loops,
            loop_s: field.times_s[1] - field.times_s[0],
            period_s: field.times_s[loops] - field.times_s[0],
            total,
            mean: spectra.iter().map(|spectrum| spectrum[0].re).sum::<f64>() / total,
            middles_s: frames.iter().map(middle).collect(),
            padded,
            spectra,
        }
    }

    /// Sum of the weights of all chirps, each the inverse of a variance.
    pub fn weight(&self) -> f64 {
        self.total
    }

    /// Log-likelihood that a sinusoid gains beside a free constant (frames may see the same part of every period); nought where the
    /// two are not distinguishable.
    pub fn gain(&self, frequency_hz: f64) -> f64 {
        let (data, once, twice) = self.sums(frequency_hz);
        let (cosine, sine) = (once.re, -once.im);
        let cc = 0.5 * (self.total + twice.re) - cosine * cosine / self.total;
        let ss = 0.5 * (self.total - twice.re) - sine * sine / self.total;
        let cs = -0.5 * twice.im - cosine * sine / self.total;
        let (yc, ys) = (data.re - self.mean * cosine, -data.im - self.mean * sine);
        let determinant = cc * ss - cs * cs;
        if determinant < 1e-3 * self.total * self.total {
            0.0
        } else {
            0.5 * (yc * yc * ss + ys * ys * cc - 2.0 * yc * ys * cs) / determinant
        }
    }

    /// Weighted sums over all chirps of the series and of one, each times exp(-2πi f T), and of exp(-4πi f T).
    fn sums(&self, frequency_hz: f64) -> (Complex64, Complex64, Complex64) {
        let place = frequency_hz * self.loop_s * self.padded as f64;
        let (below, share) = (place.floor() as usize, place.fract());
        let kernels = [1.0, 2.0].map(|k| dirichlet(k * frequency_hz * self.loop_s, self.loops));
        let [mut data, mut once, mut twice] = [Complex64::ZERO; 3];
        let (mut turn, mut last_s) = (Complex64::ONE, 0.0);
        let once_more = Complex64::cis(-std::f64::consts::TAU * frequency_hz * self.period_s);
        for (at, (&frame, spectrum)) in self.frames.iter().zip(&self.spectra).enumerate() {
            let value = spectrum[below % self.padded] * (1.0 - share) + spectrum[(below + 1) % self.padded] * share;
            // Frames follow each other regularly: most turns are products of known ones.
            let steps = (self.middles_s[at] - last_s) / self.period_s;
            turn = if at > 0 && steps < 2.5 && (steps - steps.round()).abs() < 1e-6 {
                if steps < 1.5 { turn * once_more } else { turn * once_more * once_more }
            } else {
                Complex64::cis(-std::f64::consts::TAU * frequency_hz * self.middles_s[at])
            };
            last_s = self.middles_s[at];
            data += value * turn;
            once += turn * (self.series.weight[frame] * kernels[0]);
            twice += turn * turn * (self.series.weight[frame] * kernels[1]);
        }
        (data, once, twice)
    }
}

/// Padded spectra of the weighted series of each frame, phases relative to the frame's middle.
fn frame_spectra(loops: usize, padded: usize, series: &Series, frames: &[usize]) -> Vec<Vec<Complex64>> {
    let fft = FftPlanner::new().plan_fft_forward(padded);
    frames
        .par_iter()
        .map(|&frame| {
            let mut spectrum = vec![Complex64::ZERO; padded];
            for (value, own) in spectrum.iter_mut().zip(&series.value[frame * loops..(frame + 1) * loops]) {
                *value = (own * series.weight[frame]).into();
            }
            fft.process(&mut spectrum);
            for (bin, value) in spectrum.iter_mut().enumerate() {
                *value *= Complex64::cis(std::f64::consts::PI * bin as f64 * (loops - 1) as f64 / padded as f64);
            }
            spectrum
        })
        .collect()
}

/// Σ exp(−2πi x l) over so many l, relative to their middle.
fn dirichlet(turns: f64, count: usize) -> f64 {
    let half = std::f64::consts::PI * turns;
    if half.sin().abs() < 1e-9 {
        count as f64 * (half * (count - 1) as f64).cos().signum()
    } else {
        (half * count as f64).sin() / half.sin()
    }
}
