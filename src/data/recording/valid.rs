//! `valid.npy`: which chirps were recorded, and so which frames are whole.
//!
//! What is lost is used for nothing. Everything that works frame by frame asks [`Recording::is_whole`] or
//! [`Recording::whole_frames`]; what needs frames that follow one another takes [`Recording::whole_stretch`].

use std::ops::Range;
use std::path::Path;

use super::Recording;
use crate::data::arrays::{Array, Values, read_npy, write_npy};
use crate::error::{Error, Result};
use crate::radar::Radar;

/// Whether each chirp was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Valid {
    /// `[frame, tx, rx, loop]`.
    dims: [usize; 4],
    chirps: Vec<bool>,
}

impl Valid {
    /// All chirps of a radar but these: frame, transmitter, receiver, loop. Panics where the radar has no such chirp.
    pub fn without(radar: &Radar, lost: impl IntoIterator<Item = [usize; 4]>) -> Self {
        let [frames, tx, rx, loops, _] = radar.dims();
        let mut chirps = vec![true; frames * tx * rx * loops];
        for [frame, own_tx, own_rx, index] in lost {
            chirps[((frame * tx + own_tx) * rx + own_rx) * loops + index] = false;
        }
        Self { dims: [frames, tx, rx, loops], chirps }
    }

    /// Reads bool or uint8 `[frame, tx, rx, loop]`; zero is false.
    ///
    /// # Errors
    /// A file that cannot be read, or of another type or shape.
    pub(super) fn read(path: &Path, radar: &Radar) -> Result<Self> {
        let [frames, tx, rx, loops, _] = radar.dims();
        let axes = [("frame", Some(frames)), ("tx", Some(tx)), ("rx", Some(rx)), ("loop", Some(loops))];
        let Array { values: chirps, .. } = read_npy::<bool>(path, &axes)?;
        Ok(Self { dims: [frames, tx, rx, loops], chirps })
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        write_npy(path, &self.dims, Values::Bool(&self.chirps))
    }

    /// Of some frames alone.
    pub(super) fn of_frames(&self, frames: &[usize]) -> Self {
        let [all, tx, rx, loops] = self.dims;
        let length = self.chirps.len() / all;
        let chirps = frames.iter().flat_map(|frame| &self.chirps[frame * length..(frame + 1) * length]).copied().collect();
        Self { dims: [frames.len(), tx, rx, loops], chirps }
    }

    /// Whether every chirp of a frame was recorded.
    pub fn is_whole(&self, frame: usize) -> bool {
        self.chirps(frame).iter().all(|valid| *valid)
    }

    /// `[tx, rx, loop]` of a frame.
    pub fn chirps(&self, frame: usize) -> &[bool] {
        let length = self.chirps.len() / self.dims[0];
        &self.chirps[frame * length..(frame + 1) * length]
    }

    /// Chirps that were lost, counted for every receiver.
    pub fn lost(&self) -> usize {
        self.chirps.iter().filter(|valid| !**valid).count()
    }

    /// What people read of it; none where nothing was lost.
    pub(super) fn note(&self, file: &Path) -> Option<String> {
        let frames = self.dims[0];
        let broken = (0..frames).filter(|frame| !self.is_whole(*frame)).count();
        (broken > 0).then(|| {
            format!(
                "{} of {} chirps were lost ({}): {broken} of {frames} frames are not whole and are used for nothing",
                self.lost(),
                self.chirps.len(),
                file.display()
            )
        })
    }
}

impl Recording {
    /// Which chirps were recorded, where it is stated.
    pub fn valid(&self) -> Option<&Valid> {
        self.valid.as_ref()
    }

    /// Whether no chirp of a frame was lost.
    pub fn is_whole(&self, frame: usize) -> bool {
        self.valid.as_ref().is_none_or(|valid| valid.is_whole(frame))
    }

    /// Frames of which no chirp was lost, ascending.
    pub fn whole_frames(&self) -> impl Iterator<Item = usize> {
        (0..self.frames()).filter(|frame| self.is_whole(*frame))
    }

    /// The longest run of frames that follow one another and are whole, the first of several: all frames where nothing was lost.
    ///
    /// # Errors
    /// No frame is whole.
    pub fn whole_stretch(&self) -> Result<Range<usize>> {
        let (mut longest, mut start) = (0..0, 0);
        for frame in 0..=self.frames() {
            if frame == self.frames() || !self.is_whole(frame) {
                if frame - start > longest.len() {
                    longest = start..frame;
                }
                start = frame + 1;
            }
        }
        if longest.is_empty() {
            let file = self.folder.join(self.files.valid.as_deref().unwrap_or(Path::new("valid.npy")));
            return Err(Error::field(file, "valid", "lost chirps in every frame", "one frame at least that is whole")
                .with_hint("too much was lost to use this recording: record again"));
        }
        Ok(longest)
    }
}
