//! The receiver's noise (paper, section 3.4 and its supplement on fixed noise).

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
    #[default]
    Learned,
    /// The same with the rate as it is.
    Fixed,
    /// Thermal: the same σ whatever the signal.
    Constant,
    None,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseConfig {
    pub law: NoiseLaw,
    /// σ of each component over the signal's mean amplitude; where learning starts.
    pub rate: f64,
    /// σ of each component for `constant`, in the signal's unit.
    pub level: f64,
}

impl Default for NoiseConfig {
    fn default() -> Self {
        Self { law: NoiseLaw::Learned, rate: 0.025, level: 0.0 }
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

    pub fn init(&self, device: &Device) -> Noise {
        Noise {
            raw_rate: (self.law == NoiseLaw::Learned).then(|| raw_rate(self.rate, device)),
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

impl Noise {
    /// The same noise, learning from another rate on; laws that do not learn stay as they are.
    pub fn starting_at(self, rate: f64, device: &Device) -> Self {
        Self { raw_rate: self.raw_rate.is_some().then(|| raw_rate(rate, device)), ..self }
    }

    /// σ over the signal's mean amplitude `[1]`, with the gradient to the parameter; `None` for a law without a rate.
    pub fn rate(&self, device: &Device) -> Option<Tensor<1>> {
        match (self.law, &self.raw_rate) {
            (NoiseLaw::Learned, Some(raw)) => Some(softplus(raw.val(), 1.0)),
            (NoiseLaw::Learned | NoiseLaw::Fixed, _) => Some(Tensor::from_data([self.rate as f32], device)),
            (NoiseLaw::Constant | NoiseLaw::None, _) => None,
        }
    }

    /// The signal with noise. Its mean amplitude is taken over all of the given tensor: give one frame.
    ///
    /// # Shapes
    /// signal and normals (standard, from [`normals`]) alike; any axes.
    ///
    /// # Gradient
    /// Flows to the signal, also through its mean amplitude, and to the learned rate.
    pub fn add_to<const D: usize>(&self, signal: Complex<D>, normals: Complex<D>) -> Complex<D> {
        assert_eq!(signal.dims(), normals.dims(), "noise: signal {:?}, normals {:?}", signal.dims(), normals.dims());
        match self.law {
            NoiseLaw::None => signal,
            NoiseLaw::Constant => signal.add(normals.scale_by(self.level)),
            NoiseLaw::Learned | NoiseLaw::Fixed => {
                let rate = self.rate(&signal.device()).expect("this law has a rate").cast(signal.re.dtype());
                let deviation = (rate * mean_amplitude(signal.clone())).reshape([1; D]);
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
