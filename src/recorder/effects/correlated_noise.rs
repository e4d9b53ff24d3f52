//! Noise that receivers share.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::recorder::draws::Stream;
use crate::recorder::signal::Signal;
use crate::recorder::white::deviate;

settings! {
    /// The correlation between receivers.
    CorrelatedNoise { rho: f64 [0.0, 1.0] }
}

const STREAM: Stream = Stream::of_noise(16);

/// A receiver's own share of the noise is at least this, so that what is shared stays finite.
const LEAST_OWN: f64 = 1e-3;

impl Effect for CorrelatedNoise {
    const STREAM: Option<Stream> = Some(STREAM);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        context.check_noise(key)
    }
}

impl CorrelatedNoise {
    /// Makes a part of white noise of deviation `sigma` per component the same in all receivers.
    pub fn shape(&self, context: &Context, sigma: f64, noise: &mut Signal) {
        let mut rng = context.draws.of_effect(STREAM, noise.frame);
        let (own, shared) = ((1.0 - self.rho).sqrt(), self.rho.sqrt());
        noise.mix_receivers(|_, _, values| {
            let common = deviate(context.radar.sampling, sigma * shared, &mut rng);
            values.iter_mut().for_each(|value| *value = *value * own + common);
        });
    }

    /// Adds what all receivers share to white noise of deviation `sigma` per component: ρ of the whole. What is there cannot be
    /// taken back, so the level rises by 1/(1 − ρ).
    pub fn add(&self, context: &Context, sigma: f64, signal: &mut Signal) {
        let mut rng = context.draws.of_effect(STREAM, signal.frame);
        let shared = sigma * (self.rho / (1.0 - self.rho).max(LEAST_OWN)).sqrt();
        signal.mix_receivers(|_, _, values| {
            let common = deviate(context.radar.sampling, shared, &mut rng);
            values.iter_mut().for_each(|value| *value += common);
        });
    }
}
