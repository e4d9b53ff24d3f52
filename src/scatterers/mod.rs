//! Scatterers: room patches and who sees whom.

pub mod room_patches;
pub mod visibility;
