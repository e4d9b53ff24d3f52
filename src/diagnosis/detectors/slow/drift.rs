//! What changes from frame to frame: a slow drift, or a step with a date.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::field::{Field, Part, Series};
use crate::diagnosis::statistics::{self, fisher_tail};

/// How the mean of a frame depends on its time.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Polynomial in the time over the recording, from −1 to 1, lowest power first.
    Smooth(Vec<f64>),
    /// Before, after, and the first frame after.
    Step([f64; 2], usize),
}

/// A course over the frames, with what it gains.
#[derive(Clone, Debug)]
pub struct Drift {
    pub shape: Shape,
    /// Of the change from the first to the last frame, or of the step.
    pub deviation: f64,
    /// Of the better of two tests, against the scatter of the frames about the shape and against what the body's slow parts
    /// do, corrected for the shapes that were tried.
    pub p_value: f64,
    pub held_out_nats: f64,
    frames: usize,
}

impl Drift {
    /// Its value in a frame.
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

    /// Whether a step may be before a frame as well as after it: between the last training frame before it and the first one after it,
    /// its date is open.
    fn is_open(&self, training: &[usize], frame: usize) -> bool {
        let Shape::Step(_, at) = self.shape else { return false };
        let before = training.iter().copied().filter(|&f| f < at).max().unwrap_or(0);
        let after = training.iter().copied().filter(|&f| f >= at).min().unwrap_or(self.frames);
        before < frame && frame < after
    }

    /// What the training frames say of a frame.
    fn predicted(&self, training: &[usize], frame: usize) -> f64 {
        match self.shape {
            Shape::Step([before, after], _) if self.is_open(training, frame) => 0.5 * (before + after),
            _ => self.value(frame),
        }
    }

    /// With a step's date read from the frames of which it was open as well: only once it is judged without it.
    fn dated(self, series: &Series, training: &[usize]) -> Self {
        let Shape::Step([before, after], at) = self.shape else { return self };
        let late = |frame: usize| {
            let mean = series.mean(frame);
            (mean - after).abs() < (mean - before).abs()
        };
        let date = (0..self.frames).find(|&f| if self.is_open(training, f) { late(f) } else { f >= at }).unwrap_or(at);
        Self { shape: Shape::Step([before, after], date), ..self }
    }
}

fn place(frame: usize, frames: usize) -> f64 {
    2.0 * frame as f64 / (frames.max(2) - 1) as f64 - 1.0
}

/// Highest power of a drift.
const DEGREE: usize = 3;

/// Frame, mean of its chirps, and how sure that is (inverse variance).
type Point = (usize, f64, f64);

fn points(series: &Series, frames: &[usize]) -> Vec<Point> {
    let known = frames.iter().filter(|&&frame| series.weight[frame] > 0.0);
    known.map(|&frame| (frame, series.mean(frame), series.weight[frame] * series.loops as f64)).collect()
}

fn powers(frame: usize, degree: usize, frames: usize) -> DVector<f64> {
    DVector::from_fn(degree + 1, |power, _| place(frame, frames).powi(power as i32))
}

/// Least squares: coefficients, lowest power first, and the normal equations' matrix.
fn polynomial(points: &[Point], degree: usize, frames: usize) -> Option<(DVector<f64>, Cholesky<f64, Dyn>)> {
    let (mut normal, mut right) = (DMatrix::zeros(degree + 1, degree + 1), DVector::zeros(degree + 1));
    for &(frame, value, weight) in points {
        let row = powers(frame, degree, frames);
        right += &row * (weight * value);
        normal += &row * row.transpose() * weight;
    }
    let normal = normal.cholesky()?;
    Some((normal.solve(&right), normal))
}

/// A shape as it fits to some points.
struct Fit {
    shape: Shape,
    misfit: f64,
    /// Parameters beyond the constant.
    freedom: f64,
    /// Of its change.
    variance: f64,
}

impl Fit {
    /// More freedom is paid for (BIC).
    fn price(&self, points: &[Point]) -> f64 {
        self.misfit + self.freedom * (points.len() as f64).ln()
    }
}

fn smooth(points: &[Point], degree: usize, frames: usize) -> Option<Fit> {
    let (c, normal) = polynomial(points, degree, frames)?;
    let misfit = points.iter().map(|(f, v, w)| w * (v - c.dot(&powers(*f, degree, frames))).powi(2)).sum();
    let ends = DVector::from_fn(degree + 1, |power, _| if power % 2 == 1 { 2.0 } else { 0.0 });
    let variance = ends.dot(&normal.solve(&ends));
    Some(Fit { shape: Shape::Smooth(c.iter().copied().collect()), misfit, freedom: degree as f64, variance })
}

/// `at`: the first frame after it. None where a side has too few points.
fn step(points: &[Point], at: usize) -> Option<Fit> {
    let mut sums = [[0.0; 2]; 2];
    for &(frame, value, weight) in points {
        let side = &mut sums[usize::from(frame >= at)];
        side[0] += weight * value;
        side[1] += weight;
    }
    let few = points.iter().filter(|p| p.0 < at).count().min(points.iter().filter(|p| p.0 >= at).count());
    // A date within a gap of the training frames is the same step.
    let repeated = at > 1 && !points.iter().any(|p| p.0 == at - 1);
    if few < 2 || repeated {
        return None;
    }
    let sides = sums.map(|[sum, weight]| sum / weight);
    let misfit = points.iter().map(|(f, v, w)| w * (v - sides[usize::from(*f >= at)]).powi(2)).sum();
    // The date is a parameter too.
    Some(Fit { shape: Shape::Step(sides, at), misfit, freedom: 2.0, variance: 1.0 / sums[0][1] + 1.0 / sums[1][1] })
}

/// The shape that explains the training frames best, more freedom paid for.
///
/// `series`: of `part`, from all ranges.
pub fn best(field: &Field, part: Part, series: &Series, training: &[usize], held_out: &[usize]) -> Option<Drift> {
    let points = points(series, training);
    if points.len() < 5 {
        return None;
    }
    let polynomials = (1..=DEGREE.min(points.len() - 4)).filter_map(|degree| smooth(&points, degree, field.frames));
    let fits: Vec<Fit> = polynomials.chain((1..field.frames).filter_map(|at| step(&points, at))).collect();
    let tried = fits.len() as f64;
    let Fit { shape, misfit, freedom, variance } =
        fits.into_iter().reduce(|best, fit| if fit.price(&points) < best.price(&points) { fit } else { best })?;
    let total: f64 = points.iter().map(|p| p.2).sum();
    let mean = points.iter().map(|p| p.1 * p.2).sum::<f64>() / total;
    let scatter: f64 = points.iter().map(|p| p.2 * (p.1 - mean).powi(2)).sum();
    let explained = (scatter - misfit).max(0.0);
    let freedom_left = (points.len() as f64 - 1.0 - freedom).max(1.0);
    // Frames that scatter by more than the noise (the body's slow parts) make everything less sure.
    let excess = (misfit / freedom_left).max(1.0);
    let own = fisher_tail(explained / freedom / excess, freedom, freedom_left);
    let unlike = unlike_the_body(field, part, &points, training, explained, freedom);
    let p = unlike.map_or(own, |unlike| statistics::corrected(own.min(unlike), 2.0));
    let drift = Drift {
        shape,
        deviation: (variance * excess).sqrt(),
        p_value: statistics::corrected(p, tried),
        held_out_nats: 0.0,
        frames: field.frames,
    };
    let held_out_nats = series.log_likelihood_gain(field, held_out, |frame, _, _| drift.predicted(training, frame)) / excess;
    Some(Drift { held_out_nats, ..drift.dated(series, training) })
}

/// Probability of a drift that moves the training frames' scatter by `scatter` (with `freedom` parameters), were it the body's
/// slow parts: these turn at random in every range, so that they change its gain as much as its phase, and each range
/// otherwise than the next. None where too few ranges are informative.
fn unlike_the_body(field: &Field, part: Part, points: &[Point], training: &[usize], scatter: f64, freedom: f64) -> Option<f64> {
    const FEWEST_RANGES: f64 = 2.0;
    let whole = Slow::fit(points, field.frames)?;
    let of =
        |part: Part, only: usize| Slow::fit(&self::points(&field.series(part, |group| group == only), training), field.frames);
    // Of each static range: what its other component does slowly, and what its own does otherwise than all.
    let odd: Vec<f64> = (0..field.groups.len())
        .filter_map(|only| {
            let (own, other) = (of(part, only)?, of(part.other(), only)?);
            Some(own.distance(&whole.coefficients) + other.distance(&[0.0; DEGREE]))
        })
        .collect();
    let (sum, squares) = (odd.iter().sum::<f64>(), odd.iter().map(|e| e * e).sum::<f64>());
    let effective = sum * sum / squares;
    if effective.is_nan() || effective < FEWEST_RANGES {
        return None;
    }
    let (degree, count) = (DEGREE as f64, odd.len() as f64);
    let usual = (sum / (degree * (2.0 * count - 1.0))).max(1.0);
    Some(fisher_tail(scatter / freedom / usual, freedom, degree * (2.0 * effective - 1.0)))
}

/// What some ranges do slowly in the training frames: a polynomial of degree [`DEGREE`].
struct Slow {
    /// Without the constant.
    coefficients: [f64; DEGREE],
    /// Inverse of their covariance.
    information: DMatrix<f64>,
}

impl Slow {
    fn fit(points: &[Point], frames: usize) -> Option<Self> {
        if points.len() < DEGREE + 3 {
            return None;
        }
        let (solved, normal) = polynomial(points, DEGREE, frames)?;
        let information = normal.inverse().view((1, 1), (DEGREE, DEGREE)).clone_owned().try_inverse()?;
        Some(Self { coefficients: std::array::from_fn(|power| solved[power + 1]), information })
    }

    /// From other coefficients, in squares of standard deviations.
    fn distance(&self, other: &[f64; DEGREE]) -> f64 {
        let apart = DVector::from_fn(DEGREE, |power, _| self.coefficients[power] - other[power]);
        (&self.information * &apart).dot(&apart)
    }
}
