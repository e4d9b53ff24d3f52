//! One file per family of effects: each looks at the evidence and says what it has found.

pub mod codes;
pub mod fluctuation;
pub mod geometry;
pub mod paths;
pub mod receiver;
pub mod region;
pub mod slow;
pub mod untracked;
pub mod vital;
pub mod waveform;

use super::evidence::Evidence;
use super::finding::Candidate;

/// Somebody who may be to blame.
pub struct Suspect {
    pub name: &'static str,
    /// Of the family-wise chance of a false claim, in proportion to all shares. What is as plain as a pikestaff when it
    /// is there needs little; what errors of the mesh blur needs more.
    pub share: f64,
    pub find: fn(&Evidence) -> Vec<Candidate>,
}

/// All of them. Each answers on its own, within its family; the selection chooses between families.
pub const SUSPECTS: &[Suspect] = &[
    Suspect { name: "still field", share: 1.0, find: receiver::still::find },
    Suspect { name: "still field, room unknown", share: 1.0, find: receiver::open::find },
    Suspect { name: "quadrature image", share: 1.0, find: receiver::image::find },
    Suspect { name: "non-linear receiver", share: 1.0, find: receiver::harmonic::find },
    Suspect { name: "converter's rail", share: 1.0, find: receiver::rail::find },
    Suspect { name: "spur", share: 1.0, find: receiver::spur::find },
    Suspect { name: "bursts", share: 1.0, find: receiver::bursts::find },
    Suspect { name: "noise", share: 1.0, find: receiver::noise::find },
    Suspect { name: "droop", share: 1.0, find: receiver::droop::find },
    Suspect { name: "slow time", share: 1.0, find: slow::find },
    Suspect { name: "one channel", share: 1.0, find: slow::channels::find },
    Suspect { name: "converter's codes", share: 1.0, find: codes::find },
    Suspect { name: "chirp", share: 1.0, find: waveform::find },
    Suspect { name: "static returns behind the body", share: 1.0, find: fluctuation::find },
    Suspect { name: "vital signs", share: 1.0, find: vital::find },
    Suspect { name: "untracked movers", share: 1.0, find: untracked::find },
    Suspect { name: "extra paths", share: 1.0, find: paths::find },
    Suspect { name: "geometry", share: 8.0, find: geometry::find },
];
