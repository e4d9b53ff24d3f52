//! What the oscillator does differently from chirp to chirp.

use serde_json::{Value, json};

use crate::radar::Radar;

/// How one chirp departs from an ideal one: its frequency, its start and its quadratic bend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChirpError {
    pub offset_hz: f64,
    pub late_s: f64,
    pub quadratic_hz: f64,
}

/// Of every chirp of a frame, in time; none of an ideal oscillator.
pub type ChirpErrors<'a> = &'a dyn Fn(usize) -> Option<Vec<ChirpError>>;

/// `[frame, chirp]`
pub fn by_frame(radar: &Radar, chirps: ChirpErrors, of: fn(&ChirpError) -> f64) -> Value {
    let frame = |frame: usize| chirps(frame).map(|chirps| chirps.iter().map(of).collect::<Vec<f64>>());
    json!((0..radar.frames).map(frame).collect::<Vec<_>>())
}
