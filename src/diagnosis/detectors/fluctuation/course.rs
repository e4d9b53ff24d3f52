//! Courses in time that may be slow: a Gaussian process and an unknown constant, in noise.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Standard deviations of the course that are tried, over that of the noise, and the times over which it stays alike, in frames;
/// zero where every frame is for itself.
const STRENGTHS: [f64; 9] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 64.0, 256.0];
const SLOW_FRAMES: [f64; 4] = [0.0, 1.5, 3.0, 6.0];
/// Of the unknown constant, over the strongest course.
const CONSTANT: f64 = 1e3;

/// When frames are, and by which of them a course is learned and judged.
#[derive(Clone, Copy)]
pub struct Frames<'a> {
    pub times_s: &'a [f64],
    pub training: &'a [usize],
    pub held_out: &'a [usize],
}

/// Series that share a law, `[series][frame]`, and the variance of their noise, `[frame]`. They may be the components of fewer numbers.
pub struct Data<'a> {
    pub series: &'a [Vec<f64>],
    pub numbers: f64,
    pub noise: &'a [f64],
}

#[derive(Clone, Copy)]
struct Law {
    /// Variance, over the mean noise's.
    power: f64,
    slow_s: f64,
}

const NONE: Law = Law { power: 0.0, slow_s: 0.0 };

/// What the training frames say of a course.
pub struct Course {
    law: Law,
    /// Log-likelihood gain on the training frames against no course, and of all frames, each predicted by the others, nats.
    pub training: f64,
    pub predicted: f64,
}

impl Course {
    /// The law that is most likely by the training frames.
    pub fn new(frames: Frames, data: &Data) -> Self {
        let frame_s = (frames.times_s[frames.times_s.len() - 1] - frames.times_s[0]) / (frames.times_s.len() - 1).max(1) as f64;
        let of = |law: Law, over: &[usize]| frames.log_likelihood(law, data, over);
        let none = of(NONE, frames.training);
        let laws = STRENGTHS
            .into_iter()
            .flat_map(|strength| SLOW_FRAMES.map(|slow| Law { power: strength * strength, slow_s: slow * frame_s }));
        let best = laws.map(|law| (law, of(law, frames.training) - none)).max_by(|a, b| a.1.total_cmp(&b.1));
        let (law, training) = best.filter(|(_, gain)| *gain > 0.0).unwrap_or((NONE, 0.0));
        Self { law, training, predicted: frames.predicted(law, data) - frames.predicted(NONE, data) }
    }

    /// Weights by which the training frames predict every frame, `[frame, training frame]`.
    pub fn weights(&self, frames: Frames, data: &Data) -> DMatrix<f64> {
        let (count, known) = (frames.times_s.len(), frames.training.len());
        let Some(inverse) = frames.covariance(self.law, data, frames.training).and_then(Cholesky::new) else {
            return DMatrix::zeros(count, known);
        };
        let scale = frames.scale(data);
        let shared =
            DMatrix::from_fn(known, count, |row, frame| scale * (CONSTANT + frames.alike(self.law, frames.training[row], frame)));
        inverse.solve(&shared).transpose()
    }
}

impl Frames<'_> {
    fn scale(&self, data: &Data) -> f64 {
        self.training.iter().map(|&frame| data.noise[frame]).sum::<f64>() / self.training.len().max(1) as f64
    }

    /// Covariance of the course in two frames, over the mean noise.
    fn alike(&self, law: Law, a: usize, b: usize) -> f64 {
        if a == b {
            return law.power;
        }
        if law.slow_s <= 0.0 {
            return 0.0;
        }
        law.power * (-0.5 * ((self.times_s[a] - self.times_s[b]) / law.slow_s).powi(2)).exp()
    }

    /// None where the noise is nothing.
    fn covariance(&self, law: Law, data: &Data, over: &[usize]) -> Option<DMatrix<f64>> {
        let scale = self.scale(data);
        let noise = |row: usize, column: usize| if row == column { data.noise[over[row]] } else { 0.0 };
        let covariance = DMatrix::from_fn(over.len(), over.len(), |row, column| {
            noise(row, column) + scale * (CONSTANT + self.alike(law, over[row], over[column]))
        });
        (scale > 0.0 && scale.is_finite()).then_some(covariance)
    }

    fn log_likelihood(&self, law: Law, data: &Data, over: &[usize]) -> f64 {
        let Some(cholesky) = self.covariance(law, data, over).and_then(Cholesky::new) else { return f64::NEG_INFINITY };
        let square: f64 = data
            .series
            .iter()
            .map(|series| {
                let values = DVector::from_iterator(over.len(), over.iter().map(|&frame| series[frame]));
                values.dot(&cholesky.solve(&values))
            })
            .sum();
        -0.5 * square - data.numbers * cholesky.l_dirty().diagonal().map(f64::ln).sum()
    }

    /// Log-likelihood of every frame, given all others.
    fn predicted(&self, law: Law, data: &Data) -> f64 {
        let all: Vec<usize> = (0..self.times_s.len()).collect();
        let Some(cholesky) = self.covariance(law, data, &all).and_then(Cholesky::new) else { return f64::NEG_INFINITY };
        let inverse = cholesky.inverse();
        let own = inverse.diagonal();
        let square: f64 = data
            .series
            .iter()
            .map(|series| {
                let left = &inverse * DVector::from_column_slice(series);
                left.iter().zip(own.iter()).map(|(left, own)| left * left / own).sum::<f64>()
            })
            .sum();
        0.5 * (data.numbers * own.map(f64::ln).sum() - square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support;

    #[test]
    fn what_is_slow_is_predicted_and_noise_is_not() {
        let times_s: Vec<f64> = (0..12).map(|frame| 0.1 * f64::from(frame)).collect();
        let (held_out, training): (Vec<usize>, Vec<usize>) = (0..12).partition(|frame| frame % 4 == 2);
        let frames = Frames { times_s: &times_s, training: &training, held_out: &held_out };
        let mut normal = support::normal(5);
        let mut series = |amplitude: f64| -> Vec<f64> {
            times_s
                .iter()
                .map(|time| 7.0 + amplitude * (4.0 * time).sin())
                .zip((0..12).map(|_| normal()))
                .map(|(a, b)| a + b)
                .collect()
        };
        let mut gains = vec![];
        for amplitude in [0.0, 4.0] {
            let series = [series(amplitude), series(amplitude)];
            let data = Data { series: &series, numbers: 2.0, noise: &[1.0; 12] };
            let course = Course::new(frames, &data);
            gains.push([course.training, course.predicted]);
            let weights = course.weights(frames, &data);
            let values = DVector::from_iterator(training.len(), training.iter().map(|&frame| series[0][frame] - 7.0));
            let predicted = weights * values;
            for &frame in &held_out {
                let wanted = amplitude * (4.0 * times_s[frame]).sin();
                assert!((predicted[frame] - wanted).abs() < 1.5, "{amplitude} {frame}: {} for {wanted}", predicted[frame]);
            }
        }
        assert!(gains[0][0] < 3.0 && gains[0][1] < 1.0, "{gains:?}");
        assert!(gains[1][0] > 10.0 && gains[1][1] > 20.0, "{gains:?}");
    }
}
