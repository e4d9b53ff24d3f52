//! Noise that is not white, not Gaussian, or not independent between receivers.

use crate::recorder::signal::Signal;
use crate::recorder::world::World;

/// Turns white noise of deviation `sigma` per component into what the effects make of it.
pub fn shape(world: &World, sigma: f64, noise: &mut Signal) {
    let (effects, context) = (&world.effects, world.context());
    if let Some(correlated) = &effects.correlated_noise {
        correlated.shape(&context, sigma, noise);
    }
    if let Some(impulsive) = &effects.impulsive_noise {
        impulsive.shape(&context.draws, noise);
    }
    if let Some(coloured) = &effects.coloured_noise {
        coloured.shape(context.radar, noise);
    }
}

/// Adds to samples what makes white noise of deviation `sigma` per component, which they hold already, into what the effects make of it.
/// Equal in law to [`shape`], but for the level of correlated noise.
pub fn add(world: &World, sigma: f64, signal: &mut Signal) {
    let (effects, context) = (&world.effects, world.context());
    if let Some(correlated) = &effects.correlated_noise {
        correlated.add(&context, sigma, signal);
    }
    if let Some(impulsive) = &effects.impulsive_noise {
        impulsive.add(&context, sigma, signal);
    }
    if let Some(coloured) = &effects.coloured_noise {
        coloured.add(&context, sigma, signal);
    }
}
