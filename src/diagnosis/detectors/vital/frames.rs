//! Frames' means over range, in which a return that moves slowly is followed.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::evidence::{Evidence, hann};

/// The frames' means after a Hann window and the transform to ranges.
pub struct Frames {
    /// `[frame][channel · bins + bin]`
    pub values: Vec<Vec<Complex64>>,
    /// Of a value, by channel.
    pub noise: Vec<f64>,
    pub bins: usize,
}

/// Mean chirp of every frame and channel under a Hann window, transformed to ranges.
pub fn frames(evidence: &Evidence) -> Frames {
    let [count, _, _, loops, samples] = evidence.cube.dims;
    let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
    let window = hann(samples);
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let values = (0..count)
        .map(|frame| {
            (0..channels)
                .flat_map(|channel| {
                    let mut sum = mean_chirp(evidence.cube.channel(frame, channel).chunks_exact(samples), samples);
                    sum.iter_mut().zip(&window).for_each(|(s, w)| *s *= w);
                    fft.process(&mut sum);
                    sum.truncate(bins);
                    sum
                })
                .collect()
        })
        .collect();
    Frames { values, noise: evidence.noise().iter().map(|v| v / loops as f64).collect(), bins }
}
