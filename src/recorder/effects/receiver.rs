//! From the filtered intermediate frequency to the converter's input: gains, nonlinearities, and what is added.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use super::decibels::from_db;
use super::signal::{Place, Signal};
use super::timing::Clock;
use super::{EffectsConfig, outside};
use crate::error::{Error, Result};
use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};
use crate::recorder::world::{Draw, World};

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

/// One crossing of another radar's chirp (`interference`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    pub frame: usize,
    pub tx: usize,
    pub index: usize,
    /// Where the two chirps cross, samples.
    pub sample: f64,
    /// Difference of the slopes.
    pub slope_hz_per_s: f64,
    pub relative: f64,
    phase_rad: f64,
}

/// All crossings of a recording.
pub fn bursts(world: &World) -> Vec<Burst> {
    let Some(effect) = &world.effects.interference else { return vec![] };
    let radar = &world.radar;
    let mut rng = world.random(Draw::Effect { id: super::INTERFERENCE, frame: 0 });
    (0..effect.bursts)
        .map(|_| Burst {
            frame: rng.random_range(0..radar.frames),
            tx: rng.random_range(0..radar.tx_m.len()),
            index: rng.random_range(0..radar.loops_per_frame),
            sample: rng.random_range(0.0..radar.samples_per_chirp as f64),
            // Across the whole band in one to eight samples.
            slope_hz_per_s: radar.sample_rate_hz.powi(2) / rng.random_range(1.0..8.0)
                * if rng.random::<bool>() { 1.0 } else { -1.0 },
            relative: effect.relative * rng.random_range(0.5..1.0),
            phase_rad: TAU * rng.random::<f64>(),
        })
        .collect()
}

/// Offsets of `dc_offset`, `[rx]`, relative to the peak sample.
pub fn offsets(world: &World) -> Vec<Complex64> {
    let Some(effect) = &world.effects.dc_offset else { return vec![] };
    let mut rng = world.random(Draw::Effect { id: super::DC_OFFSET, frame: 0 });
    let mut around = |value: f64| value * rng.random_range(2.0 / 3.0..4.0 / 3.0);
    world.radar.rx_m.iter().map(|_| Complex64::new(around(effect.i), around(effect.q))).collect()
}

/// Leakage of `tx_leakage`, `[tx, rx]`, relative to the peak sample.
pub fn leakage(world: &World) -> Vec<Complex64> {
    let Some(effect) = &world.effects.tx_leakage else { return vec![] };
    let mut rng = world.random(Draw::Effect { id: super::TX_LEAKAGE, frame: 0 });
    (0..world.radar.tx_m.len() * world.radar.rx_m.len())
        .map(|_| {
            let spread: f64 = StandardNormal.sample(&mut rng);
            Complex64::from_polar(effect.relative * from_db(effect.spread_db * spread), TAU * rng.random::<f64>())
        })
        .collect()
}

impl Chain {
    pub fn new(world: &World, clock: Clock, peak: f64) -> Self {
        let receivers = world.radar.rx_m.len();
        let phases = |id: u64, level: f64| (0..receivers).map(|rx| Complex64::from_polar(level, world.phase(id, rx))).collect();
        let effects = &world.effects;
        let transient = effects.ramp_edge_transient.as_ref();
        let spur = effects.spur.as_ref();
        Self {
            transients: transient.map_or(vec![], |e| phases(super::RAMP_EDGE_TRANSIENT, peak * from_db(e.level_db))),
            spurs: spur.map_or(vec![], |e| phases(super::SPUR, peak * from_db(e.level_db))),
            offsets: offsets(world).into_iter().map(|offset| offset * peak).collect(),
            bursts: bursts(world),
            effects: effects.clone(),
            radar: world.radar.clone(),
            clock,
            peak,
        }
    }

    /// Puts everything on the samples of the window, `[tx, rx, loop, sample]`.
    pub fn apply(&self, world: &World, signal: &mut Signal) {
        if self.radar.sampling == Sampling::Real {
            signal.values.iter_mut().for_each(|value| value.im = 0.0);
        }
        self.gains(signal);
        outside::gains(world, &self.clock, signal);
        self.nonlinear(signal);
        outside::pulling(&self.effects, self.peak, signal);
        self.add(signal);
        outside::memory(&self.effects, signal);
    }

    fn gains(&self, signal: &mut Signal) {
        let effects = &self.effects;
        let droop_db = effects.chirp_droop.as_ref().map_or(0.0, |e| e.db);
        let drift_db = effects.gain_drift.as_ref().map_or(0.0, |e| e.db);
        if droop_db == 0.0 && drift_db == 0.0 && effects.chirp_settling.is_none() {
            return;
        }
        let fast: Vec<f64> =
            (0..signal.samples).map(|n| from_db(-droop_db * n as f64 / (signal.samples - 1).max(1) as f64)).collect();
        let first_s = self.clock.ramp_s(&self.radar, 0, 0, 0);
        let last_s = self.clock.ramp_s(&self.radar, self.radar.frames - 1, 0, self.radar.loops_per_frame);
        let frame = signal.frame;
        for (Place { tx, index, .. }, chirp) in signal.chirps_mut() {
            let time_s = self.clock.ramp_s(&self.radar, frame, tx, index);
            let mut slow = from_db(drift_db * (time_s - first_s) / (last_s - first_s));
            if let Some(settling) = &effects.chirp_settling {
                let number = (index * self.radar.tx_m.len() + tx) as f64;
                slow *= 1.0 - settling.depth * (-number / settling.chirps).exp();
            }
            chirp.iter_mut().zip(&fast).for_each(|(value, gain)| *value *= slow * gain);
        }
    }

    fn nonlinear(&self, signal: &mut Signal) {
        let effects = &self.effects;
        let per_peak = if self.peak > 0.0 { 1.0 / self.peak } else { 0.0 };
        if let Some(compression) = &effects.compression {
            let cubic = compression.level * per_peak * per_peak;
            for value in &mut signal.values {
                // Beyond its maximum the cubic would fold back; a real stage stays there.
                let power = cubic * value.norm_sqr();
                *value *= if power <= 1.0 / 3.0 { 1.0 - power } else { 2.0 / (27.0 * power).sqrt() };
            }
        }
        if let Some(harmonic) = &effects.second_harmonic {
            let square = from_db(harmonic.level_db) * per_peak;
            signal.values.iter_mut().for_each(|value| *value += square * *value * *value);
        }
        if let Some(imbalance) = &effects.iq_imbalance {
            let gain = from_db(imbalance.gain_db);
            let (sin, cos) = imbalance.phase_deg.to_radians().sin_cos();
            signal.values.iter_mut().for_each(|value| value.im = gain * (value.im * cos + value.re * sin));
        }
    }

    fn add(&self, signal: &mut Signal) {
        let (frame, samples) = (signal.frame, signal.samples);
        for (place @ Place { tx, rx, index }, chirp) in signal.chirps_mut() {
            if let Some(offset) = self.offsets.get(rx) {
                chirp.iter_mut().for_each(|value| *value += offset);
            }
            if let Some(transient) = self.transients.get(rx) {
                let count = self.effects.ramp_edge_transient.as_ref().map_or(0, |e| e.samples).min(samples);
                for (before_end, value) in chirp.iter_mut().rev().take(count).enumerate() {
                    *value += transient * (-1.3 * before_end as f64).exp();
                }
            }
            if let (Some(tone), Some(spur)) = (self.spurs.get(rx), &self.effects.spur) {
                let start_s = if spur.coherent { 0.0 } else { self.clock.ramp_s(&self.radar, frame, tx, index) };
                for (n, value) in chirp.iter_mut().enumerate() {
                    let turns = spur.frequency_hz * (start_s + n as f64 / self.radar.sample_rate_hz);
                    *value += tone * Complex64::cis(TAU * turns.fract());
                }
            }
            let here = |burst: &&Burst| (burst.frame, burst.tx, burst.index) == (frame, tx, index);
            self.bursts.iter().filter(here).for_each(|burst| self.interfere(burst, place, chirp));
        }
        if self.radar.sampling == Sampling::Real {
            signal.values.iter_mut().for_each(|value| value.im = 0.0);
        }
    }

    /// The other chirp sweeps through the band of the receiver's filter: a plane wave, for a few samples.
    fn interfere(&self, burst: &Burst, place: Place, chirp: &mut [Complex64]) {
        let rate = self.radar.sample_rate_hz;
        let azimuth = self.effects.interference.as_ref().map_or(0.0, |e| e.azimuth_deg).to_radians();
        let [x, y, _] = self.radar.rx_m[place.rx];
        let ahead = (x * azimuth.sin() + y * azimuth.cos()) / SPEED_OF_LIGHT;
        for (n, value) in chirp.iter_mut().enumerate() {
            let time_s = (n as f64 - burst.sample) / rate;
            let beat = burst.slope_hz_per_s * time_s;
            let gain = 1.0 / (1.0 + (beat / (0.45 * rate)).powi(8));
            let angle = std::f64::consts::PI * beat * time_s + burst.phase_rad - TAU * self.radar.carrier_hz() * ahead;
            *value += Complex64::from_polar(burst.relative * self.peak * gain, angle);
        }
    }
}

pub fn check(world: &World, key: &str) -> Result<()> {
    let (effects, radar) = (&world.effects, &world.radar);
    if effects.iq_imbalance.is_some() && radar.sampling == Sampling::Real {
        return Err(Error::setting(format!("{key}.iq_imbalance"), "on", "off for a receiver without quadrature"));
    }
    if let Some(transient) = &effects.ramp_edge_transient
        && transient.samples > radar.samples_per_chirp
    {
        let wanted = format!("at most the samples of a chirp, {}", radar.samples_per_chirp);
        return Err(Error::setting(format!("{key}.ramp_edge_transient.samples"), transient.samples, wanted));
    }
    if let Some(delay) = &effects.if_delay
        && delay.delay_s >= radar.adc_start_s
    {
        let wanted = format!("less than radar.adc_start_s, {}", radar.adc_start_s);
        return Err(Error::setting(format!("{key}.if_delay.delay_s"), delay.delay_s, wanted));
    }
    if let Some(start) = &effects.adc_start_error
        && radar.adc_start_s + start.offset_s < 0.0
    {
        let wanted = format!("no earlier than the ramp, above {}", -radar.adc_start_s);
        return Err(Error::setting(format!("{key}.adc_start_error.offset_s"), start.offset_s, wanted));
    }
    Ok(())
}
