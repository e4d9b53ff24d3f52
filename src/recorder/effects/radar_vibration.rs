//! A radar that vibrates.

use std::f64::consts::{PI, TAU};

use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::sinusoid::SinusoidalMotion;

settings! {
    /// Of the radar along its boresight.
    RadarVibration { amplitude_m: f64 [0.0, 1.0e-3], frequency_hz: f64 [0.0, 5.0e3] }
}

const STREAM: Stream = Stream::new(11);

impl Effect for RadarVibration {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let wavelength_m = context.radar.wavelength_m();
        if 2.0 * TAU * self.amplitude_m / wavelength_m > PI {
            let wanted = format!("at most a quarter of a wavelength, {:.2e} metres", 0.25 * wavelength_m);
            return Err(Error::setting(format!("{key}.amplitude_m"), self.amplitude_m, wanted));
        }
        Ok(())
    }

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": context.draws.phase(STREAM, 0) })
    }
}

impl RadarVibration {
    /// The radar's motion along y, with a drawn phase.
    pub fn motion(&self, draws: &Draws) -> SinusoidalMotion {
        SinusoidalMotion {
            amplitude_m: [0.0, self.amplitude_m, 0.0],
            rate_hz: self.frequency_hz,
            phase_rad: draws.phase(STREAM, 0),
        }
    }
}
