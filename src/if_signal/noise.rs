//! The receiver's noise (paper, section 3.4 and S12).

use burn::module::{Module, Param};
use burn::tensor::{DType, Device, Tensor, TensorData, activation::softplus};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::complex::Complex;
use crate::error::{Error, Result};

/// How strong the noise is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLaw {
    /// The paper's: σ = rate · mean|Sim| for I and for Q, the rate learned.
    Learned,
    /// The same with the rate as it is.
    Fixed,
    /// Thermal: the same σ whatever the signal.
    #[default]
    Constant,
    None,
}

/// The law of the noise, and how strong it is at the start or for good.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseConfig {
    pub law: NoiseLaw,
    /// σ of each component over the signal's mean amplitude; where learning starts.
    pub rate: f64,
    /// σ of each component for `constant`, in the signal's unit; zero: measured from the recording and learned.
    pub level: f64,
}

impl Default for NoiseConfig {
    fn default() -> Self {
        Self { law: NoiseLaw::default(), rate: 0.025, level: 0.0 }
    }
}

impl NoiseConfig {
    /// Refuses what no noise can be. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return Err(Error::setting(format!("{key}.rate"), self.rate, "a rate above zero")
                .with_hint("write law = \"none\" for a signal without noise"));
        }
        if !(self.level.is_finite() && self.level >= 0.0) {
            return Err(Error::setting(format!("{key}.level"), self.level, "a level of zero or more"));
        }
        Ok(())
    }

    /// The noise before training: a learned rate starts at `rate`, an unknown level at 1 in the signal's unit.
    pub fn init(&self, device: &Device) -> Noise {
        Noise {
            raw_rate: (self.law == NoiseLaw::Learned).then(|| raw_rate(self.rate, device)),
            log_level: (self.law == NoiseLaw::Constant && self.level == 0.0).then(|| log_level(1.0, device)),
            law: self.law,
            rate: self.rate,
            level: self.level,
        }
    }
}

/// Complex Gaussian noise.
#[derive(Module, Debug)]
pub struct Noise {
    /// `[1]`; the rate is its softplus. Only with the learned law.
    pub raw_rate: Option<Param<Tensor<1>>>,
    /// `[1]`; σ is its exponential. Only with the constant law and no level given.
    pub log_level: Option<Param<Tensor<1>>>,
    #[module(skip)]
    law: NoiseLaw,
    #[module(skip)]
    rate: f64,
    #[module(skip)]
    level: f64,
}

/// The inverse of softplus, in the form that holds for large rates too.
fn raw_rate(rate: f64, device: &Device) -> Param<Tensor<1>> {
    let raw = rate + (-(-rate).exp_m1()).ln();
    Param::from_tensor(Tensor::from_data([raw as f32], device))
}

fn log_level(level: f64, device: &Device) -> Param<Tensor<1>> {
    Param::from_tensor(Tensor::from_data([level.ln() as f32], device))
}

impl Noise {
    /// The same noise, learning from another rate or level (σ of each component) on; what does not learn stays.
    pub fn starting_at(self, rate: f64, level: f64, device: &Device) -> Self {
        Self {
            raw_rate: self.raw_rate.is_some().then(|| raw_rate(rate, device)),
            log_level: self.log_level.is_some().then(|| log_level(level, device)),
            ..self
        }
    }

    /// σ over the signal's mean amplitude `[1]`, with the gradient to the parameter; `None` for a law without a rate.
    pub fn rate(&self, device: &Device) -> Option<Tensor<1>> {
        match (self.law, &self.raw_rate) {
            (NoiseLaw::Learned, Some(raw)) => Some(softplus(raw.val(), 1.0)),
            (NoiseLaw::Learned | NoiseLaw::Fixed, _) => Some(Tensor::from_data([self.rate as f32], device)),
            (NoiseLaw::Constant | NoiseLaw::None, _) => None,
        }
    }

    /// σ of each component under a signal, `[1]`; `None` without noise. The signal's mean amplitude is taken over all of the given
    /// tensor: give one frame.
    ///
    /// # Gradient
    /// Flows to the signal through its mean amplitude, and to the learned rate or level.
    pub fn deviation<const D: usize>(&self, signal: &Complex<D>) -> Option<Tensor<1>> {
        let dtype = signal.re.dtype();
        match self.law {
            NoiseLaw::None => None,
            NoiseLaw::Constant => Some(match &self.log_level {
                Some(log_level) => log_level.val().exp().cast(dtype),
                None => Tensor::from_data(TensorData::from([self.level]).convert_dtype(dtype), (&signal.device(), dtype)),
            }),
            NoiseLaw::Learned | NoiseLaw::Fixed => {
                let rate = self.rate(&signal.device()).expect("this law has a rate").cast(dtype);
                Some(rate * mean_amplitude(signal.clone()))
            }
        }
    }

    /// The signal with noise of [`Self::deviation`].
    ///
    /// # Shapes
    /// signal and normals (standard, from [`normals`]) alike; any axes.
    ///
    /// # Gradient
    /// Flows to the signal, also through its mean amplitude, and to the learned rate.
    pub fn add_to<const D: usize>(&self, signal: Complex<D>, normals: Complex<D>) -> Complex<D> {
        assert_eq!(signal.dims(), normals.dims(), "noise: signal {:?}, normals {:?}", signal.dims(), normals.dims());
        match self.deviation(&signal) {
            None => signal,
            Some(deviation) => {
                let deviation = deviation.reshape([1; D]);
                signal.add(Complex::new(normals.re * deviation.clone(), normals.im * deviation))
            }
        }
    }
}

/// Mean of |z| over everything, `[1]`; a zero has gradient zero.
fn mean_amplitude<const D: usize>(signal: Complex<D>) -> Tensor<1> {
    // The smallest that an f32's square root still answers with a finite gradient for zero.
    (signal.power() + 1e-30).sqrt().mean()
}

/// Standard normal numbers for both components, drawn on the host: equal seeds agree on every backend.
pub fn normals<const D: usize>(seed: u64, dims: [usize; D], device: &Device, dtype: DType) -> Complex<D> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = dims.iter().product();
    let mut draw = || {
        let values: Vec<f32> = (0..count).map(|_| StandardNormal.sample(&mut random)).collect();
        Tensor::from_data(TensorData::new(values, dims).convert_dtype(dtype), (device, dtype))
    };
    let re = draw();
    Complex::new(re, draw())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn signal(device: &Device, dtype: DType, scale: f64) -> Complex<3> {
        let tensor = |offset: usize| {
            let values: Vec<f64> = (0..2 * 3 * 4).map(|i| scale * (((i * 5 + offset) % 7) as f64 - 3.0)).collect();
            let tensor = Tensor::from_data(TensorData::new(values, [2, 3, 4]).convert_dtype(dtype), (device, dtype));
            if device.is_autodiff() { tensor.require_grad() } else { tensor }
        };
        Complex::new(tensor(0), tensor(3))
    }

    fn numbers<const D: usize>(tensor: &Tensor<D>) -> Vec<f64> {
        tensor.clone().into_data().convert::<f64>().try_into_vec::<f64>().unwrap()
    }

    fn config(law: NoiseLaw, rate: f64) -> NoiseConfig {
        NoiseConfig { law, rate, level: 0.5 }
    }

    #[test]
    fn the_learned_rate_starts_where_the_settings_say() {
        for rate in [1e-4, 0.025, 3.0, 50.0] {
            let noise = config(NoiseLaw::Learned, rate).init(&Device::flex());
            let found = numbers(&noise.rate(&Device::flex()).unwrap())[0];
            assert!((found / rate - 1.0).abs() < 1e-4, "{found}, wanted {rate}");
        }
    }

    #[test]
    fn deviation_is_the_rate_times_the_mean_amplitude_in_each_component() {
        let device = Device::flex();
        let dims = [40, 50, 60];
        let signal = Complex::new(Tensor::full(dims, 3.0, &device), Tensor::full(dims, 4.0, &device));
        for law in [NoiseLaw::Learned, NoiseLaw::Fixed, NoiseLaw::Constant] {
            let noisy = config(law, 0.1).init(&device).add_to(signal.clone(), normals(1, dims, &device, DType::F32));
            for (part, clean) in [(noisy.re, 3.0), (noisy.im, 4.0)] {
                let variance = numbers(&part).iter().map(|x| (x - clean).powi(2)).sum::<f64>() / 120_000.0;
                // 0.1 · |3 + 4j|, and the constant level, are both one half.
                assert!((variance.sqrt() - 0.5).abs() < 0.01, "{law:?}: {}", variance.sqrt());
            }
        }
    }

    #[test]
    fn without_noise_the_signal_stays_as_it_is() {
        let device = Device::flex();
        let clean = signal(&device, DType::F32, 1.0);
        let noisy = config(NoiseLaw::None, 0.1).init(&device).add_to(clean.clone(), normals(1, [2, 3, 4], &device, DType::F32));
        assert_eq!(numbers(&noisy.re), numbers(&clean.re));
    }

    #[test]
    fn equal_seeds_draw_equal_normals_and_others_do_not() {
        let draw = |seed| numbers(&normals(seed, [2, 3], &Device::flex(), DType::F32).im);
        assert_eq!(draw(5), draw(5));
        assert_ne!(draw(5), draw(6));
    }

    pub(crate) fn gradients_flow_to_the_rate_and_to_the_signal() {
        let device = Device::flex().autodiff();
        let noise = config(NoiseLaw::Learned, 0.3).init(&device);
        let loss = |noise: &Noise, signal: Complex<3>| {
            let normals = normals(2, [2, 3, 4], &signal.device(), DType::F64);
            noise.add_to(signal, normals).power().sum()
        };
        let clean = signal(&device, DType::F64, 1.0);
        let raw = noise.raw_rate.as_ref().unwrap().val();
        let gradients = loss(&noise, clean.clone()).backward();
        let to_rate = numbers(&raw.grad(&gradients).expect("a gradient to the rate"))[0];
        let to_signal = numbers(&clean.re.grad(&gradients).expect("a gradient to the signal"));

        let step = 1e-3;
        let at_rate = |by: f64| {
            let mut moved = noise.clone();
            moved.raw_rate = Some(Param::from_tensor(Tensor::from_data([(numbers(&raw)[0] + by) as f32], &device)));
            numbers(&loss(&moved, clean.clone()))[0]
        };
        let wanted = (at_rate(step) - at_rate(-step)) / (2.0 * step);
        crate::support::compared(&[wanted]);
        assert!((to_rate / wanted - 1.0).abs() < 1e-3, "{to_rate}, wanted {wanted}");
        for (i, found) in to_signal.iter().enumerate() {
            let at = |by: f64| {
                let mut values = numbers(&clean.re);
                values[i] += by;
                let re = Tensor::from_data(TensorData::new(values, [2, 3, 4]), (&device, DType::F64));
                numbers(&loss(&noise, Complex::new(re, clean.im.clone())))[0]
            };
            let wanted = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - wanted).abs() < 1e-6 * wanted.abs().max(1.0), "element {i}: {found}, wanted {wanted}");
        }
    }

    #[test]
    fn a_constant_level_is_learned_when_none_is_given() {
        let device = Device::flex();
        let autodiff = device.clone().autodiff();
        let noise =
            NoiseConfig { law: NoiseLaw::Constant, rate: 0.1, level: 0.0 }.init(&autodiff).starting_at(0.1, 2.5, &autodiff);
        let silence = Complex::<2>::zeros([40, 50], &autodiff);
        let noisy = noise.add_to(silence, normals(3, [40, 50], &autodiff, DType::F32));
        let power = noisy.power().mean();
        let found = f64::from(power.clone().into_scalar::<f32>()) / 2.0;
        assert!((found.sqrt() - 2.5).abs() < 0.1, "σ {}", found.sqrt());
        // d(σ²·mean)/d(ln σ) = 2 σ²·mean.
        let gradients = power.clone().backward();
        let gradient = noise.log_level.as_ref().unwrap().val().grad(&gradients).unwrap().into_scalar::<f32>();
        assert!((gradient / (2.0 * power.into_scalar::<f32>()) - 1.0).abs() < 1e-4, "{gradient}");
    }

    #[test]
    fn silence_has_finite_gradients() {
        let device = Device::flex().autodiff();
        for dtype in [DType::F32, DType::F64] {
            let noise = config(NoiseLaw::Learned, 0.3).init(&device);
            let silence = signal(&device, dtype, 0.0);
            let noisy = noise.add_to(silence.clone(), normals(2, [2, 3, 4], &device, dtype));
            let gradients = noisy.re.sum().backward();
            let found = numbers(&silence.re.grad(&gradients).unwrap());
            assert!(found.iter().all(|g| g.is_finite()), "{dtype:?}: {found:?}");
        }
    }

    #[test]
    fn rates_that_are_no_rates_are_refused() {
        assert!(config(NoiseLaw::Fixed, 0.1).check("noise").is_ok());
        for rate in [0.0, -1.0, f64::NAN] {
            let error = config(NoiseLaw::Fixed, rate).check("noise").unwrap_err();
            assert!(error.to_string().starts_with("`noise.rate` is"), "{error}");
        }
        assert!(serde_json::from_str::<NoiseConfig>(r#"{"law": "learned", "rat": 1}"#).is_err());
    }
}
