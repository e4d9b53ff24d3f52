//! Files of other programs, turned into what the simulator knows.

pub mod bvh;
mod joints;
pub mod retarget;

pub use bvh::Bvh;
pub use retarget::{BvhConfig, UpAxis, read_bvh_motion, retarget};
