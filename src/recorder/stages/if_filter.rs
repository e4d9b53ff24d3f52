//! The filters of the intermediate frequency: analogue, causal, one pole at a time.

use std::f64::consts::{PI, TAU};

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use crate::radar::Radar;
use crate::recorder::effects::{EffectsConfig, IfHighpass, IfLowpass, Section};
use crate::recorder::resample::{HALF, Resampler};

/// The analogue signal is followed at this multiple of the sample rate.
const FINER: usize = 16;

/// `if_highpass` and `if_lowpass`.
#[derive(Clone, Debug)]
pub struct IfFilter {
    sections: Vec<Section>,
    /// From rest at the ramp's start.
    from_rest: bool,
    circular: bool,
    sample_rate_hz: f64,
    phases: Vec<[Complex64; 2 * HALF]>,
}

impl IfFilter {
    pub fn new(effects: &EffectsConfig, radar: &Radar, resampler: &Resampler) -> Option<Self> {
        let high = effects.if_highpass.iter().flat_map(IfHighpass::sections);
        let low = effects.if_lowpass.iter().flat_map(IfLowpass::sections);
        let sections: Vec<Section> = high.chain(low).collect();
        let phases = (0..FINER).map(|phase| resampler.weights(phase as f64 / FINER as f64)).collect();
        (!sections.is_empty()).then(|| Self {
            sections,
            from_rest: effects.if_highpass.as_ref().is_some_and(|high| !high.settled),
            circular: effects.if_highpass.as_ref().is_some_and(|high| high.circular),
            sample_rate_hz: radar.sample_rate_hz,
            phases,
        })
    }

    /// Samples before the window that must be known for the filter to have settled at its start (to about −70 dB).
    pub fn guard(&self, radar: &Radar) -> usize {
        if self.circular {
            return 0;
        }
        let lowest = self.sections.iter().map(|section| section.corner_hz).fold(f64::INFINITY, f64::min);
        let constants = 8.0 + 2.0 * self.sections.len() as f64;
        let settle = (constants * self.sample_rate_hz / (TAU * lowest)).ceil() as usize;
        let ramp = (radar.adc_start_s.max(0.0) * self.sample_rate_hz).ceil() as usize;
        HALF + if self.from_rest { ramp } else { settle.min(1024) }
    }

    /// Filters one chirp, whose first sample is `first_s` after the ramp's start; `guard` samples at either end are not
    /// part of the window.
    pub fn apply(&self, first_s: f64, guard: usize, signal: &mut [Complex64]) {
        if self.circular {
            return self.apply_circular(guard, signal);
        }
        let rate = self.sample_rate_hz * FINER as f64;
        // Bilinear transform: v' = v_in − v_out over the pole's time constant.
        let poles: Vec<f64> = self.sections.iter().map(|section| PI * section.corner_hz / rate).collect();
        let mut last_in = vec![Complex64::ZERO; poles.len()];
        let mut low = vec![Complex64::ZERO; poles.len()];
        let fine = signal.to_vec();
        for (n, value) in signal.iter_mut().enumerate() {
            for (phase, weights) in self.phases.iter().enumerate() {
                let time_s = first_s + (n as f64 + phase as f64 / FINER as f64) / self.sample_rate_hz;
                let running = !self.from_rest || time_s >= 0.0;
                let mut x = if running { Resampler::apply(&fine, n as isize, weights) } else { Complex64::ZERO };
                for (index, section) in self.sections.iter().enumerate() {
                    let a = poles[index];
                    low[index] = (low[index] * (1.0 - a) + (x + last_in[index]) * a) / (1.0 + a);
                    last_in[index] = x;
                    x = if section.is_high { x - low[index] } else { low[index] };
                }
                if phase == 0 {
                    *value = x;
                }
            }
        }
    }

    /// The product of the window's DFT with the response, which wraps around the window.
    fn apply_circular(&self, guard: usize, signal: &mut [Complex64]) {
        let end = signal.len() - guard;
        let window = &mut signal[guard..end];
        let count = window.len();
        let mut planner = FftPlanner::new();
        planner.plan_fft_forward(count).process(window);
        for (bin, value) in window.iter_mut().enumerate() {
            let frequency = self.sample_rate_hz * bin as f64 / count as f64;
            *value *= self.response(frequency) / count as f64;
        }
        planner.plan_fft_inverse(count).process(window);
    }

    /// What a tone becomes.
    fn response(&self, frequency_hz: f64) -> Complex64 {
        self.sections.iter().map(|section| section.response(frequency_hz)).product()
    }
}
