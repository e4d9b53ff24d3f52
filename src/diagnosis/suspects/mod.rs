//! One file per family of effects: each looks at the evidence and says what it has found.

pub mod geometry;

use super::evidence::Evidence;
use super::finding::Candidate;

/// Somebody who may be to blame.
pub struct Suspect {
    pub name: &'static str,
    pub find: fn(&Evidence) -> Vec<Candidate>,
}

/// All of them. Each answers on its own, within its family; the selection chooses between families.
pub const SUSPECTS: &[Suspect] = &[Suspect { name: "geometry", find: geometry::find }];
