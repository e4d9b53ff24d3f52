//! Bets on the phases of each group's spectrum, by the spectra of others.

use num_complex::Complex64;
use rayon::prelude::*;

use super::course::Course;
use super::deviations::Deviation;
use crate::diagnosis::detectors::slow::field::Part;
use crate::diagnosis::statistics;

/// Shares of the concentration that a phase would have if a range shared everything: bets are placed on each, and on sharing nothing.
/// Powers of about three from next to nothing, since what a range adds of its own is not known.
const SHARES: [f64; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];
/// What a range would gain (nats) if it shared everything, for its absence to be informative: as in `field`.
const INFORMATIVE_GAIN: f64 = 10.0;
/// Share of what others have, from which on a range has it, too.
const MOST: f64 = 0.5;
/// Interleaved sets of frequencies, each of which is independent under the taper.
const SETS: f64 = 2.0;

/// The deviation of a group of ranges, as a course and as a spectrum over slow time.
pub struct Spectrum {
    pub course: Vec<f64>,
    values: Vec<Complex64>,
    /// What a value of one means there, rad.
    lever: f64,
    /// Of the noise in each of them.
    pub variance: f64,
}

/// What most ranges share.
pub struct Shared {
    pub part: Part,
    /// Logarithm of the product of bets.
    pub log_bets: f64,
    /// Ranges that share it, and those that are informative.
    pub sharing: usize,
    pub informative: usize,
    /// Those that share it, as places in the spectra.
    pub members: Vec<usize>,
}

/// Of all groups, surest first; of a phase in proportion to the delay per second of it.
pub fn spectra(deviations: &[Deviation], course: &Course, part: Part) -> Vec<Spectrum> {
    let of_group = |Deviation { group, values, variance }: &Deviation| {
        let lever = part.lever(group);
        let component = |value: &Complex64| if part == Part::Gain { value.re } else { value.im };
        let phases: Vec<f64> = values.iter().map(|value| component(value) / lever).collect();
        // Half of a complex variance is in the phase; both parts of a phase's spectrum have half of that each.
        let variance = 0.5 * variance / (lever * lever);
        Spectrum { values: course.spectrum(&phases), course: phases, lever, variance }
    };
    let mut spectra: Vec<Spectrum> = deviations.par_iter().map(of_group).collect();
    spectra.sort_by(|a, b| a.variance.total_cmp(&b.variance));
    spectra
}

/// What several groups say of a spectrum.
#[derive(Clone)]
struct Reference {
    sum: Vec<Complex64>,
    information: f64,
}

impl Reference {
    fn of(spectra: &[Spectrum], members: impl Iterator<Item = usize>) -> Self {
        let mut reference = Self { sum: vec![Complex64::ZERO; spectra[0].values.len()], information: f64::MIN_POSITIVE };
        members.for_each(|member| reference.add(&spectra[member]));
        reference
    }

    fn add(&mut self, spectrum: &Spectrum) {
        self.sum.iter_mut().zip(&spectrum.values).for_each(|(sum, value)| *sum += value / spectrum.variance);
        self.information += spectrum.variance.recip();
    }

    /// A value without what is probably noise of it.
    fn predicted(&self, index: usize) -> Complex64 {
        let (value, ratio) = self.value(index);
        value * statistics::kept(ratio)
    }

    /// A value, and how much more than noise it is.
    fn value(&self, index: usize) -> (Complex64, f64) {
        let value = self.sum[index] / self.information;
        (value, (value.norm_sqr() * self.information - 1.0).max(0.0))
    }
}

/// Bets of all groups, each on those before it that share something, from each group as the first: their mean is a bet, too.
pub fn shared(spectra: &[Spectrum], part: Part) -> Option<Shared> {
    let count = spectra.len();
    let of_first = |first: usize| {
        let mut reference = Reference { sum: vec![Complex64::ZERO; spectra[first].values.len()], information: 0.0 };
        reference.add(&spectra[first]);
        let (mut log_bets, mut sharing, mut informative, mut members) = (0.0, 0, 0, vec![first]);
        for (index, spectrum) in spectra.iter().enumerate().filter(|(index, _)| *index != first) {
            let (won, most) = bet(&reference, spectrum);
            log_bets += won;
            if most > INFORMATIVE_GAIN {
                informative += 1;
                sharing += usize::from(won > 0.0);
            }
            if won > 0.0 {
                reference.add(spectrum);
                members.push(index);
            }
        }
        Shared { part, log_bets, sharing, informative, members }
    };
    let all: Vec<Shared> = (0..count).into_par_iter().map(of_first).collect();
    let log_bets = statistics::log_sum(all.iter().map(|shared| shared.log_bets)) - (count as f64).ln();
    let best = all.into_iter().max_by(|a, b| a.log_bets.total_cmp(&b.log_bets))?;
    Some(Shared { log_bets, ..best })
}

/// Whether a spectrum has most of what some others do, where it would show.
pub fn shares(spectrum: &Spectrum, spectra: &[Spectrum], members: &[usize]) -> bool {
    let reference = Reference::of(spectra, members.iter().copied());
    let (won, most) = bet(&reference, spectrum);
    let [along, square] = spectrum.values.iter().enumerate().fold([0.0; 2], |[along, square], (index, value)| {
        let predicted = reference.predicted(index);
        [along + (value * predicted.conj()).re, square + predicted.norm_sqr()]
    });
    most > INFORMATIVE_GAIN && won > 0.0 && along > MOST * square
}

/// Logarithm of the likelihood of all groups' phases, but for a constant: each group has what the members beside it have, and scatters
/// by a variance of its own, which is at its maximum.
pub fn log_likelihood(spectra: &[Spectrum], members: &[usize]) -> f64 {
    let of_group = |index: usize| {
        let spectrum = &spectra[index];
        let reference = Reference::of(spectra, members.iter().copied().filter(|member| *member != index));
        let rest: f64 =
            spectrum.values.iter().enumerate().map(|(index, value)| (value - reference.predicted(index)).norm_sqr()).sum();
        -(spectrum.values.len() as f64) / SETS * (rest * spectrum.lever * spectrum.lever).max(f64::MIN_POSITIVE).ln()
    };
    (0..spectra.len()).map(of_group).sum()
}

/// Logarithm of what a bet on a group's phases returns, and of what it would return if the group had what is predicted.
fn bet(reference: &Reference, spectrum: &Spectrum) -> (f64, f64) {
    let (mut returns, mut most) = ([0.0; SHARES.len() + 1], 0.0);
    for (index, value) in spectrum.values.iter().enumerate() {
        let (known, ratio) = reference.value(index);
        let kept = statistics::kept(ratio);
        let predicted = known * kept;
        let variance = spectrum.variance + kept / reference.information;
        let concentration = 2.0 * value.norm() * predicted.norm() / variance;
        if concentration > 0.0 {
            let along = (value * predicted.conj()).re / (value.norm() * predicted.norm());
            for (sum, share) in returns.iter_mut().zip(SHARES) {
                *sum += (share * concentration * along - log_bessel_0(share * concentration)) / SETS;
            }
        }
        most += predicted.norm_sqr() / variance / SETS;
    }
    (statistics::log_sum(returns.into_iter()) - (returns.len() as f64).ln(), most)
}

/// ln I₀(x) of a positive number (Abramowitz and Stegun 1964, 9.8.1 and 9.8.2; errors below 2e-7).
pub fn log_bessel_0(x: f64) -> f64 {
    let polynomial = |t: f64, terms: &[f64]| terms.iter().rev().fold(0.0, |sum, term| sum * t + term);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        return polynomial(t, &[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3]).ln();
    }
    let terms = [
        0.398_942_28,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    x - 0.5 * x.ln() + polynomial(3.75 / x, &terms).ln()
}
