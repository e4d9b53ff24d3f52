//! A reflector beyond the unambiguous range.

use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::sinusoid::SinusoidalMotion;
use crate::recorder::vector::{Vector, add_scaled};

settings! {
    /// Something beyond the unambiguous range; amplitude as for a static reflector.
    RangeAlias {
        range_m: f64 [0.0, 200.0], #[serde(default)] azimuth_deg: f64 [-90.0, 90.0], amplitude: f64 [0.0, 1.0e3],
        /// It may oscillate along the line of sight.
        #[serde(default)] swing_m: f64 [0.0, 5.0], #[serde(default)] rate_hz: f64 [0.0, 100.0],
    }
}

const STREAM: Stream = Stream::new(12);

impl Effect for RangeAlias {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let most_m = context.radar.max_range_m();
        if self.range_m <= most_m {
            let wanted = format!("beyond the unambiguous range, {most_m:.2} metres");
            return Err(Error::setting(format!("{key}.range_m"), self.range_m, wanted));
        }
        Ok(())
    }

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        let seen_m = self.range_m.rem_euclid(context.radar.max_range_m());
        json!({ "phase_rad": context.draws.phase(STREAM, 0), "folded_range_m": seen_m })
    }
}

impl RangeAlias {
    /// Its place at rest, and its motion about it, seen from the antennas' `centre`.
    pub fn track(&self, centre: Vector, draws: &Draws) -> (Vector, SinusoidalMotion) {
        let (sin, cos) = self.azimuth_deg.to_radians().sin_cos();
        let ahead = [sin, cos, 0.0];
        let motion = SinusoidalMotion::along(ahead, self.swing_m, self.rate_hz, draws.phase(STREAM, 0));
        (add_scaled(centre, ahead, self.range_m), motion)
    }
}
