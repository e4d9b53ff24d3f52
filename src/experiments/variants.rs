//! The simulators that are compared: the full one and the paper's ablations of it, each as a change of its settings.

use serde::{Deserialize, Serialize};

use crate::body::SurfaceConfig;
use crate::if_signal::NoiseLaw;
use crate::loss::Scale;
use crate::simulator::{PathModel, SimulatorConfig};
use crate::training::TrainingConfig;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    Ours,
    /// Both paths by Gaussian patches (paper, table 3).
    Coupled,
    /// Paper, section 4.7.
    WithoutIndirect,
    /// No graph convolution in training (paper, supplement 10).
    WithoutGcn,
    /// Ours, with the graph convolution kept on at inference (paper, tables 5 and 6).
    GcnAtInference,
    /// Paper, table 4.
    WithoutNoise,
    /// The paper's fixed rate of 0.025 (paper, table 4 and supplement 12).
    FixedNoise,
    /// What receivers have: one level whatever the signal, learned.
    ThermalNoise,
    /// Trained on linear amplitudes (paper, supplement 8, which shows maps and no such training).
    LinearLoss,
    /// The surface as it is, in place of the mesh's vertices.
    DenseSurface,
    /// Ours, with what the diagnosis found in one training recording.
    WithEffects,
}

impl Variant {
    pub const ALL: [Self; 11] = [
        Self::Ours,
        Self::Coupled,
        Self::WithoutIndirect,
        Self::WithoutGcn,
        Self::GcnAtInference,
        Self::WithoutNoise,
        Self::FixedNoise,
        Self::ThermalNoise,
        Self::LinearLoss,
        Self::DenseSurface,
        Self::WithEffects,
    ];

    /// As in settings and folders.
    pub fn id(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Coupled => "coupled",
            Self::WithoutIndirect => "without_indirect",
            Self::WithoutGcn => "without_gcn",
            Self::GcnAtInference => "gcn_at_inference",
            Self::WithoutNoise => "without_noise",
            Self::FixedNoise => "fixed_noise",
            Self::ThermalNoise => "thermal_noise",
            Self::LinearLoss => "linear_loss",
            Self::DenseSurface => "dense_surface",
            Self::WithEffects => "with_effects",
        }
    }

    /// As in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Ours => "HybridSim",
            Self::Coupled => "HybridSim, coupled Gaussian patches",
            Self::WithoutIndirect => "HybridSim without indirect path",
            Self::WithoutGcn => "HybridSim, no GCN in training",
            Self::GcnAtInference => "HybridSim, GCN at inference",
            Self::WithoutNoise => "HybridSim without noise",
            Self::FixedNoise => "HybridSim, fixed noise",
            Self::ThermalNoise => "HybridSim, thermal noise",
            Self::LinearLoss => "HybridSim, linear loss",
            Self::DenseSurface => "HybridSim, dense surface",
            Self::WithEffects => "HybridSim with found effects",
        }
    }

    /// The variant whose training this one uses.
    pub fn trained_as(self) -> Self {
        if self == Self::GcnAtInference { Self::Ours } else { self }
    }

    /// The settings it is trained with. The effects that were found are not known here.
    pub fn settings(self, base: &SimulatorConfig, dense: &SurfaceConfig) -> SimulatorConfig {
        let mut settings = base.clone();
        match self.trained_as() {
            Self::Coupled => settings.paths = PathModel::Coupled,
            Self::WithoutIndirect => settings.paths = PathModel::Direct,
            Self::WithoutGcn => settings.graph.used = 0.0,
            Self::WithoutNoise => settings.noise.law = NoiseLaw::None,
            Self::FixedNoise => {
                settings.noise.law = NoiseLaw::Fixed;
                settings.noise.rate = 0.025;
            }
            Self::ThermalNoise => {
                settings.noise.law = NoiseLaw::Constant;
                settings.noise.level = 0.0;
            }
            Self::DenseSurface => settings.surface = dense.clone(),
            Self::Ours | Self::GcnAtInference | Self::LinearLoss | Self::WithEffects => {}
        }
        settings
    }

    /// How it is trained.
    pub fn training(self, base: &TrainingConfig) -> TrainingConfig {
        let mut training = base.clone();
        if self == Self::LinearLoss {
            training.loss.scale = Scale::Linear;
        }
        training
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ablation_changes_what_it_is_named_after() {
        let base = SimulatorConfig::default();
        let dense = SurfaceConfig { sampling: crate::body::Sampling::Facets, ..Default::default() };
        let same = [Variant::Ours, Variant::GcnAtInference, Variant::LinearLoss, Variant::WithEffects];
        let training = TrainingConfig::default();
        for variant in Variant::ALL {
            assert_eq!(variant.settings(&base, &dense) == base, same.contains(&variant), "{}", variant.id());
            assert_eq!(variant.training(&training) == training, variant != Variant::LinearLoss, "{}", variant.id());
            assert_eq!(serde_json::to_value(variant).unwrap(), variant.id());
        }
        assert_eq!(Variant::Coupled.settings(&base, &dense).paths, PathModel::Coupled);
        assert_eq!(Variant::GcnAtInference.trained_as(), Variant::Ours);
    }
}
