//! A point that reflects and moves.

use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::sinusoid::SinusoidalMotion;
use crate::recorder::vector::length;

settings! {
    /// Oscillates about its place; amplitude as for a static reflector.
    MovingReflector {
        position_m: [f64; 3] [-100.0, 100.0],
        /// Direction of the motion; any length.
        #[serde(default = "along_x")] axis: [f64; 3] [-1.0e3, 1.0e3],
        swing_m: f64 [0.0, 5.0], rate_hz: f64 [0.0, 100.0], amplitude: f64 [0.0, 1.0e3],
    }
}

fn along_x() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

const STREAM: Stream = Stream::new(10);

impl Effect for MovingReflector {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, _: &Context, key: &str) -> Result<()> {
        if length(self.axis) == 0.0 && self.swing_m > 0.0 {
            return Err(Error::setting(format!("{key}.axis"), "zero", "a direction"));
        }
        Ok(())
    }

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": context.draws.phase(STREAM, context.index) })
    }
}

impl MovingReflector {
    /// About its place; `index`: which of its kind it is.
    pub fn motion(&self, draws: &Draws, index: usize) -> SinusoidalMotion {
        SinusoidalMotion::along(self.axis, self.swing_m, self.rate_hz, draws.phase(STREAM, index))
    }
}
