//! From a baseline's clean signal to samples: one gain, and noise: the paper's, or the receiver's.

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

/// What is added to a baseline's signal, Gaussian and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BaselineNoise {
    None,
    /// The paper's, which is the same for all compared methods: [`NOISE_RATE`] of the method's own mean amplitude. A method
    /// without a room, or with a faint one, then has less noise than the receiver.
    Rate {
        seed: u64,
    },
    /// The receiver's: σ of I and of Q in the recordings' unit, as [`super::noise_level`] finds it.
    Level {
        seed: u64,
        deviation: f64,
    },
}

/// A baseline at a level, with noise or without.
pub struct Rendering<'a> {
    pub baseline: &'a dyn Baseline,
    /// Amplitude, from the method's unit to the recordings'.
    pub gain: f64,
    pub noise: BaselineNoise,
}

impl Rendering<'_> {
    /// `[tx, rx, loop, sample]`, in the recordings' units once the gain is calibrated. Equal seeds give equal noise on
    /// every backend.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn frame(&self, frame: usize) -> Result<Vec<Complex32>> {
        let clean = self.baseline.clean_signal(frame)?.scale_by(self.gain);
        let (seed, law) = match self.noise {
            // A law of level zero would learn one.
            BaselineNoise::None | BaselineNoise::Level { deviation: 0.0, .. } => return Ok(clean.to_host()),
            BaselineNoise::Rate { seed } => (seed, NoiseConfig { law: NoiseLaw::Fixed, rate: NOISE_RATE, level: 0.0 }),
            BaselineNoise::Level { seed, deviation } => {
                (seed, NoiseConfig { law: NoiseLaw::Constant, rate: NOISE_RATE, level: deviation })
            }
        };
        let device = clean.device();
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
        assert!(rendering(BaselineNoise::None).frame(0).unwrap().iter().all(|value| *value == Complex32::new(6.0, -8.0)));
        let rate = |seed| rendering(BaselineNoise::Rate { seed });
        let noisy = rate(3).frame(0).unwrap();
        let deviation = |part: &dyn Fn(&Complex32) -> f64| {
            (noisy.iter().map(|value| part(value).powi(2)).sum::<f64>() / noisy.len() as f64).sqrt()
        };
        for found in [deviation(&|value| f64::from(value.re) - 6.0), deviation(&|value| f64::from(value.im) + 8.0)] {
            // 0.025 · |6 − 8j|; 38,400 samples leave 0.4 %.
            assert!((found / 0.25 - 1.0).abs() < 0.02, "σ {found}");
        }
        assert_eq!(noisy, rate(3).frame(0).unwrap());
        assert_ne!(noisy, rate(4).frame(0).unwrap());
        assert_ne!(noisy, rate(3).frame(1).unwrap(), "every frame has noise of its own");
        // The receiver's, whatever the signal: the same numbers ten times larger.
        let louder = rendering(BaselineNoise::Level { seed: 3, deviation: 2.5 }).frame(0).unwrap();
        for (loud, noisy) in louder.iter().zip(&noisy) {
            let [loud, noisy] = [loud, noisy].map(|value| value - Complex32::new(6.0, -8.0));
            assert!((loud - noisy * 10.0).norm() < 1e-4 * (1.0 + loud.norm()), "{loud} {noisy}");
        }
    }
}
