//! Settings of a reproduction: which site, who is trained on and who is unseen, which simulators, and how long.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::few::FewConfig;
use super::variants::Variant;
use crate::body::{Sampling, SurfaceConfig};
use crate::data::{read_settings, settings::place_path};
use crate::diagnosis::DiagnosisConfig;
use crate::error::{Error, Result};
use crate::evaluation::ComparisonConfig;
use crate::person::actions::Action;
use crate::recognition::RecognitionConfig;
use crate::simulator::SimulatorConfig;
use crate::training::{Split, TrainingConfig};

/// Simulators by others, and the mirror ray tracer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BaselineName {
    RfGenesis,
    RfGenesisReleased,
    Mmgpe,
    /// A control: mmGPE-like lobes on the surface that our variant `dense_surface` sums.
    MmgpeSurface,
    TwoBounce,
}

impl BaselineName {
    /// All five.
    const ALL: [Self; 5] = [Self::RfGenesis, Self::RfGenesisReleased, Self::Mmgpe, Self::MmgpeSurface, Self::TwoBounce];

    /// As in settings, folders and `hybridsim baseline`.
    pub fn id(self) -> &'static str {
        match self {
            Self::RfGenesis => "rf-genesis",
            Self::RfGenesisReleased => "rf-genesis-released",
            Self::Mmgpe => "mmgpe",
            Self::MmgpeSurface => "mmgpe-surface",
            Self::TwoBounce => "two-bounce",
        }
    }

    /// As in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::RfGenesis => "RF-Genesis-like",
            Self::RfGenesisReleased => "RF-Genesis-like, as released",
            Self::Mmgpe => "mmGPE-like",
            Self::MmgpeSurface => "mmGPE-like, dense surface",
            Self::TwoBounce => "two-bounce mirror tracer",
        }
    }
}

/// On whose motions the classifier is trained; it is always tested on measured recordings of the unseen subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// The unseen subject's own motions, simulated: the paper's.
    SameMotions,
    /// Everybody else's motions, simulated: the classifier has never met the motions that it is tested on.
    OtherSubjects,
}

impl Protocol {
    /// Both.
    pub const ALL: [Self; 2] = [Self::SameMotions, Self::OtherSubjects];

    /// As in settings and folders.
    pub fn id(self) -> &'static str {
        match self {
            Self::SameMotions => "same_motions",
            Self::OtherSubjects => "other_subjects",
        }
    }
}

/// Who is trained on and who is not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SubjectSplit {
    /// The simulator learns from all of this subject's recordings but their last frames.
    pub training: String,
    /// No simulator and no classifier learns from this subject's measured recordings.
    pub unseen: String,
    /// A second unseen subject, on whom the full simulator alone is scored (paper, supplement 9). No simulator learns from
    /// this subject, and no classifier that is tested on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub additional: Option<String>,
}

impl Default for SubjectSplit {
    fn default() -> Self {
        Self { training: "s1".into(), unseen: "s4".into(), additional: None }
    }
}

/// How a trained simulator is brought to a second room.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdaptationConfig {
    /// Numbers of frames of the second room that are learned from, one run each; zero is the simulator as it was.
    pub frames: Vec<usize>,
    /// Of the optimiser in every run, whatever the number of frames.
    pub steps: usize,
}

impl Default for AdaptationConfig {
    fn default() -> Self {
        Self { frames: vec![0, 1, 4, 16, 64], steps: 1000 }
    }
}

/// Another room with other, smaller actions (paper, section 4.8).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SecondSceneConfig {
    /// As [`ReproduceConfig::site`]; recordings of the training subject count.
    pub site: PathBuf,
    /// Actions that the simulator learns from.
    #[serde(default = "learned_actions")]
    pub training: Vec<String>,
    /// Actions that it is scored on, and that a classifier tells apart.
    #[serde(default = "tested_actions")]
    pub evaluated: Vec<String>,
}

fn learned_actions() -> Vec<String> {
    Action::SMALL[..8].iter().map(|action| action.name().into()).collect()
}

fn tested_actions() -> Vec<String> {
    Action::SMALL[8..].iter().map(|action| action.name().into()).collect()
}

/// A long training with the graph convolution and one without it, neither of them tamed: the learning rate stays, and the
/// gradient is not clipped, of which the paper says nothing (supplement 10: without it training breaks, "typically around epoch
/// 7400").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StabilityConfig {
    /// Frames to learn from, evenly spaced over the training recordings.
    pub frames: usize,
    /// Visits of every frame in an epoch, which is a point of the curves.
    pub repeats: usize,
    pub epochs: usize,
    /// That of `[training]` where it begins, by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learning_rate: Option<f64>,
}

impl Default for StabilityConfig {
    /// 10,400 steps of one frame.
    fn default() -> Self {
        Self { frames: 8, repeats: 13, epochs: 100, learning_rate: None }
    }
}

impl StabilityConfig {
    /// No gradient is longer than this before something breaks.
    const UNCLIPPED: f64 = 1e30;

    fn check(&self) -> Result<()> {
        for (key, count) in [("frames", self.frames), ("repeats", self.repeats), ("epochs", self.epochs)] {
            if count == 0 {
                return Err(Error::setting(format!("stability.{key}"), 0, "at least 1"));
            }
        }
        match self.learning_rate.filter(|rate| !(rate.is_finite() && *rate > 0.0)) {
            Some(rate) => Err(Error::setting("stability.learning_rate", rate, "a positive number")),
            None => Ok(()),
        }
    }

    /// `base` without what would hide an instability.
    pub fn training(&self, base: &TrainingConfig) -> TrainingConfig {
        let learning_rate = self.learning_rate.unwrap_or(base.learning_rate);
        TrainingConfig {
            epochs: self.epochs,
            learning_rate,
            final_learning_rate: learning_rate,
            gradient_clip: Self::UNCLIPPED,
            validation_fraction: 0.0,
            frames: Some(self.frames),
            repeats: self.repeats,
            patience_epochs: 0,
            ..base.clone()
        }
    }
}

/// `hybridsim reproduce CONFIG`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReproduceConfig {
    #[serde(default)]
    pub seed: u64,
    /// So many times is every variant trained, scored and recognised: with `seed`, `seed + 1` and so on, and classifiers with their
    /// own seeds after `recognition.seed`. The second room, the second scene, the long trainings, the pictures and the additional
    /// subject are those of the first.
    #[serde(default = "once")]
    pub seeds: usize,
    /// A site's config file, or a folder of recordings with the labels `subject` and `action`; relative to this file.
    pub site: PathBuf,
    /// The same for another room.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_room: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_scene: Option<SecondSceneConfig>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stability: Option<StabilityConfig>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub few_measured: Option<FewConfig>,
    #[serde(default)]
    pub split: SubjectSplit,
    #[serde(default = "Variant::usual")]
    pub variants: Vec<Variant>,
    #[serde(default = "all_baselines")]
    pub baselines: Vec<BaselineName>,
    /// Each baseline a second time with the receiver's noise, as measured in the training recordings: the paper's noise is a
    /// share of each method's own signal, which a method without the room's returns has little of.
    #[serde(default = "yes")]
    pub receiver_noise: bool,
    /// The site once more with another draw of its mesh's error: what a simulator can reach that knows the body no better.
    #[serde(default = "yes")]
    pub other_mesh: bool,
    #[serde(default = "all_protocols")]
    pub protocols: Vec<Protocol>,
    /// The action of the training subject whose recording is diagnosed.
    #[serde(default = "diagnosed")]
    pub diagnosed_action: String,
    #[serde(default)]
    pub simulator: SimulatorConfig,
    #[serde(default)]
    pub training: TrainingConfig,
    /// The surface of the variant `dense_surface`.
    #[serde(default = "dense")]
    pub dense_surface: SurfaceConfig,
    #[serde(default)]
    pub recognition: RecognitionConfig,
    #[serde(default = "effects_only")]
    pub diagnosis: DiagnosisConfig,
    #[serde(default)]
    pub adaptation: AdaptationConfig,
    #[serde(default)]
    pub comparison: ComparisonConfig,
}

fn once() -> usize {
    1
}

fn all_baselines() -> Vec<BaselineName> {
    BaselineName::ALL.to_vec()
}

fn yes() -> bool {
    true
}

fn all_protocols() -> Vec<Protocol> {
    Protocol::ALL.to_vec()
}

fn dense() -> SurfaceConfig {
    SurfaceConfig { sampling: Sampling::Facets, ..Default::default() }
}

fn diagnosed() -> String {
    "walk_back_forth_armswing".into()
}

/// Limits on what was not found take longer than finding, and no table needs them.
fn effects_only() -> DiagnosisConfig {
    DiagnosisConfig { limits: false, ..DiagnosisConfig::default() }
}

impl SecondSceneConfig {
    fn check(&self) -> Result<()> {
        for (key, actions) in [("training", &self.training), ("evaluated", &self.evaluated)] {
            if actions.is_empty() {
                return Err(Error::setting(format!("second_scene.{key}"), "empty", "names of actions"));
            }
        }
        match self.evaluated.iter().find(|action| self.training.contains(action)) {
            Some(action) => {
                Err(Error::setting("second_scene.evaluated", action, "actions that are not in second_scene.training"))
            }
            None => Ok(()),
        }
    }
}

impl ReproduceConfig {
    /// Reads a file, over what it extends and under `sets`; fails where it cannot be read or [`Self::check`] refuses it.
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let mut config: Self = read_settings(path, sets)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        place_path(&mut config.site, "site", folder, sets)?;
        for (key, site) in [
            ("second_room", config.second_room.as_mut()),
            ("second_scene.site", config.second_scene.as_mut().map(|scene| &mut scene.site)),
        ] {
            site.map_or(Ok(()), |site| place_path(site, key, folder, sets))?;
        }
        config.check()?;
        Ok(config)
    }

    /// Refuses a variant that would be trained as `ours` is.
    fn check_differs(&self, variant: Variant) -> Result<()> {
        let trained =
            |variant: Variant| (variant.settings(&self.simulator, &self.dense_surface), variant.training(&self.training));
        let alike = [Variant::Ours, Variant::WithEffects].contains(&variant.trained_as());
        if alike || trained(variant) != trained(Variant::Ours) {
            return Ok(());
        }
        Err(Error::setting("variants", variant.id(), "what the settings do not have already: it would be trained as `ours` is")
            .with_hint("variants depart from the paper's surface, noise and loss: extend configs/paper_model.toml"))
    }

    /// Refuses what cannot be reproduced, before anything is recorded.
    pub fn check(&self) -> Result<()> {
        self.simulator.check()?;
        self.training.check()?;
        self.diagnosis.check()?;
        self.recognition.check()?;
        for &variant in &self.variants {
            variant.settings(&self.simulator, &self.dense_surface).check()?;
            self.check_differs(variant)?;
        }
        if !(1..=100).contains(&self.seeds) {
            return Err(Error::setting("seeds", self.seeds, "1 to 100"));
        }
        if !self.variants.contains(&Variant::Ours) {
            return Err(Error::setting("variants", format!("{:?}", self.variants), "a list with `ours`")
                .with_hint("the others are compared with it, and some start from it"));
        }
        if self.split.training == self.split.unseen {
            return Err(Error::setting("split.unseen", &self.split.unseen, "another subject than split.training"));
        }
        let SubjectSplit { training, unseen, additional } = &self.split;
        if additional.as_ref().is_some_and(|additional| additional == training || additional == unseen) {
            let expected = "another subject than split.training and split.unseen";
            return Err(Error::setting("split.additional", additional.as_deref().unwrap_or_default(), expected));
        }
        if let Some(scene) = &self.second_scene {
            scene.check()?;
        }
        if let Some(stability) = &self.stability {
            stability.check()?;
        }
        if let Some(few) = &self.few_measured {
            few.check(&self.variants)?;
        }
        if self.training.split != Split::Last || self.training.validation_fraction == 0.0 {
            return Err(Error::setting(
                "training.split",
                format!("{:?} with a fraction of {}", self.training.split, self.training.validation_fraction).to_lowercase(),
                "last, with a validation_fraction above zero",
            )
            .with_hint("the tables' unseen frames are the last ones of the training subject's recordings"));
        }
        let training = &self.training;
        for (key, set) in [
            ("frames", training.frames.is_some()),
            ("repeats", training.repeats != 1),
            ("start_from", training.start_from.is_some()),
        ] {
            if set {
                return Err(Error::setting(format!("training.{key}"), "given", "nothing: [adaptation] sets it"));
            }
        }
        let adaptation = &self.adaptation;
        if self.second_room.is_some() && (adaptation.steps == 0 || adaptation.frames.is_empty()) {
            return Err(Error::setting("adaptation", "empty", "frames and steps, for [second_room]"));
        }
        Ok(())
    }

    /// The settings in full, as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("settings are plain data")
    }
}

#[cfg(test)]
#[path = "config_tests.rs"]
pub(super) mod tests;
