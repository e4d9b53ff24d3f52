//! The image of an unbalanced quadrature receiver: s + μ s*, with μ the same for everything at any time.
//!
//! What moves far enough has its mirror image, −beat frequency and −Doppler, in cells where nothing else is. There, the
//! conjugate of the parent cell predicts amplitude and phase of the image but for one complex number.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::support::beat_hz;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::beat::{LOBE, empty_bins};
use crate::diagnosis::evidence::spectrum;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Volume};
use crate::diagnosis::statistics::{DECIBEL, chi2_tail, corrected};
use crate::diagnosis::{Cube, Evidence};
use crate::effects::{self, Stage};

/// Power of a parent over the noise.
const STRONG: f64 = 100.0;
/// Power that is left in the image's cells, over the noise's, from which on the image must be most of what is in them.
const CROWDED: f64 = 1.5;
/// Σ conj(parent)* · image, Σ |parent|² and Σ |image|² of a frame over the noise.
#[derive(Clone, Copy, Default)]
struct Sums {
    cross: Complex64,
    parent: f64,
    image: f64,
    cells: usize,
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    // Products of the signal are undone roughly: what they leave has images too.
    let settled =
        evidence.accepted.contains(&effects::iq_imbalance::ID) || evidence.accepted_unnamed.contains(&Behaviour::Quadratic);
    if evidence.is_real() || settled {
        return vec![];
    }
    let frames = evidence.cube.dims[0];
    let sums: Vec<Vec<Sums>> = (0..frames).into_par_iter().map(|frame| of_frame(evidence, frame)).collect();
    let over = |frames: &[usize]| {
        frames.iter().flat_map(|&frame| &sums[frame]).fold(Sums::default(), |a, b| Sums {
            cross: a.cross + b.cross,
            parent: a.parent + b.parent,
            image: a.image + b.image,
            cells: a.cells + b.cells,
        })
    };
    let training = over(&evidence.split.training);
    if training.cells < 8 || training.parent <= 0.0 {
        return vec![];
    }
    let mu = training.cross / training.parent;
    // Neighbouring cells of a windowed map share their noise: the variance is that of white noise times the window's
    // equivalent noise bandwidth in both axes, and more where other things lie in the image's cells.
    let rest = (training.image - mu.norm_sqr() * training.parent) / training.cells as f64;
    // What is there besides may have made the image, too: a receiver that is not linear has images that are none.
    let explained = mu.norm_sqr() * training.parent / (training.image - training.cells as f64).max(1.0);
    if rest > CROWDED && explained < 0.5 {
        return vec![];
    }
    let widening = 1.5 * 1.5 * rest.max(1.0);
    let variance = widening / training.parent;
    let p_value = corrected(chi2_tail(2.0 * mu.norm_sqr() / variance, 2.0), 1.0);
    let held_out = over(&evidence.split.held_out);
    let gain = (2.0 * (mu.conj() * held_out.cross).re - mu.norm_sqr() * held_out.parent) / widening;
    // The same number must come from every receiver: a chance image is not.
    if gain <= 0.0 || !agree(&sums, &evidence.split.training, mu, variance) {
        return vec![];
    }
    let scatter = jackknife(&sums, &evidence.split.training).max(variance.sqrt());
    vec![candidate(evidence, mu, scatter, p_value, gain)]
}

/// `scatter`: standard deviation of μ.
fn candidate(evidence: &Evidence, mu: Complex64, scatter: f64, p_value: f64, gain: f64) -> Candidate {
    let (gain_db, phase_deg) = imbalance(mu);
    let db_error = DECIBEL * 2.0 * scatter / std::f64::consts::SQRT_2;
    let degree_error = (2.0 * scatter / std::f64::consts::SQRT_2).to_degrees();
    let total: f64 = evidence.cube.samples.iter().map(Complex64::norm_sqr).sum();
    Candidate {
        id: Some(effects::iq_imbalance::ID),
        behaves_like: Behaviour::ConjugateImage,
        estimates: vec![Estimate::normal("gain_db", gain_db, db_error), Estimate::normal("phase_deg", phase_deg, degree_error)],
        choice: None,
        place: Place::at(Stage::Receiver),
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "everything has a mirror image at the opposite beat frequency and velocity, {:.1} dB below it: the quadrature \
             receiver's Q is {gain_db:.2} dB stronger than its I and {phase_deg:.2} degrees off the right angle",
            -20.0 * mu.norm().log10()
        ),
        curve: None,
        energy: total * mu.norm_sqr(),
        correction: undo(mu),
    }
}

/// Strong parents whose image falls where neither body nor room can be, by channel.
fn of_frame(evidence: &Evidence, frame: usize) -> Vec<Sums> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let empty = empty_bins(evidence);
    // A leakage or an offset is no parent: its own tail reaches its image's cells.
    let near = (beat_hz(evidence, 0.5) / evidence.radar.sample_rate_hz * samples as f64).ceil() as usize + LOBE;
    let still = evidence.cube.still(&[frame]);
    (0..evidence.cube.channels())
        .map(|channel| {
            let map = evidence.range_doppler(frame, channel);
            let noise = evidence.noise()[channel].max(1e-300);
            let mut sums = Sums::default();
            for doppler in 0..loops {
                for range in 0..samples {
                    let parent = map[doppler * samples + range];
                    let mirrored = (samples - range) % samples;
                    if parent.norm_sqr() < STRONG * noise || !empty[mirrored] || empty[range] || range < near {
                        continue;
                    }
                    // The windows are symmetric about the middle of the chirp, not about its first sample: the image of a
                    // cell is the conjugate of the transform at the negative frequencies, exactly.
                    let image = map[(loops - doppler) % loops * samples + mirrored];
                    sums.cross += parent * image / noise;
                    sums.parent += parent.norm_sqr() / noise;
                    sums.image += image.norm_sqr() / noise;
                    sums.cells += 1;
                }
            }
            let noise = noise / loops as f64;
            let spectrum = spectrum(&still[channel * samples..][..samples]);
            for range in 0..samples {
                let (parent, mirrored) = (spectrum[range], (samples - range) % samples);
                if parent.norm_sqr() > STRONG * noise && empty[mirrored] && !empty[range] && range >= near {
                    let image = spectrum[mirrored];
                    sums.cross += parent * image / noise;
                    sums.parent += parent.norm_sqr() / noise;
                    sums.image += image.norm_sqr() / noise;
                    sums.cells += 1;
                }
            }
            sums
        })
        .collect()
}

/// Whether the channels' own estimates are compatible with one μ.
fn agree(sums: &[Vec<Sums>], training: &[usize], mu: Complex64, variance: f64) -> bool {
    let channels = sums[0].len();
    (0..channels).all(|channel| {
        let (cross, parent) = training.iter().fold((Complex64::ZERO, 0.0), |(cross, parent), &frame| {
            (cross + sums[frame][channel].cross, parent + sums[frame][channel].parent)
        });
        parent <= 0.0 || (cross / parent - mu).norm() < 0.5 * mu.norm() + 6.0 * (variance * channels as f64).sqrt()
    })
}

/// Standard deviation of μ, from leaving frames out.
fn jackknife(sums: &[Vec<Sums>], training: &[usize]) -> f64 {
    let of = |frame: usize| sums[frame].iter().fold((Complex64::ZERO, 0.0), |(c, p), s| (c + s.cross, p + s.parent));
    let all = training.iter().map(|&frame| of(frame)).fold((Complex64::ZERO, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    let count = training.len() as f64;
    let whole = all.0 / all.1;
    let spread: f64 = training
        .iter()
        .map(|&frame| of(frame))
        .filter(|(_, parent)| all.1 - parent > 0.0)
        .map(|(cross, parent)| ((all.0 - cross) / (all.1 - parent) - whole).norm_sqr())
        .sum();
    (spread * (count - 1.0) / count).sqrt()
}

/// Gain of Q over I in decibels and error of their right angle in degrees.
pub fn imbalance(mu: Complex64) -> (f64, f64) {
    // I + jQ' with Q' = g (Q cos φ + I sin φ) is (1 + x*) / 2 s + (1 − x) / 2 s* with x = g e^{−jφ}, so that the image over
    // its parent's conjugate is μ = (1 − x) / (1 + x).
    let x = (Complex64::ONE - mu) / (Complex64::ONE + mu);
    (20.0 * x.norm().log10(), -x.arg().to_degrees())
}

/// s = (y − μ y*) / (1 − |μ|²).
pub fn balanced(value: Complex64, mu: Complex64) -> Complex64 {
    (value - mu * value.conj()) * (1.0 - mu.norm_sqr()).recip()
}

fn undo(mu: Complex64) -> Correction {
    let undo = move |cube: &mut Cube| {
        cube.each_chirp(|_, chirp| chirp.iter_mut().for_each(|value| *value = balanced(*value, mu)));
    };
    Correction::Inverse(Arc::new(undo), Volume::BY_SAMPLE)
}
