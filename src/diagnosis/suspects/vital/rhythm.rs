//! The line of a slow motion that stands out of the frequencies around it.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::statistics;

/// Rates of breathing and of a heart, Hz.
pub const BREATHING_HZ: [f64; 2] = [0.1, 0.7];
pub const HEART_HZ: [f64; 2] = [0.8, 2.2];
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

pub fn rhythm(times: &[f64], phase: &[f64], training: &[usize], held_out: &[usize]) -> Option<Rhythm> {
    let duration = times[times.len() - 1] - times[0];
    let interval = duration / (times.len() - 1) as f64;
    let frames: Vec<usize> = {
        let mut all = [training, held_out].concat();
        all.sort_unstable();
        all
    };
    let lowest = (FEWEST_PERIODS / duration).max(0.5 * BREATHING_HZ[0]);
    let highest = HEART_HZ[1].min(0.4 / interval);
    // A straight line is the body's slow sway.
    let fit = |frequency: Option<f64>| -> (f64, f64, Vec<f64>) {
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
        for &f in &frames {
            let row = row(times[f]);
            right += &row * phase[f];
            normal += &row * row.transpose();
        }
        let found = normal.cholesky().map_or_else(|| DVector::zeros(size), |c| c.solve(&right));
        let left: Vec<f64> = frames.iter().map(|&f| phase[f] - found.dot(&row(times[f]))).collect();
        let misfit = left.iter().map(|l| l * l).sum();
        (misfit, if size == 4 { found[2].hypot(found[3]) } else { 0.0 }, left)
    };
    let step = 0.1 / duration;
    let steps = ((highest - lowest) / step).floor();
    if steps < 2.0 {
        return None;
    }
    let total = fit(None).0;
    let best =
        (0..=steps as usize).map(|i| lowest + i as f64 * step).min_by(|a, b| fit(Some(*a)).0.total_cmp(&fit(Some(*b)).0))?;
    let mut frequency_hz = best;
    let mut width = 0.5 * step;
    while width > 1e-3 * step {
        let misfit = |f: f64| fit(Some(f)).0;
        if misfit(frequency_hz + width) < misfit(frequency_hz) {
            frequency_hz += width;
        } else if misfit(frequency_hz - width) < misfit(frequency_hz) {
            frequency_hz -= width;
        } else {
            width *= 0.5;
        }
    }
    let (misfit, amplitude, left) = fit(Some(frequency_hz));
    let share = 1.0 - misfit / total.max(f64::MIN_POSITIVE);
    // The rest of the motion is slow as well: what counts is how far the line stands out of the frequencies around it,
    // its harmonics left out.
    let reach = if frequency_hz < HEART_HZ[0] { [0.0, HEART_HZ[0]] } else { [frequency_hz - 0.5, frequency_hz + 0.5] };
    let mut around = vec![];
    for k in 1..(0.5 * duration / interval) as usize {
        let f = k as f64 / duration;
        let harmonic = (f / frequency_hz).round().max(1.0) * frequency_hz;
        if f >= reach[0] && f <= reach[1] && (f - harmonic).abs() > 1.0 / duration {
            let sum: Complex64 = left.iter().zip(&frames).map(|(l, &i)| l * Complex64::cis(-TAU * f * times[i])).sum();
            around.push((2.0 * sum.norm() / left.len() as f64).powi(2));
        }
    }
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
