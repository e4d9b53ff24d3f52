//! The settings of a motion file.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};

use crate::data::{MotionOptions, RotationUnit, UpAxis, settings};
use crate::error::Result;

/// What a motion file does not say about itself: the TOML file that `--motion-config` names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BvhConfig {
    /// Metres per unit of the file, exactly; absent: of a BVH file recognised from the length of the legs, of npz metres
    /// unless nobody could be as high or as fast.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_m: Option<f64>,
    /// Absent: recognised from how the person stands in the poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// Names of the body's joints → names in the BVH file, where it uses others than the known dialects:
    /// `joint_map = { left_knee = "Unterschenkel_L" }`. The names on the left are [`JOINT_NAMES`](crate::person::JOINT_NAMES); what is not mapped is
    /// still found by its dialect.
    pub joint_map: BTreeMap<String, String>,
    /// Instead of the frame time or rate of the file, or where it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// Frames to leave out at the beginning, such as a T-pose.
    pub skip_frames: usize,
    /// BVH without `scale_m`: scales the path by the ratio of the legs, so that the feet of a taller body do not slide.
    pub fit_legs: bool,
    /// Unit of the angles of npz; absent: radians, unless joints would turn as none can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angles: Option<RotationUnit>,
    /// Shape of the body of a BVH motion.
    pub betas: Vec<f64>,
}

impl Default for BvhConfig {
    fn default() -> Self {
        Self {
            scale_m: None,
            up: None,
            joint_map: BTreeMap::new(),
            frame_rate_hz: None,
            skip_frames: 0,
            fit_legs: true,
            angles: None,
            betas: Vec::new(),
        }
    }
}

impl BvhConfig {
    /// Of a file, if one is given; `up` goes before what it says.
    ///
    /// # Errors
    /// A file that cannot be read, or holds another key.
    pub fn read(file: Option<&Path>, up: Option<UpAxis>) -> Result<Self> {
        let config: Self = file.map_or_else(|| Ok(Self::default()), |file| settings::read_settings(file, &[]))?;
        Ok(Self { up: up.or(config.up), ..config })
    }

    /// The settings that npz files have in common with BVH.
    pub fn options(&self) -> MotionOptions {
        MotionOptions {
            up: self.up,
            angles: self.angles,
            rate_hz: self.frame_rate_hz,
            scale_m: self.scale_m,
            skip_poses: self.skip_frames,
        }
    }
}
