//! What varies from chirp to chirp and from frame to frame in all static returns together.
//!
//! Their complex gain is estimated in every chirp from the range cells without movers ([`field`]), as a gain, a phase
//! that all ranges share, and a phase in proportion to the delay. Each of the three is searched for sinusoids, drifts,
//! functions of the chirp's place in its frame, and randomness.

mod candidates;
pub mod drift;
pub mod field;
pub mod lines;
pub mod random;
pub mod settling;
mod undo;

use field::{Field, Part};

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;
use crate::diagnosis::statistics;

/// Kinds of looks that share one p-value: three parts, each for lines, drifts and randomness, and settling.
const LOOKS: f64 = 10.0;
/// Gain (nats) below which nothing is worth telling.
const LEAST_GAIN: f64 = 3.0;
/// A named effect may gain so much less than a nameless field.
const NAMED_SHARE: f64 = 0.8;
/// p-value below which a candidate is passed on.
const PASSED_ON: f64 = 0.01;

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let Some(field) = Field::new(evidence) else { return vec![] };
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let mut found = vec![];
    for part in [Part::Gain, Part::Phase, Part::Delay] {
        let series = field.series(part, |_| true);
        // A radian at the farthest group.
        let farthest_s = field.groups.iter().map(|g| g.delay_s).fold(0.0, f64::max);
        let largest = if part == Part::Delay { 1.0 / farthest_s } else { 1.0 };
        if let Some(line) = lines::strongest(&field, &series, training, held_out, largest) {
            found.push(candidates::of_line(evidence, &field, part, &line));
        }
        if let Some(drift) = drift::best(&field, &series, training, held_out) {
            found.push(candidates::of_drift(evidence, &field, part, &drift));
        }
        if let Some(random) = random::best(&field, part, training, held_out) {
            found.push(candidates::of_random(evidence, &field, part, &random));
        }
    }
    if let Some(settling) = settling::best(&field, training, held_out) {
        found.push(candidates::of_settling(evidence, &field, &settling));
    }
    for candidate in &mut found {
        candidate.p_value = statistics::corrected(candidate.p_value, LOOKS);
    }
    found.retain(|c| c.p_value < PASSED_ON && c.gain > LEAST_GAIN && c.id.is_none_or(|id| !evidence.accepted.contains(&id)));
    // One cause shows in several looks; a name wins where it explains nearly as much as the best of them.
    let best = found.iter().map(|c| c.gain).fold(0.0, f64::max);
    let best_named = found.iter().filter(|c| c.id.is_some()).map(|c| c.gain).fold(0.0, f64::max);
    if best_named > NAMED_SHARE * best {
        found.retain(|c| c.id.is_some());
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let rivals: Vec<(Option<&'static str>, f64)> = found.iter().map(|c| (c.id, c.gain)).collect();
    for candidate in &mut found {
        for &(id, gain) in &rivals {
            if let Some(id) = id {
                if Some(id) != candidate.id && (gain - candidate.gain).abs() < 4.6 && !candidate.look_alikes.contains(&id) {
                    candidate.look_alikes.push(id);
                }
            }
        }
    }
    found
}
