//! Receivers that pick up what their neighbours do.

use num_complex::Complex64;
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::signal::Signal;

settings! {
    /// Of each receiver in its neighbours.
    MutualCoupling { level_db: f64 [-120.0, -3.0] }
}

const STREAM: Stream = Stream::new(9);

impl Effect for MutualCoupling {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        if context.radar.rx_m.len() < 2 {
            return Err(Error::setting(key, "on", "off for a single receiver"));
        }
        Ok(())
    }

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "phase_rad": context.draws.phase(STREAM, 0) })
    }
}

impl MutualCoupling {
    /// Complex factor from a receiver to its neighbour, with a drawn phase.
    pub fn factor(&self, draws: &Draws) -> Complex64 {
        Complex64::from_polar(10f64.powf(self.level_db / 20.0), draws.phase(STREAM, 0))
    }

    /// Adds to every receiver what its two neighbours receive, times `factor`.
    pub fn apply(factor: Complex64, signal: &mut Signal) {
        signal.mix_receivers(|_, _, values| {
            let own = values.to_vec();
            for (rx, value) in values.iter_mut().enumerate() {
                let below = if rx > 0 { own[rx - 1] } else { Complex64::ZERO };
                let above = own.get(rx + 1).copied().unwrap_or(Complex64::ZERO);
                *value += factor * (below + above);
            }
        });
    }
}
