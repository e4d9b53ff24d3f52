//! One file per family of effects: each looks at the evidence and says what it has found.

pub mod broadband;
pub mod carried;
pub mod climb;
pub mod clutter;
pub mod codes;
pub mod excess;
pub mod fluctuation;
pub mod geometry;
pub mod orders;
pub mod paths;
pub mod receiver;
pub mod region;
pub mod slow;
pub mod steering;
pub mod undo;
pub mod untracked;
pub mod vital;
pub mod waveform;

use std::collections::BTreeMap;

use super::evidence::Evidence;
use super::finding::Candidate;
use super::score;

/// Somebody who may be to blame.
pub struct Suspect {
    pub name: &'static str,
    /// Of the family-wise chance of a false claim, in proportion to all shares. What has a high SNR when it is
    /// there needs little; what errors of the mesh blur needs more.
    pub share: f64,
    pub find: fn(&Evidence) -> Vec<Candidate>,
    /// Looks at the codes as they were recorded: what is corrected happened before and takes nothing back.
    pub last_in_chain: bool,
    /// Acts in the receiver on all that arrives: undone before what happened to it in front of the receiver.
    pub of_all_received: bool,
    /// Counts only where no other suspect finds anything.
    pub last_resort: bool,
    /// Trusts that the body is where it was predicted: it waits until that is so.
    pub trusts_the_place: bool,
    /// Has every frame predicted by the others: what it gains says nothing that its p-value, of the same frames, does not.
    pub predicts_all_frames: bool,
}

impl Suspect {
    const fn new(name: &'static str, find: fn(&Evidence) -> Vec<Candidate>) -> Self {
        Self {
            name,
            share: 1.0,
            find,
            last_in_chain: false,
            of_all_received: false,
            last_resort: false,
            trusts_the_place: false,
            predicts_all_frames: false,
        }
    }
}

/// All of them. Each answers on its own, within its family; the selection chooses between families.
pub const SUSPECTS: &[Suspect] = &[
    Suspect::new("still field", receiver::still::find),
    Suspect::new("still field, room unknown", receiver::open::find),
    Suspect { predicts_all_frames: true, of_all_received: true, ..Suspect::new("operators of the library", score::find) },
    Suspect { predicts_all_frames: true, ..Suspect::new("non-linear receiver", receiver::harmonic::find) },
    Suspect { last_in_chain: true, ..Suspect::new("converter's rail", receiver::rail::find) },
    Suspect::new("spur", receiver::spur::find),
    Suspect::new("bursts", receiver::bursts::find),
    Suspect { predicts_all_frames: true, ..Suspect::new("noise", receiver::noise::find) },
    // Three questions, which a body's speckle blurs.
    Suspect { share: 3.0, trusts_the_place: true, ..Suspect::new("along the chirp", waveform::along::find) },
    Suspect::new("slow time", slow::find),
    Suspect { predicts_all_frames: true, ..Suspect::new("one channel", slow::channels::find) },
    Suspect::new("chirp's number in its frame", slow::locked::find),
    Suspect::new("single frame", slow::odd_frame::find),
    Suspect { last_in_chain: true, ..Suspect::new("slipped samples", receiver::slip::find) },
    Suspect { last_in_chain: true, ..Suspect::new("converter's codes", codes::find) },
    Suspect::new("chirp", waveform::find),
    Suspect::new("vital signs", vital::find),
    Suspect::new("orders of a phase", orders::find),
    Suspect::new("movers of all velocities", broadband::find),
    Suspect::new("untracked movers", untracked::find),
    Suspect::new("extra paths", paths::find),
    Suspect { share: 8.0, ..Suspect::new("geometry", geometry::find) },
    Suspect::new("changing static returns", fluctuation::find),
    carried::SUSPECT,
    Suspect { last_resort: true, ..Suspect::new("excess power", excess::find) },
];

/// The limit of the whole at which the strongest suspicion would just pass.
pub fn strongest_suspicion(found: &[(usize, Candidate)]) -> f64 {
    let shares: f64 = SUSPECTS.iter().map(|suspect| suspect.share).sum();
    let weighted = |(suspect, candidate): &(usize, Candidate)| candidate.p_value * shares / SUSPECTS[*suspect].share;
    found.iter().map(weighted).fold(1.0, f64::min)
}

/// Smallest p-value of each suspect that has something to say.
pub fn by_suspect(found: &[(usize, Candidate)]) -> BTreeMap<String, f64> {
    let mut smallest = BTreeMap::new();
    for (suspect, candidate) in found {
        let least = smallest.entry(SUSPECTS[*suspect].name.to_string()).or_insert(1.0f64);
        *least = least.min(candidate.p_value);
    }
    smallest
}
