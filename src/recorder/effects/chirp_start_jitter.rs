//! Ramps that start late at random.

use rand::RngExt;
use serde_json::{Value, json};

use super::chirp_error::{ChirpErrors, by_frame};
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::recorder::draws::{Draws, Stream};

settings! {
    /// Each ramp starts late by either nothing or this.
    ChirpStartJitter { jitter_s: f64 [0.0, 1.0e-7] }
}

const STREAM: Stream = Stream::of_noise(3);

impl Effect for ChirpStartJitter {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, chirps: ChirpErrors) -> Value {
        json!({ "drawn_s": by_frame(context.radar, chirps, |chirp| chirp.late_s) })
    }
}

impl ChirpStartJitter {
    /// Of `count` chirps of a frame.
    pub fn late_s(&self, draws: &Draws, frame: usize, count: usize) -> Vec<f64> {
        let mut random = draws.of_effect(STREAM, frame);
        (0..count).map(|_| if random.random::<bool>() { self.jitter_s } else { 0.0 }).collect()
    }
}
