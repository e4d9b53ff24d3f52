//! Which of two detectors comes first, where one of them makes what the other one sees.

use super::NEARLY;
use super::said::said_by;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction};
use crate::diagnosis::misfit::Misfit;
use crate::diagnosis::residual::{is_added, is_rough, is_same};
use crate::effects::{self, Stage};

/// What all that is received does over time.
const COURSES: [Behaviour; 3] = [Behaviour::SlowTimeGain, Behaviour::SlowTimePhase, Behaviour::DelayProportionalPhase];

/// Stages of the signal's chain at which everything that is received is changed.
const UPSTREAM: [Stage; 2] = [Stage::Waveform, Stage::Receiver];

/// Whether the body is elsewhere, or at another time, than predicted.
pub(super) fn is_displaced(candidate: &Candidate) -> bool {
    matches!(candidate.correction, Correction::Body(_)) && candidate.place.stage != Some(Stage::Propagation)
}

/// Whether it acts on every return, or on all of the body. What has no name does where nobody is tracked: most ranges share it then.
fn is_on_all(candidate: &Candidate, evidence: &Evidence) -> bool {
    let id = candidate.id.unwrap_or_default();
    (!id.is_empty() || evidence.body.is_none() || is_displaced(candidate))
        && (id == effects::radar_vibration::ID
            || is_displaced(candidate)
            || candidate.place.stage.is_some_and(|stage| UPSTREAM.contains(&stage)))
}

/// Whether it is a gain or a phase over time of all that is received.
pub(super) fn is_course_of_all(candidate: &Candidate) -> bool {
    COURSES.contains(&candidate.behaves_like) && candidate.place.range_m.is_none()
}

/// Whether it may be something else's echoes of the body.
pub(super) fn is_echo(candidate: &Candidate) -> bool {
    candidate.behaves_like.is_path() || is_rough(candidate)
}

/// What acts on every return makes echoes of the body too, which look like paths of their own, and of the room beyond its ranges; and a
/// body that is elsewhere than predicted looks like another one: where both are found, the one is accepted that leaves less.
pub(super) fn upstream<'a>(
    original: &Evidence,
    evidence: &Evidence,
    best: &'a (usize, Candidate),
    passing: &[&'a (usize, Candidate)],
) -> &'a (usize, Candidate) {
    if is_added(&best.1)
        && let Some(course) =
            passing.iter().filter(|(_, other)| is_course_of_all(other)).max_by(|a, b| a.1.nats.total_cmp(&b.1.nats))
    {
        return course;
    }
    if best.1.id == Some(effects::tx_leakage::ID) {
        // What the chirp makes of the room's returns never changes either, nor does an offset, and a leakage is free in every channel: it
        // is none where nothing is left of it.
        let left = |evidence: &Evidence| said_by(best.0, evidence).iter().any(|candidate| candidate.id == best.1.id);
        let simpler = |candidate: &Candidate| {
            candidate.place.stage == Some(Stage::Waveform) || candidate.id == Some(effects::dc_offset::ID)
        };
        let mut simpler = passing.iter().filter(|(_, candidate)| simpler(candidate));
        return simpler.find(|(_, candidate)| !left(&evidence.with(candidate))).copied().unwrap_or(best);
    }
    let others = passing.iter().filter(|(_, candidate)| is_on_all(candidate, evidence));
    let Some(other) = others.max_by(|a, b| a.1.nats.total_cmp(&b.1.nats)).filter(|_| is_echo(&best.1)) else {
        return best;
    };
    // Seen from a wrong place, an echo of the body has no name: where the body is elsewhere with and without the echo, it is put right
    // first.
    let stands = |(detector, other): &(usize, Candidate)| {
        let found = said_by(*detector, &evidence.with(&best.1));
        found.iter().any(|found| found.id == other.id && found.nats > NEARLY * other.nats)
    };
    if best.1.id.is_none() && is_displaced(&other.1) && stands(other) {
        return other;
    }
    if evidence.body.is_none() {
        // Nobody predicts where something moves: it does where it still seems to once what all returns share is undone.
        let found = said_by(best.0, &evidence.with(&other.1));
        let stands = found.iter().any(|found| is_same(&best.1, found) && found.nats > NEARLY * best.1.nats);
        return if stands { best } else { other };
    }
    let left = |candidate: &Candidate| Misfit::after(original, &evidence.with(candidate)).loglik_per_sample;
    if left(&other.1) > left(&best.1) { other } else { best }
}
