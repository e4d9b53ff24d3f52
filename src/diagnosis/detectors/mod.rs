//! Detectors: one file per family of effects, each of which tests the evidence and returns its candidates.

mod azimuth;
pub mod broadband;
pub mod body_worn;
mod cfar;
pub mod climb;
pub mod clutter;
pub mod codes;
mod description;
pub mod excess;
mod filter;
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

/// One family of hypotheses, and how it is asked.
pub struct Detector {
    pub name: &'static str,
    /// Of the family-wise chance of a false claim, in proportion to all shares. What has a high SNR when it is
    /// there needs little; what errors of the mesh blur needs more.
    pub share: f64,
    pub find: fn(&Evidence) -> Vec<Candidate>,
    /// Looks at the codes as they were recorded: what is corrected happened before and takes nothing back.
    pub last_in_chain: bool,
    /// Acts in the receiver on all that arrives: undone before what happened to it in front of the receiver.
    pub of_all_received: bool,
    /// Counts only where no other detector finds anything.
    pub last_resort: bool,
    /// Trusts that the body is where it was predicted: it waits until that is so.
    pub trusts_the_place: bool,
    /// Has every frame predicted by the others: what it gains says nothing that its p-value, of the same frames, does not.
    pub predicts_all_frames: bool,
}

impl Detector {
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
pub const DETECTORS: &[Detector] = &[
    Detector::new("still field", receiver::additive::find),
    Detector::new("still field, room unknown", receiver::open::find),
    Detector { predicts_all_frames: true, of_all_received: true, ..Detector::new("operators of the library", score::find) },
    Detector { predicts_all_frames: true, ..Detector::new("non-linear receiver", receiver::harmonic::find) },
    Detector { last_in_chain: true, ..Detector::new("converter's rail", receiver::clipping::find) },
    Detector::new("spur", receiver::spur::find),
    Detector::new("bursts", receiver::bursts::find),
    Detector { predicts_all_frames: true, ..Detector::new("noise", receiver::noise::find) },
    // Three questions, which a body's speckle blurs.
    Detector { share: 3.0, trusts_the_place: true, ..Detector::new("along the chirp", waveform::along::find) },
    Detector::new("slow time", slow::find),
    Detector { predicts_all_frames: true, ..Detector::new("one channel", slow::channels::find) },
    Detector::new("chirp's number in its frame", slow::locked::find),
    Detector::new("single frame", slow::corrupted_frame::find),
    Detector { last_in_chain: true, ..Detector::new("slipped samples", receiver::misalignment::find) },
    Detector { last_in_chain: true, ..Detector::new("converter's codes", codes::find) },
    Detector::new("chirp", waveform::find),
    Detector::new("vital signs", vital::find),
    Detector::new("orders of a phase", orders::find),
    Detector::new("movers of all velocities", broadband::find),
    Detector::new("untracked movers", untracked::find),
    Detector::new("extra paths", paths::find),
    Detector { share: 8.0, ..Detector::new("geometry", geometry::find) },
    Detector::new("changing static returns", fluctuation::find),
    body_worn::DETECTOR,
    Detector { last_resort: true, ..Detector::new("excess power", excess::find) },
];

/// The limit of the whole at which the most significant candidate would just pass.
pub fn smallest_bound(found: &[(usize, Candidate)]) -> f64 {
    let shares: f64 = DETECTORS.iter().map(|detector| detector.share).sum();
    let weighted = |(detector, candidate): &(usize, Candidate)| candidate.p_value * shares / DETECTORS[*detector].share;
    found.iter().map(weighted).fold(1.0, f64::min)
}

/// Smallest p-value of each detector that has something to say.
pub fn by_detector(found: &[(usize, Candidate)]) -> BTreeMap<String, f64> {
    let mut smallest = BTreeMap::new();
    for (detector, candidate) in found {
        let least = smallest.entry(DETECTORS[*detector].name.to_string()).or_insert(1.0f64);
        *least = least.min(candidate.p_value);
    }
    smallest
}
