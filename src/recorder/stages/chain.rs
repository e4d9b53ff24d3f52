//! From the filtered intermediate frequency to the converter's input: gains, nonlinearities, and what is added; and what
//! happens to the converter's codes.

use num_complex::Complex64;

use super::clock::Clock;
use crate::data::IfFrame;
use crate::radar::{Radar, Sampling};
use crate::recorder::effects::{Burst, EffectsConfig};
use crate::recorder::signal::{Place, Signal};
use crate::recorder::world::World;

/// The receiver's own imperfections; `peak` is what relative levels are relative to.
#[derive(Clone, Debug)]
pub struct Chain {
    effects: EffectsConfig,
    radar: Radar,
    clock: Clock,
    peak: f64,
    bursts: Vec<Burst>,
    /// `[rx]`
    offsets: Vec<Complex64>,
    transients: Vec<Complex64>,
    spurs: Vec<Complex64>,
}

impl Chain {
    /// The imperfections of a world's receiver, with what is random about them drawn for the whole recording.
    pub fn new(world: &World, clock: Clock, peak: f64) -> Self {
        let (effects, context) = (&world.effects, world.context());
        let offsets = effects.dc_offset.as_ref().map_or(vec![], |dc| dc.offsets(&context));
        Self {
            transients: effects.ramp_edge_transient.as_ref().map_or(vec![], |edge| edge.amplitudes(&context, peak)),
            spurs: effects.spur.as_ref().map_or(vec![], |spur| spur.amplitudes(&context, peak)),
            offsets: offsets.into_iter().map(|offset| offset * peak).collect(),
            bursts: effects.interference.as_ref().map_or(vec![], |other| other.crossings(&context)),
            effects: effects.clone(),
            radar: world.radar.clone(),
            clock,
            peak,
        }
    }

    /// Puts everything on the samples of the window, `[tx, rx, loop, sample]`.
    pub fn apply(&self, world: &World, signal: &mut Signal) {
        let outside = &self.effects.outside;
        self.drop_quadrature(signal);
        self.gains(signal);
        for (index, effect) in outside.iter().enumerate() {
            effect.amplify(&world.draws(), index, self.ramp_s(signal.frame), signal);
        }
        self.nonlinear(signal);
        outside.iter().for_each(|effect| effect.pull(self.peak, signal));
        self.add(signal);
        outside.iter().for_each(|effect| effect.remember(signal));
    }

    /// A receiver may have none.
    fn drop_quadrature(&self, signal: &mut Signal) {
        if self.radar.sampling == Sampling::Real {
            signal.values.iter_mut().for_each(|value| value.im = 0.0);
        }
    }

    /// When the ramps of a frame start.
    fn ramp_s(&self, frame: usize) -> impl Fn(Place) -> f64 {
        move |Place { tx, index, .. }| self.clock.ramp_s(&self.radar, frame, tx, index)
    }

    fn gains(&self, signal: &mut Signal) {
        let EffectsConfig { chirp_droop: droop, gain_drift: drift, chirp_settling: settling, .. } = &self.effects;
        if droop.is_none() && drift.is_none() && settling.is_none() {
            return;
        }
        let samples = signal.samples;
        let fast: Vec<f64> = (0..samples).map(|n| droop.as_ref().map_or(1.0, |droop| droop.gain(n, samples))).collect();
        let first_s = self.clock.ramp_s(&self.radar, 0, 0, 0);
        let last_s = self.clock.ramp_s(&self.radar, self.radar.frames - 1, 0, self.radar.loops_per_frame);
        let ramp_s = self.ramp_s(signal.frame);
        for (place, chirp) in signal.chirps_mut() {
            let mut slow = drift.as_ref().map_or(1.0, |drift| drift.gain(ramp_s(place), [first_s, last_s]));
            if let Some(settling) = settling {
                slow *= settling.gain(place.index * self.radar.tx_m.len() + place.tx);
            }
            chirp.iter_mut().zip(&fast).for_each(|(value, gain)| *value *= slow * gain);
        }
    }

    fn nonlinear(&self, signal: &mut Signal) {
        let effects = &self.effects;
        let per_peak = if self.peak > 0.0 { 1.0 / self.peak } else { 0.0 };
        if let Some(compression) = &effects.compression {
            compression.apply(per_peak, signal);
        }
        if let Some(harmonic) = &effects.second_harmonic {
            harmonic.apply(per_peak, signal);
        }
        if let Some(imbalance) = &effects.iq_imbalance {
            imbalance.apply(signal);
        }
    }

    fn add(&self, signal: &mut Signal) {
        let effects = &self.effects;
        if let Some(dc) = &effects.dc_offset {
            dc.add(&self.offsets, signal);
        }
        if let Some(edge) = &effects.ramp_edge_transient {
            edge.add(&self.transients, signal);
        }
        if let Some(spur) = &effects.spur {
            spur.add(&self.spurs, self.radar.sample_rate_hz, self.ramp_s(signal.frame), signal);
        }
        if let Some(other) = &effects.interference {
            other.add(&self.bursts, &self.radar, self.peak, signal);
        }
        self.drop_quadrature(signal);
    }
}

/// What happens to the codes of a frame.
pub fn damage(effects: &EffectsConfig, number: usize, frame: &mut IfFrame) {
    effects.outside.iter().for_each(|effect| effect.damage(number, frame));
}
