//! From the paths at the antennas to the samples of the ADC's window.

use num_complex::Complex64;

use super::chain::Chain;
use super::channels::Channels;
use super::clock::Clock;
use super::if_filter::IfFilter;
use super::oscillator::Oscillator;
use crate::radar::Radar;
use crate::recorder::chirp::{Chirp, widened};
use crate::recorder::effects::{ChirpError, EffectsConfig, Outside};
use crate::recorder::resample::{HALF, Resampler};
use crate::recorder::signal::{Place, Signal};
use crate::recorder::world::World;

/// Everything between the scene and the converter that does not depend on how strong the signal is.
#[derive(Clone, Debug)]
pub struct Stages {
    /// The radar as it really is.
    pub radar: Radar,
    /// With `guard` samples at either end of its window, which interpolation and filters need.
    pub wide: Radar,
    guard: usize,
    pub clock: Clock,
    pub resampler: Resampler,
    oscillator: Option<Oscillator>,
    filter: Option<IfFilter>,
    channels: Channels,
    /// `[tx, rx]`, relative to the peak.
    leakage: Vec<Complex64>,
}

impl Stages {
    /// Prepares a world's stages, and finds how many guard samples their interpolations and filters need.
    pub fn new(world: &World) -> Self {
        let effects = &world.effects;
        let radar = effects.true_radar(&world.radar);
        let resampler = Resampler::new(radar.sampling);
        let oscillator = Oscillator::new(world, &radar);
        let filter = IfFilter::new(effects, &radar, &resampler);
        let skewed = effects.outside.iter().any(|effect| matches!(effect, Outside::RxMuxSkew { .. }));
        let delayed = effects.range_bias.is_some() || effects.body_multibounce.is_some();
        // Every interpolation eats as many samples as its kernel reaches, and up to two for its shift.
        let interpolations = [oscillator.is_some(), skewed, delayed].into_iter().filter(|on| *on).count();
        let steps = if effects.object_radar_object.is_some() { interpolations + 1 } else { interpolations };
        let most_skew = if skewed { radar.rx_m.len() } else { 0 };
        let guard = steps * (HALF + 2) + most_skew + filter.as_ref().map_or(0, |filter| filter.guard(&radar));
        Self {
            wide: widened(&radar, guard),
            guard,
            clock: Clock::new(effects),
            resampler,
            oscillator,
            filter,
            channels: Channels::new(world),
            leakage: effects.tx_leakage.as_ref().map_or(vec![], |leak| leak.amplitudes(&world.context())),
            radar,
        }
    }

    /// Samples that are recorded before and after the ADC's window, and cropped by [`Self::apply`].
    pub fn guard(&self) -> usize {
        self.guard
    }

    /// Of the first wide sample, after the nominal start of the ramp.
    fn first_s(&self) -> f64 {
        self.wide.adc_start_s
    }

    /// `body_multibounce`: the body's return once more, delayed.
    pub fn multibounce(&self, effects: &EffectsConfig, body: &mut Signal) {
        if let Some(bounce) = &effects.body_multibounce {
            bounce.add(&self.resampler, &self.wide, body);
        }
    }

    /// From all paths, wide, to the IF in the ADC's window: leakage, hardware delay, oscillator, antennas, filter.
    /// `peak` is what the leakage is relative to.
    pub fn apply(&self, world: &World, peak: f64, mut signal: Signal) -> Signal {
        let effects = &world.effects;
        if let Some(leak) = &effects.tx_leakage {
            leak.add(&Chirp::new(&self.wide), &self.leakage, peak, &mut signal);
        }
        if let Some(bias) = &effects.range_bias {
            bias.apply(&self.resampler, &self.wide, &mut signal);
        }
        if let Some(oscillator) = &self.oscillator {
            let (errors, transmitters) = (oscillator.draw(world, signal.frame), signal.tx);
            for (Place { tx, index, .. }, chirp) in signal.chirps_mut() {
                oscillator.apply(&self.resampler, &errors[index * transmitters + tx], self.first_s(), chirp);
            }
        }
        self.channels.apply(&mut signal);
        if let Some(filter) = &self.filter {
            for (_, chirp) in signal.chirps_mut() {
                filter.apply(self.first_s(), self.guard, chirp);
            }
        }
        effects.outside.iter().for_each(|effect| effect.skew(&self.resampler, &mut signal));
        signal.cropped(self.guard)
    }

    /// What the oscillator did in a frame, chirp by chirp.
    pub fn chirp_errors(&self, world: &World, frame: usize) -> Option<Vec<ChirpError>> {
        self.oscillator.as_ref().map(|oscillator| oscillator.draw(world, frame))
    }

    /// The phase that the oscillator adds by definition, in turns.
    pub fn extra_turns(&self, error: &ChirpError, time_s: f64, delay_s: f64) -> f64 {
        let late = self.radar.slope_hz_per_s * error.late_s * delay_s;
        let extra = |oscillator: &Oscillator| oscillator.extra_turns(error, time_s - error.late_s, delay_s) - late;
        self.oscillator.as_ref().map_or(0.0, extra)
    }

    /// The receiver behind these stages; `peak` is what relative levels are relative to.
    pub fn chain(&self, world: &World, peak: f64) -> Chain {
        Chain::new(world, self.clock, peak)
    }
}
