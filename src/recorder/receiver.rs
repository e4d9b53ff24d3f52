//! The receiver: its unknown gain, its noise and its converter.

use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rustfft::FftPlanner;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// All of this belongs to the baseline of FORMATS.md.
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
}

impl Default for ReceiverConfig {
    fn default() -> Self {
        Self { noise: true, snr_db: 40.0, unknown_phase: true, adc: true, peak_fraction: 0.27 }
    }
}

impl ReceiverConfig {
    /// Neither noise nor codes.
    pub fn ideal() -> Self {
        Self { noise: false, unknown_phase: false, adc: false, ..Self::default() }
    }

    pub fn check(&self, key: &str) -> Result<()> {
        if !(self.peak_fraction > 0.0 && self.peak_fraction <= 4.0) {
            return Err(Error::setting(format!("{key}.peak_fraction"), self.peak_fraction, "above 0 and at most 4")
                .with_hint("a fraction above 1 saturates the converter"));
        }
        if !self.snr_db.is_finite() {
            return Err(Error::setting(format!("{key}.snr_db"), self.snr_db, "a finite number of decibels"));
        }
        Ok(())
    }
}

/// Samples of one frame, `[tx, rx, loop, sample]`, as they are written.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// ADC codes of a quadrature receiver: `[.., iq]`.
    ComplexCodes(Vec<i16>),
    RealCodes(Vec<i16>),
    Complex(Vec<num_complex::Complex32>),
    Real(Vec<f32>),
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
    /// From the field at the antennas to what is written.
    pub fn receive(&self, field: &[Complex64], rng: &mut ChaCha8Rng) -> Samples {
        let components = if self.sampling == Sampling::Complex { 2 } else { 1 };
        let mut values = Vec::with_capacity(field.len() * components);
        for &sample in field {
            let scaled = sample * self.gain;
            values.push(scaled.re);
            if components == 2 {
                values.push(scaled.im);
            }
        }
        if self.noise_codes > 0.0 {
            for value in &mut values {
                let noise: f64 = StandardNormal.sample(rng);
                *value += self.noise_codes * noise;
            }
        }
        let code = |value: &f64| value.round().clamp(-self.rail - 1.0, self.rail) as i16;
        match (self.adc, self.sampling) {
            (true, Sampling::Complex) => Samples::ComplexCodes(values.iter().map(code).collect()),
            (true, Sampling::Real) => Samples::RealCodes(values.iter().map(code).collect()),
            (false, Sampling::Complex) => {
                Samples::Complex(values.chunks_exact(2).map(|iq| num_complex::Complex32::new(iq[0] as f32, iq[1] as f32)).collect())
            }
            (false, Sampling::Real) => Samples::Real(values.iter().map(|&value| value as f32).collect()),
        }
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
        Receiver { sampling, gain: Complex64::new(1000.0, 0.0), noise_codes, adc, rail: 32767.0 }
    }

    #[test]
    fn codes_are_rounded_and_clipped_at_the_rail() {
        let field = [Complex64::new(1.2344, -0.0006), Complex64::new(40.0, -40.0)];
        let codes = receiver(true, 0.0, Sampling::Complex).receive(&field, &mut ChaCha8Rng::seed_from_u64(0));
        assert_eq!(codes, Samples::ComplexCodes(vec![1234, -1, 32767, -32768]));
        let real = receiver(true, 0.0, Sampling::Real).receive(&field, &mut ChaCha8Rng::seed_from_u64(0));
        assert_eq!(real, Samples::RealCodes(vec![1234, 32767]));
    }

    #[test]
    fn noise_has_the_power_that_was_asked_for_and_is_white() {
        let field = vec![Complex64::ZERO; 64 * 64];
        let Samples::Complex(noise) = receiver(false, 3.0, Sampling::Complex).receive(&field, &mut ChaCha8Rng::seed_from_u64(5)) else {
            panic!("complex samples")
        };
        let power: f64 = noise.iter().map(|v| f64::from(v.norm_sqr())).sum::<f64>() / noise.len() as f64;
        assert!((power / 18.0 - 1.0).abs() < 0.05, "{power}");
        let lag: f64 = noise.windows(2).map(|pair| f64::from((pair[0] * pair[1].conj()).re)).sum::<f64>() / noise.len() as f64;
        assert!(lag.abs() < 0.8, "{lag}");
    }

    #[test]
    fn the_noise_level_puts_a_tone_as_far_above_the_floor_as_asked() {
        for sampling in [Sampling::Complex, Sampling::Real] {
            let radar = Radar { sampling, ..Radar::small(1) };
            let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
            let channels = radar.rx_m.len();
            let body: Vec<Complex64> =
                (0..channels * loops * samples).map(|i| Complex64::cis(0.6 * (i % samples) as f64 + 0.9 * (i / samples % loops) as f64)).collect();
            let sigma = noise_for_snr(&body, &radar, 30.0);
            let receiver = Receiver { gain: Complex64::ONE, noise_codes: sigma, ..receiver(false, 0.0, sampling) };
            let mut floor = 0.0;
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            for _ in 0..20 {
                let noise: Vec<Complex64> = match receiver.receive(&vec![Complex64::ZERO; loops * samples], &mut rng) {
                    Samples::Complex(values) => values.iter().map(|v| Complex64::new(v.re.into(), v.im.into())).collect(),
                    Samples::Real(values) => values.iter().map(|&v| f64::from(v).into()).collect(),
                    _ => panic!("floating-point samples"),
                };
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
