//! Another radar.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rand::RngExt;
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::effect::Effect;
use super::settings::{settings, unit};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::draws::Stream;
use crate::recorder::signal::{Place, Signal};

settings! {
    /// Crossings of another radar's chirps, in so many chirps of the recording.
    Interference {
        bursts: usize [1.0, 100000.0],
        /// To the peak sample.
        #[serde(default = "unit")] relative: f64 [0.0, 1000.0],
        /// Where the other radar stands.
        #[serde(default)] azimuth_deg: f64 [-90.0, 90.0],
    }
}

const STREAM: Stream = Stream::new(8);

/// One crossing of the other radar's chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    frame: usize,
    tx: usize,
    index: usize,
    /// Where the two chirps cross, samples.
    sample: f64,
    /// Difference of the slopes.
    slope_hz_per_s: f64,
    relative: f64,
    phase_rad: f64,
}

impl Effect for Interference {
    const STREAM: Option<Stream> = Some(STREAM);

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        json!({ "drawn": self.crossings(context).iter().map(|burst| json!({
            "frame": burst.frame, "tx": burst.tx, "loop": burst.index, "sample": burst.sample,
            "slope_hz_per_s": burst.slope_hz_per_s, "relative": burst.relative,
        })).collect::<Vec<Value>>() })
    }
}

impl Interference {
    /// All of a recording.
    pub fn crossings(&self, context: &Context) -> Vec<Burst> {
        let radar = context.radar;
        let mut rng = context.draws.of_effect(STREAM, 0);
        (0..self.bursts)
            .map(|_| Burst {
                frame: rng.random_range(0..radar.frames),
                tx: rng.random_range(0..radar.tx_m.len()),
                index: rng.random_range(0..radar.loops_per_frame),
                sample: rng.random_range(0.0..radar.samples_per_chirp as f64),
                // Across the whole band in one to eight samples.
                slope_hz_per_s: radar.sample_rate_hz.powi(2) / rng.random_range(1.0..8.0)
                    * if rng.random::<bool>() { 1.0 } else { -1.0 },
                relative: self.relative * rng.random_range(0.5..1.0),
                phase_rad: TAU * rng.random::<f64>(),
            })
            .collect()
    }

    /// Adds the crossings that fall into the signal's frame; `peak` is what their amplitudes are relative to.
    pub fn add(&self, bursts: &[Burst], radar: &Radar, peak: f64, signal: &mut Signal) {
        let frame = signal.frame;
        for (place, chirp) in signal.chirps_mut() {
            let here = |burst: &&Burst| (burst.frame, burst.tx, burst.index) == (frame, place.tx, place.index);
            bursts.iter().filter(here).for_each(|burst| self.cross(burst, place, radar, peak, chirp));
        }
    }

    /// The other chirp sweeps through the band of the receiver's filter: a plane wave, for a few samples.
    fn cross(&self, burst: &Burst, place: Place, radar: &Radar, peak: f64, chirp: &mut [Complex64]) {
        let rate = radar.sample_rate_hz;
        let azimuth = self.azimuth_deg.to_radians();
        let [x, y, _] = radar.rx_m[place.rx];
        let ahead = (x * azimuth.sin() + y * azimuth.cos()) / SPEED_OF_LIGHT;
        for (n, value) in chirp.iter_mut().enumerate() {
            let time_s = (n as f64 - burst.sample) / rate;
            let beat = burst.slope_hz_per_s * time_s;
            let gain = 1.0 / (1.0 + (beat / (0.45 * rate)).powi(8));
            let angle = PI * beat * time_s + burst.phase_rad - TAU * radar.carrier_hz() * ahead;
            *value += Complex64::from_polar(burst.relative * peak * gain, angle);
        }
    }
}
