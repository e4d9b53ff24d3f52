//! Breathing.

use serde_json::{Value, json};

use super::body_part::part_weights;
use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::person::Person;
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::physiology::Swell;

settings! {
    /// The trunk's surface swells along its normals, ± amplitude.
    Breathing { rate_hz: f64 [0.0, 5.0], amplitude_m: f64 [0.0, 0.05] }
}

const STREAM: Stream = Stream::new(13);

impl Effect for Breathing {
    const OF_PERSON: bool = true;
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": context.draws.phase(STREAM, 0) })
    }
}

impl Breathing {
    /// The trunk's sinusoidal motion, with a drawn phase.
    ///
    /// # Errors
    /// A person given as meshes, or a body whose spine moves no vertex.
    pub fn swell(&self, draws: &Draws, person: &Person) -> Result<Swell> {
        Ok(Swell {
            weights: part_weights(person, &["spine1", "spine2", "spine3"], "effects.breathing")?,
            amplitude_m: self.amplitude_m,
            rate_hz: self.rate_hz,
            phase_rad: draws.phase(STREAM, 0),
            harmonic: 0.0,
        })
    }
}
