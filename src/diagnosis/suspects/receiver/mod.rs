//! The receiver and its noise: what lives in fast time, beat frequency and amplitude, and needs no body to be seen.

pub mod bursts;
pub mod droop;
pub mod field;
pub mod harmonic;
pub mod image;
pub mod noise;
pub mod open;
pub mod rail;
pub mod response;
pub mod still;
pub mod support;

use super::Suspect;

/// The members of this family.
pub const SUSPECTS: &[Suspect] = &[
    Suspect { name: "still field", find: still::find },
    Suspect { name: "still field, room unknown", find: open::find },
    Suspect { name: "quadrature image", find: image::find },
    Suspect { name: "bursts", find: bursts::find },
    Suspect { name: "non-linear receiver", find: harmonic::find },
    Suspect { name: "noise", find: noise::find },
    Suspect { name: "droop", find: droop::find },
    Suspect { name: "converter's rail", find: rail::find },
];
