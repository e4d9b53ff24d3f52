//! Captures as radar boards and their tools write them, turned into recordings.
//!
//! A source says which radar it is of and gives its samples frame by frame; nothing of it is held in memory but the
//! frame at hand. What had to be assumed is a note. One layout, one file: `dca1000` (TI boards with a DCA1000 capture
//! card), `infineon` (folders of the Radar SDK and of ifxdaq), `arrays` (NumPy arrays of any order of axes).

mod arrays;
pub mod boards;
mod dca1000;
mod infineon;
mod json;
mod lanes;
mod layout;
mod schedule;
mod stream;
mod ti_cfg;
mod ti_json;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use crate::error::{Error, Result};
use crate::radar::Radar;

pub use layout::Layout;

/// What a user says of a capture besides its files.
#[derive(Clone, Debug, Default)]
pub struct Stated {
    /// Files that describe the radar: `.mmwave.json`, `.setup.json`, a `.cfg` of the mmWave SDK, or TOML with `[radar]`.
    pub configs: Vec<PathBuf>,
    /// The board, whose antenna positions are known by name.
    pub board: Option<String>,
    /// The order of an array's axes, outer to inner.
    pub layout: Option<Layout>,
    /// Which of several chirp profiles, or which subframe of an advanced frame.
    pub profile: Option<usize>,
    pub subframe: Option<usize>,
    /// Keep the chirps of one transmitter alone (zero-based, as the board numbers them).
    pub tx: Option<usize>,
    /// `radar.KEY=VALUE`, over what the files say.
    pub sets: Vec<String>,
}

/// A capture that has been understood: its radar, and a way to its samples.
pub struct Capture {
    pub radar: Radar,
    pub layout: IfLayout,
    pub notes: Vec<String>,
    /// Gives the samples of a frame.
    pub frame: Box<dyn FnMut(usize) -> Result<IfFrame>>,
}

/// Understands what `sources` are and how they are laid out.
///
/// # Errors
/// A source of no known kind, a description that is missing, contradicts itself or does not fit the samples.
pub fn open(sources: &[PathBuf], stated: &Stated) -> Result<Capture> {
    let first = sources.first().ok_or_else(|| Error::Usage {
        message: "nothing to import".into(),
        hint: Some("name the capture: adc_data.bin, a folder of the Infineon SDK, or an array".into()),
    })?;
    if first.is_dir() {
        return infineon::open(one(sources)?, stated);
    }
    let extension = first.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("bin") => dca1000::open(sources, stated),
        Some("json") => dca1000::open_setup(one(sources)?, stated),
        Some("npy") if infineon::is_samples(first) => infineon::open(first.parent().unwrap_or(Path::new("")), stated),
        Some("npy") => arrays::open(one(sources)?, stated),
        other => Err(Error::Usage {
            message: format!("{}: a capture of type `{}`", first.display(), other.unwrap_or("none")),
            hint: Some(
                "known are .bin or .setup.json (DCA1000), folders with radar.npy and config.json (Infineon), and .npy with --layout".into(),
            ),
        }),
    }
}

/// Writes a capture as a recording folder and opens it; its notes come first. `progress` hears how many of how many frames
/// are done.
pub fn import(
    mut capture: Capture,
    folder: &Path,
    labels: BTreeMap<String, String>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Recording> {
    let contents = RecordingContents {
        radar: &capture.radar,
        room: None,
        person: None,
        body_file: None,
        labels,
        layout: capture.layout,
        truth: None,
    };
    let mut recording = write_recording(folder, &contents, &mut |frame| {
        progress(frame, capture.radar.frames);
        (capture.frame)(frame)
    })?;
    recording.notes.splice(0..0, capture.notes);
    Ok(recording)
}

fn one(sources: &[PathBuf]) -> Result<&Path> {
    match sources {
        [source] => Ok(source),
        _ => Err(Error::Usage {
            message: format!("{} sources, expected one", sources.len()),
            hint: Some("only the files of one DCA1000 capture are joined; import others one by one".into()),
        }),
    }
}

#[cfg(test)]
mod tests;
