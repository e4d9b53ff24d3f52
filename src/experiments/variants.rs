//! The simulators that are compared: the full one and the paper's ablations of it, each as a change of its settings.

use serde::{Deserialize, Serialize};

use crate::body::SurfaceConfig;
use crate::effects::{EffectSetting, floor_bounce, wall_ghost};
use crate::if_signal::NoiseLaw;
use crate::loss::Scale;
use crate::room::Boundary;
use crate::simulator::{PathModel, SimulatorConfig};
use crate::training::TrainingConfig;

/// A simulator of the comparison.
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
    /// Trained on how likely the measured power is, in place of decibels.
    Likelihood,
    /// The surface as it is, in place of the mesh's vertices.
    DenseSurface,
    /// All three that physics asks for: the surface as it is, the receiver's noise, the likelihood.
    Physical,
    /// The same without the indirect path.
    PhysicalDirect,
    /// The same with every wall a mirror of the body (image theory), its coefficient learned, and patches for what is left.
    Mirrored,
    /// Ours, with what the diagnosis found in one training recording.
    WithEffects,
}

impl Variant {
    /// All fifteen.
    const ALL: [Self; 15] = [
        Self::Ours,
        Self::Coupled,
        Self::WithoutIndirect,
        Self::WithoutGcn,
        Self::GcnAtInference,
        Self::WithoutNoise,
        Self::FixedNoise,
        Self::ThermalNoise,
        Self::LinearLoss,
        Self::Likelihood,
        Self::DenseSurface,
        Self::Physical,
        Self::PhysicalDirect,
        Self::Mirrored,
        Self::WithEffects,
    ];

    /// Those that say something at any site; the others need a truth with returns of the body by way of the walls.
    pub fn usual() -> Vec<Self> {
        Self::ALL.into_iter().filter(|variant| ![Self::PhysicalDirect, Self::Mirrored].contains(variant)).collect()
    }

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
            Self::Likelihood => "likelihood",
            Self::DenseSurface => "dense_surface",
            Self::Physical => "physical",
            Self::PhysicalDirect => "physical_direct",
            Self::Mirrored => "mirrored",
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
            Self::Likelihood => "HybridSim, likelihood",
            Self::DenseSurface => "HybridSim, dense surface",
            Self::Physical => "HybridSim, dense surface, thermal noise, likelihood",
            Self::PhysicalDirect => "HybridSim, dense surface, thermal noise, likelihood, no indirect path",
            Self::Mirrored => "HybridSim, dense surface, thermal noise, likelihood, mirrors",
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
            Self::ThermalNoise => thermal(&mut settings),
            Self::DenseSurface => settings.surface = dense.clone(),
            Self::Physical => physical(&mut settings, dense),
            Self::PhysicalDirect => {
                physical(&mut settings, dense);
                settings.paths = PathModel::Direct;
            }
            Self::Mirrored => {
                physical(&mut settings, dense);
                settings.effects.extend(Boundary::ALL.map(mirror));
            }
            Self::Ours | Self::GcnAtInference | Self::LinearLoss | Self::Likelihood | Self::WithEffects => {}
        }
        settings
    }

    /// How it is trained.
    pub fn training(self, base: &TrainingConfig) -> TrainingConfig {
        let mut training = base.clone();
        match self {
            Self::LinearLoss => training.loss.scale = Scale::Linear,
            Self::Likelihood | Self::Physical | Self::PhysicalDirect | Self::Mirrored => {
                training.loss.scale = Scale::Likelihood;
            }
            _ => {}
        }
        training
    }
}

fn physical(settings: &mut SimulatorConfig, dense: &SurfaceConfig) {
    thermal(settings);
    settings.surface = dense.clone();
}

/// A wall as a mirror of the body; where learning starts is no claim about walls.
fn mirror(boundary: Boundary) -> EffectSetting {
    let mirror = match boundary {
        Boundary::Floor => EffectSetting::neutral(floor_bounce::ID),
        boundary => EffectSetting::neutral(wall_ghost::ID).choosing(boundary.name()),
    };
    mirror.with("coefficient", [0.1]).with("phase_rad", [0.0])
}

/// What receivers have: one level, learned from where it starts.
fn thermal(settings: &mut SimulatorConfig) {
    settings.noise.law = NoiseLaw::Constant;
    settings.noise.level = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ablation_changes_what_it_is_named_after() {
        let mut base = SimulatorConfig { surface: SurfaceConfig::vertices(), ..SimulatorConfig::default() };
        base.noise.law = NoiseLaw::Learned;
        let dense = SurfaceConfig { sampling: crate::body::Sampling::Facets, ..Default::default() };
        let same = [Variant::Ours, Variant::GcnAtInference, Variant::LinearLoss, Variant::Likelihood, Variant::WithEffects];
        let physical = [Variant::Physical, Variant::PhysicalDirect, Variant::Mirrored];
        let other_losses = [vec![Variant::LinearLoss, Variant::Likelihood], physical.to_vec()].concat();
        let mut training = TrainingConfig::default();
        training.loss.scale = Scale::Db;
        for variant in Variant::ALL {
            assert_eq!(variant.settings(&base, &dense) == base, same.contains(&variant), "{}", variant.id());
            assert_eq!(variant.training(&training) != training, other_losses.contains(&variant), "{}", variant.id());
            assert_eq!(serde_json::to_value(variant).unwrap(), variant.id());
        }
        assert_eq!(Variant::Coupled.settings(&base, &dense).paths, PathModel::Coupled);
        assert_eq!(Variant::GcnAtInference.trained_as(), Variant::Ours);
    }
}
