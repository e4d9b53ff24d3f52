//! The receiver and its noise: what lives in fast time, beat frequency and amplitude, and needs no body to be seen.

pub mod bursts;
mod crossings;
pub mod declip;
pub mod field;
pub mod harmonic;
pub mod image;
pub mod noise;
pub mod open;
pub mod rail;
pub mod response;
mod slow_spur;
pub mod spur;
pub mod still;
pub mod support;
pub mod wandering;
pub mod zero_beat;
