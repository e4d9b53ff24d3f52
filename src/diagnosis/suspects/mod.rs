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
    /// Looks at the codes as the converter gave them: what is corrected comes after it and takes nothing back.
    pub last_in_chain: bool,
}

/// All of them. Each answers on its own, within its family; the selection chooses between families.
pub const SUSPECTS: &[Suspect] = &[
    Suspect { name: "still field", share: 1.0, find: receiver::still::find, last_in_chain: false },
    Suspect { name: "still field, room unknown", share: 1.0, find: receiver::open::find, last_in_chain: false },
    Suspect { name: "quadrature image", share: 1.0, find: receiver::image::find, last_in_chain: false },
    Suspect { name: "non-linear receiver", share: 1.0, find: receiver::harmonic::find, last_in_chain: false },
    Suspect { name: "converter's rail", share: 1.0, find: receiver::rail::find, last_in_chain: true },
    Suspect { name: "spur", share: 1.0, find: receiver::spur::find, last_in_chain: false },
    Suspect { name: "bursts", share: 1.0, find: receiver::bursts::find, last_in_chain: false },
    Suspect { name: "noise", share: 1.0, find: receiver::noise::find, last_in_chain: false },
    Suspect { name: "droop", share: 1.0, find: receiver::droop::find, last_in_chain: false },
    Suspect { name: "slow time", share: 1.0, find: slow::find, last_in_chain: false },
    Suspect { name: "one channel", share: 1.0, find: slow::channels::find, last_in_chain: false },
    Suspect { name: "single frame", share: 1.0, find: slow::odd_frame::find, last_in_chain: false },
    Suspect { name: "converter's codes", share: 1.0, find: codes::find, last_in_chain: true },
    Suspect { name: "chirp", share: 1.0, find: waveform::find, last_in_chain: false },
    Suspect { name: "vital signs", share: 1.0, find: vital::find, last_in_chain: false },
    Suspect { name: "untracked movers", share: 1.0, find: untracked::find, last_in_chain: false },
    Suspect { name: "extra paths", share: 1.0, find: paths::find, last_in_chain: false },
    Suspect { name: "geometry", share: 8.0, find: geometry::find, last_in_chain: false },
    Suspect { name: "static returns behind the body", share: 1.0, find: fluctuation::find, last_in_chain: false },
];
