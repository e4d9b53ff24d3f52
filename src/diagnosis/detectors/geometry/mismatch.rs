//! Receivers whose gains and phases differ, estimated from all that they observe of the body.
//!
//! Phases that grow with the receivers' places are a direction, and might as well be the body's; anything else, and any
//! difference of gain, cannot be.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::cells::Cells;
use super::covariance::Array;
use super::found::{Found, LOOKS};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::statistics::{DECIBEL, corrected};
use crate::diagnosis::{Candidate, Correction, Estimate, Evidence, Place, Volume};
use crate::effects::{self, Stage};

/// What errors of the prediction do to a gain and to a phase: a body that keeps its place shows the same wrong reflectivities in all frames.
const GAIN_FLOOR_DB: f64 = 0.05;
const PHASE_FLOOR_RAD: f64 = 0.3 * PI / 180.0;
/// How well the direction of the body is known, as a sine.
const BEARING_FLOOR: f64 = 0.005;
/// Beyond, nothing is reported.
const LARGEST: f64 = 3.0;

/// Gains and phases that no body makes, `[number, direction]`, and what errors of the prediction do to each.
fn sought(array: &Array) -> (DMatrix<f64>, Vec<f64>) {
    let numbers = array.cells.numbers();
    let directions = numbers.own(&array.cells.radar, &[numbers.gain(0), numbers.phase(0)]);
    let gains = numbers.receivers - 1;
    let floor = |index: usize| if index < gains { GAIN_FLOOR_DB / DECIBEL } else { PHASE_FLOOR_RAD };
    let floors = (0..directions.ncols()).map(floor).collect();
    (directions, floors)
}

/// Of receivers that nearly are alike as these looks have them.
pub fn left(array: &Array, looks: &[Vec<Look>]) -> Option<Estimated> {
    let (directions, floors) = sought(array);
    Estimated::new(looks, &DVector::zeros(directions.ncols()), &directions, &floors)
}

fn amplitudes(cells: &Cells, values: &DVector<f64>) -> DVector<Complex64> {
    let numbers = cells.numbers();
    DVector::from_fn(numbers.receivers, |rx, _| Complex64::from_polar(values[numbers.gain(rx)].exp(), values[numbers.phase(rx)]))
}

pub fn find(evidence: &Evidence, array: &Array) -> Option<Found> {
    let Array { cells, bearing, .. } = array;
    let (directions, floors) = sought(array);
    let found = Estimated::converged(&array.looks, &directions, &floors, |at| {
        let inverse = amplitudes(cells, &(&directions * at)).map(|amplitude| 1.0 / amplitude);
        let undo = DMatrix::from_diagonal(&inverse);
        (at.amax() <= LARGEST).then(|| array.looks_after(|_| undo.clone()))
    })?;
    let numbers = cells.numbers();
    let values = &directions * &found.values;
    let against_first = |of: &dyn Fn(usize) -> usize| -> Vec<[f64; 2]> {
        let one = |rx: usize| {
            let weights: DVector<f64> = (directions.row(of(rx)) - directions.row(of(0))).transpose();
            [values[of(rx)] - values[of(0)], found.deviation(&weights)]
        };
        (0..numbers.receivers).map(one).collect()
    };
    let mut phases = against_first(&|rx| numbers.phase(rx));
    // What grows with the places is either; it is as likely to be the receivers' as they differ otherwise.
    let places: Vec<f64> =
        cells.radar.rx_m.iter().map(|at| TAU * (at[0] - cells.radar.rx_m[0][0]) / cells.radar.wavelength_m()).collect();
    let own = phases.iter().map(|[phase, _]| phase * phase).sum::<f64>() / places.iter().map(|x| x * x).sum::<f64>().max(1e-12);
    let of_the_body = bearing.deviation.hypot(BEARING_FLOOR).powi(2);
    let share = own / (own + of_the_body);
    // Where no other phase can be seen, nothing says whose the direction is: all of it may be theirs.
    let either = if directions.ncols() > numbers.receivers - 1 { 0.0 } else { bearing.sine.abs() };
    for ([phase, deviation], x) in phases.iter_mut().zip(places) {
        *phase -= share * bearing.sine * x;
        *deviation = deviation.hypot((share * of_the_body).sqrt() * x).hypot(either * x);
    }
    let p_value = corrected(found.p_value, LOOKS);
    let candidate = candidate(evidence, &against_first(&|rx| numbers.gain(rx)), &phases, p_value, found.nats);
    Some(Found { candidate, likelihood: found.likelihood, explains_all: false })
}

/// Values and deviations against the first receiver, logarithmic gains and radian.
fn candidate(evidence: &Evidence, gains: &[[f64; 2]], phases: &[[f64; 2]], p_value: f64, nats: f64) -> Candidate {
    let scaled =
        |of: &[[f64; 2]], unit: f64| -> [Vec<f64>; 2] { [0, 1].map(|part| of.iter().map(|value| value[part] * unit).collect()) };
    let [gains_db, gain_deviations] = scaled(gains, DECIBEL);
    let [phases_deg, phase_deviations] = scaled(phases, 180.0 / PI);
    let text = |values: &[f64], digits: usize| {
        values.iter().skip(1).map(|value| format!("{value:.digits$}")).collect::<Vec<_>>().join(", ")
    };
    let receivers = gains.len();
    let inverse: Vec<Complex64> =
        gains.iter().zip(phases).map(|(gain, phase)| Complex64::from_polar((-gain[0]).exp(), -phase[0])).collect();
    let energy = (0..evidence.cube.dims[0])
        .flat_map(|frame| (0..evidence.cube.channels()).map(move |channel| (frame, channel)))
        .map(|(frame, channel)| {
            let error = (1.0 - inverse[channel % receivers]).norm_sqr();
            error * evidence.cube.channel(frame, channel).iter().map(|value| value.norm_sqr()).sum::<f64>()
        })
        .sum();
    // Gains and phases that are free: receivers differ so whatever the cause.
    let id = evidence.info(effects::channel_mismatch::ID).map(|info| info.id);
    let estimates =
        vec![Estimate::list("gain_db", &gains_db, &gain_deviations), Estimate::list("phase_deg", &phases_deg, &phase_deviations)];
    let place = Place { rx: Some((1..receivers).collect()), ..Place::at(Stage::Antenna) };
    Candidate {
        id,
        statement: format!(
            "The receivers differ: against the first, {} {} dB of gain and {}° of phase, which no direction of the body explains.",
            if receivers == 2 { "the second has".to_string() } else { format!("receivers 1 to {} have", receivers - 1) },
            text(&gains_db, 2),
            text(&phases_deg, 1),
        ),
        estimates: if id.is_some() { estimates } else { vec![] },
        errs_alike: true,
        energy,
        correction: Correction::inverse(Volume::BY_SAMPLE, move |cube| {
            cube.each_chirp(|[_, channel, _], samples| {
                samples.iter_mut().for_each(|value| *value *= inverse[channel % receivers]);
            });
        }),
        ..Candidate::new(Behaviour::ChannelGain, place, p_value, nats)
    }
}

#[cfg(test)]
mod tests {
    use super::super::bearing::Bearing;
    use super::super::walking::walking;
    use super::*;
    use crate::diagnosis::cube::Loaded;

    #[test]
    fn the_phase_of_two_receivers_is_left_open_by_as_much_as_the_direction() {
        let truth: f64 = 0.35;
        let array = DMatrix::from_diagonal(&DVector::from_vec(vec![Complex64::ONE, Complex64::from_polar(1.25, truth)]));
        let cells = walking(1, |_, _| Complex64::ONE, &array);
        let radar = cells.radar.clone();
        // Half a wavelength apart.
        let bearing = Bearing { sine: -truth / PI, deviation: 0.003, p_value: 1e-9 };
        let samples = vec![Complex64::ONE; radar.dims().iter().product()];
        let evidence = Evidence::new(Loaded::of_samples(radar, samples, [-1.0, 1.0]), None, None);
        let found = find(&evidence, &Array::new(cells, bearing)).expect("nothing was found").candidate;
        let [gain, phase] = [&found.estimates[0], &found.estimates[1]];
        let holds = |estimate: &Estimate, value: f64| estimate.ci90[1][0] <= value && value <= estimate.ci90[1][1];
        assert!(holds(gain, 20.0 * 1.25f64.log10()) && gain.ci90[1][0] > 1.0, "{gain:?}");
        assert!(holds(phase, 0.0) && holds(phase, truth.to_degrees()), "{phase:?}");
        assert!(found.statement.contains("the second has"), "{}", found.statement);
    }
}
