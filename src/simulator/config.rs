//! Settings of the simulator, gathered from its parts.

use serde::{Deserialize, Serialize};

use crate::{
    body::{Interpolation, SurfaceConfig},
    features::{EncodingConfig, GraphConfig, TriPlaneConfig},
    if_signal::{NoiseConfig, SumForm},
    paths::Dechirp,
    scatterers::{GaussianConfig, MaterialConfig, room_patches::RoomPatchesConfig},
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
    pub fn has_direct(self) -> bool {
        self != Self::Indirect
    }

    pub fn has_indirect(self) -> bool {
        self != Self::Direct
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
    pub surface: SurfaceConfig,
    pub room: RoomPatchesConfig,
    pub triplane: TriPlaneConfig,
    pub encoding: EncodingConfig,
    pub graph: GraphConfig,
    /// The ablation that keeps the graph convolution on at inference.
    pub graph_at_inference: bool,
    pub material: MaterialConfig,
    pub gaussian: GaussianConfig,
    pub noise: NoiseConfig,
}

impl Default for SimulatorConfig {
    fn default() -> Self {
        Self {
            paths: PathModel::default(),
            dechirp: Dechirp::Exact,
            sum: SumForm::Auto,
            interpolation: Interpolation::Cubic,
            flip_exponent: 2.25,
            surface: SurfaceConfig::default(),
            room: RoomPatchesConfig::default(),
            triplane: TriPlaneConfig::default(),
            encoding: EncodingConfig::default(),
            graph: GraphConfig::default(),
            graph_at_inference: false,
            material: MaterialConfig::default(),
            gaussian: GaussianConfig::default(),
            noise: NoiseConfig::default(),
        }
    }
}
