//! The eight actions of the paper's data set, and twelve smaller ones for a second scene, as procedural motion: smooth, seeded,
//! without a download.
//!
//! An action says where pelvis, feet and arms should be at any time (`plan`); `posing` finds the joint rotations that
//! bring them there. Feet that carry weight stay where they are on the floor.

mod in_place;
mod plan;
mod posing;
mod small;
mod variety;
mod walking;

use serde::{Deserialize, Serialize};

use super::{BodyModel, JOINT_NAMES, Motion, Placement};
use crate::bounds;
use crate::error::{Error, Result};
use plan::Plan;
use posing::Figure;
use variety::Variety;

/// What the person does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    TorsoRotation,
    WalkClockwise,
    WalkCounterclockwise,
    ArmSwing,
    /// Towards the radar and back, the arms nearly still.
    WalkBackForth,
    WalkBackForthArmswing,
    MarchInPlace,
    Lunge,
    HandWave,
    Drink,
    ForearmCurl,
    SideBend,
    Bow,
    KneeBend,
    HeelRaise,
    WeightShift,
    Clap,
    Jab,
    HipCircle,
    FootTap,
}

impl Action {
    /// The paper's.
    pub const ALL: [Self; 8] = [
        Self::TorsoRotation,
        Self::WalkClockwise,
        Self::WalkCounterclockwise,
        Self::ArmSwing,
        Self::WalkBackForth,
        Self::WalkBackForthArmswing,
        Self::MarchInPlace,
        Self::Lunge,
    ];

    /// Smaller ones, on the spot, for the second scene (paper, section 4.8, which does not say what its twelve are): the first
    /// eight to train on, the last four to test.
    pub const SMALL: [Self; 12] = [
        Self::HandWave,
        Self::Drink,
        Self::ForearmCurl,
        Self::SideBend,
        Self::Bow,
        Self::KneeBend,
        Self::HeelRaise,
        Self::WeightShift,
        Self::Clap,
        Self::Jab,
        Self::HipCircle,
        Self::FootTap,
    ];

    /// All that there are.
    pub fn every() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().chain(Self::SMALL)
    }

    /// The name in settings and labels.
    pub fn name(self) -> &'static str {
        match self {
            Self::TorsoRotation => "torso_rotation",
            Self::WalkClockwise => "walk_clockwise",
            Self::WalkCounterclockwise => "walk_counterclockwise",
            Self::ArmSwing => "arm_swing",
            Self::WalkBackForth => "walk_back_forth",
            Self::WalkBackForthArmswing => "walk_back_forth_armswing",
            Self::MarchInPlace => "march_in_place",
            Self::Lunge => "lunge",
            Self::HandWave => "hand_wave",
            Self::Drink => "drink",
            Self::ForearmCurl => "forearm_curl",
            Self::SideBend => "side_bend",
            Self::Bow => "bow",
            Self::KneeBend => "knee_bend",
            Self::HeelRaise => "heel_raise",
            Self::WeightShift => "weight_shift",
            Self::Clap => "clap",
            Self::Jab => "jab",
            Self::HipCircle => "hip_circle",
            Self::FootTap => "foot_tap",
        }
    }
}

/// How somebody does it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StyleConfig {
    /// Speed of the repetition relative to a usual one.
    pub tempo: f64,
    /// Length of steps and reach of swings relative to usual ones.
    pub amplitude: f64,
    /// Size of the walked path; 1 is a circle of radius 1 m and a way of 2 m.
    pub path_scale: f64,
    /// Irregularity from step to step and slow sway; 0 is a machine, 1 a person.
    pub variation: f64,
    /// Of the irregularity.
    pub seed: u64,
    /// Walking back and forth goes back backwards, as the paper has it, and not after a turn.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub backward: bool,
}

impl Default for StyleConfig {
    fn default() -> Self {
        Self { tempo: 1.0, amplitude: 1.0, path_scale: 1.0, variation: 1.0, seed: 0, backward: false }
    }
}

impl StyleConfig {
    /// Refuses a tempo, amplitude, path scale or variation outside its limits.
    fn check(&self) -> Result<()> {
        let limits = [
            ("tempo", self.tempo, 0.3, 2.0),
            ("amplitude", self.amplitude, 0.3, 1.5),
            ("path_scale", self.path_scale, 0.3, 5.0),
            ("variation", self.variation, 0.0, 3.0),
        ];
        for (key, value, low, high) in limits {
            if !(low..=high).contains(&value) {
                return Err(Error::setting(format!("style.{key}"), value, format!("{low} to {high}")));
            }
        }
        Ok(())
    }
}

/// The action as poses of `model`, from time 0 to at least `duration_s`.
///
/// The motion's frame is y up, the floor at y = 0, metres. Walks go around or along the origin, the rest happens above it,
/// facing +z; with the default [`Placement`] that is towards the radar. Equal seeds give equal motions.
pub fn motion(
    action: Action,
    style: &StyleConfig,
    model: &BodyModel,
    betas: &[f64],
    duration_s: f64,
    rate_hz: f64,
) -> Result<Motion> {
    style.check()?;
    if model.joint_regressor.len() != JOINT_NAMES.len() {
        let found = format!("{} joints", model.joint_regressor.len());
        return Err(Error::setting("body", found, format!("the {} joints of SMPL for a procedural action", JOINT_NAMES.len())));
    }
    if !(duration_s.is_finite() && duration_s > 0.0) {
        return Err(Error::setting("motion.duration_s", duration_s, "a duration above zero in seconds"));
    }
    if !(10.0..=1000.0).contains(&rate_hz) {
        return Err(Error::setting("motion.rate_hz", rate_hz, "10 to 1000 poses per second"));
    }
    let figure = Figure::new(model, betas);
    let variety = Variety::new(style);
    let poses = (duration_s * rate_hz - 1e-9).ceil().max(0.0) as usize;
    let poses = poses.saturating_add(1);
    // A procedural motion is held in memory; so many poses last for 4.6 hours at 60 Hz.
    bounds::count("motion.duration_s x rate_hz", poses, 1_000_000)?;
    let (poses, translations) = (0..poses)
        .map(|pose| figure.pose(&Plan::smoothed(pose as f64 / rate_hz, |time| plan(action, style, &figure, &variety, time))))
        .unzip();
    Ok(Motion { poses, translations, betas: betas.to_vec(), rate_hz })
}

fn plan(action: Action, style: &StyleConfig, figure: &Figure, variety: &Variety, time: f64) -> Plan {
    let small = |action: &small::SmallAction| action.plan(style, figure, variety, time);
    let mut plan = match action {
        Action::TorsoRotation => in_place::torso_rotation(style, figure, time),
        Action::ArmSwing => in_place::arm_swing(style, figure, variety, time),
        Action::MarchInPlace => in_place::march(style, figure, variety, time),
        Action::Lunge => in_place::lunge(style, figure, variety, time),
        Action::WalkClockwise => walking::circle(style, figure, variety, -1.0, time),
        Action::WalkCounterclockwise => walking::circle(style, figure, variety, 1.0, time),
        Action::WalkBackForth => walking::back_and_forth(style, figure, variety, 0.25, time),
        Action::WalkBackForthArmswing => walking::back_and_forth(style, figure, variety, 1.3, time),
        Action::HandWave => small(&small::hand_wave::ACTION),
        Action::Drink => small(&small::drink::ACTION),
        Action::ForearmCurl => small(&small::forearm_curl::ACTION),
        Action::SideBend => small(&small::side_bend::ACTION),
        Action::Bow => small(&small::bow::ACTION),
        Action::KneeBend => small(&small::knee_bend::ACTION),
        Action::HeelRaise => small(&small::heel_raise::ACTION),
        Action::WeightShift => small(&small::weight_shift::ACTION),
        Action::Clap => small(&small::clap::ACTION),
        Action::Jab => small(&small::jab::ACTION),
        Action::HipCircle => small(&small::hip_circle::ACTION),
        Action::FootTap => small(&small::foot_tap::ACTION),
    };
    variety.sway(&mut plan, time);
    plan
}

/// Where to put a procedural motion: its origin straight ahead of the radar, its floor on the room's.
///
/// `floor_m` is the radar's height above the floor and `distance_m` the horizontal distance to the motion's origin.
pub fn placement(floor_m: f64, distance_m: f64) -> Placement {
    Placement { origin_m: [0.0, distance_m, -floor_m], ..Placement::default() }
}

#[cfg(test)]
mod small_tests;
#[cfg(test)]
mod tests;
