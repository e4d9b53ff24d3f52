//! A transient at a chirp's edge that dwarfs the whole chirp, where the room is unknown or the samples have no quadrature.

use nalgebra::DVector;
use num_complex::Complex64;

use super::additive_term::{self, added, counted, digits, gain};
use super::support::beat_hz;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place};
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::tones::tones;
use crate::diagnosis::{Evidence, denoised};
use crate::effects::{self, Stage};

/// Power of a transient over the strongest sample between the edges.
const WILD: f64 = 4.0;
/// And over its neighbour's, where a leakage was taken away: what the fit of that leaves at the edges rises slowly.
const ABRUPT: f64 = 10.0;
/// A leakage's cluster of returns ends here.
pub const NEAR_M: f64 = 0.3;
/// Share of the largest singular value below which a direction is left out.
const SINGULAR: f64 = 1e-8;

/// `clutter`: mean chirps, `[channel][sample]`.
pub fn edge(evidence: &Evidence, clutter: &[Vec<Complex64>], at_end: bool) -> Option<Candidate> {
    // What was taken out of some ranges is taken out poorly at the edges, and what dwarfs a chirp is found before.
    if !evidence.emptied.is_empty() {
        return None;
    }
    let samples = evidence.cube.dims[4];
    let power = powers(evidence, clutter);
    let between = &power[samples / 8..samples - samples / 8];
    let (largest, mean) = (between.iter().fold(0.0f64, |a, &b| a.max(b)), between.iter().sum::<f64>() / between.len() as f64);
    let at = |i: usize| if at_end { samples - 1 - i } else { i };
    let count = (0..samples / 8).rev().find(|&i| power[at(i)] > WILD * largest)? + 1;
    if evidence.accepted.contains(&effects::tx_leakage::ID) && power[at(count - 1)] < ABRUPT * power[at(count)] {
        return None;
    }
    let wildest = (0..count).map(|i| power[at(i)]).fold(0.0, f64::max);
    let affected = additive_term::edge(samples, count, at_end);
    if !stood_out(evidence, &affected) {
        return None;
    }
    let term: Vec<Vec<Complex64>> = clutter
        .iter()
        .map(|chirp| (0..samples).map(|n| if affected.contains(&n) { chirp[n] } else { Complex64::ZERO }).collect())
        .collect();
    let peak = denoised::peak_beside(evidence, |_, n| (!affected.contains(&n)).then_some(Complex64::ZERO));
    let level_db = 20.0 * (wildest.sqrt() / peak.max(1e-300)).log10();
    let (number, words) = counted(count, at_end);
    let p_value = corrected((-wildest / mean.max(1e-300)).exp(), samples as f64);
    let place = Place { samples: Some(affected.clone().collect()), ..Place::at(Stage::Receiver) };
    let nats = gain(evidence, &term);
    Some(Candidate {
        id: Some(effects::ramp_edge_transient::ID),
        estimates: vec![number, Estimate::normal("level_db", level_db, 8.7 * (mean / wildest).sqrt() + 0.3)],
        statement: format!(
            "{words} of every chirp jump{} to {} codes, {:.0} dB above the strongest sample in between, \
             in all channels: the ADC runs into the {} of the ramp",
            if count == 1 { "s" } else { "" },
            digits(wildest.sqrt()),
            10.0 * (wildest / largest).log10(),
            if at_end { "end" } else { "beginning" },
        ),
        // They change from chirp to chirp too and hold nothing that can be used.
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|_, chirp| chirp[affected.clone()].fill(Complex64::ZERO));
        }),
        ..added(evidence, term, place, p_value, nats)
    })
}

/// What was sampled of a value: the rest of an analytic signal says nothing of the edges.
fn sampled(evidence: &Evidence, value: Complex64) -> Complex64 {
    if evidence.is_real() { value.re.into() } else { value }
}

/// Of a sample, mean over the channels.
fn powers(evidence: &Evidence, chirps: &[Vec<Complex64>]) -> Vec<f64> {
    let samples = evidence.cube.dims[4];
    // Without quadrature a constant is no transient.
    let centre = |chirp: &Vec<Complex64>| {
        if evidence.is_real() { chirp.iter().sum::<Complex64>() / samples as f64 } else { Complex64::ZERO }
    };
    let centred: Vec<(&Vec<Complex64>, Complex64)> = chirps.iter().map(|chirp| (chirp, centre(chirp))).collect();
    let of_sample = |n: usize| centred.iter().map(|(chirp, centre)| sampled(evidence, chirp[n] - centre).norm_sqr()).sum::<f64>();
    (0..samples).map(|n| of_sample(n) / chirps.len() as f64).collect()
}

/// Whether some samples stood out before a leakage was subtracted, the fit of which is poor at the edges: they are off what all tones of
/// near returns, fitted to the other samples, predict of them (least squares; the variance of a prediction is `1 + h`, of leverage `h`).
fn stood_out(evidence: &Evidence, affected: &std::ops::Range<usize>) -> bool {
    if evidence.subtracted.is_none() {
        return true;
    }
    let samples = evidence.cube.dims[4];
    let end = beat_hz(evidence, NEAR_M) / evidence.radar.sample_rate_hz * samples as f64;
    let basis = tones(samples, [if evidence.is_real() { -end } else { 0.0 }, end]);
    let others: Vec<usize> = (0..samples).filter(|n| !affected.contains(n)).collect();
    if 2 * basis.ncols() > others.len() {
        return false;
    }
    let fitted = basis.select_rows(&others).svd(true, true);
    let least = SINGULAR * fitted.singular_values.max();
    let Ok(inverse) = fitted.pseudo_inverse(least) else { return false };
    let predict = basis * inverse;
    let standing: Vec<Complex64> = evidence.standing().iter().map(|value| sampled(evidence, *value)).collect();
    let left: Vec<Vec<Complex64>> = standing
        .chunks_exact(samples)
        .map(|chirp| {
            let known = DVector::from_iterator(others.len(), others.iter().map(|&n| chirp[n]));
            chirp.iter().zip(&(&predict * known)).map(|(value, expected)| value - expected).collect()
        })
        .collect();
    let power = |n: usize| left.iter().map(|chirp| chirp[n].norm_sqr()).sum::<f64>();
    let largest = (samples / 8..samples - samples / 8).map(power).fold(0.0, f64::max);
    let mut affected = affected.clone();
    affected.any(|n| power(n) > WILD * largest * (1.0 + predict.row(n).norm_squared()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::{Radar, Sampling};

    /// A leakage of half a turn in a chirp, a far return, and what is added to the first samples; the leakage subtracted as a fit leaves it
    /// whose edges are poor: by so much of it at the first sample, and less and less at the next ones.
    fn left(added: f64, poor: f64) -> Evidence {
        let radar = Radar { samples_per_chirp: 128, sampling: Sampling::Real, ..Radar::small(8) };
        let leakage = |n: usize| 200.0 * (TAU * 0.5 * n as f64 / 128.0 + 0.3).cos();
        let evidence = Evidence::in_noise(radar, 4, |[_, _, _, n]| {
            let far = 10.0 * (TAU * 30.0 * n as f64 / 128.0).cos();
            (leakage(n) + far + if n < 2 { added } else { 0.0 }).into()
        });
        let fit: Vec<Complex64> = (0..128).map(|n| (leakage(n) * (1.0 - poor * (-(n as f64) / 0.3).exp())).into()).collect();
        let channels = evidence.cube.channels();
        let mut after = evidence.changed();
        after.cube.each_chirp(|_, chirp| chirp.iter_mut().zip(&fit).for_each(|(value, fit)| *value -= fit));
        after.accepted.push(effects::tx_leakage::ID);
        after.subtracted = Some(fit.repeat(channels).into());
        after
    }

    #[test]
    fn a_transient_was_there_before_the_leakage_was_subtracted() {
        let found = |added: f64, poor: f64| {
            let evidence = left(added, poor);
            let clutter: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(128).map(<[Complex64]>::to_vec).collect();
            edge(&evidence, &clutter, false)
        };
        assert!(found(300.0, 0.0).is_some());
        assert!(found(0.0, 0.5).is_none(), "{:?}", found(0.0, 0.5));
        assert!(found(0.0, 0.0).is_none());
    }
}
