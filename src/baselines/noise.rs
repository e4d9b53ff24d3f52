//! From a baseline's clean signal to samples: one gain, and the noise that all compared methods share.

use burn::tensor::DType;
use num_complex::Complex32;
use rand::RngExt;

use super::Baseline;
use crate::{
    error::Result,
    if_signal::{NoiseConfig, NoiseLaw, noise},
    training::step_rng,
};

/// σ of I and of Q over a frame's mean amplitude, the same for all methods, subjects and actions (paper, supplement
/// "Details of the Fixed-Noise Control Setting").
pub const NOISE_RATE: f64 = 0.025;

/// A baseline at a level, with noise or without.
pub struct Rendering<'a> {
    pub baseline: &'a dyn Baseline,
    /// Amplitude, from the method's unit to the recordings'.
    pub gain: f64,
    /// Seed of the noise; absent: none.
    pub noise: Option<u64>,
}

impl Rendering<'_> {
    /// `[tx, rx, loop, sample]`, in the recordings' units once the gain is calibrated. Equal seeds give equal noise on
    /// every backend.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn frame(&self, frame: usize) -> Result<Vec<Complex32>> {
        let clean = self.baseline.clean_signal(frame)?.scale_by(self.gain);
        let Some(seed) = self.noise else { return Ok(clean.to_host()) };
        let device = clean.device();
        let law = NoiseConfig { law: NoiseLaw::Fixed, rate: NOISE_RATE, ..NoiseConfig::default() };
        let normals = noise::normals(step_rng(seed, frame, 0xBA5E).random(), clean.dims(), &device, DType::F32);
        Ok(law.init(&device).add_to(clean, normals).to_host())
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, Tensor};

    use super::*;
    use crate::{complex::Complex, heatmap::synthetic, radar::Radar};

    struct Constant(Radar);

    impl Baseline for Constant {
        fn radar(&self) -> &Radar {
            &self.0
        }

        fn clean_signal(&self, _: usize) -> Result<Complex<4>> {
            let [_, tx, rx, loops, samples] = self.0.dims();
            let full = |value: f64| Tensor::full([tx, rx, loops, samples], value, &Device::flex());
            Ok(Complex::new(full(3.0), full(-4.0)))
        }
    }

    #[test]
    fn noise_is_a_fortieth_of_the_mean_amplitude_in_each_component_and_set_by_its_seed() {
        let baseline = Constant(synthetic::radar());
        let rendering = |noise| Rendering { baseline: &baseline, gain: 2.0, noise };
        assert!(rendering(None).frame(0).unwrap().iter().all(|value| *value == Complex32::new(6.0, -8.0)));
        let noisy = rendering(Some(3)).frame(0).unwrap();
        let deviation = |part: &dyn Fn(&Complex32) -> f64| {
            (noisy.iter().map(|value| part(value).powi(2)).sum::<f64>() / noisy.len() as f64).sqrt()
        };
        for found in [deviation(&|value| f64::from(value.re) - 6.0), deviation(&|value| f64::from(value.im) + 8.0)] {
            // 0.025 · |6 − 8j|; 38,400 samples leave 0.4 %.
            assert!((found / 0.25 - 1.0).abs() < 0.02, "σ {found}");
        }
        assert_eq!(noisy, rendering(Some(3)).frame(0).unwrap());
        assert_ne!(noisy, rendering(Some(4)).frame(0).unwrap());
        assert_ne!(noisy, rendering(Some(3)).frame(1).unwrap(), "every frame has noise of its own");
    }
}
