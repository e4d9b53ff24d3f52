//! Refinement of a motion that is off by centimetres, degrees and milliseconds, from the recording alone.
//!
//! Before the simulator learns, each recording's place, heading and clock (and on request the poses of single frames) are moved
//! until the power that the body is expected to return lies in the cells in which it was measured. The priors of
//! [`RefineConfig`] hold what the recording does not show.
//!
//! Every second frame is fitted; the frames between them decide what is kept ([`Judgement`]).

mod config;
mod descent;
mod expected;
mod gains;
mod judge;
mod ladder;
mod parameters;
mod refiner;
mod saved;

pub use config::RefineConfig;
pub use judge::Judgement;
pub use saved::{FILE, RefinedPose, read, refined, write};

use burn::tensor::Device;

use super::LoadedRecording;
use crate::{
    body::Posing,
    error::{Error, Result},
    heatmap::HeatmapConfig,
    person::Person,
};
use ladder::Ladder;
use refiner::{Refiner, spaced};

/// The correction of a recording's motion that explains where its power lies, as far as frames that were not fitted prefer it.
///
/// `frames`: those that may be looked at; training's held-out frames are not among them.
///
/// # Errors
/// A recording without a skinned person, one that cannot be read, or a simulator that poses on the host.
pub fn refine(
    recording: &LoadedRecording,
    frames: &[usize],
    config: &RefineConfig,
    heatmap: &HeatmapConfig,
    device: &Device,
) -> Result<RefinedPose> {
    let Some(person @ Person::Skinned { motion, .. }) = recording.recording.person() else {
        return Err(Error::field(recording.folder.join("recording.toml"), "files.motion", "no motion of a skinned body", "one")
            .with_hint("training.refine_pose moves joints; leave it out for meshes and empty rooms"));
    };
    if recording.scene.body.as_ref().is_none_or(|body| body.posing() == Posing::Host) {
        return Err(Error::setting("simulator.surface.posing", "host", "tensor with training.refine_pose = true")
            .with_hint("gradients reach a pose only through tensor operations"));
    }
    if frames.is_empty() {
        return Err(Error::field(
            recording.folder.join("recording.toml"),
            "radar.frames",
            "no whole training frame",
            "at least one",
        )
        .with_hint("frames with lost chirps train nothing; leave this recording out"));
    }
    let [fitted, held_out] = alternating(&spaced(frames, 2 * config.frames));
    let mut ladder = Ladder::new(Refiner::new(recording, (person, motion), fitted, config, heatmap, device)?, held_out)?;
    ladder.climb_whole()?;
    if config.per_frame {
        let [fitted, held_out] = alternating(frames);
        ladder.climb_frames(fitted, held_out)?;
    }
    let (correction, judgements) = ladder.found();
    Ok(RefinedPose { recording: recording.folder.clone(), correction, judgements })
}

/// The first, third, … and the others.
fn alternating(frames: &[usize]) -> [Vec<usize>; 2] {
    [0, 1].map(|first| frames.iter().copied().skip(first).step_by(2).collect())
}
