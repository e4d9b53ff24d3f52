//! A ramp that ripples.

use std::f64::consts::TAU;

use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::recorder::draws::{Draws, Stream};

settings! {
    /// A periodic error of the frequency, deviation · cos(2π ripple t), alike in all chirps.
    ChirpRipple { deviation_hz: f64 [0.0, 5.0e6], ripple_hz: f64 [1.0e4, 2.0e6] }
}

const STREAM: Stream = Stream::new(1);

impl Effect for ChirpRipple {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": self.phase_rad(&context.draws) })
    }
}

impl ChirpRipple {
    /// In the middle of the ADC window.
    pub fn phase_rad(&self, draws: &Draws) -> f64 {
        draws.phase(STREAM, 0)
    }

    /// Error of the frequency, its rate, and its integral in turns, `time_s` after the middle of the ADC window.
    pub fn error(&self, phase_rad: f64, time_s: f64) -> (f64, f64, f64) {
        let (sin, cos) = (TAU * self.ripple_hz * time_s + phase_rad).sin_cos();
        (
            self.deviation_hz * cos,
            -(self.deviation_hz * TAU * self.ripple_hz * sin),
            self.deviation_hz * sin / (TAU * self.ripple_hz),
        )
    }
}
