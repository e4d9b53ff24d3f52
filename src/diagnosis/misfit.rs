//! How well the baseline explains frames that it was not fitted on.

use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::evidence::{Evidence, transform};
use super::support::Support;

/// Of the held-out frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Misfit {
    /// Of the Gaussian and exponential laws of the cells, nats.
    pub loglik_per_sample: f64,
    /// Mean squared difference between measured and expected power, dB².
    pub db_mse: f64,
    /// The same as a peak signal-to-noise ratio over the span from the noise to the strongest cell.
    pub psnr_db: f64,
}

/// Below the noise nothing is compared: logarithms of small numbers would decide.
const FLOOR: f64 = 0.1;

impl Misfit {
    /// The static part is what of the training mean can come from the room; the moving part of a cell is expected to
    /// have the power that the same cell's neighbourhood predicts from body and noise.
    pub fn of(evidence: &Evidence) -> Self {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let support = Support::new(&evidence.radar, evidence.room.as_ref());
        let channels = evidence.cube.channels();
        let still: Vec<Vec<Complex64>> =
            (0..channels).map(|channel| support.project(&evidence.still()[channel * samples..][..samples])).collect();
        let noise = evidence.noise();
        let bins = evidence.range_bins();
        // Per frame: the sum of the log-likelihood, of the squared dB differences, cells, the span.
        let sums = evidence.split.held_out.par_iter().map(|&frame| {
            let expected_moving = evidence.expected(frame);
            let (mut likelihood, mut squares, mut peak) = (0.0, 0.0, 1.0f64);
            for channel in 0..channels {
                let measured = transform(evidence.cube.channel(frame, channel), samples);
                let repeated = still[channel].repeat(loops);
                let predicted = transform(&repeated, samples);
                let variance = noise[channel].max(f64::MIN_POSITIVE);
                for doppler in 0..loops {
                    for range in 0..bins {
                        let cell = doppler * samples + range;
                        let spread = f64::from(expected_moving[cell]).max(1.0);
                        let residual = (measured[cell] - predicted[cell]).norm_sqr() / variance;
                        likelihood -= residual / spread + (std::f64::consts::PI * variance * spread).ln();
                        let seen = measured[cell].norm_sqr() / variance;
                        let wanted = predicted[cell].norm_sqr() / variance + spread;
                        squares += (10.0 * (seen.max(FLOOR) / wanted.max(FLOOR)).log10()).powi(2);
                        peak = peak.max(seen);
                    }
                }
            }
            (likelihood, squares, (channels * loops * bins) as f64, peak)
        });
        let (likelihood, squares, cells, peak) =
            sums.reduce(|| (0.0, 0.0, 0.0, 1.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2, a.3.max(b.3)));
        let cells = cells.max(1.0);
        let (db_mse, span) = (squares / cells, 10.0 * peak.log10());
        Self {
            loglik_per_sample: likelihood / cells,
            db_mse,
            psnr_db: 10.0 * (span * span / db_mse.max(f64::MIN_POSITIVE)).log10(),
        }
    }
}
