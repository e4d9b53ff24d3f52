//! An effect that is part of a simulator: its values as parameters that learn.

use std::collections::BTreeMap;

use burn::{
    module::{Module, Param},
    tensor::{DType, Device, Tensor, TensorData},
};

use super::{EffectInfo, EffectSetting, info, operator::Operator, parameter::Role, values::Values};

/// Decibels of a factor of e.
const NEPER_DB: f64 = 20.0 * std::f64::consts::LOG10_E;

/// One parameter, in units that suit an optimiser: its value is neutral + scale · raw.
#[derive(Module, Debug)]
pub struct Parameter {
    /// `[value]`
    pub raw: Param<Tensor<1>>,
    #[module(skip)]
    name: String,
    #[module(skip)]
    neutral: f64,
    #[module(skip)]
    scale: f64,
}

impl Parameter {
    /// The scale is the size of what the values start from, so that a step of the optimiser is a share of it; or half
    /// the prior's width where they start neutral (1 where only the recording knows the unit). Decibels are logarithms
    /// already: their scale is at most a factor of e.
    fn new(name: &str, values: &[f64], info: &EffectInfo, device: &Device) -> Self {
        let parameter = info.parameter(name).unwrap_or_else(|| panic!("{} has no parameter {name}", info.id));
        let away: Vec<f64> = values.iter().map(|value| value - parameter.neutral).collect();
        let size = (away.iter().map(|x| x * x).sum::<f64>() / away.len() as f64).sqrt();
        let scale = match size {
            size if size > NEPER_DB && parameter.unit.starts_with("dB") => NEPER_DB,
            size if size > 0.0 => size,
            _ if parameter.is_relative() => 1.0,
            _ => 0.5 * (parameter.most - parameter.least),
        };
        let raw: Vec<f32> = away.iter().map(|away| (away / scale) as f32).collect();
        let raw = Tensor::from_data(TensorData::new(raw, [values.len()]), device);
        Self { raw: Param::from_tensor(raw), name: name.into(), neutral: parameter.neutral, scale }
    }

    fn value(&self, dtype: DType) -> Tensor<1> {
        self.raw.val().cast(dtype) * self.scale + self.neutral
    }
}

impl EffectInfo {
    /// Values of its parameters; one that is not given keeps its neutral value.
    ///
    /// # Panics
    /// For a parameter that it does not have.
    pub fn values(&self, given: &[(&str, Vec<f64>)], device: &Device, dtype: DType) -> Values {
        let mut values = Values {
            id: self.id,
            known: self.parameters,
            tensors: BTreeMap::new(),
            fixed: BTreeMap::new(),
            choice: None,
            device: device.clone(),
            dtype,
        };
        for (name, list) in given {
            assert!(self.parameter(name).is_some(), "{} has no parameter {name}", self.id);
            if is_fixed(self, name) {
                values.fixed.insert((*name).into(), list.clone());
            } else {
                values.tensors.insert((*name).into(), values.constant(list));
            }
        }
        values
    }
}

fn is_fixed(info: &EffectInfo, name: &str) -> bool {
    info.parameter(name).is_some_and(|parameter| parameter.role == Role::Fixed)
}

/// An effect with its values.
#[derive(Module, Debug)]
pub struct Effect {
    pub parameters: Vec<Parameter>,
    #[module(skip)]
    setting: EffectSetting,
}

impl Effect {
    /// # Panics
    /// For a setting that [`EffectSetting::check`] refuses.
    pub(super) fn new(setting: &EffectSetting, device: &Device) -> Self {
        let info = info(&setting.id).unwrap_or_else(|| panic!("no effect {}", setting.id));
        let learning = setting.parameters.iter().filter(|(name, _)| !is_fixed(info, name));
        let parameters = learning.map(|(name, values)| Parameter::new(name, values, info, device)).collect();
        Self { parameters, setting: setting.clone() }
    }

    /// Its id, as in [`EffectInfo::id`].
    pub fn id(&self) -> &str {
        &self.setting.id
    }

    fn info(&self) -> &'static EffectInfo {
        info(&self.setting.id).expect("checked when it was made")
    }

    pub(super) fn operator(&self) -> Operator {
        self.info().operator
    }

    /// The boundary or the part of the body that it acts on.
    pub fn choice(&self) -> Option<&str> {
        self.setting.choice.as_deref()
    }

    /// Whether it acts; one that is switched off keeps its values.
    pub fn is_enabled(&self) -> bool {
        self.setting.enabled
    }

    pub(super) fn enable(&mut self, enabled: bool) {
        self.setting.enabled = enabled;
    }

    /// The values as tensors.
    ///
    /// # Gradient
    /// Flows to the parameters.
    pub fn values(&self, device: &Device, dtype: DType) -> Values {
        Values {
            tensors: self.parameters.iter().map(|parameter| (parameter.name.clone(), parameter.value(dtype))).collect(),
            fixed: self.fixed(),
            choice: self.setting.choice.clone(),
            ..self.info().values(&[], device, dtype)
        }
    }

    fn fixed(&self) -> BTreeMap<String, Vec<f64>> {
        let fixed = self.setting.parameters.iter().filter(|(name, _)| is_fixed(self.info(), name));
        fixed.map(|(name, values)| (name.clone(), values.clone())).collect()
    }

    /// The setting with the values as they are now.
    pub fn setting(&self) -> EffectSetting {
        let mut setting = self.setting.clone();
        for parameter in &self.parameters {
            let raw = parameter.raw.val().into_data().convert::<f64>().try_into_vec::<f64>().expect("converted");
            let values = raw.into_iter().map(|raw| raw * parameter.scale + parameter.neutral).collect();
            setting.parameters.insert(parameter.name.clone(), values);
        }
        setting
    }
}
