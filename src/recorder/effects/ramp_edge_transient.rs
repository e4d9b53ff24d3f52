//! A transient at the end of every chirp.

use num_complex::Complex64;
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::draws::Stream;
use crate::recorder::signal::Signal;

settings! {
    /// A transient, alike in all chirps of a receiver, in the last samples of each, relative to the peak sample.
    RampEdgeTransient { samples: usize [1.0, 64.0], level_db: f64 [-120.0, 40.0] }
}

const STREAM: Stream = Stream::new(6);

impl Effect for RampEdgeTransient {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let most = context.radar.samples_per_chirp;
        if self.samples > most {
            let wanted = format!("at most the samples of a chirp, {most}");
            return Err(Error::setting(format!("{key}.samples"), self.samples, wanted));
        }
        Ok(())
    }

    fn drawn(&self, _: &Context, _: ChirpErrors) -> Value {
        json!({ "relative": from_db(self.level_db) })
    }
}

impl RampEdgeTransient {
    /// Of the last sample, `[rx]`.
    pub fn amplitudes(&self, context: &Context, peak: f64) -> Vec<Complex64> {
        let phase = |rx: usize| context.draws.phase(STREAM, rx);
        (0..context.radar.rx_m.len()).map(|rx| Complex64::from_polar(peak * from_db(self.level_db), phase(rx))).collect()
    }

    /// Adds to the last samples of every chirp a transient that decays from the end backwards; `amplitudes`, `[rx]`, are those of
    /// the last sample.
    pub fn add(&self, amplitudes: &[Complex64], signal: &mut Signal) {
        let count = self.samples.min(signal.samples);
        for (place, chirp) in signal.chirps_mut() {
            for (before_end, value) in chirp.iter_mut().rev().take(count).enumerate() {
                *value += amplitudes[place.rx] * (-1.3 * before_end as f64).exp();
            }
        }
    }
}
