//! Power that falls or rises within the chirp (card R9).
//!
//! What moves is a sum of many returns whose interference is anew in every frame: over frames, its power over fast time
//! is level, and so a slope that all frames share is the transmitter's or the receiver's.

use std::sync::Arc;

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Rung};
use crate::diagnosis::{Cube, Evidence};

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.is_real() || evidence.accepted.contains(&"chirp_droop") || evidence.split.training.len() < 6 {
        return vec![];
    }
    let slopes: Vec<f64> = (0..evidence.cube.dims[0]).into_par_iter().map(|frame| slope_db(evidence, frame)).collect();
    let training: Vec<f64> = evidence.split.training.iter().map(|&frame| slopes[frame]).collect();
    let count = training.len() as f64;
    let mean = training.iter().sum::<f64>() / count;
    let variance = training.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / (count - 1.0);
    if variance <= 0.0 || !variance.is_finite() {
        return vec![];
    }
    let t = mean / (variance / count).sqrt();
    // Neighbouring frames of a slow person share some of their interference: half as many count.
    let Ok(law) = StudentsT::new(0.0, 1.0, (0.5 * count - 1.0).max(1.0)) else { return vec![] };
    let p_value = (2.0 * law.sf(t.abs() / std::f64::consts::SQRT_2)).min(1.0);
    let gain: f64 = evidence
        .split
        .held_out
        .iter()
        .map(|&frame| (slopes[frame].powi(2) - (slopes[frame] - mean).powi(2)) / (4.0 * variance))
        .sum();
    if p_value > 1e-2 || gain <= 0.0 {
        return vec![];
    }
    let error = (2.0 * variance / count).sqrt();
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

/// Slope of the power of what moves, decibels over the chirp.
fn slope_db(evidence: &Evidence, frame: usize) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let mut power = vec![0.0; samples];
    let own = evidence.cube.still(&[frame]);
    let mut noise = 0.0;
    for channel in 0..evidence.cube.channels() {
        noise += evidence.noise()[channel] * (loops - 1) as f64;
        for chirp in evidence.cube.channel(frame, channel).chunks_exact(samples) {
            let still = &own[channel * samples..][..samples];
            power.iter_mut().zip(chirp.iter().zip(still)).for_each(|(sum, (value, still))| *sum += (value - still).norm_sqr());
        }
    }
    let centre = 0.5 * (samples as f64 - 1.0);
    let (mut tilt, mut whole, mut spread) = (0.0, 0.0, 0.0);
    for (n, power) in power.iter().enumerate() {
        let x = (n as f64 - centre) / samples as f64;
        tilt += x * power;
        spread += x * x;
        whole += (power - noise) / samples as f64;
    }
    10.0 / std::f64::consts::LN_10 * tilt / spread / whole.max(0.02 * noise).max(1e-300)
}
