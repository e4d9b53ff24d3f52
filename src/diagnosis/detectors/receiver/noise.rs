//! Noise that is not white over beat frequency, or not independent between receivers.
//!
//! Read from cells where neither room nor body can be; low quantiles and a bound on power keep movers out.

use nalgebra::DMatrix;
use num_complex::Complex64;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::coloured::coloured;
use super::shares::Shares;
use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::folds;
use crate::diagnosis::evidence::beat::{empty_bins, quiet_bins, ranges_m};
use crate::diagnosis::evidence::{hann, transform_under};
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::effects::{self, Stage};

/// A cell's power over the noise, beyond which it is a mover's.
const MOVER: f64 = 8.0;

/// Cells of a map under one Hann window per independent product of two receivers' noise: neighbours in range are correlated by 2/3
/// and 1/6, and their products by the square of that.
const PER_PRODUCT: f64 = 35.0 / 18.0;

/// Least correlation: far below a hundredth it does not matter, and the tails of movers begin to count.
const LEAST_RHO: f64 = 0.005;

/// Cells that are looked at.
struct Cells {
    /// Windows' maps, `[channel][cell]`.
    values: Vec<Vec<Complex64>>,
    /// Beat-frequency bin and Doppler row, `[cell]`.
    places: Vec<[usize; 2]>,
}

/// Candidates for coloured noise and for noise that receivers share, one of either at most. None with too few empty beat
/// frequencies or fewer than 16 loops.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let empty = if ranges_m(evidence).is_some() { empty_bins(evidence) } else { quiet_bins(evidence) };
    let samples = evidence.cube.dims[4];
    let bins: Vec<usize> = (2..samples - 1).filter(|&bin| empty[bin]).collect();
    if bins.len() < 8 || evidence.cube.dims[3] < 16 {
        return vec![];
    }
    let filtered = [effects::if_highpass::ID, effects::if_lowpass::ID, effects::coloured_noise::ID]
        .iter()
        .any(|id| evidence.accepted.contains(id));
    let colour = if filtered { None } else { coloured(evidence, &bins) };
    // Receivers that were uncoupled again share the noise that each of them had for itself, and what an ADC that clips
    // cut off bursts and peaks is the same in all of them.
    let known = [effects::correlated_noise::ID, effects::mutual_coupling::ID, effects::adc_saturation::ID]
        .iter()
        .any(|id| evidence.accepted.contains(id))
        || evidence.accepted_unnamed.contains(&Behaviour::NoiseSharedByReceivers);
    let correlation = if known { None } else { correlated(evidence, &bins) };
    colour.into_iter().chain(correlation).collect()
}

/// Whitened by each channel's own power; cells with a mover in any channel are left out.
fn cells(evidence: &Evidence, frame: usize, bins: &[usize]) -> Cells {
    let [_, _, rx, loops, samples] = evidence.cube.dims;
    // Where nothing is, nothing leaks over Doppler: all chirps count alike.
    let (slow, fast) = (vec![1.0 / (loops as f64).sqrt(); loops], hann(samples));
    let maps: Vec<Vec<Complex64>> =
        (0..rx).map(|channel| transform_under(&evidence.moving(frame, channel), &slow, &fast)).collect();
    let mut cells = Cells { values: vec![vec![]; rx], places: vec![] };
    for &bin in bins {
        for doppler in 3..loops - 2 {
            let at = doppler * samples + bin;
            let ordinary = (0..rx).all(|c| maps[c][at].norm_sqr() < MOVER * evidence.noise()[c]);
            if ordinary {
                (0..rx).for_each(|c| cells.values[c].push(maps[c][at] / evidence.noise()[c].max(1e-300).sqrt()));
                cells.places.push([bin, doppler]);
            }
        }
    }
    cells
}

/// Level of the test for a correlation that is the same in all frames; customary (Fisher 1925).
const SIGNIFICANCE: f64 = 0.05;

/// What every Doppler row, beat frequency and frame has of a correlation between the receivers.
fn shares(evidence: &Evidence, bins: &[usize], found: &DMatrix<Complex64>) -> Shares<3> {
    let [frames, _, rx, loops, samples] = evidence.cube.dims;
    let pairs: Vec<(usize, usize)> = pairs_of(rx).collect();
    let whole: f64 = pairs.iter().map(|&pair| found[pair].norm_sqr()).sum();
    let mut shares = Shares::new([samples, loops, frames]);
    for &frame in &evidence.split.training {
        let cells = cells(evidence, frame, bins);
        for (cell, &[bin, row]) in cells.places.iter().enumerate() {
            let value = |c: usize| cells.values[c][cell];
            let along: f64 = pairs.iter().map(|&(a, b)| (found[(a, b)].conj() * value(a) * value(b).conj()).re).sum();
            shares.add([bin, row, frame], along, whole);
        }
    }
    shares
}

/// Squared coherence, over pairs of receivers, of a correlation with that of static clutter: phase noise turns all returns, so that its
/// products are theirs.
fn of_clutter(evidence: &Evidence, found: &DMatrix<Complex64>) -> f64 {
    let [_, _, rx, _, samples] = evidence.cube.dims;
    // One pair has the phase of anything.
    if rx < 3 {
        return 0.0;
    }
    let chirp = |channel: usize| evidence.clutter()[channel * samples..][..samples].iter();
    let product = |(a, b): (usize, usize)| -> Complex64 { chirp(a).zip(chirp(b)).map(|(a, b)| a * b.conj()).sum() };
    let (mut shared, mut own, mut theirs) = (Complex64::ZERO, 0.0, 0.0);
    for pair in pairs_of(rx) {
        let clutter = product(pair);
        shared += found[pair] * clutter.conj();
        own += found[pair].norm_sqr();
        theirs += clutter.norm_sqr();
    }
    shared.re.max(0.0).powi(2) / (own * theirs).max(f64::MIN_POSITIVE)
}

/// What receivers share, summed over cells.
struct Shared {
    /// Products of every two, the second one conjugated.
    products: DMatrix<Complex64>,
    cells: f64,
}

impl Shared {
    fn none(receivers: usize) -> Self {
        Self { products: DMatrix::zeros(receivers, receivers), cells: 0.0 }
    }

    fn of(evidence: &Evidence, frame: usize, bins: &[usize]) -> Self {
        let values = cells(evidence, frame, bins).values;
        let product = |a: usize, b: usize| values[a].iter().zip(&values[b]).map(|(a, b)| a * b.conj()).sum();
        Self { products: DMatrix::from_fn(values.len(), values.len(), product), cells: values[0].len() as f64 }
    }

    fn and(self, other: &Self) -> Self {
        Self { products: self.products + &other.products, cells: self.cells + other.cells }
    }

    fn independent(&self) -> f64 {
        self.cells / PER_PRODUCT
    }

    /// Root mean square of every receiver.
    fn scales(&self) -> Vec<f64> {
        (0..self.products.nrows()).map(|rx| (self.products[(rx, rx)].re / self.cells.max(1.0)).max(1e-300).sqrt()).collect()
    }

    fn correlations(&self, scales: &[f64]) -> DMatrix<Complex64> {
        let receivers = self.products.nrows();
        DMatrix::from_fn(receivers, receivers, |a, b| self.products[(a, b)] / (self.cells.max(1.0) * scales[a] * scales[b]))
    }

    /// Log-likelihood that other cells gain by correlations, beside these powers alone; `alike`: the same one in all pairs.
    fn gain(&self, others: &Self, alike: bool) -> Option<f64> {
        let scales = self.scales();
        let (own, seen) = (self.correlations(&scales), others.correlations(&scales));
        let expected = if alike { equal(own.nrows(), mean_correlation(&own)) } else { own };
        let determinant = expected.determinant().re;
        let inverse = expected.try_inverse()?;
        (determinant > 0.0).then(|| others.independent() * (seen.trace().re - (inverse * seen).trace().re - determinant.ln()))
    }
}

fn pairs_of(receivers: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..receivers).flat_map(|a| (0..a).map(move |b| (a, b)))
}

/// Mean over pairs of receivers; what is common to all of them is real.
fn mean_correlation(correlations: &DMatrix<Complex64>) -> f64 {
    let receivers = correlations.nrows();
    pairs_of(receivers).map(|pair| correlations[pair].re).sum::<f64>() / pairs_of(receivers).count().max(1) as f64
}

/// One and the same correlation between any two.
fn equal(receivers: usize, rho: f64) -> DMatrix<Complex64> {
    DMatrix::from_fn(receivers, receivers, |a, b| Complex64::from(if a == b { 1.0 } else { rho }))
}

/// A correlation of receivers that is significant.
struct Correlation {
    /// The same one in all pairs, or the root mean square of several.
    alike: bool,
    rho: f64,
    p_value: f64,
    /// Number of products that it was estimated from.
    products: f64,
    found: DMatrix<Complex64>,
}

impl Correlation {
    /// Any correlation of any two; or that of noise from one place, such as a supply, which is the same in all receivers: one number.
    fn of(training: &Shared, rx: usize) -> Option<Self> {
        let found = training.correlations(&training.scales());
        let independent = training.independent();
        let pairs = (rx * (rx - 1) / 2) as f64;
        let total: f64 = pairs_of(rx).map(|pair| found[pair].norm_sqr()).sum();
        let mean = mean_correlation(&found);
        let chances =
            [chi2_tail(2.0 * independent * total, 2.0 * pairs), Normal::standard().sf(mean * (2.0 * independent * pairs).sqrt())];
        let alike = chances[1] < chances[0];
        let p_value = corrected(chances[0].min(chances[1]), 2.0);
        // Of what is found, chance has its share.
        let rho = if alike { mean } else { (total / pairs - 1.0 / independent).max(0.0).sqrt() };
        if p_value > 1e-3 || rho < LEAST_RHO {
            return None;
        }
        Some(Self { alike, rho, p_value, products: independent * pairs, found })
    }

    fn expected(&self) -> DMatrix<Complex64> {
        if self.alike { equal(self.found.nrows(), self.rho) } else { self.found.clone() }
    }
}

fn correlated(evidence: &Evidence, bins: &[usize]) -> Option<Candidate> {
    let rx = evidence.cube.dims[2];
    if rx < 2 {
        return None;
    }
    let of_frames: Vec<Shared> =
        (0..evidence.cube.dims[0]).into_par_iter().map(|frame| Shared::of(evidence, frame, bins)).collect();
    let sum = |frames: &[usize]| frames.iter().fold(Shared::none(rx), |sum, &frame| sum.and(&of_frames[frame]));
    let training = sum(&evidence.split.training);
    if training.cells < 100.0 {
        return None;
    }
    let correlation = Correlation::of(&training, rx)?;
    let shares = shares(evidence, bins, &correlation.expected());
    if !shares.are_everywhere() {
        return None;
    }
    // Bursts differ from frame to frame.
    let is_steady = shares.chance_of_level(2, PER_PRODUCT) > SIGNIFICANCE;
    // Few held-out frames say little of so many numbers: every frame is predicted by those of the other folds.
    let nats: f64 = folds(of_frames.len())
        .map(|parts| {
            let [rest, fold] = parts.map(|frames| sum(&frames));
            rest.gain(&fold, correlation.alike).unwrap_or(f64::NEG_INFINITY)
        })
        .sum();
    Some(shared_noise(evidence, &correlation, nats, is_steady))
}

fn shared_noise(evidence: &Evidence, correlation: &Correlation, nats: f64, is_steady: bool) -> Candidate {
    let &Correlation { alike, rho, p_value, products, .. } = correlation;
    let error = (2.0 * products).sqrt().recip() + 0.02 * rho;
    let over = if alike { "mean" } else { "root mean square" };
    let noise = evidence.mean_noise();
    // That receivers share something is observed; the library says what.
    let id = evidence.info(effects::correlated_noise::ID).map(|info| info.id).filter(|_| is_steady);
    let turns = id.is_some() && of_clutter(evidence, &correlation.found) > 0.5;
    Candidate {
        id,
        estimates: id.map(|_| Estimate::normal("rho", rho, error)).into_iter().collect(),
        look_alikes: turns.then_some(effects::phase_noise::ID).into_iter().collect(),
        statement: format!(
            "the receivers' noise is not independent: where nothing is, they agree with a correlation of {rho:.3} ({over} \
             over pairs), like a target in one fixed direction in every cell{}",
            if is_steady { "" } else { "; more in some frames than in others, as noise does not" }
        ),
        energy: rho * noise * evidence.cube.samples.len() as f64,
        ..Candidate::new(Behaviour::NoiseSharedByReceivers, Place::at(Stage::Noise), p_value, nats)
    }
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
