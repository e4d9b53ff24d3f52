//! Captures of four cascaded AWR2243: the MMWCAS-RF-EVM on the MMWCAS-DSP-EVM, as mmWave Studio has them captured.
//!
//! Every device has files of its own, `master_0000_data.bin` to `slave3_0000_data.bin`, and `_0001_` and so on where a capture is split.
//! They hold little-endian 16-bit words: chirp by chirp, sample by sample, I and Q of the device's four receivers in turn. Beside each
//! lies `_idx.bin`, which says how many frames there are.
//!
//! Source: TI, "mmWave Studio Cascade user's guide", section 7.3; TI's MATLAB examples of mmWave Studio for the cascade,
//! `read_ADC_bin_TDA2_separateFiles.m` (the words), `getBinFileNames_withIdx.m` and `getValidNumFrames.m` (the index, see `cascade_index`).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Value;

use super::boards::{Board, CASCADE};
use super::cascade_index::{Index, grid, hold_together};
use super::descriptions::descriptions;
use super::schedule::Selection;
use super::stream::Words;
use super::ti_json::{CASCADED, RECEIVERS};
use super::time_stamps::Grid;
use super::{Capture, Stated, radar_table, ti_json};
use crate::data::entries::entries;
use crate::data::{IfFrame, IfLayout};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

const DEVICES: [&str; CASCADED] = ["master", "slave1", "slave2", "slave3"];
const END: &str = "_data.bin";

/// Which device's file it is, and which part of the capture; none of what is no such file.
fn part_of(path: &Path) -> Option<(usize, usize)> {
    let (device, rest) = path.file_name()?.to_str()?.split_once('_')?;
    let part = rest.strip_suffix(END).filter(|part| part.len() == 4 && part.bytes().all(|byte| byte.is_ascii_digit()))?;
    Some((DEVICES.iter().position(|own| *own == device)?, part.parse().ok()?))
}

/// Whether a file is one of a cascade's.
pub fn is_part(path: &Path) -> bool {
    part_of(path).is_some()
}

/// Whether a folder holds such files.
pub fn is_folder(folder: &Path) -> bool {
    entries(folder).is_ok_and(|files| files.iter().any(|file| is_part(file)))
}

/// Understands a cascade's capture: its folder, one of its files, or all of them.
///
/// # Errors
/// A device or a part that is missing; devices of which one has another number of frames; an index that is not that of its file.
pub fn open(sources: &[PathBuf], stated: &Stated) -> Result<Capture> {
    let parts = parts(sources)?;
    let mut notes = Vec::new();
    let (config, _) = descriptions(&parts[0][0], stated, &mut notes)?;
    let mut stated = stated.clone();
    if stated.board.is_none() {
        notes.push("no board was named: a cascade of four devices is taken for the MMWCAS-RF-EVM".into());
        stated.board = Some(CASCADE.into());
    }
    let config = &config;
    let board = stated.board.as_deref().map(Board::named).transpose()?;
    board.into_iter().try_for_each(of_four)?;
    if config.extension().is_some_and(|extension| extension == "toml") {
        let (mut radar, asked) = radar_of(config, &stated, &mut notes)?;
        let words_per_frame = (radar.samples_per_chirp * radar.tx_m.len() * radar.loops_per_frame * RECEIVERS * 2) as u64;
        let Found { frames, streams, grid } = found(&parts, words_per_frame, config, &mut notes)?;
        radar.frames = asked.unwrap_or(frames);
        radar_table::hold_frames(&radar, frames, &parts[0][0])?;
        let chirp = (radar.samples_per_chirp * RECEIVERS * 2) as u64;
        let senders = radar.tx_m.len() as u64;
        let start = |index: u64| (0..senders).map(|tx| (index * senders + tx) * chirp).collect();
        let starts = (0..radar.loops_per_frame as u64).map(start).collect();
        let capture = capture(parts, streams, radar, words_per_frame, starts, false, notes);
        return Ok(placed(grid, Capture { board, ..capture }));
    }
    let radar = ti_json::read_cascade(config)?;
    let words_per_frame = radar.words_per_frame()?;
    let Found { frames, streams, grid } = found(&parts, words_per_frame, config, &mut notes)?;
    let Selection { radar: found, words_per_frame, starts, notes: more, .. } = radar.select(&stated, &|_, _| Ok(frames))?;
    notes.extend(more);
    let shaped = radar_table::apply(found, &stated.sets)?;
    let capture = capture(parts, streams, shaped, words_per_frame, starts, radar.lanes.q_first, notes);
    Ok(placed(grid, Capture { board, ..capture }))
}

/// Refuses the board of one device.
fn of_four(board: &Board) -> Result<()> {
    match board.rx_half_wavelengths.len() {
        count if count >= RECEIVERS * CASCADED => Ok(()),
        count => Err(Error::Usage {
            message: format!("--board {}: {count} receivers, expected {}, four a device", board.name, RECEIVERS * CASCADED),
            hint: Some(format!("the board of four cascaded AWR2243 is the {CASCADE}: name it, or leave --board out")),
        }),
    }
}

/// The profiles of the chirps in a frame.
pub fn profiles(sources: &[PathBuf], stated: &Stated) -> Result<Vec<usize>> {
    let (config, _) = descriptions(&parts(sources)?[0][0], stated, &mut vec![])?;
    ti_json::read_cascade(&config)?.profiles_in_frame(stated)
}

/// Frames where they came, as far as the indices say.
fn placed(grid: Option<Grid>, capture: Capture) -> Capture {
    match grid {
        Some(grid) => grid.place(&capture.source.clone(), capture),
        None => capture,
    }
}

fn capture(
    parts: Vec<[PathBuf; CASCADED]>,
    streams: [Words; CASCADED],
    radar: Radar,
    words_per_frame: u64,
    starts: Vec<Vec<u64>>,
    q_first: bool,
    notes: Vec<String>,
) -> Capture {
    let [_, n_tx, n_rx, loops, samples] = radar.dims();
    let frame = move |index: usize| {
        let read = |words: &Words| words.read(index as u64 * words_per_frame, words_per_frame as usize);
        let blocks = streams.iter().map(read).collect::<Result<Vec<_>>>()?;
        Ok(arrange(&blocks, &starts, [n_tx, n_rx, loops, samples], q_first))
    };
    let source = parts[0][0].clone();
    Capture { source, radar, layout: IfLayout::Codes, board: None, notes, lost: vec![], rest: 0.0, frame: Box::new(frame) }
}

/// The words of a frame, device by device, as `[tx, rx, loop, sample]`.
fn arrange(blocks: &[Vec<i16>], starts: &[Vec<u64>], dims: [usize; 4], q_first: bool) -> IfFrame {
    let [n_tx, n_rx, loops, samples] = dims;
    let count = n_tx * n_rx * loops * samples;
    let (mut re, mut im) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for tx in 0..n_tx {
        for rx in 0..n_rx {
            let words = &blocks[rx / RECEIVERS];
            for chirp in starts.iter().take(loops).map(|starts| starts[tx] as usize) {
                for sample in 0..samples {
                    let place = chirp + 2 * (sample * RECEIVERS + rx % RECEIVERS);
                    re.push(f32::from(words[place + usize::from(q_first)]));
                    im.push(f32::from(words[place + usize::from(!q_first)]));
                }
            }
        }
    }
    IfFrame::new(dims, re, Some(im))
}

/// The files of all devices, part by part.
fn parts(sources: &[PathBuf]) -> Result<Vec<[PathBuf; CASCADED]>> {
    let listed = match sources {
        [folder] if folder.is_dir() => entries(folder)?,
        [file] => entries(file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")))?,
        several => several.to_vec(),
    };
    let mut found: BTreeMap<usize, [Option<PathBuf>; CASCADED]> = BTreeMap::new();
    for file in &listed {
        match part_of(file) {
            Some((device, part)) => found.entry(part).or_default()[device] = Some(file.clone()),
            None if sources.len() > 1 && !file.to_string_lossy().ends_with("_idx.bin") => {
                return Err(Error::field(file, "name", "another file", "the samples of a cascade, such as slave1_0000_data.bin")
                    .with_hint("name the folder of the capture"));
            }
            None => {}
        }
    }
    let folder = listed.iter().find(|file| is_part(file)).and_then(|file| file.parent()).unwrap_or(Path::new("")).to_path_buf();
    let last = found.keys().next_back().copied().unwrap_or(0);
    (0..=last)
        .map(|part| {
            let mut devices = found.remove(&part).unwrap_or_default();
            if let Some(missing) = devices.iter().position(Option::is_none) {
                let name = format!("{}_{part:04}{END}", DEVICES[missing]);
                return Err(Error::field(folder.join(name), "samples", "missing", "a file of every device and every part")
                    .with_hint("copy the whole capture: the virtual array needs all four devices"));
            }
            Ok(std::array::from_fn(|device| devices[device].take().expect("none is missing")))
        })
        .collect()
}

/// What the files hold.
struct Found {
    frames: usize,
    /// Every device's words of them.
    streams: [Words; CASCADED],
    /// When they came; none where the indices do not say.
    grid: Option<Grid>,
}

fn found(parts: &[[PathBuf; CASCADED]], words_per_frame: u64, config: &Path, notes: &mut Vec<String>) -> Result<Found> {
    let mut indices = Vec::with_capacity(parts.len());
    for part in parts {
        let of_devices = part.iter().map(|data| Index::of(data, 2 * words_per_frame, config, notes));
        let of_devices = of_devices.collect::<Result<Vec<_>>>()?;
        hold_together(&of_devices)?;
        indices.push(of_devices);
    }
    let frames = indices.iter().map(|of_devices| of_devices[0].frames).sum();
    if frames == 0 {
        let expected = format!("at least {} bytes, one frame of {}", 2 * words_per_frame, config.display());
        return Err(Error::field(&parts[0][0], "samples", "no whole frame", expected)
            .with_hint("the description belongs to another capture, or the capture was cut off"));
    }
    let grid = grid(&indices, notes)?;
    let of_device = |device: usize| {
        let part = |part: &Vec<Index>| (part[device].data.clone(), part[device].frames as u64 * words_per_frame);
        Words::of(indices.iter().map(part).collect())
    };
    Ok(Found { frames, streams: std::array::from_fn(of_device), grid })
}

/// The radar of a TOML file; antennas that it does not state are the board's, in the firing order of mmWave Studio's script for TDM
/// (`Cascade_Configuration_MIMO.lua`): transmitter 12 first. Besides, how many frames it states.
fn radar_of(config: &Path, stated: &Stated, notes: &mut Vec<String>) -> Result<(Radar, Option<usize>)> {
    let mut table = radar_table::table_of(Some(config), &stated.sets)?;
    let radar = radar_table::radar_table(&mut table)?;
    let board = Board::named(stated.board.as_deref().unwrap_or(CASCADE))?;
    notes.push(format!("antennas of the {} ({})", board.name, board.source));
    let senders: Vec<usize> = (0..board.tx_half_wavelengths.len()).rev().collect();
    let receivers = board.rx_half_wavelengths.len().min(RECEIVERS * CASCADED);
    if radar_table::place_antennas(radar, board, &senders, receivers).contains(&"tx_m") {
        notes.push(
            "radar.tx_m is not stated: transmitters fire from the board's last to its first, as mmWave Studio's script has it"
                .into(),
        );
    }
    let states_frames = radar.contains_key("frames");
    radar.entry("frames").or_insert(Value::Integer(1));
    if !radar.contains_key("full_scale_codes") {
        radar.insert("full_scale_codes".into(), Value::Float(f64::from(i16::MAX)));
    }
    let radar = radar_table::finished(table, config, notes)?;
    if radar.sampling != Sampling::Complex {
        return Err(Error::setting("radar.sampling", "real", "complex, as cascades are captured").in_file(config));
    }
    if radar.rx_m.len() != RECEIVERS * CASCADED {
        return Err(Error::setting("radar.rx_m", format!("{} receivers", radar.rx_m.len()), "16, four a device"));
    }
    let frames = states_frames.then_some(radar.frames);
    Ok((radar, frames))
}

#[cfg(test)]
#[path = "cascade_tests.rs"]
mod tests;
