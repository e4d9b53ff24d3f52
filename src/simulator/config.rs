//! Settings of the simulator, gathered from its parts.

use serde::{Deserialize, Serialize};

use super::equations::EquationsConfig;
use crate::{
    body::{Interpolation, Sampling, SurfaceConfig},
    effects::EffectSetting,
    error::{Error, Result},
    features::{EncodingConfig, GcnConfig, TriPlaneConfig},
    if_signal::{NoiseConfig, SumForm},
    paths::Dechirp,
    scatterers::{
        decoders::DecodersConfig, microfacet::Response, room_patches::RoomPatchesConfig, visibility::DEFAULT_FLIP_EXPONENT,
    },
};

/// Which paths are simulated, and by which model of scattering (the paper's ablations).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PathModel {
    /// Direct by microfacets, indirect by Gaussian patches: the paper's model.
    #[default]
    Decoupled,
    /// Both by Gaussian patches ("coupled 3DGS").
    Coupled,
    /// Only the direct path, by microfacets.
    Direct,
    /// Only the indirect path, by Gaussian patches.
    Indirect,
}

impl PathModel {
    /// Whether the direct path is simulated.
    pub fn has_direct(self) -> bool {
        self != Self::Indirect
    }

    /// By Gaussian patches, whatever the direct path is by.
    pub fn has_indirect(self) -> bool {
        self != Self::Direct
    }

    /// Whether some scatterers are taken for microfacets.
    pub fn has_microfacets(self) -> bool {
        matches!(self, Self::Decoupled | Self::Direct)
    }
}

/// Everything that shapes the simulator's answer; saved with each checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulatorConfig {
    pub paths: PathModel,
    pub dechirp: Dechirp,
    pub sum: SumForm,
    /// Between poses.
    pub interpolation: Interpolation,
    /// γ of hidden point removal: the flip radius is 10^γ times the largest distance.
    pub flip_exponent: f64,
    /// Facets are integrated on the direct path; on the indirect one the patches' own aperture takes that place.
    pub surface: SurfaceConfig,
    pub room: RoomPatchesConfig,
    pub triplane: TriPlaneConfig,
    pub encoding: EncodingConfig,
    pub graph: GcnConfig,
    pub decoders: DecodersConfig,
    /// What of the microfacet model is the amplitude.
    pub response: Response,
    /// Where amplitudes are the paper's and where ours.
    pub equations: EquationsConfig,
    pub noise: NoiseConfig,
    /// Physics beyond the plain model; the values are where learning starts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectSetting>,
}

impl Default for SimulatorConfig {
    fn default() -> Self {
        Self {
            paths: PathModel::default(),
            dechirp: Dechirp::default(),
            sum: SumForm::default(),
            interpolation: Interpolation::default(),
            flip_exponent: DEFAULT_FLIP_EXPONENT,
            surface: SurfaceConfig::default(),
            room: RoomPatchesConfig::default(),
            triplane: TriPlaneConfig::default(),
            encoding: EncodingConfig::default(),
            graph: GcnConfig::default(),
            decoders: DecodersConfig::default(),
            response: Response::default(),
            equations: EquationsConfig::default(),
            noise: NoiseConfig::default(),
            effects: Vec::new(),
        }
    }
}

impl SimulatorConfig {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        self.surface.check("simulator.surface")?;
        self.room.check("simulator.room")?;
        self.triplane.check("simulator.triplane")?;
        self.encoding.check("simulator.encoding")?;
        self.graph.check("simulator.graph")?;
        self.decoders.check("simulator.decoders")?;
        self.noise.check("simulator.noise")?;
        self.equations.check("simulator.equations", self.surface.sampling)?;
        for (index, effect) in self.effects.iter().enumerate() {
            effect.check(&format!("simulator.effects.{index}"))?;
        }
        if self.paths == PathModel::Coupled && self.surface.sampling == Sampling::Facets {
            return Err(Error::setting(
                "simulator.surface.sampling",
                "facets",
                "vertices or subdivided with paths = \"coupled\"",
            )
            .with_hint("Gaussian patches have an aperture of their own; the facets' integral would count it twice"));
        }
        if !(0.0..=10.0).contains(&self.flip_exponent) {
            return Err(Error::setting("simulator.flip_exponent", self.flip_exponent, "0 to 10"));
        }
        Ok(())
    }
}
