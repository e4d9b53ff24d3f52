//! One number per chirp of what all groups of ranges share.

use super::Field;
use super::part::Part;

/// One number per chirp: the common deviation, with its inverse variance.
pub struct Series {
    /// `[frame, loop]`
    pub value: Vec<f64>,
    /// `[frame]`: all chirps of a frame are equally sure.
    pub weight: Vec<f64>,
    pub loops: usize,
}

impl Field {
    /// The best estimate of one part, from the groups that `wanted` keeps.
    pub fn series(&self, part: Part, wanted: impl Fn(usize) -> bool) -> Series {
        let mut value = Vec::with_capacity(self.frames * self.loops);
        let mut weight = Vec::with_capacity(self.frames);
        for frame in 0..self.frames {
            let kept: Vec<f64> = self.weights(frame).iter().enumerate().map(|(g, w)| if wanted(g) { *w } else { 0.0 }).collect();
            let lever = |g: usize| part.lever(&self.groups[g]);
            let information: f64 = kept.iter().enumerate().map(|(g, w)| w * lever(g) * lever(g)).sum();
            for index in 0..self.loops {
                let sum: f64 = self
                    .deviations(frame, index)
                    .iter()
                    .enumerate()
                    .map(|(g, v)| kept[g] * lever(g) * if part == Part::Gain { v.re } else { v.im })
                    .sum();
                value.push(if information > 0.0 { sum / information } else { 0.0 });
            }
            // Half of a complex variance is in each part.
            weight.push(2.0 * information);
        }
        Series { value, weight, loops: self.loops }
    }
}

impl Series {
    /// Of a frame.
    pub fn mean(&self, frame: usize) -> f64 {
        self.value[frame * self.loops..(frame + 1) * self.loops].iter().sum::<f64>() / self.loops as f64
    }

    /// Log-likelihood that some frames gain by a prediction, of which `predicted` gives frame, loop and radar time.
    pub fn log_likelihood_gain(&self, field: &Field, frames: &[usize], predicted: impl Fn(usize, usize, f64) -> f64) -> f64 {
        let mut gain = 0.0;
        for &frame in frames {
            for index in 0..self.loops {
                let i = frame * self.loops + index;
                let (value, model) = (self.value[i], predicted(frame, index, field.times_s[i]));
                gain += self.weight[frame] * model * (value - 0.5 * model);
            }
        }
        gain
    }
}
