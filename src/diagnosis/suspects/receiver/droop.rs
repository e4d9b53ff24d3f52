//! Power that falls or rises within the chirp (card R9).
//!
//! What moves is a sum of many returns whose interference is anew in every frame: over frames, its power over fast time
//! is level, and so a slope that all frames share is the transmitter's or the receiver's.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::FftPlanner;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::diagnosis::evidence::hann;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Rung};
use crate::diagnosis::{Cube, Evidence};

/// Fewest training frames with movers, and fewest loops.
const FEWEST: usize = 6;
/// Correlation of neighbouring frames' slopes beyond which nothing more is lost.
const MOST_ALIKE: f64 = 0.8;
/// Power of a Doppler cell over the noise's from which on its slope is read.
const OVER_NOISE: f64 = 3.0;

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.is_real() || evidence.accepted.contains(&"chirp_droop") || evidence.cube.dims[3] < FEWEST {
        return vec![];
    }
    let slopes: Vec<Option<f64>> = (0..evidence.cube.dims[0]).into_par_iter().map(|frame| slope_db(evidence, frame)).collect();
    let training: Vec<f64> = evidence.split.training.iter().filter_map(|&frame| slopes[frame]).collect();
    if training.len() < FEWEST {
        return vec![];
    }
    let count = training.len() as f64;
    let mean = training.iter().sum::<f64>() / count;
    let variance = training.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / (count - 1.0);
    if variance <= 0.0 || !variance.is_finite() {
        return vec![];
    }
    // Neighbouring frames of a slow person share some of their interference: fewer count.
    let neighbours: f64 = training.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    let alike = (neighbours / (count - 1.0) / variance).clamp(0.0, MOST_ALIKE);
    let independent = count * (1.0 - alike) / (1.0 + alike);
    let error = (variance / independent).sqrt();
    let Ok(law) = StudentsT::new(0.0, 1.0, (independent - 1.0).max(1.0)) else { return vec![] };
    let p_value = (2.0 * law.sf(mean.abs() / error)).min(1.0);
    let gain: f64 = evidence
        .split
        .held_out
        .iter()
        .filter_map(|&frame| slopes[frame])
        .map(|slope| (slope.powi(2) - (slope - mean).powi(2)) / (2.0 * variance))
        .sum::<f64>()
        * independent
        / count;
    if p_value > 1e-2 || gain <= 0.0 {
        return vec![];
    }
    let samples = evidence.cube.dims[4] as f64;
    let db = -mean;
    let total: f64 = evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum();
    vec![Candidate {
        id: Some("chirp_droop"),
        behaves_like: "fast-time gain",
        estimates: vec![Estimate::normal("db", db, error)],
        choice: None,
        place: Place::at("receiver"),
        p_value,
        gain,
        rung: Rung::D,
        look_alikes: vec![],
        statement: format!(
            "the power {} by {:.2} dB from the first to the last sample of every chirp, whatever is seen",
            if db > 0.0 { "falls" } else { "rises" },
            db.abs()
        ),
        curve: None,
        energy: total * (db / 8.686).powi(2) / 12.0,
        correction: Correction::Samples(Arc::new(move |cube: &mut Cube| {
            cube.each_chirp(|_, chirp| {
                chirp.iter_mut().enumerate().for_each(|(n, value)| *value *= 10f64.powf(db * (n as f64 / samples - 0.5) / 20.0));
            });
        })),
    }]
}

/// Slope of the power of what moves, decibels over the chirp: the median over the frame's Doppler cells, each of which
/// holds other parts of the body and hence another interference. None where nothing moves.
fn slope_db(evidence: &Evidence, frame: usize) -> Option<f64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let own = evidence.cube.still(&[frame]);
    let window = hann(loops);
    let fft = FftPlanner::new().plan_fft_forward(loops);
    // `[doppler, sample]`
    let (mut power, mut noise) = (vec![0.0; loops * samples], 0.0);
    for channel in 0..evidence.cube.channels() {
        noise += evidence.noise()[channel] * window.iter().map(|w| w * w).sum::<f64>();
        let chirps = evidence.cube.channel(frame, channel);
        for sample in 0..samples {
            let still = own[channel * samples + sample];
            let mut slow: Vec<Complex64> = (0..loops).map(|i| (chirps[i * samples + sample] - still) * window[i]).collect();
            fft.process(&mut slow);
            slow.iter().enumerate().for_each(|(doppler, value)| power[doppler * samples + sample] += value.norm_sqr());
        }
    }
    let centre = 0.5 * (samples as f64 - 1.0);
    let place = |n: usize| (n as f64 - centre) / samples as f64;
    let spread: f64 = (0..samples).map(|n| place(n).powi(2)).sum();
    let slope = |power: &[f64]| {
        let whole = power.iter().sum::<f64>() / samples as f64 - noise;
        let tilt: f64 = power.iter().enumerate().map(|(n, power)| place(n) * power).sum();
        (whole > OVER_NOISE * noise).then(|| 10.0 / std::f64::consts::LN_10 * tilt / spread / whole)
    };
    let mut slopes: Vec<f64> = power.chunks_exact(samples).filter_map(slope).collect();
    slopes.sort_by(f64::total_cmp);
    let count = slopes.len();
    (count > 0).then(|| 0.5 * (slopes[(count - 1) / 2] + slopes[count / 2]))
}
