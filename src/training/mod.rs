//! Training: the loop, its split of frames, its checkpoints. It emits events and prints nothing.

mod calibrate;
pub mod checkpoint;
mod config;
mod largest;
mod metrics;
mod prepared;
pub mod refine;
mod site;
mod split;
mod trainer;

pub use config::{Split, TrainingConfig};
pub use metrics::EpochMetrics;
pub use refine::{RefineConfig, RefinedPose};
pub use site::{LoadedRecording, load_recordings, load_recordings_as_stated, refuse_ambiguous_ranges, site, site_from};
pub use split::{FrameId, FrameSplit, step_rng};
pub use trainer::{Event, Outcome, Trainer};
