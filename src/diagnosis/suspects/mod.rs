//! One file per family of effects: each looks at the evidence and says what it has found.

pub mod codes;
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
    pub find: fn(&Evidence) -> Vec<Candidate>,
}

/// All of them. Each answers on its own, within its family; the selection chooses between families.
pub const SUSPECTS: &[Suspect] = &[
    Suspect { name: "still field", find: receiver::still::find },
    Suspect { name: "still field, room unknown", find: receiver::open::find },
    Suspect { name: "quadrature image", find: receiver::image::find },
    Suspect { name: "non-linear receiver", find: receiver::harmonic::find },
    Suspect { name: "converter's rail", find: receiver::rail::find },
    Suspect { name: "spur", find: receiver::spur::find },
    Suspect { name: "bursts", find: receiver::bursts::find },
    Suspect { name: "noise", find: receiver::noise::find },
    Suspect { name: "droop", find: receiver::droop::find },
    Suspect { name: "slow time", find: slow::find },
    Suspect { name: "one channel", find: slow::channels::find },
    Suspect { name: "converter's codes", find: codes::find },
    Suspect { name: "chirp", find: waveform::find },
    Suspect { name: "vital signs", find: vital::find },
    Suspect { name: "untracked movers", find: untracked::find },
    Suspect { name: "extra paths", find: paths::find },
    Suspect { name: "geometry", find: geometry::find },
];
