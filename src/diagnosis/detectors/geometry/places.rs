//! Antennas that stand elsewhere than declared: the phase between two of them grows with the direction.
//!
//! A displacement that is the same for all antennas shows nowhere, and one in proportion to their places might as well be a body
//! that is wider or narrower: only the rest is the antennas' own.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::cells::Cells;
use super::covariance::Array;
use super::found::{Found, LOOKS};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::energy_beyond_noise;
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Candidate, Estimate, Evidence, Place};
use crate::effects::{self, Stage};

/// What errors of the prediction look like, radian per unit of the sine.
const FLOOR: f64 = 0.02;
/// Beyond, nothing is reported: a wavelength.
const LARGEST: f64 = TAU;

pub fn find(evidence: &Evidence, array: &Array) -> Option<Found> {
    let numbers = array.cells.numbers();
    let directions = numbers.own(&array.cells.radar, &[numbers.place(0)]);
    let floors = vec![FLOOR; directions.ncols()];
    let found = Estimated::converged(&array.looks, &directions, &floors, |at| {
        let turns = (&directions * at).rows(numbers.place(0), numbers.receivers).into_owned();
        let undo = |sine: f64| DMatrix::from_diagonal(&turns.map(|turn| Complex64::cis(turn * sine)));
        (at.amax() <= LARGEST).then(|| array.looks_after(undo))
    })?;
    let candidate = candidate(evidence, &array.cells, &directions, &found);
    Some(Found { candidate, likelihood: found.likelihood, explains_all: false })
}

fn candidate(evidence: &Evidence, cells: &Cells, directions: &DMatrix<f64>, found: &Estimated) -> Candidate {
    let radar = &evidence.radar;
    let wave = TAU / radar.wavelength_m();
    let numbers = cells.numbers();
    let along = DVector::from_iterator(radar.rx_m.len(), radar.rx_m.iter().map(|at| at[0] - radar.rx_m[0][0]));
    // By direction, metres, from the first one; what grows with the places is as well the body's, and nothing of it is estimable.
    let places = directions.rows(numbers.place(0), numbers.receivers) / wave;
    let places = DMatrix::from_columns(
        &places
            .column_iter()
            .map(|column| {
                let offsets = column.add_scalar(-column[0]);
                &offsets - &along * (along.dot(&offsets) / along.norm_squared().max(f64::MIN_POSITIVE))
            })
            .collect::<Vec<_>>(),
    );
    let offsets = &places * &found.values;
    // How much is hidden so is not known, but it is likely to be as much as in any other direction.
    let usual = offsets.norm_squared() / found.values.len() as f64 / along.norm_squared().max(f64::MIN_POSITIVE);
    let deviations: Vec<f64> = places
        .row_iter()
        .zip(along.iter())
        .map(|(row, along)| found.deviation(&row.transpose()).hypot(along * usual.sqrt()))
        .collect();
    let list = offsets.iter().map(|offset| format!("{:.0}", 1e6 * offset)).collect::<Vec<_>>().join(", ");
    let growth = found.values.norm();
    let place = Place::at(Stage::Antenna);
    Candidate {
        id: Some(effects::antenna_position::ID),
        estimates: vec![Estimate::list("offset_m", offsets.as_slice(), &deviations)],
        errs_alike: true,
        statement: format!(
            "The phases between neighbouring receivers grow with the direction of the body, and not alike: the receivers stand {list} µm \
             farther along x than declared (against the first, and but for a common stretch, which nothing here would show).",
        ),
        energy: energy_beyond_noise(evidence) * (growth * 0.2).powi(2),
        ..Candidate::new(Behaviour::PhaseBetweenReceivers, place, corrected(found.p_value, LOOKS), found.nats)
    }
}
