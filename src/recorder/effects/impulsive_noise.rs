//! Noise that is not Gaussian.

use rand::RngExt;

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::signal::Signal;
use crate::recorder::white::deviate;

settings! {
    /// With this probability a sample's noise is `strength` times as strong.
    ImpulsiveNoise { rate: f64 [0.0, 1.0], strength: f64 [1.0, 1.0e4] }
}

const STREAM: Stream = Stream::of_noise(15);

impl Effect for ImpulsiveNoise {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        context.check_noise(key)
    }
}

impl ImpulsiveNoise {
    /// Strengthens single samples of a noise, each with the probability `rate`.
    pub fn shape(&self, draws: &Draws, noise: &mut Signal) {
        let mut rng = draws.of_effect(STREAM, noise.frame);
        for value in &mut noise.values {
            if rng.random::<f64>() < self.rate {
                *value *= self.strength;
            }
        }
    }

    /// Adds what white noise of deviation `sigma` per component lacks.
    pub fn add(&self, context: &Context, sigma: f64, signal: &mut Signal) {
        let mut rng = context.draws.of_effect(STREAM, signal.frame);
        let further = sigma * (self.strength * self.strength - 1.0).max(0.0).sqrt();
        for sample in &mut signal.values {
            if rng.random::<f64>() < self.rate {
                *sample += deviate(context.radar.sampling, further, &mut rng);
            }
        }
    }
}
