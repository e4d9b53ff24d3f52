//! A body that stands elsewhere.

use super::effect::Effect;
use super::settings::settings;
use crate::recorder::vector::Vector;

settings! {
    /// The body stands elsewhere: turned about the radar's vertical axis, then moved.
    PoseOffset { offset_m: [f64; 3] [-3.0, 3.0], #[serde(default)] yaw_deg: f64 [-90.0, 90.0] }
}

impl Effect for PoseOffset {
    const OF_PERSON: bool = true;
}

impl PoseOffset {
    /// Rotation and translation in the radar frame.
    pub fn stands(&self) -> ([[f64; 3]; 3], Vector) {
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        ([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], self.offset_m)
    }
}
