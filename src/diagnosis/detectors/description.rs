//! What is said of something found: its name where the library has one, its numbers, and both in words.

use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Estimate, Place};

/// What it is called, how large it is, and both in words.
pub struct Description {
    pub id: Option<&'static str>,
    pub estimates: Vec<Estimate>,
    pub statement: String,
}

impl Description {
    pub fn candidate(self, behaves_like: Behaviour, place: Place, p_value: f64, nats: f64) -> Candidate {
        let Self { id, estimates, statement } = self;
        Candidate { id, estimates, statement, ..Candidate::new(behaves_like, place, p_value, nats) }
    }

    pub fn unnamed(statement: String) -> Self {
        Self { id: None, estimates: vec![], statement }
    }

    /// `observed`: what is seen, and `cause`: what that is. What any cause may have is observed without it, where the library has no such
    /// effect.
    pub fn named(evidence: &Evidence, id: &'static str, estimates: Vec<Estimate>, [observed, cause]: [String; 2]) -> Self {
        match evidence.info(id) {
            Some(_) => Self { id: Some(id), estimates, statement: format!("{observed}: {cause}.") },
            None => Self::unnamed(format!("{observed}.")),
        }
    }
}
