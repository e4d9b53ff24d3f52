//! Motions and captures of other programs, turned into what the simulator knows.

pub mod bvh;
mod bvh_config;
pub mod capture;
mod joints;
mod neutral;
pub mod retarget;

pub use bvh::Bvh;
pub use bvh_config::BvhConfig;
pub use retarget::{read_bvh_motion, retarget};

pub use crate::data::UpAxis;

use std::path::Path;

use crate::{
    data,
    error::{Error, Result},
    person::{BodyModel, Motion},
};

/// Reads a motion for a body: BVH, or npz in AMASS layout or another that people's tools write. The notes say, a line each,
/// what was assumed and what had to be fitted to the body.
///
/// The motion stands on y, in metres and radians.
pub fn read_motion(path: &Path, model: &BodyModel, config: &BvhConfig) -> Result<(Motion, Vec<String>)> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("bvh") => {
            let (motion, notes) = read_bvh_motion(path, model, config)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            Ok((motion, notes.into_iter().map(|note| format!("{name}: {note}")).collect()))
        }
        Some("npz") => data::read_motion_upright(path, model, &config.options()),
        other => Err(Error::Usage {
            message: format!("{}: a motion of type `{}`", path.display(), other.unwrap_or("none")),
            hint: Some("expected .bvh, or .npz in AMASS layout (poses, trans, betas, mocap_framerate)".into()),
        }),
    }
}

#[cfg(test)]
mod tried_files_tests;
#[cfg(test)]
mod tried_npz_tests;
#[cfg(test)]
mod tried_tests;
#[cfg(test)]
mod written;
