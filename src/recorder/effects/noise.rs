//! Noise that is not white, not Gaussian, or not independent between receivers.

use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rustfft::FftPlanner;

use super::signal::Signal;
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};
use crate::recorder::world::{Draw, World};

/// Turns white noise of deviation `sigma` per component into what the effects make of it.
pub fn shape(world: &World, sigma: f64, noise: &mut Signal) {
    let effects = &world.effects;
    if let Some(correlated) = &effects.correlated_noise {
        let mut rng = world.random(Draw::Effect { id: super::CORRELATED_NOISE, frame: noise.frame });
        let (own, shared) = ((1.0 - correlated.rho).sqrt(), correlated.rho.sqrt());
        let quadrature = world.radar.sampling == Sampling::Complex;
        noise.mix_receivers(|_, _, values| {
            let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
            let common = Complex64::new(draw(), if quadrature { draw() } else { 0.0 }) * (sigma * shared);
            values.iter_mut().for_each(|value| *value = *value * own + common);
        });
    }
    if let Some(impulsive) = &effects.impulsive_noise {
        let mut rng = world.random(Draw::Effect { id: super::IMPULSIVE_NOISE, frame: noise.frame });
        for value in &mut noise.values {
            if rng.random::<f64>() < impulsive.rate {
                *value *= impulsive.strength;
            }
        }
    }
    if let Some(coloured) = &effects.coloured_noise {
        colour(&world.radar, coloured.knee_hz, coloured.power, 1.0, noise);
    }
}

/// Adds to samples what makes white noise of deviation `sigma` per component, which they hold already, into what the effects make of it.
/// Equal in law to [`shape`], but for correlated noise: what is there cannot be taken back, so the level rises by 1/(1 − ρ).
pub fn add(world: &World, sigma: f64, signal: &mut Signal) {
    let (effects, frame) = (&world.effects, signal.frame);
    let quadrature = world.radar.sampling == Sampling::Complex;
    let value = |rng: &mut ChaCha8Rng, deviation: f64| {
        let mut draw = || -> f64 { StandardNormal.sample(rng) };
        Complex64::new(draw(), if quadrature { draw() } else { 0.0 }) * deviation
    };
    if let Some(correlated) = &effects.correlated_noise {
        let mut rng = world.random(Draw::Effect { id: super::CORRELATED_NOISE, frame });
        // What all receivers share is ρ of the whole.
        let shared = sigma * (correlated.rho / (1.0 - correlated.rho).max(LEAST_OWN)).sqrt();
        signal.mix_receivers(|_, _, values| {
            let common = value(&mut rng, shared);
            values.iter_mut().for_each(|value| *value += common);
        });
    }
    if let Some(impulsive) = &effects.impulsive_noise {
        let mut rng = world.random(Draw::Effect { id: super::IMPULSIVE_NOISE, frame });
        let further = sigma * (impulsive.strength * impulsive.strength - 1.0).max(0.0).sqrt();
        for sample in &mut signal.values {
            if rng.random::<f64>() < impulsive.rate {
                *sample += value(&mut rng, further);
            }
        }
    }
    if let Some(coloured) = &effects.coloured_noise {
        let mut rng = world.random(Draw::Noise { frame });
        let mut noise = signal.clone();
        noise.values.iter_mut().for_each(|sample| *sample = value(&mut rng, sigma));
        colour(&world.radar, coloured.knee_hz, coloured.power, 0.0, &mut noise);
        signal.values.iter_mut().zip(noise.values).for_each(|(sample, noise)| *sample += noise);
    }
}

/// A receiver's own share of the noise is at least this, so that what is shared stays finite.
const LEAST_OWN: f64 = 1e-3;

/// Every chirp's spectrum times √(white + (knee/f)^power).
fn colour(radar: &Radar, knee_hz: f64, power: f64, white: f64, noise: &mut Signal) {
    let count = noise.samples;
    let bin_hz = radar.sample_rate_hz / count as f64;
    let gains: Vec<f64> = (0..count)
        .map(|bin| {
            let frequency = (bin.min(count - bin) as f64).max(0.5) * bin_hz;
            (white + (knee_hz / frequency).powf(power)).sqrt() / count as f64
        })
        .collect();
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(count), planner.plan_fft_inverse(count));
    for (_, chirp) in noise.chirps_mut() {
        forward.process(chirp);
        chirp.iter_mut().zip(&gains).for_each(|(value, gain)| *value *= gain);
        inverse.process(chirp);
    }
}

pub fn check(world: &World, key: &str) -> Result<()> {
    let effects = &world.effects;
    let on = [
        ("coloured_noise", effects.coloured_noise.is_some()),
        ("impulsive_noise", effects.impulsive_noise.is_some()),
        ("correlated_noise", effects.correlated_noise.is_some()),
    ];
    match on.iter().find(|(_, on)| *on && !world.receiver.noise) {
        Some((name, _)) => Err(Error::setting(format!("{key}.{name}"), "on", "off without receiver.noise")),
        None => Ok(()),
    }
}
