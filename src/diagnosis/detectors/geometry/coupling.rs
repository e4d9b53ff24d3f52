//! Mutual coupling of neighbouring receivers: the inner ones have two neighbours, the outer ones one.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::covariance::Array;
use super::found::{Found, LOOKS, UNEVEN};
use super::mismatch;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::statistics::UNDECIDED;
use crate::diagnosis::{Candidate, Correction, Cube, Estimate, Evidence, Place, Volume, statistics};
use crate::effects::{self, Stage};

/// What errors of the prediction may imitate: 0.3° and 0.05 dB.
const FLOOR: f64 = 0.005;
/// Beyond, it is no weak coupling.
const STRONGEST: f64 = 0.5;
/// Of the unevenness of gains and phases (squares), what a coupling may leave: a random one of four receivers lies so near to one
/// that a coupling makes with a probability of 1 %.
const BY_CHANCE: f64 = 0.1;

/// Coupling into a receiver from the one before it and from the one after it.
type Coupling = [Complex64; 2];

/// The coupling of all neighbours alike.
pub fn find(evidence: &Evidence, array: &Array) -> Option<Found> {
    let (found, coupling) = estimate(array, &[&[0, 2], &[1, 3]])?;
    let mut candidate = candidate(evidence, coupling[0], &found);
    let before = mismatch::left(array, &array.looks).map_or(0.0, |before| before.square);
    let after = mismatch::left(array, &looks_alone(array, coupling)?);
    // Any receivers may look like that by chance, if not to the last digit.
    if after.as_ref().is_some_and(|after| after.square > BY_CHANCE * before) {
        candidate.look_alikes.push(effects::channel_mismatch::ID);
    }
    let explains_all = after.is_none_or(|after| after.p_value > UNEVEN);
    Some(Found { candidate, likelihood: found.likelihood, explains_all })
}

/// Receivers that are coupled to the neighbour on one side only, which no coupling of antennas does: it has no name. None where
/// neighbours that are coupled to one another `alike` predict held-out frames nearly as well, where the two sides may not differ,
/// or where the receivers are not alike without it.
pub fn one_way(evidence: &Evidence, array: &Array, alike: Option<&Found>) -> Option<Found> {
    let either = ["before", "after"].into_iter().enumerate().filter_map(|(index, side)| {
        let (found, coupling) = estimate(array, &[&[2 * index], &[2 * index + 1]])?;
        Some((side, coupling[index], found, coupling))
    });
    let (side, strength, found, coupling) = either.max_by(|a, b| a.2.likelihood.total_cmp(&b.2.likelihood))?;
    if alike.is_some_and(|alike| alike.likelihood > found.likelihood - UNDECIDED) {
        return None;
    }
    let (both, _) = estimate(array, &[&[0], &[1], &[2], &[3]])?;
    let difference = DMatrix::from_fn(4, 2, |number, part| match number {
        number if number == part => 1.0,
        number if number == part + 2 => -1.0,
        _ => 0.0,
    });
    let after = mismatch::left(array, &looks_alone(array, coupling)?);
    if both.chance(&difference) > UNEVEN || after.is_some_and(|after| after.p_value < UNEVEN) {
        return None;
    }
    let neighbours = candidate(evidence, strength, &found);
    let candidate = Candidate {
        id: None,
        behaves_like: Behaviour::CoupledOnOneSide,
        statement: format!(
            "Each receiver also receives the signal of the one {side} it, {:.1} dB below its own, and not that of the one on \
             its other side: antennas that couple would do so alike to both sides.",
            -20.0 * strength.norm().log10()
        ),
        energy: 0.5 * neighbours.energy,
        correction: uncoupled(evidence.radar.rx_m.len(), coupling),
        look_alikes: vec![],
        ..neighbours
    };
    Some(Found { candidate, likelihood: found.likelihood, explains_all: false })
}

/// `shared`: for every number that is sought, the parts of [`Numbers::coupling`](super::numbers::Numbers::coupling) that it is.
fn estimate(array: &Array, shared: &[&[usize]]) -> Option<(Estimated, Coupling)> {
    let numbers = array.cells.numbers();
    // Of two receivers, each has one neighbour.
    if numbers.receivers < 3 {
        return None;
    }
    let mut directions = DMatrix::zeros(numbers.count(), shared.len());
    for (column, parts) in shared.iter().enumerate() {
        parts.iter().for_each(|&part| directions[(numbers.coupling(part), column)] = 1.0);
    }
    let coupling = |at: &DVector<f64>| -> Coupling {
        let all = &directions * at;
        [0, 2].map(|part| Complex64::new(all[numbers.coupling(part)], all[numbers.coupling(part + 1)]))
    };
    // As much for a coupling that is alike for all, however many numbers that is.
    let floors: Vec<f64> = shared.iter().map(|parts| FLOOR * (2.0 / parts.len() as f64).sqrt()).collect();
    let found = Estimated::converged(&array.looks, &directions, &floors, |at| {
        if at.norm() > STRONGEST { None } else { looks_alone(array, coupling(at)) }
    })?;
    let coupling = coupling(&found.values);
    Some((found, coupling))
}

/// What is left of the receivers' looks without their coupling. None where that is not estimable.
fn looks_alone(array: &Array, coupling: Coupling) -> Option<Vec<Vec<Look>>> {
    let undo = alone(array.cells.numbers().receivers, coupling)?;
    Some(array.looks_after(|_| undo.clone()))
}

/// What makes of the coupled signals of the receivers those without coupling. None where that is singular.
fn alone(receivers: usize, [before, after]: Coupling) -> Option<DMatrix<Complex64>> {
    let coupled = DMatrix::from_fn(receivers, receivers, |row, column| match row as isize - column as isize {
        0 => Complex64::ONE,
        1 => before,
        -1 => after,
        _ => Complex64::ZERO,
    });
    coupled.try_inverse()
}

fn candidate(evidence: &Evidence, strength: Complex64, found: &Estimated) -> Candidate {
    let deviation = found.deviation(&found.values.normalize());
    let receivers = evidence.radar.rx_m.len();
    let level_db = 20.0 * strength.norm().log10();
    let samples = evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum::<f64>();
    let mean_neighbours = 2.0 * (receivers as f64 - 1.0) / receivers as f64;
    let place = Place::at(Stage::Antenna);
    Candidate {
        id: Some(effects::mutual_coupling::ID),
        estimates: vec![Estimate::normal("level_db", level_db, statistics::DECIBEL * deviation / strength.norm())],
        errs_alike: true,
        // Of three receivers only the middle one is odd.
        look_alikes: if receivers < 4 { vec![effects::channel_mismatch::ID] } else { vec![] },
        statement: format!(
            "Each receiver also receives its neighbours' signals, {:.1} dB below them and {:.0}° ahead: the inner receivers, which \
             have two neighbours, differ from the outer ones, which have one, in the way that every direction of the body \
             predicts.",
            -level_db,
            strength.arg().to_degrees()
        ),
        energy: samples * strength.norm_sqr() * mean_neighbours,
        correction: uncoupled(receivers, [strength; 2]),
        ..Candidate::new(Behaviour::ChannelGain, place, statistics::corrected(found.p_value, LOOKS), found.nats)
    }
}

fn uncoupled(receivers: usize, coupling: Coupling) -> Correction {
    // Of the real and the imaginary part.
    let stretched = alone(receivers, coupling).map_or(0.0, |inverse| 2.0 * inverse.determinant().norm().ln() / receivers as f64);
    Correction::inverse(Volume { alike: stretched, ..Volume::KEPT }, move |cube| undo(cube, coupling))
}

/// Solves for the signals without coupling.
fn undo(cube: &mut Cube, coupling: Coupling) {
    let [_, _, receivers, loops, samples] = cube.dims;
    let Some(inverse) = alone(receivers, coupling) else { return };
    let length = loops * samples;
    let mut received = vec![Complex64::ZERO; receivers];
    for block in cube.samples.chunks_exact_mut(receivers * length) {
        for at in 0..length {
            received.iter_mut().enumerate().for_each(|(rx, value)| *value = block[rx * length + at]);
            for rx in 0..receivers {
                block[rx * length + at] = received.iter().enumerate().map(|(other, value)| inverse[(rx, other)] * value).sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undoing_is_the_inverse() {
        let strength = Complex64::new(0.1, -0.2);
        let clean: Vec<Complex64> = (0..12).map(|i| Complex64::cis(f64::from(i) * 0.7) * f64::from(i + 1)).collect();
        let at = |rx: usize, n: usize| clean[rx * 3 + n];
        let samples = (0..12).map(|i| {
            let (rx, n) = (i / 3, i % 3);
            let before = if rx > 0 { at(rx - 1, n) } else { Complex64::ZERO };
            let after = if rx < 3 { at(rx + 1, n) } else { Complex64::ZERO };
            clean[i] + strength * (before + after)
        });
        let mut cube = Cube::new([1, 1, 4, 1, 3], samples.collect());
        undo(&mut cube, [strength; 2]);
        assert!(cube.samples.iter().zip(&clean).all(|(a, b)| (a - b).norm() < 1e-12));
    }
}
