//! One score test for every effect of the library whose operator acts on the summed signal: a new effect is one file in `effects`.
//!
//! With the clean signal ŝ, the operator E of the library and its amplitudes θ, zero where the effect is absent, a recording is
//! y = ŝ + Σ θ_j J_j + n, J_j = ∂E_θ(ŝ)/∂θ_j at θ = 0. In cells of range and Doppler the score and the information of θ are
//!
//!   U_j = Σ 2 Re(J_j* y) / C,   I_jk = Σ 2 Re(J_j* J_k) / C
//!
//! (Rao 1948), over the cells in which ŝ itself says nothing (`cells.rs`), with C the power that is left there. θ̂ = I⁻¹ U; what is
//! significant is refined by Gauss-Newton steps through the operator (`fit.rs`) and held against the same pattern elsewhere (`shifted.rs`).
//! Errors are by how groups of cells disagree (the sandwich of Huber 1967), the gain is that of frames which others predict
//! (`estimated.rs`).
//! An effect that changes each return where it is alone (a filter, a phase) has no such cells, and is not judged here. What follows the
//! signal and is no effect of the library is a field without a name (`fields.rs`).

mod cells;
mod directions;
mod fields;
mod fit;
mod looks;
mod shifted;

use std::sync::Arc;

use num_complex::Complex64;

use self::directions::{Amplitudes, Direction, Drive};
use self::fields::Field;
use self::fit::{Fit, WORTH_REFINING};
use super::behaviour::Behaviour;
use super::cube::Cube;
use super::evidence::{Evidence, denoised};
use super::finding::{Candidate, Correction, Estimate, NINETY, Place, Volume};
use super::never;
use super::statistics::{DECIBEL, corrected};
use crate::effects::{self, EffectInfo, Operator, Role};

/// Share of the power above the noise that may be left where the effect is above it: what else lies there makes more of it than the
/// effect does.
const MOST_LEFT: f64 = 0.5;
/// The same below which an effect of the library explains what a field does; and the share of the field's gain that it may lack.
const LEFT_BY_A_LAW: f64 = 0.2;
/// Standard deviations of a one-sided limit of 95 %.
const NINETY_FIVE: f64 = 1.645;

/// Effects of the evidence's library that the test is asked of.
fn asked(evidence: &Evidence) -> Vec<&'static EffectInfo> {
    // A signal that the converter cut has products of all kinds, and so has one whose products were undone roughly.
    let is_bent =
        evidence.accepted.contains(&effects::adc_saturation::ID) || evidence.accepted_unnamed.contains(&Behaviour::Quadratic);
    let never: Vec<&str> = never::all(evidence.body.is_some()).map(|(id, _)| id).collect();
    let is_asked = |info: &&'static EffectInfo| {
        !is_bent && !evidence.accepted.contains(&info.id) && !never.contains(&info.id) && !Direction::all(info).is_empty()
    };
    evidence.library.iter().copied().filter(is_asked).collect()
}

/// Candidates for every effect that one test for all can judge, and for fields without a name that none of them explains.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let named = asked(evidence);
    let is_open = |field: &&Field| !named.is_empty() && !evidence.accepted_unnamed.contains(&field.behaves_like);
    let fields: Vec<&Field> = fields::ALL.iter().filter(is_open).collect();
    let asked: Vec<&'static EffectInfo> = named.iter().copied().chain(fields.iter().map(|field| field.info)).collect();
    let of = |fit: Option<Fit>| {
        let fit = fit?;
        let p_value = corrected(fit.p_value, asked.len() as f64);
        (p_value < WORTH_REFINING && fit.left < MOST_LEFT).then_some(Fit { p_value, ..fit })
    };
    let mut fits: Vec<Option<Fit>> = at_zero(evidence, &asked).into_iter().map(of).collect();
    let of_fields = fits.split_off(named.len().min(fits.len()));
    let laws: Vec<[f64; 2]> = fits.iter().flatten().map(|fit| [fit.left, fit.nats]).collect();
    let is_explained =
        |field: &Fit| laws.iter().any(|[left, gain]| *left < LEFT_BY_A_LAW || *gain > (1.0 - LEFT_BY_A_LAW) * field.nats);
    let candidates = named.iter().zip(fits).filter_map(|(info, fit)| candidate(evidence, info, &fit?));
    let nameless = fields.iter().zip(of_fields).filter_map(|(field, fit)| {
        let fit = fit.filter(|fit| !is_explained(fit))?;
        Some(Candidate {
            id: None,
            behaves_like: field.behaves_like,
            estimates: vec![],
            ..candidate(evidence, field.info, &fit)?
        })
    });
    candidates.chain(nameless).collect()
}

/// Energy over all samples that an effect can have at most, with a confidence of 95 %, where it was not found; by effect.
pub fn limits(evidence: &Evidence) -> Vec<(&'static str, f64)> {
    let asked = asked(evidence);
    let frames = evidence.cube.dims[0] as f64;
    let of = |(info, fit): (&&'static EffectInfo, Option<Fit>)| {
        let fit = fit?;
        // Where each receiver has its own, each has its share of the energy.
        let share = frames / fit.amplitudes.receivers() as f64;
        let errors = fit.amplitudes.values.iter().zip(&fit.deviations).zip(fit.frame_energies.iter().cycle());
        let most = |value: f64, deviation: f64| value.abs() + NINETY_FIVE * deviation;
        let energy: f64 = errors.map(|((value, deviation), energy)| most(*value, *deviation).powi(2) * energy).sum();
        Some((info.id, share * energy))
    };
    asked.iter().zip(at_zero(evidence, &asked)).filter_map(of).collect()
}

/// No work, and no peak looked for, where nothing is asked.
fn at_zero(evidence: &Evidence, asked: &[&'static EffectInfo]) -> Vec<Option<Fit>> {
    if asked.is_empty() || evidence.peak() <= 0.0 {
        return vec![];
    }
    Fit::at_zero(evidence, asked, evidence.peak())
}

fn candidate(evidence: &Evidence, info: &'static EffectInfo, fit: &Fit) -> Option<Candidate> {
    let estimates = estimates(info, fit);
    let numbers: Vec<String> = estimates.iter().filter_map(|estimate| said(info, estimate)).collect();
    let reference = evidence.peak();
    let drive = Drive::new(info, evidence, reference)?;
    let before = drive.undone(&evidence.cube, &fit.amplitudes);
    let energy = evidence.cube.samples.iter().zip(&before.samples).map(|(after, before)| (after - before).norm_sqr()).sum();
    Some(Candidate {
        id: Some(info.id),
        estimates,
        statement: format!("{} ({}). {}", info.title, numbers.join(", "), info.explanation),
        energy,
        correction: correction(evidence, drive, fit),
        ..Candidate::new(behaviour(info), Place::at(info.stage), fit.p_value, fit.nats)
    })
}

fn correction(evidence: &Evidence, drive: Drive, fit: &Fit) -> Correction {
    let amplitudes = fit.amplitudes.clone();
    let size: usize = evidence.cube.dims[1..].iter().product();
    // What depends on other samples goes to other cells than its own: to first order volumes stay.
    let by_sample = drive.is_by_sample(&evidence.cube.samples[..size], &amplitudes);
    let volume = if by_sample { Volume::BY_SAMPLE } else { Volume::KEPT };
    Correction::Inverse(Arc::new(move |cube: &mut Cube| *cube = drive.undone(cube, &amplitudes)), volume)
}

fn behaviour(info: &EffectInfo) -> Behaviour {
    match info.operator {
        Operator::Nonlinear(_) => Behaviour::NonLinear,
        _ => Behaviour::LinearInTheSignal,
    }
}

/// Amplitudes with their angle, or their level, as the effect's parameters have them.
fn estimates(info: &EffectInfo, fit: &Fit) -> Vec<Estimate> {
    let named = |role: Role| info.parameters.iter().find(|parameter| parameter.role == role);
    let Amplitudes { directions, values } = &fit.amplitudes;
    let size = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let deviation = (fit.deviations.iter().map(|value| value * value).sum::<f64>() / fit.deviations.len() as f64).sqrt();
    let share = deviation / size.max(f64::MIN_POSITIVE);
    // What levels are relative to is known so well; squares of it twice as well.
    let is_relative = info.parameters.iter().any(|parameter| parameter.name == "reference");
    let reference = if is_relative { denoised::PEAK_DB / DECIBEL } else { 0.0 };
    if let Some(level) = named(Role::Level) {
        return vec![Estimate::normal(level.name, DECIBEL * size.ln(), DECIBEL * share.hypot(reference))];
    }
    if let (Some(angle), [of, _]) = (named(Role::Angle), directions.as_slice()) {
        let phase = Complex64::new(values[0], values[1]).arg();
        let amplitude = Estimate::normal(of.parameter.name, size, size * share.hypot(reference));
        return vec![amplitude, Estimate::normal(angle.name, phase, share)];
    }
    let one = |index: usize| {
        let of_receivers = |all: &[f64]| -> Vec<f64> { all.iter().skip(index).step_by(directions.len()).copied().collect() };
        let (values, deviations) = (of_receivers(values), of_receivers(&fit.deviations));
        let deviations: Vec<f64> =
            values.iter().zip(deviations).map(|(value, deviation)| deviation.hypot(2.0 * reference * value)).collect();
        Estimate::list(directions[index].parameter.name, &values, &deviations)
    };
    (0..directions.len()).map(one).collect()
}

/// "gain_db 0.5 ± 0.1 dB"; of receivers one after the other.
fn said(info: &EffectInfo, estimate: &Estimate) -> Option<String> {
    let parameter = info.parameter(estimate.name)?;
    let number = |(value, [low, high]): (&f64, &[f64; 2])| {
        let half = 0.5 * (high - low);
        // Digits down to the tenth part of the error.
        let digits = (1.0 - (half / NINETY).max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{value:.digits$} ± {half:.digits$}")
    };
    let numbers: Vec<String> = estimate.values.iter().zip(&estimate.ci90).map(number).collect();
    let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
    let of = if numbers.len() > 1 { " by receiver" } else { "" };
    Some(format!("{}{of} {}{unit}", estimate.name, numbers.join(", ")))
}

#[cfg(test)]
mod tests;
