//! The receiver: its unknown gain, its noise and its converter.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::data::{IfFrame, IfLayout};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// All of this belongs to the baseline of docs/diagnosis.md.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReceiverConfig {
    pub noise: bool,
    /// The body's strongest range-Doppler cell over the noise floor in frame 0 (Hann windows).
    pub snr_db: f64,
    /// A phase nobody knows; the gain is fixed by `peak_fraction`.
    pub unknown_phase: bool,
    /// Converts to whole codes and clips at the rail; else the samples stay floating-point numbers on the same scale.
    pub adc: bool,
    /// Of the ADC's full scale that the strongest samples reach.
    pub peak_fraction: f64,
    /// A board whose gain and noise are settled already; `snr_db` and `peak_fraction` then say nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<Level>,
}

/// Gain and noise of a board, for recordings that share it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// What the amplitudes of added reflectors are relative to: the body's return, in units of the transmitted wave.
    pub body: f64,
    /// What levels relative to the peak sample are relative to, in units of the transmitted wave.
    pub peak: f64,
    /// Codes per unit of the transmitted wave.
    pub gain: f64,
    /// Standard deviation per component.
    pub noise_codes: f64,
}

impl Default for ReceiverConfig {
    fn default() -> Self {
        Self { noise: true, snr_db: 40.0, unknown_phase: true, adc: true, peak_fraction: 0.27, level: None }
    }
}

impl ReceiverConfig {
    /// Neither noise nor codes.
    pub fn ideal() -> Self {
        Self { noise: false, unknown_phase: false, adc: false, ..Self::default() }
    }

    /// Refuses levels that no receiver can have; `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if !(self.peak_fraction > 0.0 && self.peak_fraction <= 4.0) {
            return Err(Error::setting(format!("{key}.peak_fraction"), self.peak_fraction, "above 0 and at most 4")
                .with_hint("a fraction above 1 saturates the converter"));
        }
        if let Some(level) = &self.level {
            for (name, value, least) in [
                ("body", level.body, 0.0),
                ("peak", level.peak, 0.0),
                ("gain", level.gain, f64::MIN_POSITIVE),
                ("noise_codes", level.noise_codes, 0.0),
            ] {
                if !(value.is_finite() && value >= least) {
                    return Err(Error::setting(format!("{key}.level.{name}"), value, "a finite number that is not negative"));
                }
            }
        }
        if !self.snr_db.is_finite() {
            return Err(Error::setting(format!("{key}.snr_db"), self.snr_db, "a finite number of decibels"));
        }
        Ok(())
    }
}

/// A receiver whose gain and noise level are settled.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    pub sampling: Sampling,
    /// Codes per unit of field.
    pub gain: Complex64,
    /// Standard deviation per component, codes.
    pub noise_codes: f64,
    pub adc: bool,
    /// Whether there is a rail.
    pub clips: bool,
    pub rail: f64,
}

/// The ADC's rail: as the radar says, else that of 16 bits.
pub fn rail(radar: &Radar) -> f64 {
    radar.full_scale_codes.unwrap_or(32767.0).min(32767.0)
}

/// A random phase factor.
pub fn random_phase(rng: &mut ChaCha8Rng) -> Complex64 {
    Complex64::cis(std::f64::consts::TAU * rng.random::<f64>())
}

impl Receiver {
    /// How its samples are stored.
    pub fn layout(&self) -> IfLayout {
        match (self.adc, self.sampling) {
            (true, Sampling::Complex) => IfLayout::Codes,
            (true, Sampling::Real) => IfLayout::RealCodes,
            (false, Sampling::Complex) => IfLayout::Complex,
            (false, Sampling::Real) => IfLayout::Real,
        }
    }

    /// White noise, codes; without quadrature the imaginary parts are zero.
    pub fn noise(&self, count: usize, rng: &mut ChaCha8Rng) -> Vec<Complex64> {
        let mut value = || -> f64 {
            let noise: f64 = if self.noise_codes > 0.0 { StandardNormal.sample(rng) } else { 0.0 };
            self.noise_codes * noise
        };
        let quadrature = self.sampling == Sampling::Complex;
        (0..count).map(|_| Complex64::new(value(), if quadrature { value() } else { 0.0 })).collect()
    }

    /// From the field, `[tx, rx, loop, sample]`, and the noise, codes, to what is written.
    pub fn convert(&self, field: &[Complex64], noise: &[Complex64], dims: [usize; 4]) -> IfFrame {
        let value = |value: f64| {
            let clipped = if self.clips { value.clamp(-self.rail - 1.0, self.rail) } else { value };
            if self.adc { clipped.round() as f32 } else { clipped as f32 }
        };
        let (mut re, mut im) = (Vec::with_capacity(field.len()), Vec::new());
        for (sample, noise) in field.iter().zip(noise) {
            let scaled = sample * self.gain + noise;
            re.push(value(scaled.re));
            if self.sampling == Sampling::Complex {
                im.push(value(scaled.im));
            }
        }
        IfFrame::new(dims, re, (self.sampling == Sampling::Complex).then_some(im))
    }
}

/// Periodic Hann window.
pub fn hann(length: usize) -> Vec<f64> {
    (0..length).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / length as f64).sin().powi(2)).collect()
}

/// Power in the range-Doppler cells of one channel, `[doppler, range]`, from `[loop, sample]`; Hann windows.
pub fn range_doppler_power(signal: &[Complex64], samples: usize) -> Vec<f64> {
    let loops = signal.len() / samples;
    let (slow, fast) = (hann(loops), hann(samples));
    let mut map: Vec<Complex64> =
        signal.iter().enumerate().map(|(i, value)| value * (slow[i / samples] * fast[i % samples])).collect();
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(samples).process(&mut map);
    let doppler = planner.plan_fft_forward(loops);
    let mut column = vec![Complex64::ZERO; loops];
    for range in 0..samples {
        for (i, value) in column.iter_mut().enumerate() {
            *value = map[i * samples + range];
        }
        doppler.process(&mut column);
        for (i, value) in column.iter().enumerate() {
            map[i * samples + range] = *value;
        }
    }
    map.iter().map(Complex64::norm_sqr).collect()
}

/// Noise per component, relative to the unit of `body` (`[tx, rx, loop, sample]`, frame 0), that puts its strongest
/// range-Doppler cell `snr_db` above the floor. The cell's power is averaged over the channels.
pub fn noise_for_snr(body: &[Complex64], radar: &Radar, snr_db: f64) -> f64 {
    let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
    let mut mean = vec![0.0; loops * samples];
    let mut channels = 0.0;
    for channel in body.chunks_exact(loops * samples) {
        let seen: Vec<Complex64> = match radar.sampling {
            Sampling::Complex => channel.to_vec(),
            Sampling::Real => channel.iter().map(|value| value.re.into()).collect(),
        };
        for (sum, power) in mean.iter_mut().zip(range_doppler_power(&seen, samples)) {
            *sum += power;
        }
        channels += 1.0;
    }
    let peak = mean.iter().copied().fold(0.0, f64::max) / channels;
    let window_energy = |length: usize| hann(length).iter().map(|w| w * w).sum::<f64>();
    // A cell collects the noise of both components.
    let components = if radar.sampling == Sampling::Complex { 2.0 } else { 1.0 };
    (peak / (10f64.powf(snr_db / 10.0) * window_energy(loops) * window_energy(samples) * components)).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn receiver(adc: bool, noise_codes: f64, sampling: Sampling) -> Receiver {
        Receiver { sampling, gain: Complex64::new(1000.0, 0.0), noise_codes, adc, clips: adc, rail: 32767.0 }
    }

    fn receive(receiver: &Receiver, field: &[Complex64], dims: [usize; 4], rng: &mut ChaCha8Rng) -> IfFrame {
        receiver.convert(field, &receiver.noise(field.len(), rng), dims)
    }

    fn field_of(frame: &IfFrame) -> Vec<Complex64> {
        let im = frame.im.clone().unwrap_or(vec![0.0; frame.re.len()]);
        frame.re.iter().zip(im).map(|(&re, im)| Complex64::new(re.into(), im.into())).collect()
    }

    #[test]
    fn codes_are_rounded_and_clipped_at_the_rail() {
        let field = [Complex64::new(1.2344, -0.0006), Complex64::new(40.0, -40.0)];
        let receive = |sampling| receive(&receiver(true, 0.0, sampling), &field, [1, 1, 1, 2], &mut ChaCha8Rng::seed_from_u64(0));
        let codes = receive(Sampling::Complex);
        assert_eq!((codes.re, codes.im), (vec![1234.0, 32767.0], Some(vec![-1.0, -32768.0])));
        let codes = receive(Sampling::Real);
        assert_eq!((codes.re, codes.im), (vec![1234.0, 32767.0], None));
    }

    #[test]
    fn noise_has_the_power_that_was_asked_for_and_is_white() {
        let receiver = receiver(false, 3.0, Sampling::Complex);
        let noise =
            field_of(&receive(&receiver, &vec![Complex64::ZERO; 64 * 64], [1, 1, 64, 64], &mut ChaCha8Rng::seed_from_u64(5)));
        let power: f64 = noise.iter().map(|v| v.norm_sqr()).sum::<f64>() / noise.len() as f64;
        assert!((power / 18.0 - 1.0).abs() < 0.05, "{power}");
        let lag: f64 = noise.windows(2).map(|pair| (pair[0] * pair[1].conj()).re).sum::<f64>() / noise.len() as f64;
        assert!(lag.abs() < 0.8, "{lag}");
    }

    #[test]
    fn the_noise_level_puts_a_tone_as_far_above_the_floor_as_asked() {
        for sampling in [Sampling::Complex, Sampling::Real] {
            let radar = Radar { sampling, ..Radar::small(1) };
            let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
            let channels = radar.rx_m.len();
            let body: Vec<Complex64> = (0..channels * loops * samples)
                .map(|i| Complex64::cis(0.6 * (i % samples) as f64 + 0.9 * (i / samples % loops) as f64))
                .collect();
            let sigma = noise_for_snr(&body, &radar, 30.0);
            let receiver = Receiver { gain: Complex64::ONE, noise_codes: sigma, ..receiver(false, 0.0, sampling) };
            let mut floor = 0.0;
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            for _ in 0..20 {
                let silence = vec![Complex64::ZERO; loops * samples];
                let noise = field_of(&receive(&receiver, &silence, [1, 1, loops, samples], &mut rng));
                let map = range_doppler_power(&noise, samples);
                floor += map.iter().sum::<f64>() / map.len() as f64 / 20.0;
            }
            let seen: Vec<Complex64> = match sampling {
                Sampling::Complex => body[..loops * samples].to_vec(),
                Sampling::Real => body[..loops * samples].iter().map(|v| v.re.into()).collect(),
            };
            let peak = range_doppler_power(&seen, samples).into_iter().fold(0.0, f64::max);
            let snr = 10.0 * (peak / floor).log10();
            assert!((snr - 30.0).abs() < 0.5, "{sampling:?}: {snr:.2} dB");
        }
    }
}
