//! The response of the intermediate frequency to beat frequency: filters and delays.
//!
//! A filter that acts on each chirp of finite length reshapes the tails that the static scene's tones have outside the
//! room's delays: what is measured must lie in H · U, with U the space of the room's tones. No knowledge of the scene
//! inside is needed. A filter that starts from rest leaves a decaying transient at the chirp's beginning instead.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::field::{Field, add, orthonormal};
use super::support::{beat_hz, dot, tone};
use crate::diagnosis::evidence::hann;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, Place, Volume};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::diagnosis::{Cube, Evidence};

/// Hypotheses within this many nats of the best are indistinguishable from it.
const INDISTINGUISHABLE: f64 = 4.6;
/// Power that a response must let through to be undone in full.
const LEAST_POWER: f64 = 0.25;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// `wrapped`: beat frequencies above half the sample rate count as negative.
    Highpass {
        order: i32,
        from_rest: bool,
        wrapped: bool,
    },
    Lowpass {
        wrapped: bool,
    },
    Delay {
        wrapped: bool,
    },
}

impl Shape {
    fn id(self) -> &'static str {
        match self {
            Self::Highpass { .. } => "if_highpass",
            Self::Lowpass { .. } => "if_lowpass",
            Self::Delay { .. } => "if_delay",
        }
    }

    /// Response over the DFT's bins; `value` in hertz, or seconds for a delay.
    fn response(self, value: f64, samples: usize, rate: f64) -> Vec<Complex64> {
        let one = Complex64::ONE;
        let hertz = |bin: usize, wrapped: bool| {
            let bin = if wrapped && 2 * bin >= samples { bin as f64 - samples as f64 } else { bin as f64 };
            bin * rate / samples as f64
        };
        (0..samples)
            .map(|bin| match self {
                Self::Highpass { order, wrapped, .. } => {
                    let ratio = Complex64::I * (hertz(bin, wrapped) / value);
                    (ratio / (one + ratio)).powi(order)
                }
                Self::Lowpass { wrapped } => one / (one + Complex64::I * (hertz(bin, wrapped) / value)),
                Self::Delay { wrapped } => Complex64::cis(-TAU * hertz(bin, wrapped) * value),
            })
            .collect()
    }

    fn grid(self, samples: usize, rate: f64) -> Vec<f64> {
        let geometric = |low: f64, high: f64, count: usize| {
            (0..count).map(move |i| low * (high / low).powf(i as f64 / (count as f64 - 1.0))).collect::<Vec<_>>()
        };
        match self {
            Self::Highpass { .. } => geometric(0.4 * rate / samples as f64, 0.25 * rate, 9),
            Self::Lowpass { .. } => geometric(0.15 * rate, 20.0 * rate, 6),
            Self::Delay { .. } => (-4..=4).filter(|&i| i != 0).map(|i| 0.4 * f64::from(i) / rate).collect(),
        }
    }
}

const SHAPES: [Shape; 13] = [
    Shape::Highpass { order: 1, from_rest: false, wrapped: true },
    Shape::Highpass { order: 2, from_rest: false, wrapped: true },
    Shape::Highpass { order: 3, from_rest: false, wrapped: true },
    Shape::Highpass { order: 1, from_rest: false, wrapped: false },
    Shape::Highpass { order: 2, from_rest: false, wrapped: false },
    Shape::Highpass { order: 3, from_rest: false, wrapped: false },
    Shape::Highpass { order: 1, from_rest: true, wrapped: true },
    Shape::Highpass { order: 2, from_rest: true, wrapped: true },
    Shape::Highpass { order: 3, from_rest: true, wrapped: true },
    Shape::Lowpass { wrapped: true },
    Shape::Lowpass { wrapped: false },
    Shape::Delay { wrapped: true },
    Shape::Delay { wrapped: false },
];

/// A response and the log-likelihood that training frames gain by it.
pub struct Found {
    pub candidate: Candidate,
    pub likelihood: f64,
    /// The same of an additive term instead.
    pub additive: f64,
}

/// The best of the library's responses.
///
/// `without`: the still chirps less an additive term that competes with it.
pub fn find(evidence: &Evidence, field: &Field, without: &[Vec<Complex64>]) -> Option<Found> {
    let samples = evidence.cube.dims[4];
    let rate = evidence.radar.sample_rate_hz;
    let band = |range: f64| beat_hz(evidence, range) / rate;
    let process = Process::new(field, band(field.support.low_m), band(field.support.high_m));
    let training = evidence.split.training.len() as f64;
    let of_mean: Vec<f64> = field.variance.iter().map(|variance| variance / training).collect();
    let nothing = process.likelihood(&field.still, &of_mean, None, rate);
    // What an additive term would make of the same scene.
    let additive = process.likelihood(without, &of_mean, None, rate) - nothing;
    let likelihood = |shape: Shape, value: f64| process.likelihood(&field.still, &of_mean, Some((shape, value)), rate) - nothing;
    let tried: Vec<(f64, Shape, f64)> = SHAPES
        .iter()
        .filter(|shape| !evidence.accepted.contains(&shape.id()))
        .flat_map(|&shape| shape.grid(samples, rate).into_iter().map(move |value| (shape, value)))
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(shape, value)| (likelihood(shape, value), shape, value))
        .collect();
    let count = tried.len() as f64;
    // The best grid point of each shape, the promising ones refined.
    let mut best: Vec<(f64, Shape, f64)> = vec![];
    for shape in SHAPES {
        let of_shape = tried.iter().filter(|(_, s, _)| *s == shape).max_by(|a, b| a.0.total_cmp(&b.0));
        best.extend(of_shape.copied());
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(3);
    let mut best: Vec<(f64, Shape, f64)> = best
        .into_par_iter()
        .map(|(_, shape, value)| {
            let value = refine(shape, value, samples, rate, |value| likelihood(shape, value));
            (likelihood(shape, value), shape, value)
        })
        .collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    let &(top, shape, value) = best.first()?;
    if top <= 0.0 {
        return None;
    }
    let p_value = corrected(chi2_tail(2.0 * top, 3.0), count);
    let held_out: Vec<Vec<Complex64>> =
        evidence.cube.still(field.held_out()).chunks_exact(samples).map(<[Complex64]>::to_vec).collect();
    let of_held_out: Vec<f64> = field.variance.iter().map(|variance| variance / field.held_out().len().max(1) as f64).collect();
    let gain = process.likelihood(&held_out, &of_held_out, Some((shape, value)), rate)
        - process.likelihood(&held_out, &of_held_out, None, rate);
    let step = 0.01 * value.abs();
    let curvature = (2.0 * top - likelihood(shape, value + step) - likelihood(shape, value - step)) / (step * step);
    let error = if curvature > 0.0 { curvature.recip().sqrt().max(2e-3 * value.abs()) } else { 0.1 * value.abs() };
    let mut look_alikes: Vec<&'static str> = best
        .iter()
        .filter(|(likelihood, other, _)| top - likelihood < INDISTINGUISHABLE && other.id() != shape.id())
        .map(|(_, other, _)| other.id())
        .collect();
    look_alikes.dedup();
    let (estimates, statement) = described(shape, value, error);
    let response = shape.response(value, samples, rate);
    let (fitted, still) = restored(field, shape, value, rate);
    let energy = field
        .still
        .iter()
        .zip(&still)
        .map(|(found, clean)| found.iter().zip(clean).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>())
        .sum::<f64>()
        * (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64;
    let half = samples / 2;
    let hertz: Vec<f64> = (0..half).map(|bin| bin as f64 * rate / samples as f64).collect();
    let decibels = (0..half).map(|bin| 20.0 * response[bin].norm().max(1e-6).log10()).collect();
    let candidate = Candidate {
        id: Some(shape.id()),
        behaves_like: "beat-frequency gain",
        estimates,
        choice: None,
        place: Place::at("receiver"),
        p_value,
        gain,
        errs_alike: false,
        look_alikes,
        statement,
        curve: Some(Curve {
            title: "Response of the intermediate frequency".into(),
            x_label: "beat frequency, Hz".into(),
            y_label: "gain, dB".into(),
            series: vec![("fitted".into(), hertz, decibels)],
        }),
        energy,
        correction: undo(&response, fitted, still),
    };
    Some(Found { candidate, likelihood: top, additive })
}

fn described(shape: Shape, value: f64, error: f64) -> (Vec<Estimate>, String) {
    match shape {
        Shape::Highpass { order, from_rest, .. } => (
            vec![
                Estimate::normal("corner_hz", value, error),
                Estimate { name: "order", values: vec![order.into()], ci90: vec![[f64::from(order), f64::from(order)]] },
            ],
            format!(
                "the receiver weakens and turns low beat frequencies: a high-pass filter of order {order} with its corner at \
                 {:.0} kHz{}; near ranges appear too weak",
                value * 1e-3,
                if from_rest { ", which starts from rest in each chirp and leaves a transient" } else { "" }
            ),
        ),
        Shape::Lowpass { .. } => (
            vec![Estimate::normal("corner_hz", value, error)],
            format!(
                "the receiver weakens and delays high beat frequencies: a low-pass filter with its corner at {:.2} MHz",
                value * 1e-6
            ),
        ),
        Shape::Delay { .. } => (
            vec![Estimate::normal("delay_s", value, error)],
            format!("the intermediate frequency reaches the converter {:.1} ns late", value * 1e9),
        ),
    }
}

/// The static scene as a Gaussian process: tones over the room's delays with the density that is measured.
///
/// A response that takes tails away is seen by their absence, which needs how strong they should have been.
struct Process {
    /// Beat frequencies in turns per sample and the measured density there.
    tones: Vec<(f64, f64)>,
    samples: usize,
}

impl Process {
    fn new(field: &Field, low: f64, high: f64) -> Self {
        let samples = field.still[0].len();
        let window = hann(samples);
        let long = 2 * samples;
        let mut density = vec![0.0; long];
        for chirp in &field.still {
            let mut padded = vec![Complex64::ZERO; long];
            (0..samples).for_each(|n| padded[n] = chirp[n] * window[n]);
            FftPlanner::new().plan_fft_forward(long).process(&mut padded);
            density.iter_mut().zip(&padded).for_each(|(sum, value)| *sum += value.norm_sqr() / field.still.len() as f64);
        }
        let noise = field.variance.iter().sum::<f64>() / field.variance.len() as f64;
        let (first, last) = ((low * long as f64).floor() as usize, (high * long as f64).ceil() as usize);
        let tones = (first..=last)
            .map(|bin| {
                // A few neighbours, since a density is a mean.
                let sum: f64 = (0..5).map(|i| density[(bin + long + i - 2) % long]).sum();
                // White noise of unit variance has the density 1: half of it per tone, which are half a bin apart.
                (bin as f64 / long as f64, 0.5 * (sum / 5.0).max(1e-3 * noise) / samples as f64)
            })
            .collect();
        Self { tones, samples }
    }

    /// Log-likelihood of chirps, of a variance of the noise each, behind a response.
    fn likelihood(&self, chirps: &[Vec<Complex64>], variance: &[f64], shape: Option<(Shape, f64)>, rate: f64) -> f64 {
        let samples = self.samples;
        let noise = variance.iter().sum::<f64>() / variance.len() as f64;
        let mut columns: Vec<Vec<Complex64>> = self
            .tones
            .iter()
            .map(|&(turns, density)| {
                let mut column = tone(turns, samples);
                column.iter_mut().for_each(|value| *value *= density.sqrt());
                column
            })
            .collect();
        match shape {
            Some((Shape::Highpass { order, from_rest: true, .. }, value)) => {
                let power: f64 = self.tones.iter().map(|(_, density)| density).sum();
                columns.extend((0..order).map(|exponent| decay(value / rate, exponent, samples, power.sqrt())));
            }
            Some((shape, value)) => {
                let response = shape.response(value, samples, rate);
                let filter = Filter::new(&response);
                for (column, &(turns, _)) in columns.iter_mut().zip(&self.tones) {
                    filter.apply(column);
                    // The measured density already has the response in it.
                    let at = response[(turns * samples as f64).round() as usize % samples].norm().max(0.05);
                    column.iter_mut().for_each(|value| *value /= at);
                }
            }
            None => {}
        }
        let rows: Vec<Vec<Complex64>> =
            (0..samples).map(|row| columns.iter().map(|column| column[row].conj()).collect()).collect();
        // Only the lower triangle is read.
        let mut covariance = DMatrix::zeros(samples, samples);
        for row in 0..samples {
            for column in 0..=row {
                covariance[(row, column)] = dot(&rows[row], &rows[column]);
            }
            covariance[(row, row)] += Complex64::from(noise);
        }
        let Some(factor) = covariance.cholesky() else { return f64::NEG_INFINITY };
        let lower = factor.l_dirty();
        let log_determinant: f64 = (0..samples).map(|n| 2.0 * lower[(n, n)].re.max(1e-300).ln()).sum();
        chirps
            .iter()
            .map(|chirp| {
                let chirp = DVector::from_column_slice(chirp);
                let whitened = factor.l().solve_lower_triangular(&chirp).unwrap_or_else(|| DVector::zeros(samples));
                -whitened.norm_squared() - log_determinant
            })
            .sum()
    }
}

fn decay(turns_per_sample: f64, power: i32, samples: usize, amplitude: f64) -> Vec<Complex64> {
    (0..samples)
        .map(|n| {
            let turns = turns_per_sample * n as f64;
            Complex64::from(amplitude * (TAU * turns).powi(power) * (-TAU * turns).exp())
        })
        .collect()
}

/// What the static scene can look like behind the response.
fn space(field: &Field, shape: Shape, value: f64, rate: f64) -> Vec<Vec<Complex64>> {
    let inside = &field.support.inside;
    let samples = inside[0].len();
    if let Shape::Highpass { order, from_rest: true, .. } = shape {
        let transients = (0..order).map(|power| decay(value / rate, power, samples, 1.0));
        return inside.iter().cloned().chain(transients).collect();
    }
    let filter = Filter::new(&shape.response(value, samples, rate));
    inside
        .iter()
        .map(|direction| {
            let mut chirp = direction.clone();
            filter.apply(&mut chirp);
            chirp
        })
        .collect()
}

/// The still chirps as the response leaves them, and as they were before it, `[channel][sample]` each.
fn restored(field: &Field, shape: Shape, value: f64, rate: f64) -> (Vec<Vec<Complex64>>, Vec<Vec<Complex64>>) {
    let columns = space(field, shape, value, rate);
    let inside = &field.support.inside;
    let samples = inside[0].len();
    let decomposed = DMatrix::from_fn(samples, columns.len(), |row, column| columns[column][row]).svd(true, true);
    let cut = 1e-3 * decomposed.singular_values.max();
    let mut fitted = vec![];
    let mut before = vec![];
    for chirp in &field.still {
        let solved = decomposed.solve(&DVector::from_column_slice(chirp), cut).unwrap_or_else(|_| DVector::zeros(columns.len()));
        let mut behind = vec![Complex64::ZERO; samples];
        let mut clean = vec![Complex64::ZERO; samples];
        columns.iter().zip(solved.iter()).for_each(|(column, amplitude)| add(&mut behind, column, *amplitude));
        inside.iter().zip(solved.iter()).for_each(|(column, amplitude)| add(&mut clean, column, *amplitude));
        // What a truncated solution misses outside the room's delays is no scene either.
        let basis = orthonormal(&columns);
        let mut all = vec![Complex64::ZERO; samples];
        basis.iter().for_each(|direction| add(&mut all, direction, dot(direction, chirp)));
        fitted.push(all);
        before.push(clean);
    }
    (fitted, before)
}

/// Moving parts are amplified back where the response is not too weak; the still part is replaced by its fit.
fn undo(response: &[Complex64], fitted: Vec<Vec<Complex64>>, still: Vec<Vec<Complex64>>) -> Correction {
    // Where hardly anything comes through, the inverse would raise nothing but noise: it falls off instead.
    let inverse: Vec<Complex64> = response.iter().map(|h| h.conj() / h.norm_sqr().max(LEAST_POWER)).collect();
    let filter = Filter::new(&inverse);
    let stretched = inverse.iter().map(|h| h.norm_sqr().max(f64::MIN_POSITIVE).ln()).sum::<f64>() / inverse.len().max(1) as f64;
    Correction::Inverse(
        Arc::new(move |cube: &mut Cube| {
            cube.each_chirp(|[_, channel, _], chirp| {
                chirp.iter_mut().zip(&fitted[channel]).for_each(|(value, fitted)| *value -= fitted);
                filter.apply(chirp);
                chirp.iter_mut().zip(&still[channel]).for_each(|(value, still)| *value += still);
            });
        }),
        Volume { alike: stretched, ..Volume::KEPT },
    )
}

/// A multiplication of a chirp's DFT.
struct Filter {
    response: Vec<Complex64>,
    forward: Arc<dyn rustfft::Fft<f64>>,
    inverse: Arc<dyn rustfft::Fft<f64>>,
}

impl Filter {
    fn new(response: &[Complex64]) -> Self {
        let mut planner = FftPlanner::new();
        let samples = response.len();
        Self {
            response: response.iter().map(|h| h / samples as f64).collect(),
            forward: planner.plan_fft_forward(samples),
            inverse: planner.plan_fft_inverse(samples),
        }
    }

    fn apply(&self, chirp: &mut [Complex64]) {
        self.forward.process(chirp);
        chirp.iter_mut().zip(&self.response).for_each(|(value, h)| *value *= h);
        self.inverse.process(chirp);
    }
}

/// Golden-section search between the grid's neighbours.
fn refine(shape: Shape, at: f64, samples: usize, rate: f64, value: impl Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_895;
    let grid = shape.grid(samples, rate);
    let index = grid.iter().position(|&point| point == at).unwrap_or(0);
    let (mut low, mut high) = (grid[index.saturating_sub(1)], grid[(index + 1).min(grid.len() - 1)]);
    for _ in 0..11 {
        let (a, b) = (high - RATIO * (high - low), low + RATIO * (high - low));
        if value(a) > value(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
