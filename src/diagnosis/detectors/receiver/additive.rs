//! Additive fields that are static and lie outside the delays of the room: offsets, leakage, transients at the chirps' edges.
//!
//! Elements are chosen one after the other by their log-likelihood on the training frames less the Bayesian information
//! criterion's penalty, together with the images that non-linear receivers make of the static scene (which belong to
//! other detectors, but must not be taken for a leakage). Named elements are believed only if all together explain most
//! of what a free field does.

use num_complex::Complex64;

use super::additive_term::{Chosen, added, is_bent};
use super::elements::{Element, Images, NEAR_M, choose, templates};
use super::field::{Field, Fitted, add};
use super::response;
use super::support::{Support, UNLIKELY, energy, range_m, ranges_m};
use crate::diagnosis::Evidence;
use crate::diagnosis::evidence::beat::with_clearance;
use crate::diagnosis::finding::{Candidate, Place};
use crate::diagnosis::statistics::chi2_tail;
use crate::effects::Stage;

/// Share of what a free field explains that named elements must reach.
const ENOUGH: f64 = 0.8;
/// Held-out log-likelihood that a free field must gain, nats.
const LEAST_GAIN: f64 = 20.0;

/// Candidates for what is added outside the room's delays: named elements, a filter in their place, or a field without a name.
/// None where a free field is not significant. What stands before the room's surfaces or behind them is of the room: fields are asked
/// for beside it.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let mut ranges_m = ranges_m(evidence);
    while let Some(field) = ranges_m.and_then(|ranges_m| Field::beside(evidence, ranges_m)) {
        match beside(evidence, field) {
            Ok(found) => return found,
            Err(wider_m) => ranges_m = Some(wider_m),
        }
    }
    vec![]
}

/// Candidates, or the ranges of static surfaces where these have more than was known.
fn beside(evidence: &Evidence, field: Field) -> Result<Vec<Candidate>, [f64; 2]> {
    let free = field.free_likelihood();
    let p_free = chi2_tail(2.0 * free, field.freedom());
    if p_free > 1e-4 {
        return Ok(vec![]);
    }
    let images = Images::new(evidence, &field);
    let elements = choose(evidence, &field, &images, false);
    let fitted = field.fit(&templates(&elements, &images));
    let free_gain = field.gain(None, &field.mean);
    let explained = field.gain(None, &fitted.predicted);
    let named = elements.iter().any(|element| !matches!(element, Element::Image | Element::Square));
    let without = residual(&elements, &fitted, &field, &images);
    // A field far stronger than any filter's traces needs no second thought.
    let plain = explained >= 0.98 * free_gain && fitted.likelihood > 1e5;
    let bent = is_bent(evidence);
    let filter = if plain || bent { None } else { response::find(evidence, &field, &without) };
    // What is added explains itself as well as any filter does; a filter's traces it does not.
    let filter = filter.filter(|found| {
        found.likelihood > 12.0
            && found.likelihood >= ENOUGH * (free - 0.5 * field.freedom())
            && (!named || found.likelihood > found.additive)
    });
    if let Some(found) = filter.as_ref().filter(|found| found.chance >= UNLIKELY) {
        return Ok(vec![found.candidate.clone()]);
    }
    if let Some(wider_m) = wider_m(evidence, &field, &choose(evidence, &field, &images, true)) {
        return Err(wider_m);
    }
    Ok(match filter {
        None if explained >= ENOUGH * free_gain => {
            // The field is sure; what an element's numbers are is another question.
            let chosen = Chosen { evidence, field: &field, images: &images, elements: &elements, fitted: &fitted };
            let found = (0..elements.len()).filter_map(|index| chosen.candidate(index));
            found.map(Candidate::named_if_sure).collect()
        }
        _ if free_gain < LEAST_GAIN || bent => vec![],
        _ => unexplained(evidence, &field, p_free, free_gain).into_iter().collect(),
    })
}

/// Ranges of static surfaces with those of what stands beside them, if anything does.
fn wider_m(evidence: &Evidence, field: &Field, elements: &[Element]) -> Option<[f64; 2]> {
    let ranges_m = elements.iter().filter_map(|element| match element {
        Element::Return(turns) => Some(range_m(evidence, turns * evidence.radar.sample_rate_hz)),
        _ => None,
    });
    let Support { low_m, high_m, .. } = field.support;
    ranges_m
        .map(|range_m| with_clearance([range_m, range_m]))
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        .map(|[nearest_m, farthest_m]| [low_m.min(nearest_m.max(NEAR_M)), high_m.max(farthest_m)])
}

/// Mean chirps less what the elements add to them.
fn residual(elements: &[Element], fitted: &Fitted, field: &Field, images: &Images) -> Vec<Vec<Complex64>> {
    let templates = templates(elements, images);
    let mut rest = field.clutter.clone();
    for (channel, chirp) in rest.iter_mut().enumerate() {
        templates.own.iter().zip(&fitted.own[channel]).for_each(|(template, amplitude)| add(chirp, template, -amplitude));
        templates.common.iter().zip(&fitted.common).for_each(|(template, amplitude)| add(chirp, &template[channel], -amplitude));
    }
    rest
}

/// The residual that no name explains.
fn unexplained(evidence: &Evidence, field: &Field, p_value: f64, nats: f64) -> Option<Candidate> {
    let samples = evidence.cube.dims[4];
    let term: Vec<Vec<Complex64>> = field
        .mean
        .iter()
        .map(|coordinates| {
            let mut sum = vec![Complex64::ZERO; samples];
            field.support.outside.iter().zip(coordinates).for_each(|(direction, value)| add(&mut sum, direction, *value));
            sum
        })
        .collect();
    let energy_of_chirp = term.iter().map(|chirp| energy(chirp)).sum::<f64>();
    let power_db = 10.0 * (energy_of_chirp / field.clutter.iter().map(|chirp| energy(chirp)).sum::<f64>().max(1e-300)).log10();
    Some(Candidate {
        statement: format!(
            "every chirp holds something that never changes at beat frequencies where the room ({:.1} to {:.1} m) has nothing, \
             {power_db:.1} dB to all static clutter; no effect of the library explains its shape",
            field.support.low_m, field.support.high_m
        ),
        ..added(evidence, term, Place::at(Stage::Receiver), p_value, nats)
    })
}

#[cfg(test)]
mod tests {
    use super::super::elements::scene;
    use super::*;
    use crate::effects;
    use crate::room::Room;

    #[test]
    fn a_leakage_that_no_single_tone_describes_is_one_and_is_taken_out_in_full() {
        let (evidence, _) = scene::leaking();
        let likelihood = |evidence: &Evidence| Field::new(evidence).expect("a field").free_likelihood();
        let found = find(&evidence);
        let leaks: Vec<&Candidate> = found.iter().filter(|found| found.id == Some(effects::tx_leakage::ID)).collect();
        assert_eq!(leaks.len(), 1, "{found:?}");
        let [low, high] = leaks[0].place.range_m.expect("a range");
        assert!(low < 0.08 && 0.08 < high, "{low} to {high}");
        let (before, after) = (likelihood(&evidence), likelihood(&evidence.with(leaks[0])));
        assert!(after < 1e-3 * before, "{after} of {before}");
    }

    /// A table that nobody stated: what the room's delays leave of it is neither a leakage nor a transient.
    #[test]
    fn what_stands_before_the_rooms_surfaces_has_no_name_of_the_receivers() {
        let (leaking, turns_per_m) = scene::leaking();
        for table_m in [0.8, 1.3, 1.6] {
            let mut evidence = Evidence::in_noise(leaking.radar.clone(), 7, |[_, rx, _, n]| {
                let tone = |range_m: f64| Complex64::cis(std::f64::consts::TAU * turns_per_m * range_m * n as f64 + rx as f64);
                tone(3.0) * 30.0 + tone(table_m) * 60.0
            });
            let walls = Room { left_m: Some(2.2), right_m: Some(2.2), ..Room::default() };
            evidence.room = Some(Room { floor_m: Some(2.2), ceiling_m: Some(2.2), front_m: Some(4.0), ..walls });
            let found = find(&evidence);
            assert!(found.iter().all(|found| found.id.is_none()), "{table_m} m: {found:?}");
        }
    }
}
