//! A tone at the intermediate frequency.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::context::Context;
use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;
use crate::recorder::draws::Stream;
use crate::recorder::signal::{Place, Signal};

settings! {
    /// A continuous tone at the intermediate frequency, relative to the peak sample.
    Spur {
        frequency_hz: f64 [-1.0e8, 1.0e8], level_db: f64 [-120.0, 40.0],
        /// It starts each chirp with the same phase.
        #[serde(default)] coherent: bool,
    }
}

const STREAM: Stream = Stream::new(7);

impl Effect for Spur {
    const STREAM: Option<Stream> = Some(STREAM);
}

impl Spur {
    /// `[rx]`
    pub fn amplitudes(&self, context: &Context, peak: f64) -> Vec<Complex64> {
        let phase = |rx: usize| context.draws.phase(STREAM, rx);
        (0..context.radar.rx_m.len()).map(|rx| Complex64::from_polar(peak * from_db(self.level_db), phase(rx))).collect()
    }

    /// `ramp_s`: when a chirp's ramp starts.
    pub fn add(&self, amplitudes: &[Complex64], sample_rate_hz: f64, ramp_s: impl Fn(Place) -> f64, signal: &mut Signal) {
        for (place, chirp) in signal.chirps_mut() {
            let start_s = if self.coherent { 0.0 } else { ramp_s(place) };
            for (n, value) in chirp.iter_mut().enumerate() {
                let turns = self.frequency_hz * (start_s + n as f64 / sample_rate_hz);
                *value += amplitudes[place.rx] * Complex64::cis(TAU * turns.fract());
            }
        }
    }
}
