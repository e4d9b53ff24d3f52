//! An effect's values as tensors, which is how operators read them.

use std::collections::BTreeMap;

use burn::tensor::{DType, Device, Int, Tensor, TensorData};

use super::parameter::{ParameterInfo, named};
use crate::complex::Complex;

/// Values of one effect in the signal's number type.
#[derive(Clone, Debug)]
pub struct Values {
    /// Of the effect.
    pub(super) id: &'static str,
    pub(super) known: &'static [ParameterInfo],
    /// Each `[value]`, in the parameter's unit.
    pub(super) tensors: BTreeMap<String, Tensor<1>>,
    pub(super) fixed: BTreeMap<String, Vec<f64>>,
    pub(super) choice: Option<String>,
    pub(super) device: Device,
    pub(super) dtype: DType,
}

impl Values {
    fn neutral(&self, name: &str) -> f64 {
        named(self.known, name).unwrap_or_else(|| panic!("{} has no parameter {name}", self.id)).neutral
    }

    /// `[value]`; the neutral value where none is given.
    pub fn get(&self, name: &str) -> Tensor<1> {
        match self.tensors.get(name) {
            Some(tensor) => tensor.clone(),
            None => self.constant(&[self.neutral(name)]),
        }
    }

    /// The first value, `[1]`.
    pub fn first(&self, name: &str) -> Tensor<1> {
        self.get(name).narrow(0, 0, 1)
    }

    /// The first value, for any shape.
    pub fn scalar<const D: usize>(&self, name: &str) -> Tensor<D> {
        self.first(name).reshape([1; D])
    }

    /// Whether the setting names this parameter.
    pub fn has(&self, name: &str) -> bool {
        self.tensors.contains_key(name) || self.fixed.contains_key(name)
    }

    /// Values of a parameter that does not learn.
    pub fn host(&self, name: &str) -> Vec<f64> {
        self.fixed.get(name).cloned().unwrap_or_else(|| vec![self.neutral(name)])
    }

    /// The three components of a place or an offset, each `[1]`.
    pub fn vector(&self, name: &str) -> [Tensor<1>; 3] {
        let all = self.get(name);
        let [count] = all.dims();
        std::array::from_fn(|axis| all.clone().narrow(0, axis.min(count - 1), 1))
    }

    /// A constant beside these values, `[value]`.
    pub fn constant(&self, values: &[f64]) -> Tensor<1> {
        self.tensor(values.to_vec(), [values.len()])
    }

    /// A constant of any shape.
    pub fn tensor<const D: usize>(&self, values: Vec<f64>, dims: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values, dims).convert_dtype(self.dtype), (&self.device, self.dtype))
    }

    /// A list with a value for each channel (tx by tx), for each receiver, or one for all: `[tx, rx, 1, 1]`.
    /// A list of another length is repeated.
    pub fn channels(&self, list: Tensor<1>, [tx, rx]: [usize; 2]) -> Tensor<4> {
        let [count] = list.dims();
        if count == 1 {
            return list.reshape([1, 1, 1, 1]);
        }
        repeated(list, tx * rx).reshape([tx, rx, 1, 1])
    }

    /// Linear amplitude 10^(level/20) + re + j im relative to the reference, `[value]`; zero at the neutral values.
    pub fn amplitude(&self) -> Complex<1> {
        let neutral = self.neutral("level_db");
        let per_db = std::f64::consts::LN_10 / 20.0;
        // exp(…) − 1 is exactly zero at the neutral level, where a power alone would leave 1e-10.
        let level = ((self.get("level_db") - neutral) * per_db).exp() - 1.0;
        let re = level * 10f64.powf(neutral / 20.0) + self.get("re");
        let im = self.get("im");
        let count = re.dims()[0].max(im.dims()[0]);
        Complex::new(repeated(re, count), repeated(im, count))
    }

    /// What levels are relative to, `[1]`: the setting's, or the strongest sample of this frame's signal. No gradient.
    pub fn reference(&self, signal: &Complex<4>) -> Tensor<1> {
        match self.host("reference")[0] {
            given if given > 0.0 => self.constant(&[given]),
            _ => (signal.clone().detach().power().max() + 1e-30).sqrt(),
        }
    }

    /// exp(j angle) of the parameter `phase_rad`, any shape.
    pub fn phase<const D: usize>(&self) -> Complex<D> {
        let angle = self.scalar::<D>("phase_rad");
        Complex::new(angle.clone().cos(), angle.sin())
    }
}

/// The list over and over, up to `count` values.
pub(super) fn repeated(list: Tensor<1>, count: usize) -> Tensor<1> {
    let [length] = list.dims();
    if length == count {
        return list;
    }
    let index: Vec<i64> = (0..count).map(|i| (i % length) as i64).collect();
    let device = list.device();
    list.select(0, Tensor::<1, Int>::from_data(TensorData::new(index, [count]), &device))
}
