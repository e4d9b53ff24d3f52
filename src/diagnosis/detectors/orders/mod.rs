//! What carries another multiple of a phase than the returns do whose phase it is, where nobody is tracked.
//!
//! Once it is known how a phase φ goes over time ([`Course`]), its multiples identify the path of a signal:
//! a return has order 1; what is added behind the mixer does not turn, order 0; what went to the thing and back twice turns twice,
//! order 2. Static returns that share a phase so identify the part of them that is none.

mod fit;
mod offset;
mod twice;

use std::sync::Arc;

use fit::Fit;

use crate::diagnosis::course::{Course, Of};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;

/// Candidates from every phase that accepted findings have over time. None where somebody is tracked.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.body.is_some() {
        return vec![];
    }
    let of_course = |course: &Arc<Course>| match &course.of {
        Of::All => {
            let Some(fit) = Fit::new(evidence, course) else { return vec![] };
            offset::find(evidence, &fit).into_iter().collect()
        }
        Of::Mover { bin, amplitude } => twice::find(evidence, course, *bin, amplitude).into_iter().collect::<Vec<_>>(),
    };
    evidence.courses.iter().flat_map(of_course).collect()
}

#[cfg(test)]
mod tests;
