//! The index of a file of a cascade's device, `_idx.bin`, and whether the files of all devices belong together.
//!
//! A header of 24 bytes (tag, version, flags, number of frames, each of 32 bits; bytes of samples, 64 bits), then 48 bytes for each frame
//! (tag, version: 16 bits; flags: 32; width, height: 16; four sizes of planes, size in all: 32; time stamp, offset: 64), little-endian.
//!
//! Source: TI's MATLAB examples of mmWave Studio for the cascade, `getValidNumFrames.m`.

use std::path::{Path, PathBuf};

use super::stream::Words;
use super::time_stamps::Grid;
use crate::data::files;
use crate::error::{Error, Result};

const HEADER: usize = 24;
const RECORD: usize = 48;
const SIZE_AT: usize = 28;
const TIME_AT: usize = 32;

/// A file of samples, the frames in it, and when they came.
pub struct Index {
    pub data: PathBuf,
    pub frames: usize,
    /// Of every frame, in the capture card's own unit; none without an index.
    times: Option<Vec<u64>>,
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    *bytes[at..].first_chunk().expect("it was measured")
}

impl Index {
    /// Of a file of samples, whose frames have so many bytes as `config` says. Without an index its whole frames count.
    ///
    /// # Errors
    /// An index that contradicts itself, its file or the description.
    pub fn of(data: &Path, frame_bytes: u64, config: &Path, notes: &mut Vec<String>) -> Result<Self> {
        let name = data.file_name().unwrap_or_default().to_string_lossy().replace("_data.bin", "_idx.bin");
        let index = data.with_file_name(name);
        if !index.is_file() {
            let length = Words::open(&[data.into()])?.bytes();
            let (frames, rest) = (length / frame_bytes, length % frame_bytes);
            notes.push(format!("{}: no {}: all {frames} whole frames are taken", data.display(), index.display()));
            if rest > 0 {
                notes.push(format!("{}: {rest} bytes after the last whole frame are left out", data.display()));
            }
            return Ok(Self { data: data.into(), frames: frames as usize, times: None });
        }
        let bytes = files::read(&index)?;
        let cut = |found: String, expected: String| {
            Error::field(&index, "frames", found, expected)
                .with_hint("copy the index again; without it, the whole frames of the samples are read")
        };
        if bytes.len() < HEADER {
            return Err(cut(format!("a header of {} bytes", bytes.len()), format!("{HEADER} bytes")));
        }
        let frames = u32::from_le_bytes(number(&bytes, 12));
        let stated = u64::from_le_bytes(number(&bytes, 16));
        let records = &bytes[HEADER..];
        if records.len() as u64 != u64::from(frames) * RECORD as u64 {
            let expected = format!("{RECORD} bytes for each of the {frames} frames that the header counts");
            return Err(cut(format!("{} bytes of records", records.len()), expected));
        }
        let records: Vec<&[u8]> = records.chunks_exact(RECORD).collect();
        let other = |field: String, found: u64, expected: u64| {
            let expected = format!("{expected} bytes: frames of {frame_bytes} bytes each by {}", config.display());
            Error::field(&index, field, format!("{found} bytes"), expected)
                .with_hint("the description or the index is of another capture, or samples were packed to 12 bits")
        };
        let whole = u64::from(frames).saturating_mul(frame_bytes);
        if stated != whole {
            return Err(other("dataFileSize".into(), stated, whole));
        }
        let size = |record: &[u8]| u64::from(u32::from_le_bytes(number(record, SIZE_AT)));
        if let Some(at) = records.iter().position(|record| size(record) != frame_bytes) {
            return Err(other(format!("size of frame {at}"), size(records[at]), frame_bytes));
        }
        let times = records.iter().map(|record| u64::from_le_bytes(number(record, TIME_AT))).collect();
        let own = Self { data: data.into(), frames: frames as usize, times: Some(times) };
        own.hold_against_samples(&index, whole, notes)?;
        Ok(own)
    }

    /// The samples must be there; files are made before the capture, so that there may be more.
    fn hold_against_samples(&self, index: &Path, whole: u64, notes: &mut Vec<String>) -> Result<()> {
        let length = if whole == 0 { 0 } else { Words::open(std::slice::from_ref(&self.data))?.bytes() };
        if length < whole {
            let expected = format!("{whole} bytes: the {} frames of {}", self.frames, index.display());
            return Err(Error::field(&self.data, "samples", format!("{length} bytes"), expected)
                .with_hint("the file is cut off: copy it again"));
        }
        if length > whole {
            notes.push(format!(
                "{}: {} bytes after the last frame of its index are left out",
                self.data.display(),
                length - whole
            ));
        }
        Ok(())
    }
}

/// Whether the files of all devices hold as many frames.
///
/// # Errors
/// Another number of frames in one of them.
pub fn hold_together(devices: &[Index]) -> Result<()> {
    let (master, slaves) = devices.split_first().expect("a cascade has a master");
    let Some(slave) = slaves.iter().find(|slave| slave.frames != master.frames) else { return Ok(()) };
    let expected = format!("{}, as in {}", master.frames, master.data.display());
    Err(Error::field(&slave.data, "frames", slave.frames.to_string(), expected)
        .with_hint("a file is cut off or of another capture, or a device lost frames: those after them do not belong together"))
}

/// When the frames of a device came, over all parts of the capture; none where an index is missing.
fn times(parts: &[Vec<Index>], device: usize) -> Option<Vec<f64>> {
    let times: Option<Vec<&Vec<u64>>> = parts.iter().map(|part| part[device].times.as_ref()).collect();
    let times: Vec<u64> = times?.into_iter().flatten().copied().collect();
    // Counted from the first one's, so that a float holds them.
    let since = |time: &u64| i128::from(*time) - i128::from(times[0]);
    Some(times.iter().map(|time| since(time) as f64).collect())
}

/// When the frames of a capture came, by the master's indices; none where they do not say.
///
/// # Errors
/// A device whose frames came at other times.
pub fn grid(parts: &[Vec<Index>], notes: &mut Vec<String>) -> Result<Option<Grid>> {
    let master = &parts[0][0].data;
    let Some(wanted) = times(parts, 0).and_then(|times| Grid::read(master, &times, notes)) else { return Ok(None) };
    for device in 1..parts[0].len() {
        let Some(grid) = times(parts, device).and_then(|times| Grid::of(&times).ok()) else { continue };
        if let Some(at) = grid.slots.iter().zip(&wanted.slots).position(|(own, wanted)| own != wanted) {
            let ends = parts.iter().scan(0, |end, part| {
                *end += part[device].frames;
                Some(*end)
            });
            let part = ends.take_while(|end| *end <= at).count();
            let found = format!("frame {at} in frame period {}", grid.slots[at]);
            let expected = format!("period {}, as in {}", wanted.slots[at], parts[part][0].data.display());
            return Err(Error::field(&parts[part][device].data, "time stamps", found, expected)
                .with_hint("a device lost frames: those after them do not belong together"));
        }
    }
    Ok(Some(wanted))
}
