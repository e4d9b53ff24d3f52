//! What detectors have to say, as far as the evidence's library has names for it.

use rayon::prelude::*;

use crate::diagnosis::detectors::DETECTORS;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;

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
    found
}
