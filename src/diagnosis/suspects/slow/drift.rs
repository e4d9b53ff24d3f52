//! What changes from frame to frame: a slow drift, or a step with a date.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::field::{Field, Series};
use crate::diagnosis::statistics;

/// How the mean of a frame depends on its time.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Polynomial in the time over the recording, from −1 to 1, lowest power first.
    Smooth(Vec<f64>),
    /// Before, after, and the first frame after.
    Step([f64; 2], usize),
}

#[derive(Clone, Debug)]
pub struct Drift {
    pub shape: Shape,
    /// Of the change from the first to the last frame, or of the step.
    pub deviation: f64,
    /// Corrected for the shapes that were tried, and for scatter of the frames beyond the noise.
    pub p_value: f64,
    pub held_out_gain: f64,
    frames: usize,
}

impl Drift {
    pub fn value(&self, frame: usize) -> f64 {
        match &self.shape {
            Shape::Smooth(coefficients) => {
                let x = place(frame, self.frames);
                coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
            }
            Shape::Step([before, after], at) => {
                if frame < *at {
                    *before
                } else {
                    *after
                }
            }
        }
    }

    /// Change from the first to the last frame.
    pub fn change(&self) -> f64 {
        self.value(self.frames - 1) - self.value(0)
    }
}

fn place(frame: usize, frames: usize) -> f64 {
    2.0 * frame as f64 / (frames.max(2) - 1) as f64 - 1.0
}

/// Highest power of a drift.
const DEGREE: usize = 3;

/// The shape that explains the training frames best, more freedom paid for (BIC).
pub fn best(field: &Field, series: &Series, training: &[usize], held_out: &[usize]) -> Option<Drift> {
    let loops = series.loops as f64;
    let points: Vec<(usize, f64, f64)> = training
        .iter()
        .filter(|&&f| series.weight[f] > 0.0)
        .map(|&f| {
            let mean = series.value[f * series.loops..(f + 1) * series.loops].iter().sum::<f64>() / loops;
            (f, mean, series.weight[f] * loops)
        })
        .collect();
    if points.len() < 5 {
        return None;
    }
    let count = points.len() as f64;
    let total: f64 = points.iter().map(|p| p.2).sum();
    let mean = points.iter().map(|p| p.1 * p.2).sum::<f64>() / total;
    let scatter: f64 = points.iter().map(|p| p.2 * (p.1 - mean).powi(2)).sum();
    let mut tried = 0.0;
    // Shape, misfit, free parameters beyond the constant, variance of its change.
    let mut found: Option<(Shape, f64, f64, f64)> = None;
    let mut offer = |shape: Shape, misfit: f64, freedom: f64, variance: f64| {
        tried += 1.0;
        let price = |misfit: f64, freedom: f64| misfit + freedom * count.ln();
        if found.as_ref().is_none_or(|f| price(misfit, freedom) < price(f.1, f.2)) {
            found = Some((shape, misfit, freedom, variance));
        }
    };
    for degree in 1..=DEGREE.min(points.len() - 4) {
        let size = degree + 1;
        let row = |frame: usize| -> Vec<f64> { (0..size).map(|p| place(frame, field.frames).powi(p as i32)).collect() };
        let mut normal = nalgebra::DMatrix::<f64>::zeros(size, size);
        let mut right = nalgebra::DVector::<f64>::zeros(size);
        for &(frame, value, weight) in &points {
            let row = nalgebra::DVector::from_vec(row(frame));
            right += &row * (weight * value);
            normal += &row * row.transpose() * weight;
        }
        let Some(solved) = normal.cholesky() else { continue };
        let c = solved.solve(&right);
        let misfit =
            points.iter().map(|(f, v, w)| w * (v - c.iter().zip(row(*f)).map(|(c, x)| c * x).sum::<f64>()).powi(2)).sum();
        let ends = nalgebra::DVector::from_iterator(size, (0..size).map(|p| if p % 2 == 1 { 2.0 } else { 0.0 }));
        let variance = ends.dot(&solved.solve(&ends));
        offer(Shape::Smooth(c.iter().copied().collect()), misfit, degree as f64, variance);
    }
    for at in 1..field.frames {
        let mut sums = [[0.0; 2]; 2];
        for &(frame, value, weight) in &points {
            let side = &mut sums[usize::from(frame >= at)];
            side[0] += weight * value;
            side[1] += weight;
        }
        let few = points.iter().filter(|p| p.0 < at).count().min(points.iter().filter(|p| p.0 >= at).count());
        // A date within a gap of the training frames is the same step.
        let repeated = at > 1 && !points.iter().any(|p| p.0 == at - 1);
        if few < 2 || repeated {
            continue;
        }
        let sides = sums.map(|[sum, weight]| sum / weight);
        let misfit = points.iter().map(|(f, v, w)| w * (v - sides[usize::from(*f >= at)]).powi(2)).sum();
        // The date is a parameter too.
        offer(Shape::Step(sides, at), misfit, 2.0, 1.0 / sums[0][1] + 1.0 / sums[1][1]);
    }
    let (shape, misfit, freedom, variance) = found?;
    let freedom_left = (count - 1.0 - freedom).max(1.0);
    // Frames that scatter by more than the noise (the body's slow parts) make everything less sure.
    let excess = (misfit / freedom_left).max(1.0);
    let ratio = (scatter - misfit).max(0.0) / freedom / (misfit / freedom_left).max(1.0);
    let p = fisher_tail(ratio, freedom, freedom_left);
    let drift = Drift {
        shape,
        deviation: (variance * excess).sqrt(),
        p_value: statistics::corrected(p, tried),
        held_out_gain: 0.0,
        frames: field.frames,
    };
    // Between the last training frame before a step and the first one after it, the date is open.
    let open = |frame: usize| match drift.shape {
        Shape::Step(_, at) => {
            let before = training.iter().copied().filter(|&f| f < at).max().unwrap_or(0);
            let after = training.iter().copied().filter(|&f| f >= at).min().unwrap_or(field.frames);
            before < frame && frame < after
        }
        Shape::Smooth(_) => false,
    };
    let predicted = |frame: usize| match drift.shape {
        Shape::Step([before, after], _) if open(frame) => 0.5 * (before + after),
        _ => drift.value(frame),
    };
    let held_out_gain = series.gain(field, held_out, |frame, _, _| predicted(frame)) / excess;
    // Judged without it, the date is then read from those frames as well.
    if let Shape::Step([before, after], at) = drift.shape {
        let late = |frame: usize| {
            let mean = series.value[frame * series.loops..(frame + 1) * series.loops].iter().sum::<f64>() / loops;
            (mean - after).abs() < (mean - before).abs()
        };
        let date = (0..field.frames).find(|&f| if open(f) { late(f) } else { f >= at }).unwrap_or(at);
        return Some(Drift { shape: Shape::Step([before, after], date), held_out_gain, ..drift });
    }
    Some(Drift { held_out_gain, ..drift })
}

/// Probability that a ratio of variances exceeds this.
fn fisher_tail(ratio: f64, above: f64, below: f64) -> f64 {
    if ratio <= 0.0 { 1.0 } else { FisherSnedecor::new(above, below).map_or(1.0, |law| law.sf(ratio)) }
}
