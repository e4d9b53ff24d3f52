//! `adc_data.bin` of a DCA1000 capture card behind a TI radar.

use std::path::{Path, PathBuf};

use super::boards::Board;
use super::descriptions::descriptions;
use super::radar_table::apply;
use super::schedule::{Selection, TiRadar};
use super::stream::Words;
use super::{Capture, Stated, cascade, inverted, lanes::Lanes, parts, ti_cfg, ti_json};
use crate::data::{IfFrame, IfLayout, files};
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// Understands the files of one capture.
///
/// The radar is that of `--config`; without one, of the only `.mmwave.json` or `.cfg` beside the samples. Files are
/// joined in the order in which they are named.
pub fn open(sources: &[PathBuf], stated: &Stated) -> Result<Capture> {
    let mut notes = Vec::new();
    let (config, setup) = descriptions(&sources[0], stated, &mut notes)?;
    let mut stated = stated.clone();
    if stated.board.is_none()
        && let Some(device) = &setup.device
    {
        notes.push(format!("the set-up names the device {device}; --board NAME says which board carries it"));
    }
    let words = Words::open(sources)?;
    let radar = read(&config)?;
    let Selection { radar: found, words_per_frame, starts, inverted_rx, notes: more } =
        radar.select(&stated, &|words_per_frame, notes| radar.frames_present(&words, words_per_frame, notes))?;
    notes.extend(more);
    notes.extend(parts::note_of_others(sources));
    notes.extend(log_beside(&sources[0]));
    let shaped = apply(found, &std::mem::take(&mut stated.sets))?;
    let board = stated.board.as_deref().map(Board::named).transpose()?;
    let lanes = radar.lanes;
    notes.extend(board.filter(|board| board.interleaves() && !lanes.interleaved).map(|board| {
        format!(
            "the {} sends its receivers side by side (SWRA581B), but {} says one after the other: samples are read as it says; if it is \
             wrong, set chInterleave to 0 there (in a .cfg the last but one number of adcbufCfg)",
            board.name,
            config.display()
        )
    }));
    let [_, n_tx, n_rx, loops, samples] = shaped.dims();
    // Of one frame all of which is kept: then its loops are those of the description.
    let of_kept = (n_tx * n_rx * loops * samples * if lanes.sampling == Sampling::Complex { 2 } else { 1 }) as u64;
    let is_alone = words.len() / words_per_frame == 1 && of_kept == words_per_frame;
    let rest = if is_alone { (words.len() % words_per_frame) as f64 / words_per_frame as f64 } else { 0.0 };
    let frame = move |index: usize| {
        let words = words.read(index as u64 * words_per_frame, words_per_frame as usize)?;
        Ok(inverted::turned_back(arrange(&words, &starts, lanes, [n_tx, n_rx, loops, samples]), &inverted_rx))
    };
    let layout = if lanes.sampling == Sampling::Complex { IfLayout::Codes } else { IfLayout::RealCodes };
    Ok(Capture { source: sources[0].clone(), radar: shaped, layout, board, notes, lost: vec![], rest, frame: Box::new(frame) })
}

/// Opens the files that a `.setup.json` of mmWave Studio names.
pub fn open_setup(path: &Path, stated: &Stated) -> Result<Capture> {
    let (files, stated) = of_setup(path, stated)?;
    if files.iter().any(|file| cascade::is_part(file)) {
        return cascade::open(&files, &stated);
    }
    open(&parts::in_order(&files)?, &stated)
}

/// The profiles of the chirps in a frame.
pub fn profiles(sources: &[PathBuf], stated: &Stated) -> Result<Vec<usize>> {
    let (config, _) = descriptions(&sources[0], stated, &mut vec![])?;
    read(&config)?.profiles_in_frame(stated)
}

/// As [`profiles`], of what a `.setup.json` names.
pub fn profiles_of_setup(path: &Path, stated: &Stated) -> Result<Vec<usize>> {
    let (files, stated) = of_setup(path, stated)?;
    if files.iter().any(|file| cascade::is_part(file)) {
        return cascade::profiles(&files, &stated);
    }
    profiles(&files, &stated)
}

/// The files that a `.setup.json` names, and what it adds to what is stated.
fn of_setup(path: &Path, stated: &Stated) -> Result<(Vec<PathBuf>, Stated)> {
    let setup = ti_json::read_setup(path)?;
    if setup.files.is_empty() {
        return Err(Error::field(path, "capturedFiles.files", "none", "the files of the capture")
            .with_hint("name the .bin files themselves, with --config for the .mmwave.json"));
    }
    let mut stated = stated.clone();
    if stated.configs.is_empty() {
        stated.configs.extend(setup.config.clone());
    }
    stated.configs.push(path.into());
    Ok((setup.files, stated))
}

fn read(config: &Path) -> Result<TiRadar> {
    match config.extension().and_then(|extension| extension.to_str()) {
        Some("json") => ti_json::read_radar(config),
        _ => ti_cfg::read_radar(config),
    }
}

/// The words of a frame as `[tx, rx, loop, sample]`.
fn arrange(words: &[i16], starts: &[Vec<u64>], lanes: Lanes, dims: [usize; 4]) -> IfFrame {
    let [n_tx, n_rx, loops, samples] = dims;
    let count = n_tx * n_rx * loops * samples;
    let (mut re, mut im) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for tx in 0..n_tx {
        for rx in 0..n_rx {
            for chirp in starts.iter().take(loops).map(|starts| starts[tx] as usize) {
                for sample in 0..samples {
                    let (i, q) = lanes.place(rx, n_rx, sample, samples);
                    re.push(f32::from(words[chirp + i]));
                    if lanes.sampling == Sampling::Complex {
                        im.push(f32::from(words[chirp + q]));
                    }
                }
            }
        }
    }
    IfFrame::new(dims, re, (lanes.sampling == Sampling::Complex).then_some(im))
}

/// What the capture card's log says was lost.
fn log_beside(source: &Path) -> Option<String> {
    let stem = source.file_stem()?.to_string_lossy().into_owned();
    let stem =
        stem.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '_').trim_end_matches("_Raw").to_string();
    let folder = source.parent()?;
    let log =
        ["_LogFile.csv", "_Raw_LogFile.csv"].iter().map(|end| folder.join(format!("{stem}{end}"))).find(|path| path.is_file())?;
    let text = files::read_text(&log).ok()?;
    let number = |key: &str| {
        text.lines()
            .find_map(|line| line.trim().strip_prefix(key)?.trim_start_matches([' ', '-', ',']).trim().parse::<u64>().ok())
    };
    let (zeros, order) = (number("Number of zero filled bytes")?, number("Out of sequence count").unwrap_or(0));
    Some(if zeros == 0 && order == 0 {
        format!("{}: no packet was lost", log.display())
    } else {
        format!("{}: {zeros} bytes were lost and filled with zeros, {order} packets came out of order", log.display())
    })
}
