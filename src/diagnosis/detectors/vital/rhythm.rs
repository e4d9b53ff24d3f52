//! The line of a slow motion that stands out of the frequencies around it.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::statistics;

/// Rates of breathing and of a heart, Hz.
pub const BREATHING_HZ: [f64; 2] = [0.1, 0.7];
pub const HEART_HZ: [f64; 2] = [0.8, 2.2];
/// Lines to either side that a line stands out of, at least.
const FEWEST_BESIDE: f64 = 5.0;
/// A rhythm needs so many periods.
const FEWEST_PERIODS: f64 = 2.5;

/// A rhythm in a phase.
pub struct Rhythm {
    pub frequency_hz: f64,
    pub frequency_deviation_hz: f64,
    pub amplitude: f64,
    pub amplitude_deviation: f64,
    /// Of the variance about a straight line that it explains.
    pub share: f64,
    pub p_value: f64,
}

/// A phase over the frames' times.
struct Series<'a> {
    times: &'a [f64],
    phase: &'a [f64],
    frames: Vec<usize>,
    duration: f64,
}

/// A sinusoid beside a straight line.
struct Fit {
    misfit: f64,
    amplitude: f64,
    /// What is left, by frame.
    left: Vec<f64>,
}

impl Series<'_> {
    /// With the mean time between two frames.
    fn of<'a>(times: &'a [f64], phase: &'a [f64], training: &[usize], held_out: &[usize]) -> (Series<'a>, f64) {
        let duration = times[times.len() - 1] - times[0];
        let mut frames = [training, held_out].concat();
        frames.sort_unstable();
        (Series { times, phase, frames, duration }, duration / (times.len() - 1) as f64)
    }

    /// A straight line is the body's slow sway.
    fn fit(&self, frequency: Option<f64>) -> Fit {
        let Self { times, phase, frames, duration } = self;
        let size = if frequency.is_some() { 4 } else { 2 };
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut right = DVector::<f64>::zeros(size);
        let row = |t: f64| {
            let mut row = vec![1.0, (t - times[0]) / duration - 0.5];
            if let Some(f) = frequency {
                let (s, c) = (TAU * f * t).sin_cos();
                row.extend([c, s]);
            }
            DVector::from_vec(row)
        };
        for &f in frames {
            let row = row(times[f]);
            right += &row * phase[f];
            normal += &row * row.transpose();
        }
        let found = normal.cholesky().map_or_else(|| DVector::zeros(size), |c| c.solve(&right));
        let left: Vec<f64> = frames.iter().map(|&f| phase[f] - found.dot(&row(times[f]))).collect();
        let misfit = left.iter().map(|l| l * l).sum();
        Fit { misfit, amplitude: if size == 4 { found[2].hypot(found[3]) } else { 0.0 }, left }
    }

    /// The frequency between two that leaves the least.
    fn best(&self, lowest: f64, highest: f64) -> Option<f64> {
        let step = 0.1 / self.duration;
        let steps = ((highest - lowest) / step).floor();
        if steps < 2.0 {
            return None;
        }
        let misfit = |f: f64| self.fit(Some(f)).misfit;
        let first = (0..=steps as usize).map(|i| lowest + i as f64 * step).min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
        Some(climb(|f| -misfit(f), first, 0.5 * step, 1e-3 * step).0)
    }

    /// Squared amplitudes of what is left at the frequencies around one, its harmonics left out.
    fn around(&self, frequency_hz: f64, left: &[f64], interval: f64) -> Vec<f64> {
        let Self { times, frames, duration, .. } = self;
        // A short recording has few lines.
        let half = 0.5f64.max(FEWEST_BESIDE / duration);
        let reach = if frequency_hz < HEART_HZ[0] { [0.0, HEART_HZ[0]] } else { [frequency_hz - half, frequency_hz + half] };
        let mut around = vec![];
        for k in 1..(0.5 * duration / interval) as usize {
            let f = k as f64 / duration;
            let harmonic = (f / frequency_hz).round().max(1.0) * frequency_hz;
            if f >= reach[0] && f <= reach[1] && (f - harmonic).abs() > 1.0 / duration {
                let sum: Complex64 = left.iter().zip(frames).map(|(l, &i)| l * Complex64::cis(-TAU * f * times[i])).sum();
                around.push((2.0 * sum.norm() / left.len() as f64).powi(2));
            }
        }
        around
    }

    /// The line at a frequency, of those between two that were looked at; none where too few are around it.
    fn standing_out(&self, frequency_hz: f64, interval: f64, [lowest, highest]: [f64; 2]) -> Option<Rhythm> {
        let duration = self.duration;
        let Fit { misfit, amplitude, left } = self.fit(Some(frequency_hz));
        let share = 1.0 - misfit / self.fit(None).misfit.max(f64::MIN_POSITIVE);
        // The rest of the motion is slow as well: what counts is how far the line stands out of the frequencies around it.
        let around = self.around(frequency_hz, &left, interval);
        if around.len() < 3 {
            return None;
        }
        let count = around.len() as f64;
        let background = (around.iter().sum::<f64>() / count).max(1e-12);
        let p = (1.0 + amplitude * amplitude / background / count).powf(-count);
        let deviation = (0.5 * background).sqrt();
        Some(Rhythm {
            frequency_hz,
            // Of a sinusoid in noise of that density, twice the variance because no body keeps time exactly.
            frequency_deviation_hz: deviation / amplitude.max(1e-9) * 12.0f64.sqrt() / (PI * duration),
            amplitude,
            amplitude_deviation: deviation,
            share,
            p_value: statistics::corrected(p, (highest - lowest) * duration),
        })
    }
}

/// That of a body.
pub fn rhythm(times: &[f64], phase: &[f64], training: &[usize], held_out: &[usize]) -> Option<Rhythm> {
    let (series, interval) = Series::of(times, phase, training, held_out);
    let lowest = (FEWEST_PERIODS / series.duration).max(0.5 * BREATHING_HZ[0]);
    let highest = HEART_HZ[1].min(0.4 / interval);
    let frequency_hz = series.best(lowest, highest)?;
    series.standing_out(frequency_hz, interval, [lowest, highest])
}

/// That of anything, up to half of the frame rate: the strongest line of the periodogram. A faster one is folded into that; beyond about a
/// fifth, frames between others are not predicted by them, and nothing is found.
pub fn vibration(times: &[f64], phase: &[f64], training: &[usize], held_out: &[usize]) -> Option<Rhythm> {
    let (series, interval) = Series::of(times, phase, training, held_out);
    let (step, width) = (0.5 / series.duration, 1.0 / series.duration);
    let (lowest, highest) = (FEWEST_PERIODS / series.duration, 0.5 / interval - width);
    let left = series.fit(None).left;
    let power = |hz: f64| -> f64 {
        left.iter().zip(&series.frames).map(|(l, &f)| l * Complex64::cis(-TAU * hz * times[f])).sum::<Complex64>().norm_sqr()
    };
    let lines = (0..).map(|k| lowest + f64::from(k) * step).take_while(|hz| *hz < highest).map(|hz| (hz, power(hz)));
    let (strongest, _) = lines.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let frequency_hz = series.best((strongest - width).max(lowest), strongest + width)?;
    series.standing_out(frequency_hz, interval, [lowest, highest])
}
