//! What nobody else explains: a box of range, Doppler and frames with more power than body, room and noise have.

use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Place};
use crate::diagnosis::locate::{Residual, strongest};
use crate::effects::Stage;

/// At most one candidate: the most significant box of the residual. None once such power was accepted.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.accepted_unnamed.contains(&Behaviour::ExcessPower) {
        return vec![];
    }
    let Some(found) = Residual::new(evidence).and_then(|residual| strongest(evidence, &residual)) else { return vec![] };
    let place = &found.region.place;
    let along = |what: &str, unit: &str, bounds: Option<[f64; 2]>| {
        bounds.map(|[low, high]| format!("{what} {low:.1} to {high:.1} {unit}"))
    };
    let frames = place.frames.as_ref().map(|frames| format!("in frames {} to {}", frames[0], frames[frames.len() - 1]));
    let words: Vec<String> =
        [along("at", "m", place.range_m), along("at", "m/s", place.velocity_mps), frames].into_iter().flatten().collect();
    let place_words = if words.is_empty() { "everywhere".to_string() } else { words.join(", ") };
    let place = Place { stage: Some(Stage::Propagation), ..place.clone() };
    vec![Candidate {
        statement: format!(
            "there is {:.1} dB more power than body, room and noise can have, {place_words}; no effect of the library explains it",
            found.region.excess_db
        ),
        energy: found.region.energy * evidence.total_noise(),
        ..Candidate::new(Behaviour::ExcessPower, place, found.p_value, found.gain)
    }]
}
