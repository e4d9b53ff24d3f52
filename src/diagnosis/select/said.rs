//! What detectors have to say, as far as the evidence's library has names for it.

use rayon::prelude::*;

use crate::diagnosis::detectors::DETECTORS;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Estimate, NINETY};

/// What every detector has to say.
pub(super) fn candidates(evidence: &Evidence) -> Vec<(usize, Candidate)> {
    // The shared products first, so that detectors do not wait for one another.
    evidence.maps();
    let ask = |index: usize| said_by(index, evidence).into_iter().map(move |candidate| (index, candidate));
    (0..DETECTORS.len()).into_par_iter().flat_map_iter(ask).collect()
}

/// What one of them has to say, as far as it is in the evidence's library.
pub(super) fn said_by(detector: usize, evidence: &Evidence) -> Vec<Candidate> {
    let mut found = (DETECTORS[detector].find)(evidence);
    let is_known = |id: &&'static str| evidence.info(id).is_some();
    found.retain(|candidate| candidate.id.as_ref().is_none_or(is_known));
    found.iter_mut().for_each(|candidate| candidate.look_alikes.retain(is_known));
    found.into_iter().map(passive).collect()
}

/// Without its name where an echo of the body returns more than it receives, by more than a standard deviation: nothing passive does.
fn passive(candidate: Candidate) -> Candidate {
    let gains = |estimate: &Estimate| estimate.name == "coefficient" && least(estimate) > 1.0;
    if candidate.id.is_none() || !candidate.estimates.iter().any(gains) {
        return candidate;
    }
    let statement = format!("{} No boundary returns more than it receives: something else moves there.", candidate.statement);
    Candidate { id: None, estimates: vec![], look_alikes: vec![], choice: None, statement, ..candidate }
}

/// The magnitude that an estimate exceeds by a standard deviation of its logarithm.
fn least(estimate: &Estimate) -> f64 {
    let of = |(value, [low, high]): (&f64, &[f64; 2])| {
        let ends = [low.abs(), high.abs()];
        let nearer = ends[0].min(ends[1]) / value.abs().max(f64::MIN_POSITIVE);
        value.abs() * nearer.min(1.0).powf(1.0 / NINETY)
    };
    estimate.values.iter().zip(&estimate.ci90).map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Place;
    use crate::diagnosis::behaviour::Behaviour;
    use crate::effects::{Stage, wall_ghost};

    #[test]
    fn an_echo_that_is_stronger_than_the_body_has_no_name() {
        let id = |coefficient: f64| {
            let spread = |factor: f64| coefficient * (factor * NINETY * 0.3f64).exp();
            let estimates =
                vec![Estimate { name: "coefficient", values: vec![coefficient], ci90: vec![[spread(-1.0), spread(1.0)]] }];
            let ghost = Candidate::new(Behaviour::PathLike, Place::at(Stage::Propagation), 0.0, 100.0);
            passive(Candidate { id: Some(wall_ghost::ID), estimates, ..ghost }).id
        };
        assert_eq!([0.4, 1.0, 1.3].map(id), [Some(wall_ghost::ID); 3]);
        assert_eq!([1.4, -2.1].map(id), [None; 2]);
    }
}
