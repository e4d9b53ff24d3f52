//! A constant in every sample.

use num_complex::Complex64;
use rand::RngExt;
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::recorder::draws::Stream;
use crate::recorder::signal::Signal;

settings! {
    /// Relative to the peak sample; every receiver has its own within a third around it.
    DcOffset { i: f64 [-10.0, 10.0], q: f64 [-10.0, 10.0] }
}

const STREAM: Stream = Stream::new(5);

impl Effect for DcOffset {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        let offsets = self.offsets(context);
        json!({
            "drawn_i": offsets.iter().map(|value| value.re).collect::<Vec<f64>>(),
            "drawn_q": offsets.iter().map(|value| value.im).collect::<Vec<f64>>(),
        })
    }
}

impl DcOffset {
    /// `[rx]`, relative to the peak sample.
    pub fn offsets(&self, context: &Context) -> Vec<Complex64> {
        let mut rng = context.draws.of_effect(STREAM, 0);
        let mut around = |value: f64| value * rng.random_range(2.0 / 3.0..4.0 / 3.0);
        context.radar.rx_m.iter().map(|_| Complex64::new(around(self.i), around(self.q))).collect()
    }

    /// Adds to every sample its receiver's offset, `[rx]`, in the signal's unit.
    pub fn add(&self, offsets: &[Complex64], signal: &mut Signal) {
        for (place, chirp) in signal.chirps_mut() {
            chirp.iter_mut().for_each(|value| *value += offsets[place.rx]);
        }
    }
}
