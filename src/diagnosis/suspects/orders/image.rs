//! The image of a static room in an unbalanced quadrature receiver: it turns backwards when all static returns turn.

use std::sync::Arc;

use num_complex::Complex64;

use super::fit::{Fit, against};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::Cube;
use crate::diagnosis::evidence::{Evidence, HANN_LOBE, spectrum};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Volume};
use crate::diagnosis::statistics::DECIBEL;
use crate::diagnosis::suspects::receiver::image::{balanced, imbalance};
use crate::effects::{self, Stage};

/// Orders of the fit: static returns and what turns backwards.
const STATIC: usize = 0;
const BACKWARDS: usize = 2;
/// Beat frequencies next to zero, and their images, belong to offsets and leakage.
const NEAREST: usize = 2 * HANN_LOBE;

pub fn find(evidence: &Evidence, fit: &Fit) -> Option<Candidate> {
    let [_, tx, rx, _, samples] = evidence.cube.dims;
    if evidence.is_real() || samples < 16 * HANN_LOBE || evidence.accepted.contains(&effects::iq_imbalance::ID) {
        return None;
    }
    let of = |order: usize| -> Vec<Vec<Complex64>> { fit.parts[order].iter().map(|part| spectrum(part)).collect() };
    let (parents, images) = (of(STATIC), of(BACKWARDS));
    let error = |channel: usize| evidence.noise()[channel].max(f64::MIN_POSITIVE) / fit.own[channel / rx][BACKWARDS];
    // Of a receiver, at the image's beat frequency or so many bins beside it: the conjugate's coefficient and its weight.
    let coefficient = |receiver: usize, beside: usize| {
        let (mut product, mut weight) = (Complex64::ZERO, 0.0);
        for channel in (0..tx).map(|t| t * rx + receiver) {
            for bin in NEAREST..samples - NEAREST {
                let image = images[channel][(2 * samples - bin + beside) % samples];
                product += parents[channel][bin] * image / error(channel);
                weight += parents[channel][bin].norm_sqr() / error(channel);
            }
        }
        (product / weight.max(f64::MIN_POSITIVE), weight)
    };
    let power = |beside: usize| -> f64 {
        let of_receiver = |receiver| coefficient(receiver, beside);
        (0..rx).map(of_receiver).map(|(mu, weight)| mu.norm_sqr() * weight).sum()
    };
    // What a phase that is not quite known leaves of all returns is beside the images as well as at them.
    let others: Vec<f64> =
        (HANN_LOBE + 1..samples / 4).step_by(HANN_LOBE + 1).flat_map(|q| [power(q), power(samples - q)]).collect();
    let (p_value, excess) = against(power(0), &others, rx);
    let found: Vec<(Complex64, f64)> = (0..rx).map(|receiver| coefficient(receiver, 0)).collect();
    let term: Vec<Vec<Complex64>> = fit.parts[STATIC]
        .iter()
        .enumerate()
        .map(|(channel, part)| part.iter().map(|value| value.conj() * found[channel % rx].0).collect())
        .collect();
    let gain = fit.held_out_gain(evidence, BACKWARDS, &term) / excess;
    if gain <= 0.0 {
        return None;
    }
    Some(candidate(evidence, fit, &found, excess, p_value, gain))
}

/// `found`: coefficient and weight of every receiver; `excess`: of their variance over the noise's.
fn candidate(evidence: &Evidence, fit: &Fit, found: &[(Complex64, f64)], excess: f64, p_value: f64, gain: f64) -> Candidate {
    let rx = found.len();
    let mean =
        found.iter().map(|(mu, weight)| mu * weight).sum::<Complex64>() / found.iter().map(|(_, weight)| weight).sum::<f64>();
    // Receivers differ: one number for all errs by their scatter.
    let scatter = found.iter().map(|(mu, _)| (mu - mean).norm_sqr()).sum::<f64>() / rx as f64;
    let noise = found.iter().map(|(_, weight)| excess / weight).sum::<f64>() / (rx * rx) as f64;
    let deviation = (0.5 * (scatter + noise)).sqrt();
    let (gain_db, phase_deg) = imbalance(mean);
    let levels: Vec<String> = found.iter().map(|(mu, _)| format!("{:.1}", DECIBEL * mu.norm().ln())).collect();
    let coefficients: Vec<Complex64> = found.iter().map(|(mu, _)| *mu).collect();
    let still: f64 = evidence.still().iter().map(|value| value.norm_sqr()).sum();
    let course = fit.course.clone();
    Candidate {
        id: Some(effects::iq_imbalance::ID),
        behaves_like: Behaviour::ConjugateImage,
        estimates: vec![
            Estimate::normal("gain_db", gain_db, 2.0 * DECIBEL * deviation),
            Estimate::normal("phase_deg", phase_deg, (2.0 * deviation).to_degrees()),
        ],
        choice: None,
        place: Place::at(Stage::Receiver),
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "everything has a mirror image at the opposite beat frequency, whose phase is conjugate where all static returns share a phase: {} dB \
             in the {rx} receivers; on their average Q is {gain_db:.2} dB stronger than I and {phase_deg:.2} degrees off the right angle",
            levels.join(", ")
        ),
        curve: None,
        energy: mean.norm_sqr() * still * (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64,
        correction: Correction::Inverse(Arc::new(move |cube| undo(cube, &course.turned, &coefficients)), Volume::BY_SAMPLE),
    }
}

/// In samples in which static returns were turned back.
fn undo(cube: &mut Cube, turned: &[Complex64], coefficients: &[Complex64]) {
    let [_, tx, rx, loops, _] = cube.dims;
    cube.each_chirp(|[frame, channel, index], chirp| {
        let back = turned[frame * tx * loops + channel / rx * loops + index].conj();
        let mu = coefficients[channel % rx] * back * back;
        chirp.iter_mut().for_each(|value| *value = balanced(*value, mu));
    });
}
