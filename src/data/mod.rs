//! The files that things come in: arrays, settings, bodies, motions and recordings.
//!
//! What is read here is checked here, so that whatever goes in further is whole, finite and of the right shape.
//! What is written here is either whole or absent.

pub mod arrays;
pub mod atomic;
pub mod bodies;
mod claim;
pub mod entries;
pub mod files;
mod hex;
pub(crate) mod leftovers;
pub mod meshes;
pub mod motions;
pub mod program;
pub mod recording;
mod scratch;
pub mod settings;
mod shard;
pub mod unfinished;

pub use bodies::{read_body, write_body};
pub use claim::Claim;
pub use hex::hex;
pub use meshes::{Meshes, read_meshes};
pub use motions::{Figure, MotionOptions, RotationUnit, UpAxis, find_up, read_motion, read_motion_upright, write_motion};
pub use recording::{
    IfFrame, IfLayout, Recording, RecordingContents, StagedRecording, Valid, stage_recording, write_placement, write_recording,
    write_recording_into,
};
pub use scratch::Scratch;
pub use settings::{read_settings, read_toml};
pub use shard::Shard;

#[cfg(test)]
pub(crate) mod test_support;
