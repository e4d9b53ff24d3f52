//! A board that sends the scene's return into the scene again.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::effect::Effect;
use super::settings::settings;
use crate::radar::Radar;
use crate::recorder::resample::Resampler;
use crate::recorder::signal::{Place, Signal};

settings! {
    /// The board sends the scene's return into the scene again: `coefficient` is the second bounce over the first
    /// where the first has the peak sample's level.
    ObjectRadarObject { coefficient: f64 [0.0, 1.0] }
}

impl Effect for ObjectRadarObject {}

impl ObjectRadarObject {
    /// The two beams of R6 multiplied: tx → scene → board and board → scene → rx, as fractions of `peak`.
    ///
    /// The dechirp adds delays, but of −πS(τ₁ + τ₂)² the mixed part −2πSτ₁τ₂ is in neither beam; to first order it is a
    /// product of derivatives, as each brings down 2πSτ.
    pub fn twice_bounced(&self, out: &Signal, back: &Signal, radar: &Radar, resampler: &Resampler, peak: f64) -> Signal {
        let factor = self.coefficient / peak;
        let mut product = back.clone();
        for (place, chirp) in product.chirps_mut() {
            let first = out.chirp(Place { rx: 0, ..place });
            let second = back.chirp(place);
            let derivative = |signal: &[Complex64], n: usize| {
                const STEP: f64 = 0.1;
                let [before, after] = [-STEP, STEP].map(|step| resampler.at(signal, n as f64 + step));
                (after - before) * (radar.sample_rate_hz / (2.0 * STEP))
            };
            let mixed = Complex64::new(0.0, 1.0 / (TAU * radar.slope_hz_per_s));
            for (n, value) in chirp.iter_mut().enumerate() {
                *value = factor * (first[n] * second[n] + mixed * derivative(first, n) * derivative(second, n));
            }
        }
        product
    }
}
