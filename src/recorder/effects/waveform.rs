//! The oscillator: what the ramp really is. A path of delay τ shows Φ(t) − Φ(t − τ), so every error of the frequency
//! appears as a phase in proportion to the delay.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use super::resample::Resampler;
use super::{EffectsConfig, Outside};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::world::{Draw, World};

/// Range at which phase noise is stated.
const STATED_M: f64 = 3.0;

/// The radar as it really is: errors of start frequency, ADC start and slope, the delay of the IF (which opens the window earlier),
/// and displaced antennas.
pub fn true_radar(radar: &Radar, effects: &EffectsConfig) -> Radar {
    let mut radar = radar.clone();
    radar.start_frequency_hz *= 1.0 + effects.start_frequency_error.as_ref().map_or(0.0, |e| e.relative);
    radar.slope_hz_per_s *= 1.0 + effects.slope_error.as_ref().map_or(0.0, |e| e.relative);
    radar.adc_start_s += effects.adc_start_error.as_ref().map_or(0.0, |e| e.offset_s);
    radar.adc_start_s -= effects.if_delay.as_ref().map_or(0.0, |e| e.delay_s);
    if let Some(position) = &effects.antenna_position {
        for (antenna, offset) in radar.rx_m.iter_mut().zip(&position.offset_m) {
            antenna[0] += offset;
        }
    }
    radar
}

/// Errors of the frequency over time that no other radar setting could express.
#[derive(Clone, Debug)]
pub struct Oscillator {
    slope_hz_per_s: f64,
    sample_rate_hz: f64,
    /// Of the ADC window, after the ramp's start.
    middle_s: f64,
    half_window_s: f64,
    quadratic_hz: f64,
    cubic_hz: f64,
    /// Of the quadratic part in the last frame.
    drift_hz: f64,
    last_frame: usize,
    deviation_hz: f64,
    ripple_hz: f64,
    ripple_rad: f64,
    per_chirp_hz: f64,
    per_frame_hz: f64,
    jitter_s: f64,
}

/// What differs from chirp to chirp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChirpError {
    pub offset_hz: f64,
    pub late_s: f64,
    quadratic_hz: f64,
}

impl Oscillator {
    /// `None`: an ideal ramp. `radar` is the true one.
    pub fn new(world: &World, radar: &Radar) -> Option<Self> {
        let effects = &world.effects;
        let nonlinear = effects.chirp_nonlinearity.as_ref().map_or(0.0, |e| e.peak_hz);
        let ripple = effects.chirp_ripple.as_ref();
        let noise = effects.phase_noise.as_ref();
        let in_hz = |rad: f64| rad * SPEED_OF_LIGHT / (2.0 * STATED_M * TAU);
        let drift_hz = effects.outside.iter().find_map(|effect| match effect {
            Outside::ThermalCurvature { peak_hz } => Some(*peak_hz),
            _ => None,
        });
        let window_s = radar.samples_per_chirp as f64 / radar.sample_rate_hz;
        let oscillator = Self {
            slope_hz_per_s: radar.slope_hz_per_s,
            sample_rate_hz: radar.sample_rate_hz,
            middle_s: radar.adc_start_s + 0.5 * window_s,
            half_window_s: 0.5 * window_s,
            quadratic_hz: 0.7 * nonlinear,
            cubic_hz: 0.3 * nonlinear,
            drift_hz: drift_hz.unwrap_or(0.0),
            last_frame: (radar.frames - 1).max(1),
            deviation_hz: ripple.map_or(0.0, |e| e.deviation_hz),
            ripple_hz: ripple.map_or(1.0, |e| e.ripple_hz),
            ripple_rad: world.phase(super::CHIRP_RIPPLE, 0),
            per_chirp_hz: noise.map_or(0.0, |e| in_hz(e.per_chirp_rad)),
            per_frame_hz: noise.map_or(0.0, |e| in_hz(e.per_frame_rad)),
            jitter_s: effects.chirp_start_jitter.as_ref().map_or(0.0, |e| e.jitter_s),
        };
        let wrong = [nonlinear, oscillator.drift_hz, oscillator.deviation_hz, oscillator.per_chirp_hz, oscillator.per_frame_hz];
        (wrong.iter().any(|hz| *hz != 0.0) || oscillator.jitter_s != 0.0).then_some(oscillator)
    }

    /// Of every chirp of a frame, in time.
    pub fn draw(&self, world: &World, frame: usize) -> Vec<ChirpError> {
        let mut frequency = world.random(Draw::Effect { id: super::PHASE_NOISE, frame });
        let mut start = world.random(Draw::Effect { id: super::CHIRP_START_JITTER, frame });
        let common: f64 = StandardNormal.sample(&mut frequency);
        (0..world.radar.loops_per_frame * world.radar.tx_m.len())
            .map(|_| {
                let own: f64 = StandardNormal.sample(&mut frequency);
                ChirpError {
                    offset_hz: self.per_frame_hz * common + self.per_chirp_hz * own,
                    late_s: if start.random::<bool>() { self.jitter_s } else { 0.0 },
                    quadratic_hz: self.drift_hz * frame as f64 / self.last_frame as f64,
                }
            })
            .collect()
    }

    /// Error of the frequency, its rate, and its integral in turns, `time_s` after the ramp's start.
    fn error(&self, chirp: &ChirpError, time_s: f64) -> (f64, f64, f64) {
        let s = (time_s - self.middle_s) / self.half_window_s;
        let (p2, p3) = (0.5 * (3.0 * s * s - 1.0), 0.5 * (5.0 * s * s * s - 3.0 * s));
        let (d2, d3) = (3.0 * s, 0.5 * (15.0 * s * s - 3.0));
        let (i2, i3) = (0.5 * (s * s * s - s), 0.5 * (1.25 * s.powi(4) - 1.5 * s * s));
        let quadratic = self.quadratic_hz + chirp.quadratic_hz;
        let angle = TAU * self.ripple_hz * (time_s - self.middle_s) + self.ripple_rad;
        let (sin, cos) = angle.sin_cos();
        (
            quadratic * p2 + self.cubic_hz * p3 + self.deviation_hz * cos + chirp.offset_hz,
            (quadratic * d2 + self.cubic_hz * d3) / self.half_window_s - self.deviation_hz * TAU * self.ripple_hz * sin,
            (quadratic * i2 + self.cubic_hz * i3) * self.half_window_s
                + self.deviation_hz * sin / (TAU * self.ripple_hz)
                + chirp.offset_hz * time_s,
        )
    }

    /// What a path of `delay_s` shows beyond an ideal ramp that started on time, in turns; the definition.
    pub fn extra_turns(&self, chirp: &ChirpError, time_s: f64, delay_s: f64) -> f64 {
        self.error(chirp, time_s).2 - self.error(chirp, time_s - delay_s).2
    }

    /// Puts the errors on a whole chirp, whose first sample is `first_s` after the nominal start of the ramp.
    ///
    /// A phase 2πτδf equals the beat read δf/S later, whatever the delays in it. δf belongs to the middle of the way,
    /// t − τ/2; that first-order difference is a second derivative of the beat, as each derivative brings down 2πSτ.
    pub fn apply(&self, resampler: &Resampler, chirp: &ChirpError, first_s: f64, signal: &mut [Complex64]) {
        const STEP: f64 = 0.1;
        let ideal = signal.to_vec();
        let curved = self.deviation_hz != 0.0 || self.quadratic_hz + chirp.quadratic_hz != 0.0 || self.cubic_hz != 0.0;
        for (n, value) in signal.iter_mut().enumerate() {
            let ramp_s = first_s + n as f64 / self.sample_rate_hz - chirp.late_s;
            let (error_hz, rate, _) = self.error(chirp, ramp_s);
            let position = n as f64 + self.sample_rate_hz * (error_hz / self.slope_hz_per_s - chirp.late_s);
            *value = resampler.at(&ideal, position);
            if curved {
                let [before, after] = [-STEP, STEP].map(|step| resampler.at(&ideal, position + step));
                let second = (before + after - *value * 2.0) * (self.sample_rate_hz / STEP).powi(2);
                *value += second * Complex64::new(0.0, rate / (4.0 * PI * self.slope_hz_per_s.powi(2)));
            }
        }
    }
}

/// A part of the receiver's chain that delays everything by `delay_s`: s(t − τ) times the ramp's own beat with τ. Exact,
/// as Φ(t) − Φ(t − τ − τ') = [Φ(t − τ) − Φ(t − τ − τ')] + [Φ(t) − Φ(t − τ)]. The first sample is `first_s` after the
/// ramp's start.
pub fn delayed(signal: &[Complex64], resampler: &Resampler, radar: &Radar, first_s: f64, delay_s: f64) -> Vec<Complex64> {
    let mut values = resampler.shifted(signal, -delay_s * radar.sample_rate_hz);
    for (n, value) in values.iter_mut().enumerate() {
        let time_s = first_s + n as f64 / radar.sample_rate_hz;
        let turns = delay_s * (radar.start_frequency_hz + radar.slope_hz_per_s * (time_s - 0.5 * delay_s));
        *value *= Complex64::cis(TAU * turns.fract());
    }
    values
}
