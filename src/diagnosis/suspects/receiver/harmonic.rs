//! Non-linear receivers: the second harmonic s + κ s² and compression s − κ |s|² s (cards R5, R4).
//!
//! What was measured is the best prediction of what drives them: its square and its cube are transformed like the signal
//! itself, and in cells where neither room nor body can be, one complex number must relate the two everywhere.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::image::empty_bins;
use crate::diagnosis::denoised;
use crate::diagnosis::evidence::{spectrum, transform};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Rung};
use crate::diagnosis::statistics::{chi2_tail, corrected};
use crate::diagnosis::{Cube, Evidence};

#[derive(Clone, Copy, Default)]
struct Sums {
    cross: Complex64,
    template: f64,
    found: f64,
    cells: usize,
}

/// A product of the signal with itself.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Product {
    /// s²
    Square,
    /// |s|²
    Magnitude,
    /// |s|² s
    Cube,
}

impl Product {
    fn of(self, value: Complex64) -> Complex64 {
        match self {
            Self::Square => value * value,
            Self::Magnitude => value.norm_sqr().into(),
            Self::Cube => value * value.norm_sqr(),
        }
    }

    /// For factors that are shares of the peak sample.
    fn scale(self, peak: f64) -> f64 {
        if self == Self::Cube { 1.0 / (peak * peak) } else { 1.0 / peak }
    }
}

/// How much of a product is in the recording.
#[derive(Clone, Copy)]
struct Law {
    product: Product,
    kappa: Complex64,
    /// Of κ, complex.
    scatter: f64,
    p_value: f64,
    /// Of held-out frames.
    gain: f64,
    peak: f64,
}

/// A magnitude squared at least this large beside a square makes it no harmonic.
const BESIDE: f64 = 0.3;
/// Least gain on held-out frames for it, nats.
const LEAST_GAIN: f64 = 20.0;
/// Chance below which it is there.
const SURELY: f64 = 1e-6;

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.is_real() || evidence.accepted.contains(&"adc_saturation") {
        return vec![];
    }
    if let Some(laws) = mixed(evidence) {
        return if evidence.accepted.contains(&QUADRATIC) { vec![] } else { vec![nameless(evidence, laws)] };
    }
    let known = |id: &str| evidence.accepted.contains(&id);
    let square = (!known("second_harmonic") && !known(QUADRATIC)).then(|| tested(evidence, Product::Square));
    let cube = (!known("compression")).then(|| tested(evidence, Product::Cube));
    square.into_iter().chain(cube).flatten().map(|law| candidate(evidence, law)).collect()
}

pub const QUADRATIC: &str = "quadratic in the signal";

/// Square and magnitude squared, if the latter is there and nearly as large: no mere second harmonic and no second trip.
/// An oscillator that the signal pulls does it, or mixers whose I and Q are bent each on its own.
fn mixed(evidence: &Evidence) -> Option<Vec<Law>> {
    let magnitude = tested(evidence, Product::Magnitude).filter(|law| law.p_value < SURELY && law.gain > LEAST_GAIN)?;
    // A receiver that compresses leaves a little of it too.
    if tested(evidence, Product::Cube).is_some_and(|cube| cube.gain > magnitude.gain) {
        return None;
    }
    let square = tested(evidence, Product::Square).filter(|law| law.p_value < SURELY);
    let beside = square.is_none_or(|square| magnitude.kappa.norm() > BESIDE * square.kappa.norm());
    beside.then(|| square.into_iter().chain([magnitude]).collect())
}

/// Whether products of the signal with its own conjugate are there: then nothing that stands still, and no tone, can be
/// told from such a product.
pub fn is_mixed(evidence: &Evidence) -> bool {
    !evidence.is_real() && mixed(evidence).is_some()
}

/// None where it is not to be expected, or held-out frames are worse with it.
fn tested(evidence: &Evidence, product: Product) -> Option<Law> {
    let empty = empty_bins(evidence);
    if !empty.contains(&true) {
        return None;
    }
    let frames = evidence.cube.dims[0];
    let peak = evidence.cube.samples.iter().map(Complex64::norm_sqr).fold(0.0, f64::max).sqrt();
    if peak <= 0.0 {
        return None;
    }
    let sums: Vec<Sums> = (0..frames).into_par_iter().map(|frame| of_frame(evidence, frame, &empty, product, peak)).collect();
    let over = |frames: &[usize]| {
        frames.iter().fold(Sums::default(), |a, &frame| Sums {
            cross: a.cross + sums[frame].cross,
            template: a.template + sums[frame].template,
            found: a.found + sums[frame].found,
            cells: a.cells + sums[frame].cells,
        })
    };
    let training = over(&evidence.split.training);
    if training.template <= 0.0 {
        return None;
    }
    let kappa = training.cross / training.template;
    let rest = (training.found - kappa.norm_sqr() * training.template) / training.cells.max(1) as f64;
    // Windowed neighbours share their noise; other things in the cells count as more of it.
    let widening = 2.25 * rest.max(1.0);
    let variance = widening / training.template;
    // Frames must agree on it as well as the noise lets expect.
    let scatter = jackknife(&sums, &evidence.split.training).max(variance.sqrt());
    let p_value = corrected(chi2_tail(2.0 * kappa.norm_sqr() / (scatter * scatter), 2.0), 2.0);
    let held_out = over(&evidence.split.held_out);
    let gain = (2.0 * (kappa.conj() * held_out.cross).re - kappa.norm_sqr() * held_out.template) / widening;
    // A receiver that expands instead of compressing, or turns phases more than amplitudes, is none.
    let possible = gain > 0.0 && !(product == Product::Cube && kappa.re > 0.0);
    possible.then_some(Law { product, kappa, scatter, p_value, gain, peak })
}

fn candidate(evidence: &Evidence, law: Law) -> Candidate {
    let Law { product, kappa, scatter, .. } = law;
    let level = kappa.norm();
    let level_db = 20.0 * level.log10();
    let (id, estimate, statement) = if product == Product::Cube {
        (
            "compression",
            Estimate::normal("level", -kappa.re, 0.71 * scatter),
            format!(
                "strong samples come out too small: the receiver compresses, the strongest sample by {:.2} %; its third-order \
                 products lie where neither the room nor the body can be",
                -100.0 * kappa.re
            ),
        )
    } else {
        (
            "second_harmonic",
            Estimate::normal("level_db", level_db, 8.7 * 0.71 * scatter / level),
            format!(
                "everything has a second harmonic, at twice its beat frequency and velocity: {level_db:.1} dB at the strongest \
                 sample; it follows the square of the measured signal in phase"
            ),
        )
    };
    Candidate { id: Some(id), estimates: vec![estimate], ..nonlinear(evidence, "non-linear", vec![law], statement) }
}

fn nameless(evidence: &Evidence, laws: Vec<Law>) -> Candidate {
    let level = |product: Product| {
        let law = laws.iter().find(|law| law.product == product);
        law.map_or("not seen".into(), |law| format!("{:.1} dB at the strongest sample", 20.0 * law.kappa.norm().log10()))
    };
    let statement = format!(
        "products of the signal with itself lie where neither the room nor the body can be, at differences of beat frequencies \
         and velocities ({}) and at sums ({}): more than a second harmonic; something that the whole signal drives, such as \
         an oscillator that it pulls",
        level(Product::Magnitude),
        level(Product::Square)
    );
    nonlinear(evidence, QUADRATIC, laws, statement)
}

/// Without a name.
fn nonlinear(evidence: &Evidence, behaves_like: &'static str, laws: Vec<Law>, statement: String) -> Candidate {
    let (p_value, gain) = (laws.iter().map(|law| law.p_value).fold(1.0, f64::min), laws.iter().map(|law| law.gain).sum());
    let distortion = move |value: Complex64| -> Complex64 {
        laws.iter().map(|law| law.kappa * law.product.scale(law.peak) * law.product.of(value)).sum()
    };
    let energy = evidence.cube.samples.iter().map(|value| distortion(*value).norm_sqr()).sum();
    Candidate {
        id: None,
        behaves_like,
        estimates: vec![],
        choice: None,
        place: Place::at("receiver"),
        p_value,
        gain,
        rung: Rung::F,
        look_alikes: vec![],
        statement,
        curve: None,
        energy,
        correction: Correction::Samples(Arc::new(move |cube: &mut Cube| {
            cube.each_chirp(|_, chirp| {
                chirp.iter_mut().for_each(|value| {
                    let found = *value;
                    // The distortion of the undistorted signal: two steps are enough for what is small.
                    let first = found - distortion(found);
                    *value = found - distortion(first);
                });
            });
        })),
    }
}

/// Templates are scaled by the peak sample, so that κ is a share of it.
fn of_frame(evidence: &Evidence, frame: usize, empty: &[bool], product: Product, peak: f64) -> Sums {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let scale = product.scale(peak);
    let mut sums = Sums::default();
    for channel in 0..evidence.cube.channels() {
        let noise = evidence.noise()[channel].max(1e-300);
        let signal = evidence.cube.channel(frame, channel);
        let clean = denoised::channel(evidence, frame, channel);
        let mut template: Vec<Complex64> = clean.iter().map(|value| product.of(*value) * scale).collect();
        let mut mean = vec![Complex64::ZERO; samples];
        let mut still = vec![Complex64::ZERO; samples];
        for (template, chirp) in template.chunks_exact(samples).zip(signal.chunks_exact(samples)) {
            mean.iter_mut().zip(template).for_each(|(sum, value)| *sum += value / loops as f64);
            still.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value / loops as f64);
        }
        for chirp in template.chunks_exact_mut(samples) {
            chirp.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
        }
        let moving: Vec<Complex64> = signal.iter().enumerate().map(|(i, value)| value - still[i % samples]).collect();
        let (found, expected) = (transform(&moving, samples), transform(&template, samples));
        let (still, mean) = (spectrum(&still), spectrum(&mean));
        let mut count = |found: Complex64, expected: Complex64, noise: f64| {
            // Strangers far above what could be predicted are left out by a bound on their say.
            let bounded = found * (6.0 * (noise + 0.01 * expected.norm_sqr()).sqrt() / found.norm().max(1e-300)).min(1.0);
            sums.cross += expected.conj() * bounded / noise;
            sums.template += expected.norm_sqr() / noise;
            sums.found += bounded.norm_sqr() / noise;
            sums.cells += 1;
        };
        for range in (0..samples).filter(|&range| empty[range]) {
            for doppler in 1..loops {
                count(found[doppler * samples + range], expected[doppler * samples + range], noise);
            }
            // An offset or a leakage is near zero; what stands still elsewhere counts.
            if range > 8 && range + 8 < samples {
                count(still[range], mean[range], noise / loops as f64);
            }
        }
    }
    sums
}

fn jackknife(sums: &[Sums], training: &[usize]) -> f64 {
    let all = training.iter().fold((Complex64::ZERO, 0.0), |a, &f| (a.0 + sums[f].cross, a.1 + sums[f].template));
    let count = training.len() as f64;
    let spread: f64 = training
        .iter()
        .filter(|&&f| all.1 > sums[f].template)
        .map(|&f| ((all.0 - sums[f].cross) / (all.1 - sums[f].template) - all.0 / all.1).norm_sqr())
        .sum();
    (spread * (count - 1.0) / count).sqrt()
}
