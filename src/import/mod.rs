//! Motions and captures of other programs, turned into what the simulator knows.

pub mod bvh;
pub mod capture;
mod joints;
pub mod retarget;

pub use bvh::Bvh;
pub use retarget::{BvhConfig, UpAxis, read_bvh_motion, retarget};

use std::path::Path;

use crate::{
    data,
    error::{Error, Result},
    person::{BodyModel, Motion},
};

/// Reads a motion for a body: BVH, or npz in AMASS layout. The notes say what had to be fitted to the body.
pub fn read_motion(path: &Path, model: &BodyModel, bvh: &BvhConfig) -> Result<(Motion, Vec<String>)> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("bvh") => Ok((read_bvh_motion(path, model, bvh)?, Vec::new())),
        Some("npz") => data::read_motion(path, model.parents.len(), model.shape_directions.len()),
        other => Err(Error::Usage {
            message: format!("{}: a motion of type `{}`", path.display(), other.unwrap_or("none")),
            hint: Some("expected .bvh, or .npz in AMASS layout (poses, trans, betas, mocap_framerate)".into()),
        }),
    }
}
