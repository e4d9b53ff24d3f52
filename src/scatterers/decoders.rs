//! Small networks that turn features into what a surface is made of and how a patch scatters (paper, sections 3.2, 3.3).
//!
//! Body and room have networks of their own. What has units or limits is decoded through a range (`material`,
//! `patches`); what a network returns is called raw.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::material::{Material, MaterialConfig};
use super::patches::{Patch, PatchConfig};
use crate::error::Result;
use crate::features::{Mlp, MlpConfig, draw};

/// Settings of all decoders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DecodersConfig {
    pub network: MlpConfig,
    pub body_material: MaterialConfig,
    pub room_material: MaterialConfig,
    pub body_patch: PatchConfig,
    pub room_patch: PatchConfig,
    /// Where the learned gains start, decibels of amplitude: ADC codes (or whatever unit the recording has) per unit of
    /// amplitude of one square metre at one metre. Training sets them from its first recording, see `Gain::scale`.
    pub gain_db: f64,
}

impl Default for DecodersConfig {
    fn default() -> Self {
        Self {
            network: MlpConfig::default(),
            body_material: MaterialConfig::default(),
            room_material: MaterialConfig::wall(),
            body_patch: PatchConfig::default(),
            room_patch: PatchConfig::default(),
            gain_db: 0.0,
        }
    }
}

impl DecodersConfig {
    /// Refuses settings that cannot work. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        self.network.check(&format!("{key}.network"))?;
        self.body_material.check(&format!("{key}.body_material"))?;
        self.room_material.check(&format!("{key}.room_material"))?;
        self.body_patch.check(&format!("{key}.body_patch"))?;
        self.room_patch.check(&format!("{key}.room_patch"))?;
        if self.body_patch.degree != self.room_patch.degree {
            return Err(crate::Error::setting(
                format!("{key}.room_patch.degree"),
                self.room_patch.degree,
                format!("the degree of body_patch, {}", self.body_patch.degree),
            ));
        }
        if !self.gain_db.is_finite() {
            return Err(crate::Error::setting(format!("{key}.gain_db"), self.gain_db, "a number of decibels"));
        }
        Ok(())
    }

    /// For features of these lengths.
    pub fn init(&self, body_features: usize, room_features: usize, rng: &mut ChaCha8Rng, device: &Device) -> Decoders {
        let mut material = |config: &MaterialConfig, features| MaterialDecoder {
            network: self.network.init(features, &config.raw_initial(), rng, device),
            config: config.clone(),
        };
        let (body_material, room_material) =
            (material(&self.body_material, body_features), material(&self.room_material, room_features));
        let mut patch = |config: &PatchConfig, features| PatchDecoder {
            network: self.network.init(features, &config.raw_initial(), rng, device),
            config: config.clone(),
        };
        let (body_patch, room_patch) = (patch(&self.body_patch, body_features), patch(&self.room_patch, room_features));
        let gain = || Gain::new(self.gain_db, device);
        Decoders { body_material, room_material, body_patch, room_patch, body_gain: gain(), room_gain: gain() }
    }
}

/// All that turns features into scattering. Learned: the networks and the gains.
///
/// Body and room have gains of their own: how densely each is sampled is a choice of ours, and a surface sampled more
/// coarsely than half a wavelength returns too much or too little by up to 16 dB.
#[derive(Module, Debug)]
pub struct Decoders {
    pub body_material: MaterialDecoder,
    pub room_material: MaterialDecoder,
    pub body_patch: PatchDecoder,
    pub room_patch: PatchDecoder,
    pub body_gain: Gain,
    pub room_gain: Gain,
}

/// Features to material (the paper's BRDF decoder).
#[derive(Module, Debug)]
pub struct MaterialDecoder {
    pub network: Mlp,
    #[module(skip)]
    config: MaterialConfig,
}

impl MaterialDecoder {
    /// # Shapes
    /// - `features`: `[point, feature]`
    /// - result: `[point]` each
    ///
    /// # Gradient
    /// Flows to the features and the network.
    pub fn forward(&self, features: Tensor<2>) -> Material {
        self.config.real(self.network.forward(features))
    }
}

/// Features to Gaussian patches (the paper's 3DGS decoder).
#[derive(Module, Debug)]
pub struct PatchDecoder {
    pub network: Mlp,
    #[module(skip)]
    config: PatchConfig,
}

impl PatchDecoder {
    /// # Shapes
    /// - `features`: `[point, feature]`
    /// - result: `[point, …]`, see `Patch`
    ///
    /// # Gradient
    /// Flows to the features and the network.
    pub fn forward(&self, features: Tensor<2>) -> Patch {
        self.config.real(self.network.forward(features))
    }
}

/// The factor from scattering amplitude to the recording's unit (ADC codes), which no physics here knows: transmit
/// power, antenna gains, receiver gain. Applied to direct and indirect path alike.
#[derive(Module, Debug)]
pub struct Gain {
    /// `[1]`, natural logarithm of the factor.
    pub log_gain: Param<Tensor<1>>,
}

impl Gain {
    /// A factor that starts at `gain_db` (20 log₁₀ of amplitude) and learns.
    fn new(gain_db: f64, device: &Device) -> Self {
        Self { log_gain: draw::values(&[gain_db / 20.0 * std::f64::consts::LN_10], [1], device) }
    }

    /// The factor, `[1]`. Gradient flows to `log_gain`.
    pub fn factor(&self) -> Tensor<1> {
        self.log_gain.val().exp()
    }

    /// In decibels of amplitude.
    pub fn db(&self) -> f64 {
        let log_gain = self.log_gain.val().into_data_as::<f64>().try_into_vec::<f64>().expect("f64 data")[0];
        log_gain * 20.0 / std::f64::consts::LN_10
    }

    /// The same gain times `factor`. Before training, with the ratio of a recording's level to a simulation's: the
    /// optimiser's small steps would take thousands of them to get there.
    pub fn scale(self, factor: f64) -> Self {
        let device = self.log_gain.val().device();
        Self { log_gain: Self::new(self.db() + 20.0 * factor.log10(), &device).log_gain }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_gradient, in_f64, input, numbers, other_devices, tensor, values};
    use rand::SeedableRng;

    fn decoders(device: &Device) -> Decoders {
        let config = DecodersConfig { network: MlpConfig { hidden: vec![6] }, gain_db: 6.0, ..Default::default() };
        config.init(4, 3, &mut ChaCha8Rng::seed_from_u64(3), device)
    }

    #[test]
    fn untrained_decoders_give_plausible_surfaces() {
        let device = Device::flex();
        let decoders = decoders(&device);
        let features = tensor(&numbers(1, 200, -1.0, 1.0), [50, 4], &device).cast(burn::tensor::DType::F32);
        let near = |found: &Tensor<1>, wanted: f64, tolerance: f64| {
            let found = values(found);
            assert!(found.iter().all(|value| (value - wanted).abs() < tolerance), "{found:?} is not about {wanted}");
        };
        let skin = decoders.body_material.forward(features.clone());
        near(&skin.refraction, 3.0, 0.3);
        near(&skin.extinction, 1.5, 0.3);
        near(&skin.roughness, 0.4, 0.05);
        let patch = decoders.body_patch.forward(features);
        assert_eq!(patch.lobes.dims(), [50, 9]);
        near(&patch.reflectance, 0.1, 0.02);
        near(&patch.scale_m.clone().reshape([100]), 5e-4, 1e-4);
        near(&patch.offset_m.clone().reshape([150]), 0.0, 2e-3);
        assert!(values(&patch.offset_m).windows(2).any(|pair| pair[0] != pair[1]), "points differ");
    }

    #[test]
    fn one_seed_gives_one_network_on_every_backend() {
        let refraction = |device: &Device| {
            let features = tensor(&numbers(1, 8, -1.0, 1.0), [2, 4], device).cast(burn::tensor::DType::F32);
            values(&decoders(device).body_material.forward(features).refraction)
        };
        for (name, device) in other_devices() {
            assert_close(name, &refraction(&device), &refraction(&Device::flex()), 1e-6);
        }
    }

    #[test]
    fn the_gain_is_a_factor_in_decibels() {
        let gain = Gain::new(20.0, &Device::flex());
        assert_close("factor", &values(&gain.factor()), &[10.0], 1e-6);
        let gain = gain.scale(100.0);
        assert_close("factor", &values(&gain.factor()), &[1000.0], 1e-5);
        assert!((gain.db() - 60.0).abs() < 1e-4);
    }

    pub(crate) fn gradients_to_the_features_and_the_gain_agree_with_central_differences() {
        let decoders = in_f64(decoders(&Device::flex()));
        let inputs = [input("features", numbers(2, 8, -1.0, 1.0)), input("gain", [0.3])];
        check_gradient(&inputs, 1e-5, 1e-7, |x| {
            let mut decoders = decoders.clone().to_device(&x[0].device());
            decoders.body_gain.log_gain = decoders.body_gain.log_gain.map(|_| x[1].clone());
            let features = x[0].clone().reshape([2, 4]);
            let skin = decoders.body_material.forward(features.clone());
            let patch = decoders.body_patch.forward(features);
            let parts = vec![
                skin.roughness,
                skin.extinction,
                patch.offset_m.reshape([6]) * 1e2,
                patch.scale_m.reshape([4]) * 1e3,
                patch.rotation_rad,
                patch.lobes.reshape([18]),
                decoders.body_gain.factor(),
            ];
            Tensor::cat(parts, 0)
        });
    }

    #[test]
    fn settings_survive_writing_and_refuse_unknown_keys() {
        let config = DecodersConfig::default();
        assert!(config.check("decoders").is_ok());
        let text = toml::to_string(&config).expect("serialisable");
        assert_eq!(toml::from_str::<DecodersConfig>(&text).expect("readable"), config);
        assert!(toml::from_str::<DecodersConfig>("gain = 3.0").is_err());
        let mut uneven = config;
        uneven.room_patch.degree = 1;
        let error = uneven.check("decoders").unwrap_err();
        assert_eq!(error.to_string(), "`decoders.room_patch.degree` is 1, expected the degree of body_patch, 2");
    }
}
