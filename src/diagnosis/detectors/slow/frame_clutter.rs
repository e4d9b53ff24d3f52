//! Static clutter within a frame, from frame to frame: spectra of the frames' mean chirps.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::evidence::{Evidence, Tapered};

/// Spectra in units of the noise's deviation of a frame's mean chirp.
pub struct FrameClutter {
    pub frames: usize,
    pub channels: usize,
    pub bins: usize,
    /// `[channel, bin]`, mean of the training frames.
    pub mean: Vec<Complex64>,
    /// `[frame, channel, bin]`, what a frame deviates from it.
    deviation: Vec<Complex64>,
    /// `[frame, bin]`, variance within the frame over the noise's, mean over the channels.
    scatter: Vec<f64>,
    /// Scatter up to which nothing moves within a frame.
    limit: f64,
    /// `[bin]`: something was taken out there.
    pub touched: Vec<bool>,
}

/// Scatter over the noise that a cell without a mover may have; its law is narrower than this.
const CLEAN: f64 = 1.25;

impl FrameClutter {
    /// None without noise to measure by, or with too few chirps.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins, noise) = (evidence.cube.channels(), evidence.range_bins(), evidence.noise());
        if loops < 4 || bins < 16 || noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        let tapered = Tapered::new(samples);
        let of_frame = |frame: usize| -> (Vec<Complex64>, Vec<f64>) {
            let (mut means, mut scatter) = (Vec::with_capacity(channels * bins), vec![0.0; bins]);
            for (channel, variance) in noise.iter().enumerate() {
                let spectra = tapered.spectra(evidence.cube.channel(frame, channel), 1.0 / variance.sqrt());
                for bin in 0..bins {
                    let values = || spectra[bin..].iter().step_by(samples);
                    let mean = values().sum::<Complex64>() / loops as f64;
                    let variance = values().map(|v| (v - mean).norm_sqr()).sum::<f64>() / (loops - 1) as f64;
                    scatter[bin] += variance / channels as f64;
                    means.push(mean * (loops as f64).sqrt());
                }
            }
            (means, scatter)
        };
        let per_frame: Vec<(Vec<Complex64>, Vec<f64>)> = (0..frames).into_par_iter().map(of_frame).collect();
        let training = &evidence.split.training;
        let mean: Vec<Complex64> = (0..channels * bins)
            .map(|i| training.iter().map(|&f| per_frame[f].0[i]).sum::<Complex64>() / training.len().max(1) as f64)
            .collect();
        let deviation = per_frame.iter().flat_map(|(means, _)| means.iter().zip(&mean).map(|(m, s)| m - s)).collect();
        let scatter = per_frame.into_iter().flat_map(|(_, scatter)| scatter).collect();
        let limit = CLEAN.max(1.0 + 5.0 / ((channels * loops) as f64).sqrt());
        Some(Self { frames, channels, bins, mean, deviation, scatter, limit, touched: evidence.touched() })
    }

    /// What a frame of a channel deviates from the mean of the training frames at a range.
    pub fn deviation(&self, frame: usize, channel: usize, bin: usize) -> Complex64 {
        self.deviation[(frame * self.channels + channel) * self.bins + bin]
    }

    /// Whether nothing moves within the frame at a range, nor right beside it.
    pub fn quiet(&self, frame: usize, bin: usize) -> bool {
        (bin.saturating_sub(1)..(bin + 2).min(self.bins)).all(|k| self.scatter[frame * self.bins + k] < self.limit)
    }
}
