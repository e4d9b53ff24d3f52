//! Noise that is not white, not Gaussian, or not independent between receivers.

use num_complex::Complex64;
use rand::RngExt;
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
        colour(&world.radar, coloured.knee_hz, coloured.power, noise);
    }
}

/// Every chirp's spectrum times √(1 + (knee/f)^power).
fn colour(radar: &Radar, knee_hz: f64, power: f64, noise: &mut Signal) {
    let count = noise.samples;
    let bin_hz = radar.sample_rate_hz / count as f64;
    let gains: Vec<f64> = (0..count)
        .map(|bin| {
            let frequency = (bin.min(count - bin) as f64).max(0.5) * bin_hz;
            (1.0 + (knee_hz / frequency).powf(power)).sqrt() / count as f64
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
