//! Traces of the red-rover project (`roverd`): a folder of sensors, of which the radar's holds `meta.json`, `iq`, `ts`, `valid` and
//! `radar.json`.
//!
//! `iq` is `[frame, loop, tx, rx, word]` int16: chirp by chirp, transmitters in firing order, one receiver after the other, of every two
//! samples Q first, then I. `ts` is float64 seconds, `valid` uint8: zero where packets of the frame were lost.
//!
//! Source: RadarML/red-rover, format/docs/spec.md (channel, sensor, data set) and `roverd.sensors.XWRRadar`; RadarML/xwr 0.5,
//! `xwr.rsp.iq_from_iiqq` for the order of the words.

use std::path::{Path, PathBuf};

use super::boards::Board;
use super::inverted;
use super::json::Json;
use super::lanes::Lanes;
use super::rover_radar::{Frames, radar_of};
use super::stream::Words;
use super::time_stamps::Grid;
use super::{Capture, Stated};
use crate::data::entries::entries;
use crate::data::{IfFrame, IfLayout, files};
use crate::error::{Error, Result};
use crate::radar::Sampling;

const META: &str = "meta.json";
const SAMPLES: &str = "iq";
const STAMPS: &str = "ts";
const WHOLE: &str = "valid";
/// NumPy's names and those of older traces, which count bits.
const INT16: &[&str] = &["i2", "<i2", "i16", "int16"];
const FLOAT64: &[&str] = &["f8", "<f8", "f64", "float64"];
const UINT8: &[&str] = &["u1", "|u1", "u8", "uint8", "b1", "|b1", "?", "bool"];

/// Whether a folder is a radar of a trace.
fn is_sensor(folder: &Path) -> bool {
    let meta = folder.join(META);
    let names_samples = || Json::read(&meta).is_ok_and(|meta| meta.find(SAMPLES).is_some());
    meta.is_file() && (folder.join(SAMPLES).is_file() || names_samples())
}

/// The folder itself, or the radars one folder below. Names with an underscore are of what was computed from sensors.
fn sensors(folder: &Path) -> Vec<PathBuf> {
    if is_sensor(folder) {
        return vec![folder.into()];
    }
    let is_computed = |path: &Path| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"_"));
    let mut below = entries(folder).unwrap_or_default();
    below.retain(|path| is_sensor(path) && !is_computed(path));
    below
}

/// Whether a folder is a trace with a radar, or the radar's folder in it.
pub fn is_folder(folder: &Path) -> bool {
    !sensors(folder).is_empty()
}

/// Understands a trace, or the folder of its radar.
///
/// # Errors
/// Several radars; a channel that is compressed, of another type or another number of frames; settings that are missing or contradict
/// what the trace says.
pub fn open(folder: &Path, stated: &Stated) -> Result<Capture> {
    let sensors = sensors(folder);
    let [sensor] = &sensors[..] else {
        return Err(Error::Usage {
            message: format!("{}: {} radars", folder.display(), sensors.len()),
            hint: Some("import each radar's folder by itself".into()),
        });
    };
    let mut notes = Vec::new();
    let meta = Json::read(&sensor.join(META))?;
    let shape = shape_of(&meta)?;
    let words = Words::open(&[sensor.join(SAMPLES)])?;
    let block = shape.iter().try_fold(1u64, |all, &length| all.checked_mul(length as u64)).unwrap_or(u64::MAX);
    let frames = whole_frames(&words, block, shape, meta.file())?;
    let mut lost = lost(sensor, &meta, frames, &mut notes)?;
    let stamps = sensor.join(STAMPS);
    let grid = Grid::read(&stamps, &times(sensor, &meta, frames)?, &mut notes);
    let found = Frames { meta: meta.file(), stamps: &stamps, shape, frames, grid: grid.as_ref() };
    let (radar, inverted_rx) = radar_of(sensor, &found, stated, &mut notes)?;
    lost.retain(|frame| *frame < radar.frames);
    let lanes = Lanes { count: 2, interleaved: false, q_first: true, sampling: radar.sampling };
    let [_, n_tx, n_rx, loops, samples] = radar.dims();
    let frame = move |index: usize| {
        let words = words.read(index as u64 * block, block as usize)?;
        Ok(inverted::turned_back(arrange(&words, lanes, [n_tx, n_rx, loops, samples]), &inverted_rx))
    };
    let layout = if lanes.sampling == Sampling::Complex { IfLayout::Codes } else { IfLayout::RealCodes };
    let board = stated.board.as_deref().map(Board::named).transpose()?;
    let capture = Capture { source: sensor.join(SAMPLES), radar, layout, board, notes, lost, rest: 0.0, frame: Box::new(frame) };
    Ok(match grid {
        Some(grid) => grid.place(&stamps, capture),
        None => capture,
    })
}

/// Frames that are not whole.
fn lost(sensor: &Path, meta: &Json, frames: usize, notes: &mut Vec<String>) -> Result<Vec<usize>> {
    let Some(whole) = whole(sensor, meta, frames)? else {
        notes.push(format!("{}: no channel `{WHOLE}`: every frame is taken to be whole", meta.file().display()));
        return Ok(vec![]);
    };
    if !whole.contains(&true) {
        return Err(Error::field(sensor.join(WHOLE), WHOLE, "0 in every frame", "one frame at least that is whole")
            .with_hint("too much was lost to use this capture: record again"));
    }
    Ok((0..frames).filter(|&frame| !whole[frame]).collect())
}

/// Refuses a channel that is compressed or of another type.
fn check_channel(channel: &Json, types: &[&str]) -> Result<()> {
    let format = channel.get("format")?;
    if format.text()? != "raw" {
        return Err(format.wrong("\"raw\"").with_hint(
            "compressed channels are not read: decompress it with roverd, which reads lzma and lzmaf, and state raw",
        ));
    }
    let kind = channel.get("type")?;
    if !types.contains(&kind.text()?) {
        return Err(kind.wrong(&format!("\"{}\"", types[0])));
    }
    Ok(())
}

/// Loops, transmitters, receivers and words of a chirp and receiver.
fn shape_of(meta: &Json) -> Result<[usize; 4]> {
    let channel = meta.get(SAMPLES)?;
    check_channel(&channel, INT16)?;
    let shape = channel.get("shape")?;
    let lengths = shape.items()?.iter().map(Json::count).collect::<Result<Vec<usize>>>()?;
    match lengths[..] {
        [loops, tx, rx, words] if !lengths.contains(&0) => Ok([loops, tx, rx, words]),
        _ => Err(shape.wrong("loops, transmitters, receivers and words, each at least 1")),
    }
}

/// How many frames there are.
fn whole_frames(words: &Words, block: u64, shape: [usize; 4], meta: &Path) -> Result<usize> {
    let bytes = block.saturating_mul(2);
    if !words.bytes().is_multiple_of(bytes) {
        let expected = format!("whole frames of {bytes} bytes: `iq.shape` is {shape:?} in {}", meta.display());
        return Err(Error::field(words.first(), "samples", format!("{} bytes", words.bytes()), expected).with_hint(
            "the file is cut off: copy it again; of a capture that broke off, cut iq, ts and valid after the last whole frame",
        ));
    }
    Ok((words.len() / block) as usize)
}

/// A channel with one number for each frame.
fn numbers<const N: usize>(sensor: &Path, meta: &Json, name: &str, types: &[&str], frames: usize) -> Result<Vec<[u8; N]>> {
    check_channel(&meta.get(name)?, types)?;
    let path = sensor.join(name);
    let (_, length) = files::open(&path)?;
    if length != (N * frames) as u64 {
        let is_whole = length.is_multiple_of(N as u64);
        let found = if is_whole { (length / N as u64).to_string() } else { format!("{length} bytes") };
        let expected = format!("{frames} of {N} bytes each, as in {}", sensor.join(SAMPLES).display());
        return Err(Error::field(&path, "frames", found, expected)
            .with_hint("a channel is cut off or of another capture: copy the radar's whole folder again"));
    }
    Ok(files::read(&path)?.as_chunks().0.to_vec())
}

/// Which frames lost no packet; none where the trace does not say.
fn whole(sensor: &Path, meta: &Json, frames: usize) -> Result<Option<Vec<bool>>> {
    if meta.find(WHOLE).is_none() {
        return Ok(None);
    }
    let bytes = numbers::<1>(sensor, meta, WHOLE, UINT8, frames)?;
    Ok(Some(bytes.into_iter().map(|[byte]| byte != 0).collect()))
}

/// When every frame came, seconds.
fn times(sensor: &Path, meta: &Json, frames: usize) -> Result<Vec<f64>> {
    let times: Vec<f64> = numbers::<8>(sensor, meta, STAMPS, FLOAT64, frames)?.into_iter().map(f64::from_le_bytes).collect();
    match times.iter().position(|time| !time.is_finite()) {
        Some(at) => {
            let hint = "the file is damaged or no file of time stamps: copy it again";
            Err(Error::field(sensor.join(STAMPS), format!("time of frame {at}"), times[at].to_string(), "seconds")
                .with_hint(hint))
        }
        None => Ok(times),
    }
}

/// The words of a frame as `[tx, rx, loop, sample]`.
fn arrange(words: &[i16], lanes: Lanes, dims: [usize; 4]) -> IfFrame {
    let [n_tx, n_rx, loops, samples] = dims;
    let chirp = lanes.words_per_chirp(n_rx, samples);
    let is_complex = lanes.sampling == Sampling::Complex;
    let count = n_tx * n_rx * loops * samples;
    let (mut re, mut im) = (Vec::with_capacity(count), Vec::with_capacity(if is_complex { count } else { 0 }));
    for tx in 0..n_tx {
        for rx in 0..n_rx {
            for start in (0..loops).map(|index| (index * n_tx + tx) * chirp) {
                for sample in 0..samples {
                    let (i, q) = lanes.place(rx, n_rx, sample, samples);
                    re.push(f32::from(words[start + i]));
                    if is_complex {
                        im.push(f32::from(words[start + q]));
                    }
                }
            }
        }
    }
    IfFrame::new(dims, re, is_complex.then_some(im))
}
