//! The dechirp: what a delay that changes while the chirp runs becomes in the intermediate frequency.
//!
//! The delay τ(t) is the bistatic distance over c with every position taken at the moment of reception: quasi-static.
//! The exact retardation would shift the time of reflection by r/c ≈ 10 ns, 3e-8 m at 3 m/s.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::radar::Radar;

/// Constants of one radar's chirp, seen from the middle of the ADC window (sample N/2).
#[derive(Clone, Copy, Debug)]
pub struct Chirp {
    start_frequency_hz: f64,
    pub slope_hz_per_s: f64,
    sample_rate_hz: f64,
    samples: usize,
    /// From the ramp's start to the middle sample.
    pub middle_s: f64,
    pub middle_hz: f64,
    pub window_s: f64,
}

/// A path in one chirp as polynomials of the fast time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Phase at the middle sample.
    pub turns: f64,
    pub turns_per_sample: f64,
    /// Curvature of the phase: radians per squared window.
    pub bend_rad: f64,
}

/// The radar with `guard` more samples before and after its window.
pub fn widened(radar: &Radar, guard: usize) -> Radar {
    Radar {
        samples_per_chirp: radar.samples_per_chirp + 2 * guard,
        adc_start_s: radar.adc_start_s - guard as f64 / radar.sample_rate_hz,
        ..radar.clone()
    }
}

impl Chirp {
    /// The constants of a radar's chirp; phases are taken at its middle sample.
    pub fn new(radar: &Radar) -> Self {
        let middle_s = radar.sample_time_s(radar.samples_per_chirp / 2);
        Self {
            start_frequency_hz: radar.start_frequency_hz,
            slope_hz_per_s: radar.slope_hz_per_s,
            sample_rate_hz: radar.sample_rate_hz,
            samples: radar.samples_per_chirp,
            middle_s,
            middle_hz: radar.start_frequency_hz + radar.slope_hz_per_s * middle_s,
            window_s: radar.samples_per_chirp as f64 / radar.sample_rate_hz,
        }
    }

    /// The definition: Φ(t) − Φ(t − τ) in turns, Φ(t) = f₀ t + S t²/2, t from the start of the ramp.
    pub fn exact_turns(&self, time_s: f64, delay_s: f64) -> f64 {
        let phase = |t: f64| self.start_frequency_hz * t + 0.5 * self.slope_hz_per_s * t * t;
        phase(time_s) - phase(time_s - delay_s)
    }

    /// Instantaneous frequency at `fraction` of the window from its middle, −1/2 … 1/2.
    pub fn frequency_hz(&self, fraction: f64) -> f64 {
        self.middle_hz + self.slope_hz_per_s * fraction * self.window_s
    }

    /// The same phase for τ(u) = delay + rate · u, u from the middle sample, through the second order in u:
    /// f_m τ − S τ²/2  +  u (f_m τ' + S τ − S τ τ')  +  u² (S τ' − S τ'²/2). Exact, as τ is linear.
    #[inline(always)]
    pub fn line(&self, delay_s: f64, rate: f64) -> Line {
        let beat = self.slope_hz_per_s * delay_s;
        Line {
            turns: delay_s * (self.middle_hz - 0.5 * beat),
            turns_per_sample: (rate * (self.middle_hz - beat) + beat) * (1.0 / self.sample_rate_hz),
            bend_rad: TAU * self.slope_hz_per_s * rate * (1.0 - 0.5 * rate) * self.window_s * self.window_s,
        }
    }

    /// Adds a path whose delay is `delay_s` at the middle sample and grows by `rate` seconds per second; exact.
    pub fn add_moving(&self, signal: &mut [Complex64], amplitude: Complex64, delay_s: f64, rate: f64) {
        let line = self.line(delay_s, rate);
        for (n, value) in signal.iter_mut().enumerate() {
            let u = n as f64 - (self.samples / 2) as f64;
            let bend = line.bend_rad * (u / self.samples as f64).powi(2);
            *value += amplitude * Complex64::cis(TAU * (line.turns + line.turns_per_sample * u).fract() + bend);
        }
    }

    /// Adds a path of constant delay to `signal` `[sample]`; exact.
    pub fn add_static(&self, signal: &mut [Complex64], amplitude: Complex64, delay_s: f64) {
        let line = self.line(delay_s, 0.0);
        let start = line.turns - line.turns_per_sample * (self.samples / 2) as f64;
        let step = Complex64::cis(TAU * line.turns_per_sample.fract());
        let mut phasor = amplitude * Complex64::cis(TAU * start.fract());
        for value in signal {
            *value += phasor;
            phasor *= step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_path_is_the_exact_phase_at_every_sample() {
        let radar = Radar::mmmesh(1);
        let chirp = Chirp::new(&radar);
        let (delay, rate) = (2.0 * 3.0 / 299_792_458.0, 2.0 * 2.5 / 299_792_458.0);
        let mut signal = vec![Complex64::ZERO; 256];
        chirp.add_moving(&mut signal, Complex64::ONE, delay, rate);
        for (sample, value) in signal.iter().enumerate() {
            let time = radar.sample_time_s(sample);
            let turns = chirp.exact_turns(time, delay + rate * (time - chirp.middle_s));
            assert!((value - Complex64::cis(TAU * turns.fract())).norm() < 1e-5, "sample {sample}");
        }
    }

    #[test]
    fn the_line_is_the_exact_phase_of_a_delay_that_grows_linearly() {
        let radar = Radar::mmmesh(1);
        let chirp = Chirp::new(&radar);
        for (range, speed) in [(0.3, 0.0), (3.0, 1.2), (9.0, -4.0)] {
            let (delay, rate) = (2.0 * range / 299_792_458.0, 2.0 * speed / 299_792_458.0);
            let line = chirp.line(delay, rate);
            for sample in [0, 1, 128, 255] {
                let s = sample as f64 - 128.0;
                let time = radar.sample_time_s(sample);
                let exact = chirp.exact_turns(time, delay + rate * (time - chirp.middle_s));
                let found = line.turns + line.turns_per_sample * s + line.bend_rad / TAU * (s / 256.0).powi(2);
                assert!((found - exact).abs() < 1e-6, "{range} m, {speed} m/s, sample {sample}: {:e}", found - exact);
            }
        }
    }

    #[test]
    fn a_static_path_is_the_paper_phase_with_the_residual_video_phase() {
        let radar = Radar::mmmesh(1);
        let chirp = Chirp::new(&radar);
        let delay = 2.0 * 4.0 / 299_792_458.0;
        let mut signal = vec![Complex64::ZERO; 256];
        chirp.add_static(&mut signal, Complex64::ONE, delay);
        for (sample, value) in signal.iter().enumerate() {
            let t = sample as f64 / radar.sample_rate_hz;
            let turns = radar.carrier_hz() * delay + radar.slope_hz_per_s * (t * delay - 0.5 * delay * delay);
            assert!((value - Complex64::cis(TAU * turns.fract())).norm() < 1e-7);
        }
    }
}
