//! What turns twice as far as something that moves, at twice its range: its return goes out from the radar once more, and comes back
//! from it a second time.
//!
//! The second harmonic of a receiver has twice the beat frequency and twice the phase, too, but also twice the phase of every receiver
//! against the others, where a second trip has that of one arrival.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::course::{Course, powers};
use crate::diagnosis::detectors::region::{Region, removal};
use crate::diagnosis::detectors::vital::frames::{Frames, frames};
use crate::diagnosis::evidence::{Evidence, hann};
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics::{DECIBEL, UNDECIDED, corrected, fisher_tail};
use crate::effects::{self, Stage};

/// What may lie at twice the range: the second trip, and the harmonic.
const KINDS: [(&str, bool); 2] = [(effects::object_radar_object::ID, false), (effects::second_harmonic::ID, true)];
/// Range bins to each side of twice the range: the mean range of a body that moves is between bins.
const ASIDE: usize = 1;

/// A series over frames along a pattern of the channels, on 1, e^{jφ} and e^{2jφ}.
struct Along {
    bin: usize,
    kind: usize,
    factor: Complex64,
    deviation: f64,
    p_value: f64,
    /// Log-likelihood that order 2 gains.
    gain: f64,
}

pub fn find(evidence: &Evidence, course: &Course, bin: f64, amplitude: &[Complex64]) -> Option<Candidate> {
    if KINDS.iter().any(|(id, _)| evidence.accepted.contains(id)) {
        return None;
    }
    let data = frames(evidence);
    let centre = (2.0 * bin).round() as usize;
    if centre + ASIDE >= data.bins || (centre as f64) < bin + 4.0 {
        return None;
    }
    let bins = centre - ASIDE..=centre + ASIDE;
    let looks = bins.clone().flat_map(|bin| (0..KINDS.len()).map(move |kind| (bin, kind)));
    let tried = looks.clone().count() as f64;
    let all: Vec<Along> =
        looks.filter_map(|(bin, kind)| along(evidence, &data, course, bin, kind, &pattern(amplitude, kind))).collect();
    let strongest = all.iter().max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    // Where receivers do not distinguish the two, the way outside goes first: it needs no receiver that bends all else, too.
    let as_good = all.iter().filter(|other| other.kind == 0 && strongest.gain - other.gain < UNDECIDED);
    let best = as_good.max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap_or(strongest);
    let rival = all.iter().filter(|other| other.kind != best.kind).map(|other| other.gain).fold(f64::NEG_INFINITY, f64::max);
    let gain: f64 = bins.map(|bin| held_out_gain(evidence, &data, course, bin)).sum();
    let look_alikes = if best.gain - rival < UNDECIDED {
        KINDS.iter().map(|kind| kind.0).filter(|id| *id != KINDS[best.kind].0).collect()
    } else {
        vec![]
    };
    Some(candidate(evidence, best, bin, amplitude, (corrected(best.p_value, tried), gain), look_alikes))
}

/// `bin`: range of what moves itself, and its channels' amplitudes.
fn candidate(
    evidence: &Evidence,
    best: &Along,
    bin: f64,
    amplitude: &[Complex64],
    (p_value, gain): (f64, f64),
    look_alikes: Vec<&'static str>,
) -> Candidate {
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = best.bin as f64 * bin_m;
    let level_db = DECIBEL * best.factor.norm().ln();
    // The window's sum, by which amplitudes of samples and of cells differ.
    let sum: f64 = hann(evidence.cube.dims[4]).iter().sum();
    let mean = amplitude.iter().map(|a| a.norm()).sum::<f64>() / (amplitude.len() as f64 * sum);
    let (value, deviation) = (best.factor.norm() / mean * evidence.peak(), best.deviation / mean * evidence.peak());
    let window = |bin: usize| [bin as f64 - 1.5, bin as f64 + 1.5];
    let region = Region { range: window(best.bin), doppler: [-1.0, 1.0] };
    let power: f64 = amplitude.iter().map(|a| a.norm_sqr()).sum();
    let place = Place { range_m: Some(window(best.bin).map(|bin| bin * bin_m)), ..Place::at(Stage::Propagation) };
    Candidate {
        id: Some(KINDS[best.kind].0),
        estimates: vec![if KINDS[best.kind].1 {
            Estimate::normal("level_db", DECIBEL * value.ln(), DECIBEL * deviation / value.max(1e-12))
        } else {
            Estimate::normal("coefficient", value, deviation)
        }],
        look_alikes,
        statement: format!(
            "at {range_m:.2} m, twice the range of what moves at {:.2} m, something turns twice as far as it does, {level_db:.0} dB \
             relative to it: {}",
            bin * bin_m,
            if best.kind == 0 { "its return goes out from the radar a second time" } else { "the receiver's second harmonic" },
        ),
        energy: best.factor.norm_sqr() * power * evidence.cube.chirps(),
        correction: removal(evidence, 1, region),
        ..Candidate::new(Behaviour::PathLike, place, p_value, gain)
    }
}

/// Of the channels, from the amplitudes of what moves itself: those of one arrival, or twice their phases.
fn pattern(amplitude: &[Complex64], kind: usize) -> Vec<Complex64> {
    let of = |a: &Complex64| if KINDS[kind].1 { a * a / a.norm().max(f64::MIN_POSITIVE) } else { *a };
    amplitude.iter().map(of).collect()
}

/// Complex least squares of values on the first orders; none where these are not independent.
fn solve(turned: &[Complex64], values: &[Complex64], count: usize) -> Option<DVector<Complex64>> {
    let rows = DMatrix::from_fn(turned.len(), count, |i, k| powers(turned[i])[k]);
    let adjoint = rows.adjoint();
    let solved = (&adjoint * &rows).lu().solve(&(adjoint * DVector::from_column_slice(values)))?;
    solved.iter().all(|factor| factor.is_finite()).then_some(solved)
}

fn along(evidence: &Evidence, data: &Frames, course: &Course, bin: usize, kind: usize, pattern: &[Complex64]) -> Option<Along> {
    let training = &evidence.split.training;
    let power: f64 = pattern.iter().zip(&data.noise).map(|(a, noise)| a.norm_sqr() / noise).sum();
    let value = |frame: usize| -> Complex64 {
        let sum = pattern.iter().zip(&data.noise).enumerate();
        sum.map(|(c, (a, noise))| a.conj() * data.values[frame][c * data.bins + bin] / noise).sum::<Complex64>() / power
    };
    let values: Vec<Complex64> = training.iter().map(|&frame| value(frame)).collect();
    let turned: Vec<Complex64> = training.iter().map(|&frame| course.turned[frame]).collect();
    let found = solve(&turned, &values, 3)?;
    // Order 2 beside the lower ones.
    let second: Vec<Complex64> = turned.iter().map(|turned| turned * turned).collect();
    let known = solve(&turned, &second, 2)?;
    let beside: Vec<Complex64> =
        turned.iter().zip(&second).map(|(turned, second)| second - known[0] - known[1] * turned).collect();
    let energy: f64 = beside.iter().map(|b| b.norm_sqr()).sum();
    let left = |i: usize, found: &DVector<Complex64>| {
        values[i] - found.iter().zip(powers(turned[i])).map(|(factor, order)| factor * order).sum::<Complex64>()
    };
    let scores: Vec<Complex64> = (0..values.len()).map(|i| left(i, &found) * beside[i].conj()).collect();
    let (variance, freedom) = long_run_variance(&scores);
    let ratio = (found[2].norm() * energy).powi(2) / variance.max(f64::MIN_POSITIVE);
    // In all channels over the noise: what is left without order 2, and what the pattern takes of it.
    let of_channel = |c: usize| Some(left_of_channel(data, training, &turned, c * data.bins + bin)? / data.noise[c]);
    let before = (0..data.noise.len()).map(of_channel).sum::<Option<f64>>()?;
    let after = before - found[2].norm_sqr() * energy * power;
    let floor = (training.len() * data.noise.len()) as f64;
    Some(Along {
        bin,
        kind,
        factor: found[2],
        deviation: (0.5 * variance).sqrt() / energy.max(f64::MIN_POSITIVE),
        p_value: fisher_tail(ratio, 2.0, freedom),
        gain: 0.5 * freedom * (before.max(floor) / after.max(floor)).ln(),
    })
}

/// What a channel holds at a cell beside orders 0 and 1.
fn left_of_channel(data: &Frames, training: &[usize], turned: &[Complex64], cell: usize) -> Option<f64> {
    let values: Vec<Complex64> = training.iter().map(|&frame| data.values[frame][cell]).collect();
    let found = solve(turned, &values, 2)?;
    Some(values.iter().zip(turned).map(|(value, turned)| (value - found[0] - found[1] * turned).norm_sqr()).sum())
}

/// Variance of a sum whose terms are correlated in time, and the degrees of freedom that it is known by: Bartlett's kernel with the
/// bandwidth of a first-order autoregression (Andrews, Heteroskedasticity and autocorrelation consistent covariance matrix estimation,
/// Econometrica 59, 1991).
fn long_run_variance(terms: &[Complex64]) -> (f64, f64) {
    let count = terms.len();
    let covariance = |lag: usize| (lag..count).map(|i| (terms[i] * terms[i - lag].conj()).re).sum::<f64>();
    let all = covariance(0);
    let correlation = (covariance(1) / all.max(f64::MIN_POSITIVE)).clamp(0.0, 0.97);
    let alpha = 4.0 * correlation.powi(2) / (1.0 - correlation.powi(2)).powi(2);
    let width = (1.1447 * (alpha * count as f64).cbrt()).max(1.0);
    let lags = (width.ceil() as usize).min(count - 1);
    let sum: f64 = (1..=lags).map(|lag| (1.0 - lag as f64 / (lags + 1) as f64) * 2.0 * covariance(lag)).sum();
    ((all + sum).max(0.0), 2.0 * count as f64 / (lags + 1) as f64)
}

/// Log-likelihood that held-out frames gain at a range by order 2, each channel with amplitudes of its own from the training frames.
fn held_out_gain(evidence: &Evidence, data: &Frames, course: &Course, bin: usize) -> f64 {
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let turned: Vec<Complex64> = training.iter().map(|&frame| course.turned[frame]).collect();
    let of_channel = |channel: usize| -> Option<f64> {
        let cell = channel * data.bins + bin;
        let values: Vec<Complex64> = training.iter().map(|&frame| data.values[frame][cell]).collect();
        let (with, without) = (solve(&turned, &values, 3)?, solve(&turned, &values, 2)?);
        let left = |frame: usize, found: &DVector<Complex64>| {
            let predicted: Complex64 = found.iter().zip(powers(course.turned[frame])).map(|(factor, order)| factor * order).sum();
            (data.values[frame][cell] - predicted).norm_sqr()
        };
        let variance = training.iter().map(|&frame| left(frame, &with)).sum::<f64>() / training.len() as f64;
        let gains = held_out.iter().map(|&frame| left(frame, &without) - left(frame, &with));
        Some(gains.sum::<f64>() / variance.max(data.noise[channel]))
    };
    (0..data.noise.len()).filter_map(of_channel).sum()
}
