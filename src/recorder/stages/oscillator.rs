//! The oscillator: what the ramp really is. A path of delay τ shows Φ(t) − Φ(t − τ), so every error of the frequency
//! appears as a phase in proportion to the delay.

use std::f64::consts::PI;

use num_complex::Complex64;

use crate::radar::Radar;
use crate::recorder::effects::{ChirpError, ChirpRipple, ChirpStartJitter, Outside, PhaseNoise, curvature};
use crate::recorder::resample::Resampler;
use crate::recorder::world::World;

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
    /// With its phase.
    ripple: Option<(ChirpRipple, f64)>,
    noise: Option<PhaseNoise>,
    jitter: Option<ChirpStartJitter>,
}

impl Oscillator {
    /// `None`: an ideal ramp. `radar` is the true one.
    pub fn new(world: &World, radar: &Radar) -> Option<Self> {
        let effects = &world.effects;
        let [quadratic_hz, cubic_hz] = effects.chirp_nonlinearity.as_ref().map_or([0.0; 2], |bent| bent.parts_hz());
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
            quadratic_hz,
            cubic_hz,
            drift_hz: drift_hz.unwrap_or(0.0),
            last_frame: (radar.frames - 1).max(1),
            ripple: effects.chirp_ripple.as_ref().map(|ripple| (ripple.clone(), ripple.phase_rad(&world.draws()))),
            noise: effects.phase_noise.clone(),
            jitter: effects.chirp_start_jitter.clone(),
        };
        (!oscillator.is_ideal()).then_some(oscillator)
    }

    fn is_ideal(&self) -> bool {
        let noise = self.noise.as_ref().is_some_and(|noise| noise.per_chirp_rad != 0.0 || noise.per_frame_rad != 0.0);
        let jitter = self.jitter.as_ref().is_some_and(|jitter| jitter.jitter_s != 0.0);
        let bent = [self.quadratic_hz, self.cubic_hz, self.drift_hz].iter().any(|hz| *hz != 0.0);
        !(bent || self.ripples() || noise || jitter)
    }

    fn ripples(&self) -> bool {
        self.ripple.as_ref().is_some_and(|(ripple, _)| ripple.deviation_hz != 0.0)
    }

    /// Of every chirp of a frame, in time.
    pub fn draw(&self, world: &World, frame: usize) -> Vec<ChirpError> {
        let (draws, count) = (world.draws(), world.radar.loops_per_frame * world.radar.tx_m.len());
        let offsets_hz = self.noise.as_ref().map_or(vec![0.0; count], |noise| noise.offsets_hz(&draws, frame, count));
        let late_s = self.jitter.as_ref().map_or(vec![0.0; count], |jitter| jitter.late_s(&draws, frame, count));
        let quadratic_hz = self.drift_hz * frame as f64 / self.last_frame as f64;
        let chirp = |(offset_hz, late_s): (f64, f64)| ChirpError { offset_hz, late_s, quadratic_hz };
        offsets_hz.into_iter().zip(late_s).map(chirp).collect()
    }

    /// Error of the frequency, its rate, and its integral in turns, `time_s` after the ramp's start.
    fn error(&self, chirp: &ChirpError, time_s: f64) -> (f64, f64, f64) {
        let since_middle_s = time_s - self.middle_s;
        let quadratic_hz = self.quadratic_hz + chirp.quadratic_hz;
        let bent = curvature(quadratic_hz, self.cubic_hz, since_middle_s / self.half_window_s, self.half_window_s);
        let ripple = self.ripple.as_ref().map_or((0.0, 0.0, 0.0), |(ripple, phase)| ripple.error(*phase, since_middle_s));
        (bent.0 + ripple.0 + chirp.offset_hz, bent.1 + ripple.1, bent.2 + ripple.2 + chirp.offset_hz * time_s)
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
        let curved = self.ripples() || self.quadratic_hz + chirp.quadratic_hz != 0.0 || self.cubic_hz != 0.0;
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
