//! Frequency that differs at random from chirp to chirp.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

use super::chirp_error::{ChirpErrors, by_frame};
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::radar::SPEED_OF_LIGHT;
use crate::recorder::draws::{Draws, Stream};

settings! {
    /// A random error of the frequency per chirp, as the phase it causes at 3 m, root mean square.
    PhaseNoise {
        per_chirp_rad: f64 [0.0, 1.0],
        /// Another one per frame.
        #[serde(default)] per_frame_rad: f64 [0.0, 1.0],
    }
}

const STREAM: Stream = Stream::of_noise(2);

/// Range at which phase noise is stated.
const STATED_M: f64 = 3.0;

impl Effect for PhaseNoise {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, chirps: ChirpErrors) -> Value {
        json!({ "drawn_hz": by_frame(context.radar, chirps, |chirp| chirp.offset_hz) })
    }
}

impl PhaseNoise {
    /// Of `count` chirps of a frame.
    pub fn offsets_hz(&self, draws: &Draws, frame: usize, count: usize) -> Vec<f64> {
        let in_hz = |rad: f64| rad * SPEED_OF_LIGHT / (2.0 * STATED_M * TAU);
        let (per_chirp_hz, per_frame_hz) = (in_hz(self.per_chirp_rad), in_hz(self.per_frame_rad));
        let mut random = draws.of_effect(STREAM, frame);
        let common: f64 = StandardNormal.sample(&mut random);
        let mut offset = || {
            let own: f64 = StandardNormal.sample(&mut random);
            per_frame_hz * common + per_chirp_hz * own
        };
        (0..count).map(|_| offset()).collect()
    }
}
