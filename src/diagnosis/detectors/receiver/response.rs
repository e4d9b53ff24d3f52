//! The response of the intermediate frequency to beat frequency: filters and delays.
//!
//! A filter that acts on each chirp of finite length reshapes the tails that the static scene's tones have outside the
//! room's delays: what is measured must lie in H · U, with U the space of the room's tones. No knowledge of the scene
//! inside is needed. A filter that starts from rest leaves a decaying transient at the chirp's beginning instead.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::field::{Field, add, orthonormal};
use super::filters::{SHAPES, Shape, decay};
use super::support::{beat_hz, dot, powers, tone};
use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::climb::golden_section;
use crate::diagnosis::detectors::filter::Filter;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Place, Volume};
use crate::diagnosis::statistics::{UNDECIDED, chi2_tail, corrected, deviation_at_top};
use crate::effects::Stage;

/// Power that a response must let through to be undone in full.
const LEAST_POWER: f64 = 0.25;

/// A response and the log-likelihood that training frames gain by it.
pub struct Found {
    pub candidate: Candidate,
    pub likelihood: f64,
    /// The same of an additive term instead.
    pub additive: f64,
    /// Chance that what it leaves of the static scene is as large, where it is the response: whitened, that is white noise.
    pub chance: f64,
}

/// The best of the library's responses.
///
/// `without`: the mean chirps less an additive term that competes with it.
pub fn find(evidence: &Evidence, field: &Field, without: &[Vec<Complex64>]) -> Option<Found> {
    let search = Search::new(evidence, field);
    // What an additive term would make of the same scene.
    let additive = search.process.likelihood(without, &search.of_mean, None, search.rate) - search.nothing;
    let (best, count) = search.best();
    let &(top, shape, _) = best.first()?;
    if top <= 0.0 {
        return None;
    }
    let p_value = corrected(chi2_tail(2.0 * top, 3.0), count);
    let mut look_alikes: Vec<&'static str> = best
        .iter()
        .filter(|(likelihood, other, _)| top - likelihood < UNDECIDED && other.id() != shape.id())
        .map(|(_, other, _)| other.id())
        .collect();
    look_alikes.dedup();
    let candidate = search.candidate(best[0], p_value, look_alikes);
    let chance = search.process.chance(&field.clutter, &search.of_mean, (shape, best[0].2), search.rate);
    Some(Found { candidate, likelihood: top, additive, chance })
}

/// A shape with its value, after the log-likelihood that it gains.
type Tried = (f64, Shape, f64);

/// Responses by what they make of the mean chirps.
struct Search<'a> {
    evidence: &'a Evidence,
    field: &'a Field,
    process: Process,
    rate: f64,
    /// Variance of the mean chirps, by channel.
    of_mean: Vec<f64>,
    /// Log-likelihood without a response.
    nothing: f64,
}

impl<'a> Search<'a> {
    fn new(evidence: &'a Evidence, field: &'a Field) -> Self {
        let rate = evidence.radar.sample_rate_hz;
        let band = |range: f64| beat_hz(evidence, range) / rate;
        let process = Process::new(field, band(field.support.low_m), band(field.support.high_m));
        let training = evidence.split.training.len() as f64;
        let of_mean: Vec<f64> = field.variance.iter().map(|variance| variance / training).collect();
        let nothing = process.likelihood(&field.clutter, &of_mean, None, rate);
        Self { evidence, field, process, rate, of_mean, nothing }
    }

    fn likelihood(&self, shape: Shape, value: f64) -> f64 {
        self.process.likelihood(&self.field.clutter, &self.of_mean, Some((shape, value)), self.rate) - self.nothing
    }

    /// The best of the most promising shapes, best first, and how many were tried.
    fn best(&self) -> (Vec<Tried>, f64) {
        let (samples, rate) = (self.evidence.cube.dims[4], self.rate);
        let tried: Vec<Tried> = SHAPES
            .iter()
            .filter(|shape| self.evidence.may_name(shape.id()))
            .flat_map(|&shape| shape.grid(samples, rate).into_iter().map(move |value| (shape, value)))
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|(shape, value)| (self.likelihood(shape, value), shape, value))
            .collect();
        // The best grid point of each shape, the promising ones refined.
        let mut best: Vec<Tried> = vec![];
        for shape in SHAPES {
            let of_shape = tried.iter().filter(|(_, s, _)| *s == shape).max_by(|a, b| a.0.total_cmp(&b.0));
            best.extend(of_shape.copied());
        }
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.truncate(3);
        let mut best: Vec<Tried> = best
            .into_par_iter()
            .map(|(_, shape, value)| {
                let value = refine(shape, value, samples, rate, |value| self.likelihood(shape, value));
                (self.likelihood(shape, value), shape, value)
            })
            .collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        (best, tried.len() as f64)
    }

    /// Log-likelihood that the held-out frames gain.
    fn log_likelihood_gain(&self, shape: Shape, value: f64) -> f64 {
        let Self { evidence, field, process, rate, .. } = self;
        let samples = evidence.cube.dims[4];
        let held_out: Vec<Vec<Complex64>> =
            evidence.cube.clutter(field.held_out()).chunks_exact(samples).map(<[Complex64]>::to_vec).collect();
        let of_held_out: Vec<f64> =
            field.variance.iter().map(|variance| variance / field.held_out().len().max(1) as f64).collect();
        process.likelihood(&held_out, &of_held_out, Some((shape, value)), *rate)
            - process.likelihood(&held_out, &of_held_out, None, *rate)
    }

    /// Standard deviation of a value, by the likelihood's curvature there.
    fn deviation(&self, (top, shape, value): Tried) -> f64 {
        let deviation = deviation_at_top(|value| self.likelihood(shape, value), value, top, 0.01 * value.abs());
        deviation.map_or(0.1 * value.abs(), |deviation| deviation.max(2e-3 * value.abs()))
    }

    fn candidate(&self, best: Tried, p_value: f64, look_alikes: Vec<&'static str>) -> Candidate {
        let (evidence, field, (_, shape, value)) = (self.evidence, self.field, best);
        let (estimates, statement) = shape.described(value, self.deviation(best));
        let response = shape.response(value, evidence.cube.dims[4], self.rate);
        let (fitted, clutter) = restored(field, shape, value, self.rate);
        let energy = field
            .clutter
            .iter()
            .zip(&clutter)
            .map(|(found, clean)| found.iter().zip(clean).map(|(a, b)| (a - b).norm_sqr()).sum::<f64>())
            .sum::<f64>()
            * evidence.cube.chirps();
        let place = Place::at(Stage::Receiver);
        Candidate {
            id: Some(shape.id()),
            estimates,
            look_alikes,
            statement,
            curve: Some(curve(&response, self.rate)),
            energy,
            correction: undo(&response, fitted, clutter),
            ..Candidate::new(Behaviour::BeatFrequencyGain, place, p_value, self.log_likelihood_gain(shape, value))
        }
    }
}

fn curve(response: &[Complex64], rate: f64) -> Curve {
    let (samples, half) = (response.len(), response.len() / 2);
    let hertz: Vec<f64> = (0..half).map(|bin| bin as f64 * rate / samples as f64).collect();
    let decibels = (0..half).map(|bin| 20.0 * response[bin].norm().max(1e-6).log10()).collect();
    Curve::new("Response of the intermediate frequency", ["beat frequency, Hz", "gain, dB"], [("fitted", hertz, decibels)])
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
        let samples = field.clutter[0].len();
        let long = 2 * samples;
        let mut density = vec![0.0; long];
        for chirp in &field.clutter {
            density.iter_mut().zip(powers(chirp, 2)).for_each(|(sum, power)| *sum += power / field.clutter.len() as f64);
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
        self.whitened(chirps, variance, shape, rate)
            .map_or(f64::NEG_INFINITY, |(energy, log_determinant)| -energy - chirps.len() as f64 * log_determinant)
    }

    /// Chance that whitened chirps have as much energy or more: half of a χ² of two degrees of freedom for each sample.
    fn chance(&self, chirps: &[Vec<Complex64>], variance: &[f64], shape: (Shape, f64), rate: f64) -> f64 {
        let freedom = (2 * chirps.len() * self.samples) as f64;
        self.whitened(chirps, variance, Some(shape), rate).map_or(0.0, |(energy, _)| chi2_tail(2.0 * energy, freedom))
    }

    /// Energy of the chirps once they are white behind a response, and the log-determinant of a chirp's covariance.
    fn whitened(
        &self,
        chirps: &[Vec<Complex64>],
        variance: &[f64],
        shape: Option<(Shape, f64)>,
        rate: f64,
    ) -> Option<(f64, f64)> {
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
        let factor = covariance.cholesky()?;
        let lower = factor.l_dirty();
        let log_determinant: f64 = (0..samples).map(|n| 2.0 * lower[(n, n)].re.max(1e-300).ln()).sum();
        let lower = factor.l();
        let energy = |chirp: &Vec<Complex64>| {
            let whitened = lower.solve_lower_triangular(&DVector::from_column_slice(chirp));
            whitened.unwrap_or_else(|| DVector::zeros(samples)).norm_squared()
        };
        Some((chirps.iter().map(energy).sum(), log_determinant))
    }
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

/// The mean chirps as the response leaves them, and as they were before it, `[channel][sample]` each.
fn restored(field: &Field, shape: Shape, value: f64, rate: f64) -> (Vec<Vec<Complex64>>, Vec<Vec<Complex64>>) {
    let columns = space(field, shape, value, rate);
    let inside = &field.support.inside;
    let samples = inside[0].len();
    let decomposed = DMatrix::from_fn(samples, columns.len(), |row, column| columns[column][row]).svd(true, true);
    let cut = 1e-3 * decomposed.singular_values.max();
    let mut fitted = vec![];
    let mut before = vec![];
    for chirp in &field.clutter {
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

/// Moving parts are amplified back where the response is not too weak; static clutter is replaced by its fit.
fn undo(response: &[Complex64], fitted: Vec<Vec<Complex64>>, clutter: Vec<Vec<Complex64>>) -> Correction {
    // Where hardly anything comes through, the inverse would raise nothing but noise: it falls off instead.
    let inverse: Vec<Complex64> = response.iter().map(|h| h.conj() / h.norm_sqr().max(LEAST_POWER)).collect();
    let filter = Filter::new(&inverse);
    let stretched = inverse.iter().map(|h| h.norm_sqr().max(f64::MIN_POSITIVE).ln()).sum::<f64>() / inverse.len().max(1) as f64;
    Correction::inverse(Volume { alike: stretched, ..Volume::KEPT }, move |cube| {
        cube.each_chirp(|[_, channel, _], chirp| {
            chirp.iter_mut().zip(&fitted[channel]).for_each(|(value, fitted)| *value -= fitted);
            filter.apply(chirp);
            chirp.iter_mut().zip(&clutter[channel]).for_each(|(value, clutter)| *value += clutter);
        });
    })
}

/// The maximum between the grid's neighbours.
fn refine(shape: Shape, at: f64, samples: usize, rate: f64, value: impl Fn(f64) -> f64) -> f64 {
    let grid = shape.grid(samples, rate);
    let index = grid.iter().position(|&point| point == at).unwrap_or(0);
    golden_section([grid[index.saturating_sub(1)], grid[(index + 1).min(grid.len() - 1)]], 11, value)
}
