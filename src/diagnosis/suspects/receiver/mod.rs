//! The receiver and its noise: what lives in fast time, beat frequency and amplitude, and needs no body to be seen.

pub mod bursts;
pub mod field;
pub mod image;
pub mod rail;
pub mod response;
pub mod still;
pub mod support;

use super::Suspect;

/// The members of this family.
pub const SUSPECTS: &[Suspect] = &[
    Suspect { name: "still field", find: still::find },
    Suspect { name: "quadrature image", find: image::find },
    Suspect { name: "bursts", find: bursts::find },
    Suspect { name: "converter's rail", find: rail::find },
];
