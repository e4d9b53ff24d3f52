//! Effects put onto samples that were recorded already, by somebody's radar and with whatever they hold.
//!
//! The physics and the draws are those of the recorder: equal seeds draw the same bursts, phases and offsets. The signal meets the
//! effects in the recorder's order (leakage, oscillator, antennas, gains, nonlinearity, what is added, noise, converter), but what
//! the samples hold has been through a converter before, and its noise goes through the effects too.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::chain::{Chain, damage};
use super::channels::Channels;
use super::clock::Clock;
use super::noise;
use super::oscillator::Oscillator;
use crate::data::IfFrame;
use crate::error::Result;
use crate::radar::{Radar, Sampling};
use crate::recorder::chirp::Chirp;
use crate::recorder::effects::{ChirpError, EffectsConfig};
use crate::recorder::receiver::ReceiverConfig;
use crate::recorder::signal::{Place, Signal};
use crate::recorder::world::World;

/// What must be known of the samples that effects are put onto.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Largest magnitude of a sample about its zero: what relative levels are relative to.
    pub peak: f64,
    /// Largest magnitude of a component about its zero: what the converter's rail bounds.
    pub largest_component: f64,
    /// Of the noise, per component.
    pub sigma: f64,
    /// What stands for zero, in-phase and quadrature: not 0 in codes of offset binary.
    pub zero: Complex64,
    /// Smallest and largest code, where the samples are whole codes.
    pub rail: Option<[f64; 2]>,
}

/// Effects ready to be put onto frames.
#[derive(Clone, Debug)]
pub struct Onto {
    world: World,
    ground: Ground,
    path: Chirp,
    /// `[tx · rx]`, relative to the peak.
    leakage: Vec<Complex64>,
    oscillator: Option<Oscillator>,
    channels: Channels,
    chain: Chain,
}

impl Onto {
    /// # Errors
    /// Effects that this radar cannot have, or numbers out of bounds.
    pub fn new(radar: &Radar, effects: &EffectsConfig, seed: u64, ground: &Ground) -> Result<Self> {
        let receiver = ReceiverConfig { noise: true, adc: ground.rail.is_some(), ..ReceiverConfig::ideal() };
        let world = World { radar: radar.clone(), effects: effects.clone(), receiver, seed, ..World::empty() };
        world.check_radar()?;
        // The rest of an empty world can be recorded.
        effects.check(&world, "effects")?;
        Ok(Self {
            path: Chirp::new(radar),
            leakage: effects.tx_leakage.as_ref().map_or(vec![], |leak| leak.amplitudes(&world.context())),
            oscillator: Oscillator::new(&world, radar),
            channels: Channels::new(&world),
            // Frames keep their numbers: what is lost before one of them is left out by whoever writes them.
            chain: Chain::new(&world, Clock::default(), ground.peak),
            ground: ground.clone(),
            world,
        })
    }

    /// A frame with the effects in it.
    pub fn apply(&self, number: usize, frame: &IfFrame) -> IfFrame {
        let [tx, rx, loops, samples] = frame.dims;
        let Ground { zero, peak, sigma, .. } = self.ground;
        let im = |index: usize| frame.im.as_ref().map_or(0.0, |im| f64::from(im[index]));
        let value = |(index, &re): (usize, &f32)| Complex64::new(re.into(), im(index)) - zero;
        let mut signal =
            Signal { frame: number, tx, rx, loops, samples, values: frame.re.iter().enumerate().map(value).collect() };
        if let Some(leak) = &self.world.effects.tx_leakage {
            leak.add(&self.path, &self.leakage, peak, &mut signal);
        }
        self.turn(&mut signal);
        self.channels.apply(&mut signal);
        self.chain.apply(&self.world, &mut signal);
        noise::add(&self.world, sigma, &mut signal);
        let mut written = self.convert(&signal, frame.dims);
        damage(&self.world.effects, number, &mut written);
        written
    }

    /// What differs from chirp to chirp in the oscillator: the beat is read at another time, for the whole chirp. A recording has no
    /// samples beyond its window, so the chirp's own spectrum is turned, as if it repeated itself.
    fn turn(&self, signal: &mut Signal) {
        let Some(oscillator) = &self.oscillator else { return };
        let radar = &self.world.radar;
        let (errors, transmitters) = (oscillator.draw(&self.world, signal.frame), signal.tx);
        let later = |error: &ChirpError| radar.sample_rate_hz * (error.offset_hz / radar.slope_hz_per_s - error.late_s);
        let count = signal.samples;
        // Beats are positive; a quadrature receiver holds them up to one turn per sample.
        let highest = if radar.sampling == Sampling::Complex { 0.85 } else { 0.5 };
        let turns: Vec<f64> = (0..count)
            .map(|bin| bin as f64 / count as f64)
            .map(|turns| if turns > highest { turns - 1.0 } else { turns })
            .collect();
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(count), planner.plan_fft_inverse(count));
        for (Place { tx, index, .. }, chirp) in signal.chirps_mut() {
            let shift = later(&errors[index * transmitters + tx]);
            forward.process(chirp);
            for (value, turns) in chirp.iter_mut().zip(&turns) {
                *value *= Complex64::cis(std::f64::consts::TAU * turns * shift) / count as f64;
            }
            inverse.process(chirp);
        }
    }

    /// To what is stored; a converter that saturates has its rail where the signal is, and the receiver's gain stays.
    fn convert(&self, signal: &Signal, dims: [usize; 4]) -> IfFrame {
        let Ground { zero, largest_component, rail, .. } = self.ground;
        let saturation = self.world.effects.adc_saturation.as_ref();
        let lower = saturation.map_or(f64::INFINITY, |saturation| saturation.rail(largest_component));
        let stored = |value: f64, zero: f64| {
            let value = value.clamp(-lower, lower) + zero;
            rail.map_or(value, |[low, high]| value.round().clamp(low, high)) as f32
        };
        let re = signal.values.iter().map(|value| stored(value.re, zero.re)).collect();
        let im = || signal.values.iter().map(|value| stored(value.im, zero.im)).collect();
        IfFrame::new(dims, re, (self.world.radar.sampling == Sampling::Complex).then(im))
    }
}

#[cfg(test)]
#[path = "onto_tests.rs"]
mod tests;
