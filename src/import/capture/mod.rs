//! Captures as radar boards and their tools write them, turned into recordings.
//!
//! A source says which radar it is of and gives its samples frame by frame; nothing of it is held in memory but the
//! frame at hand. What had to be assumed is a note. One layout, one file: `dca1000` (TI boards with a DCA1000 capture
//! card), `cascade` (four devices on an MMWCAS-DSP-EVM), `infineon` (folders of the Radar SDK and of ifxdaq), `rover` (traces of roverd),
//! `arrays` (arrays of any order of axes, in any file of `container`, as words alone or as `numbers` of a stated type).

mod arrays;
mod board_names;
pub mod boards;
mod cascade;
mod cascade_index;
mod coloradar;
mod container;
mod cube;
mod dca1000;
mod described;
mod descriptions;
mod infineon;
mod infineon_shape;
mod inverted;
mod json;
pub mod lanes;
mod layout;
mod numbers;
mod packets;
mod parts;
mod presets;
mod radar_table;
mod rover;
mod rover_radar;
mod schedule;
mod stream;
mod time_stamps;
mod ti_cfg;
mod ti_json;
mod word_kind;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::data::atomic::AtomicFolder;
use crate::data::{IfFrame, IfLayout, Recording, RecordingContents, StagedRecording, Valid, stage_recording};
use crate::error::{Error, Result};
use crate::integrity::{self, Finding};
use crate::radar::Radar;

use boards::Board;
pub use layout::Layout;
pub use presets::Preset;
pub use rover_radar::INVERTED_RX;

/// What a user says of a capture besides its files.
#[derive(Clone, Debug, Default)]
pub struct Stated {
    /// Files that describe the radar: `.mmwave.json`, `.setup.json`, a `.cfg` of the mmWave SDK, or TOML with `[radar]`.
    pub configs: Vec<PathBuf>,
    /// The board, whose antenna positions are known by name.
    pub board: Option<String>,
    /// The order of an array's axes, outer to inner.
    pub layout: Option<Layout>,
    /// Which of a file's arrays; `RE,IM` where its parts are two.
    pub variable: Option<String>,
    /// A public data set, whose layout and radar are known.
    pub preset: Option<Preset>,
    /// Which of several chirp profiles, or which subframe of an advanced frame.
    pub profile: Option<usize>,
    pub subframe: Option<usize>,
    /// Keep the chirps of one transmitter alone (zero-based, as the board numbers them).
    pub tx: Option<usize>,
    /// `radar.KEY=VALUE`, over what the files say.
    pub sets: Vec<String>,
}

impl Stated {
    /// Whether `--set` states a key.
    fn has_set(&self, key: &str) -> bool {
        self.sets.iter().any(|set| set.split('=').next().is_some_and(|own| own.trim() == key))
    }
}

/// A capture that has been understood: its radar, and a way to its samples.
pub struct Capture {
    /// The file that messages name.
    pub source: PathBuf,
    pub radar: Radar,
    pub layout: IfLayout,
    /// The board, where it is known.
    pub board: Option<&'static Board>,
    pub notes: Vec<String>,
    /// Frames that were lost, wholly or in part, as the capture itself says.
    pub lost: Vec<usize>,
    /// Share of a frame that follows the last whole one.
    pub rest: f64,
    /// Gives the samples of a frame.
    pub frame: Box<dyn FnMut(usize) -> Result<IfFrame>>,
}

/// What a capture's files are.
enum Kind {
    Cascade,
    Array,
    Rover(PathBuf),
    Infineon(PathBuf),
    Dca1000(Vec<PathBuf>),
    /// The `.setup.json` of a capture of either kind of TI's.
    Setup(PathBuf),
}

fn kind(sources: &[PathBuf], stated: &Stated) -> Result<Kind> {
    let first = sources.first().ok_or_else(|| Error::Usage {
        message: "nothing to import".into(),
        hint: Some("name the capture: adc_data.bin, a folder of the Infineon SDK, or an array".into()),
    })?;
    let is_laid_out = stated.layout.is_some() || stated.preset.is_some();
    if first.is_dir() {
        let folder = one(sources)?;
        return Ok(match () {
            () if cascade::is_folder(folder) => Kind::Cascade,
            () if is_laid_out => Kind::Array,
            () if rover::is_folder(folder) => Kind::Rover(folder.into()),
            () => match parts::in_folder(folder)? {
                parts if parts.is_empty() => Kind::Infineon(folder.into()),
                parts => Kind::Dca1000(parts),
            },
        });
    }
    let extension = first.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    Ok(match extension.as_deref() {
        Some("bin") if cascade::is_part(first) => Kind::Cascade,
        Some("bin") if is_laid_out => Kind::Array,
        Some("bin") => Kind::Dca1000(parts::in_order(sources)?),
        Some("json") => Kind::Setup(one(sources)?.into()),
        Some("npy") if !is_laid_out && infineon::is_samples(first) => {
            Kind::Infineon(first.parent().unwrap_or(Path::new("")).into())
        }
        Some(kind) if container::EXTENSIONS.contains(&kind) => Kind::Array,
        other => {
            return Err(Error::Usage {
                message: format!("{}: a capture of type `{}`", first.display(), other.unwrap_or("none")),
                hint: Some(
                    "known are .bin or .setup.json (DCA1000), folders with master_0000_data.bin and so on (cascades), with radar.npy and \
                     config.json (Infineon) or with meta.json and iq (roverd), and .npy, .npz, .mat, .h5 or .bin with --layout or --preset"
                        .into(),
                ),
            });
        }
    })
}

/// Understands what `sources` are and how they are laid out.
///
/// # Errors
/// A source of no known kind, a description that is missing, contradicts itself or does not fit the samples; a chirp outside of the band
/// of the board's device.
pub fn open(sources: &[PathBuf], stated: &Stated) -> Result<Capture> {
    let capture = match kind(sources, stated)? {
        Kind::Cascade => cascade::open(sources, stated),
        Kind::Array => arrays::open(sources, stated),
        Kind::Rover(folder) => rover::open(&folder, stated),
        Kind::Infineon(folder) => infineon::open(&folder, stated),
        Kind::Dca1000(parts) => dca1000::open(&parts, stated),
        Kind::Setup(path) => dca1000::open_setup(&path, stated),
    }?;
    if let Some(board) = capture.board {
        board.hold_band(&capture.radar, &capture.source)?;
    }
    Ok(capture)
}

/// The chirp profiles that the frames of a capture of TI's hold, each of which can be imported by itself.
///
/// # Errors
/// A capture whose description has no profiles; several subframes and none chosen.
pub fn profiles(sources: &[PathBuf], stated: &Stated) -> Result<Vec<usize>> {
    match kind(sources, stated)? {
        Kind::Cascade => cascade::profiles(sources, stated),
        Kind::Dca1000(parts) => dca1000::profiles(&parts, stated),
        Kind::Setup(path) => dca1000::profiles_of_setup(&path, stated),
        _ => Err(Error::Usage {
            message: format!("{}: no description with chirp profiles", sources[0].display()),
            hint: Some("leave --profile out: only .mmwave.json and .cfg of TI describe several profiles in a frame".into()),
        }),
    }
}

/// A capture that is written as a recording and was looked at, but has not appeared yet: dropped, it leaves nothing.
pub struct Draft {
    source: PathBuf,
    staged: StagedRecording,
    /// Chirps that the capture itself says were lost.
    lost: Vec<[usize; 4]>,
    /// What the samples say of what is stated.
    pub findings: Vec<Finding>,
}

impl Draft {
    /// The recording, its notes first those of the capture.
    pub fn recording(&self) -> &Recording {
        &self.staged.recording
    }

    /// Makes the recording appear. Chirps that were lost are stated in `valid.npy`.
    ///
    /// # Errors
    /// Samples that contradict what is stated of them, unless `as_stated`; no frame without a lost chirp.
    pub fn publish(mut self, as_stated: bool) -> Result<Recording> {
        if let Some(finding) = self.findings.iter().find(|finding| finding.is_refusal() && !as_stated) {
            return Err(Error::field(&self.source, finding.name(), finding.contradiction(), finding.expected).with_hint(
                "correct the description or the layout, or take the samples of another file; --as-stated keeps your word against the data",
            ));
        }
        let mut notes = std::mem::take(&mut self.staged.recording.notes);
        let mut lost: Vec<[usize; 4]> = self.findings.iter().flat_map(|finding| finding.chirps.iter().copied()).collect();
        if !lost.is_empty() {
            lost.append(&mut self.lost);
            self.staged.set_valid(&Valid::without(&self.staged.recording.radar, lost))?;
            if self.staged.recording.whole_frames().next().is_none() {
                let found = ["lost chirps in every frame".into()].into_iter().chain(integrity::damage(&self.findings));
                let found = found.collect::<Vec<_>>().join(": ");
                return Err(Error::field(&self.source, "samples", found, "one frame at least that is whole")
                    .with_hint("too much was lost to use this capture: record again"));
            }
        }
        let mut recording = self.staged.publish()?;
        recording.notes.retain(|note| !notes.contains(note));
        notes.append(&mut recording.notes);
        recording.notes = notes;
        Ok(recording)
    }
}

/// Writes a capture under a temporary name and asks its samples whether they are what they are stated to be. `progress` receives
/// how many of how many frames are done.
pub fn draft(
    mut capture: Capture,
    folder: &Path,
    labels: BTreeMap<String, String>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Draft> {
    let contents = RecordingContents {
        radar: &capture.radar,
        room: None,
        person: None,
        body_file: None,
        labels,
        layout: capture.layout,
        truth: None,
    };
    let mut staged = stage_recording(AtomicFolder::create(folder)?, &contents, &mut |frame| {
        progress(frame, capture.radar.frames);
        (capture.frame)(frame)
    })?;
    progress(capture.radar.frames, capture.radar.frames);
    let lost = chirps_of(&capture.lost, &capture.radar);
    if !lost.is_empty() {
        staged.set_valid(&Valid::without(&capture.radar, lost.iter().copied()))?;
    }
    staged.recording.notes.splice(0..0, capture.notes);
    let mut findings = integrity::inspect(&staged.recording, staged.recording.radar.frames)?;
    integrity::weigh_rest(&mut findings, &staged.recording.radar, capture.rest);
    Ok(Draft { source: capture.source, staged, lost, findings })
}

/// Writes a capture as a recording folder and opens it; its notes come first. `progress` as in [`draft`].
///
/// # Errors
/// As [`Draft::publish`]; nothing is left then.
pub fn import(
    capture: Capture,
    folder: &Path,
    labels: BTreeMap<String, String>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Recording> {
    draft(capture, folder, labels, progress)?.publish(false)
}

/// All chirps of some frames: frame, transmitter, receiver, loop.
fn chirps_of(frames: &[usize], radar: &Radar) -> Vec<[usize; 4]> {
    let [_, n_tx, n_rx, loops, _] = radar.dims();
    let chirps = |&frame: &usize| {
        (0..n_tx * n_rx * loops).map(move |chirp| [frame, chirp / (n_rx * loops), chirp / loops % n_rx, chirp % loops])
    };
    frames.iter().flat_map(chirps).collect()
}

fn one(sources: &[PathBuf]) -> Result<&Path> {
    match sources {
        [source] => Ok(source),
        _ => Err(Error::Usage {
            message: format!("{} sources, expected one", sources.len()),
            hint: Some("only the files of one capture, or the frames of one array, are joined; import others one by one".into()),
        }),
    }
}

#[cfg(test)]
mod array_tests;
#[cfg(test)]
mod board_tests;
#[cfg(test)]
mod description_tests;
#[cfg(test)]
mod tests;
