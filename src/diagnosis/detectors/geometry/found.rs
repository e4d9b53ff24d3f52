//! One way in which receivers may differ, and how several of them are compared.

use crate::diagnosis::Candidate;

/// Chance below which receivers may not be alike.
pub const UNEVEN: f64 = 0.05;
/// In which ways receivers may differ.
pub const LOOKS: f64 = 5.0;

/// One way in which receivers may differ.
pub struct Found {
    pub candidate: Candidate,
    /// What it gains if errors of the prediction are not counted, nats: by which they are compared.
    pub likelihood: f64,
    /// Whether the receivers are alike without it.
    pub explains_all: bool,
}
