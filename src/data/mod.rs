//! The files that things come in: arrays, settings, bodies, motions and recordings.
//!
//! What is read here is checked here, so that whatever goes in further is whole, finite and of the right shape.
//! What is written here is either whole or absent.

pub mod arrays;
pub mod atomic;
pub mod bodies;
pub mod files;
mod hex;
pub mod motions;
pub mod recording;
pub mod settings;
mod shard;

pub use bodies::{read_body, write_body};
pub use hex::hex;
pub use motions::{Figure, MotionOptions, RotationUnit, UpAxis, find_up, read_motion, read_motion_upright, write_motion};
pub use recording::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
pub use settings::{read_settings, read_toml};
pub use shard::Shard;

#[cfg(test)]
pub(crate) mod test_support;
