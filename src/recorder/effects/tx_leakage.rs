//! Leakage of the transmitters on the board.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::decibels::{from_db, in_db};
use super::effect::Effect;
use super::settings::settings;
use crate::radar::SPEED_OF_LIGHT;
use crate::recorder::chirp::Chirp;
use crate::recorder::draws::Stream;
use crate::recorder::signal::{Place, Signal};

settings! {
    /// A short path from transmitters to receivers on the board, `relative` to the peak sample.
    TxLeakage {
        range_m: f64 [0.0, 1.0], relative: f64 [0.0, 100.0],
        /// Standard deviation of its level between channels.
        #[serde(default)] spread_db: f64 [0.0, 20.0],
    }
}

const STREAM: Stream = Stream::new(4);

impl Effect for TxLeakage {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({
            "level_db": in_db(self.relative),
            "drawn_relative": self.amplitudes(context).iter().map(|value| value.norm()).collect::<Vec<f64>>(),
        })
    }
}

impl TxLeakage {
    /// `[tx, rx]`, relative to the peak sample.
    pub fn amplitudes(&self, context: &Context) -> Vec<Complex64> {
        let mut rng = context.draws.of_effect(STREAM, 0);
        (0..context.radar.tx_m.len() * context.radar.rx_m.len())
            .map(|_| {
                let spread: f64 = StandardNormal.sample(&mut rng);
                Complex64::from_polar(self.relative * from_db(self.spread_db * spread), TAU * rng.random::<f64>())
            })
            .collect()
    }

    /// Adds the leakage's tone to every chirp; `amplitudes`, `[tx, rx]`, are relative to `peak`.
    pub fn add(&self, path: &Chirp, amplitudes: &[Complex64], peak: f64, signal: &mut Signal) {
        let receivers = signal.rx;
        let delay_s = 2.0 * self.range_m / SPEED_OF_LIGHT;
        for (Place { tx, rx, .. }, chirp) in signal.chirps_mut() {
            path.add_static(chirp, amplitudes[tx * receivers + rx] * peak, delay_s);
        }
    }
}
