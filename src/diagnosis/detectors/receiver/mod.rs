//! The receiver and its noise: what lives in fast time, beat frequency and amplitude, and needs no body to be seen.

pub mod additive;
mod additive_term;
mod burst;
pub mod bursts;
mod coloured;
mod crossings;
pub mod declipping;
mod elements;
pub mod field;
mod filters;
pub mod harmonic;
mod levels;
mod line;
pub mod noise;
pub mod open;
pub mod clipping;
pub mod response;
mod shares;
pub mod misalignment;
mod slow_spur;
pub mod spur;
pub mod support;
mod transient;
pub mod wandering;
pub mod zero_beat;
