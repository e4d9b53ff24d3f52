//! Errors of the chirp's frequency within a chirp: they act in proportion to the delay.

pub mod along;
mod doppler_cells;
pub mod ripple;

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;

/// The candidate of [`ripple::find`], if there is one.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    ripple::find(evidence).into_iter().collect()
}
