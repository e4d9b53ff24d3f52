//! What is added behind the mixer: a constant of each receiver, which does not turn when all static returns do.
//!
//! A leakage over the board may not turn either. It has a delay, though, of the way between the nearest antennas at least: where the
//! beat frequency of what does not turn is surely lower than that, it is a constant.

use num_complex::Complex64;

use super::fit::{Fit, against};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::Cube;
use crate::diagnosis::detectors::receiver::zero_beat::ZeroBeat;
use crate::diagnosis::evidence::{Evidence, HANN_LOBE, spectrum};
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place};
use crate::effects::{self, Stage};

pub fn find(evidence: &Evidence, fit: &Fit) -> Option<Candidate> {
    let [frames, tx, rx, loops, samples] = evidence.cube.dims;
    if evidence.is_real() || samples < 8 * HANN_LOBE || !evidence.may_name(effects::dc_offset::ID) {
        return None;
    }
    let spectra: Vec<Vec<Complex64>> = fit.added.iter().map(|part| spectrum(part)).collect();
    let error = |channel: usize| evidence.noise()[channel].max(f64::MIN_POSITIVE) / fit.own[channel / rx];
    let power = |bin: usize| (0..tx * rx).map(|c| spectra[c][bin].norm_sqr() / error(c)).sum::<f64>();
    let others: Vec<f64> = (2 * HANN_LOBE..samples - 2 * HANN_LOBE).step_by(HANN_LOBE + 1).map(power).collect();
    let (p_value, excess) = against(power(0), &others, tx * rx);
    let means = |channel: usize| fit.added[channel].iter().sum::<Complex64>() / samples as f64;
    let offsets: Vec<Complex64> = (0..rx).map(|r| (0..tx).map(|t| means(t * rx + r)).sum::<Complex64>() / tx as f64).collect();
    // Errors as what is left says, which is more than the noise.
    let deviation = |r: usize| (0.5 * excess * error(r) / (samples * tx) as f64).sqrt();
    let term: Vec<Vec<Complex64>> = (0..tx * rx).map(|channel| vec![offsets[channel % rx]; samples]).collect();
    let nats = fit.held_out_gain(evidence, &term) / excess;
    let beat = ZeroBeat::new(evidence, &fit.added, |channel| excess * error(channel));
    // Neither by its frequency: something else that does not turn.
    if nats <= 0.0 || !beat.may_be_constant() {
        return None;
    }
    let parts = |part: fn(&Complex64) -> f64| -> Vec<f64> { offsets.iter().map(part).collect() };
    let deviations: Vec<f64> = (0..rx).map(deviation).collect();
    let course = fit.course.clone();
    let constant = offsets.clone();
    let place = Place { range_m: Some([0.0, 0.0]), ..Place::at(Stage::Receiver) };
    Some(Candidate {
        id: Some(effects::dc_offset::ID),
        estimates: vec![Estimate::list("i", &parts(|d| d.re), &deviations), Estimate::list("q", &parts(|d| d.im), &deviations)],
        look_alikes: if beat.may_be_leakage() { vec![effects::tx_leakage::ID] } else { vec![] },
        statement: format!(
            "a constant of {} codes is added to every sample of the {rx} receivers: it does not turn when all static returns do",
            offsets.iter().map(|d| format!("{:.1}", d.norm())).collect::<Vec<_>>().join(", ")
        ),
        energy: offsets.iter().map(|d| d.norm_sqr()).sum::<f64>() * (frames * tx * loops * samples) as f64,
        correction: Correction::samples(move |cube| subtract(cube, &course.turned, &constant)),
        ..Candidate::new(Behaviour::AdditiveFastTime, place, p_value, nats)
    })
}

/// Takes the constants out of samples in which static returns were turned back.
fn subtract(cube: &mut Cube, turned: &[Complex64], offsets: &[Complex64]) {
    let [_, tx, rx, loops, _] = cube.dims;
    cube.each_chirp(|[frame, channel, index], chirp| {
        let value = offsets[channel % rx] * turned[frame * tx * loops + channel / rx * loops + index].conj();
        chirp.iter_mut().for_each(|sample| *sample -= value);
    });
}
