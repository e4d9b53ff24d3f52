//! Heartbeat.

use serde_json::{Value, json};

use super::body_part::part_weights;
use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::person::Person;
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::mesh::vertex_normals;
use crate::recorder::physiology::Swell;
use crate::recorder::vector::Vector;

settings! {
    /// The chest's front beats, twice per period in quick succession.
    Heartbeat { rate_hz: f64 [0.0, 10.0], amplitude_m: f64 [0.0, 0.01] }
}

const STREAM: Stream = Stream::new(14);

impl Effect for Heartbeat {
    const OF_PERSON: bool = true;
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": context.draws.phase(STREAM, 0) })
    }
}

impl Heartbeat {
    /// `rest`: vertices of the rest pose, `[vertex, xyz]`.
    pub fn swell(&self, draws: &Draws, person: &Person, rest: &[Vector]) -> Result<Swell> {
        // A body at rest faces +z.
        let front = vertex_normals(rest, person.faces());
        let chest = part_weights(person, &["spine2", "spine3"], "effects.heartbeat")?;
        Ok(Swell {
            weights: chest.iter().zip(front).map(|(weight, normal)| weight * normal[2].max(0.0)).collect(),
            amplitude_m: self.amplitude_m,
            rate_hz: self.rate_hz,
            phase_rad: draws.phase(STREAM, 0),
            harmonic: 0.5,
        })
    }
}
