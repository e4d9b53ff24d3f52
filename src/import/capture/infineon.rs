//! Recording folders of Infineon's Radar SDK (`RadarIfxAvian_00`) and of ifxdaq.
//!
//! Source: Infineon Radar SDK, `config.json` of a recording; `radar.npy` is `[frame, rx, chirp, sample]`, unsigned
//! ADC codes around half scale.

use std::path::{Path, PathBuf};

use super::boards::Board;
use super::cube::{Cube, half_scale_note};
use super::json::Json;
use super::{Capture, Layout, Stated, radar_table::apply};
use crate::data::{IfLayout, entries::entries};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

const SAMPLES: &str = "radar.npy";

/// Whether a file is the samples of such a folder.
pub fn is_samples(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == SAMPLES) && path.with_file_name("config.json").is_file()
}

pub fn open(folder: &Path, stated: &Stated) -> Result<Capture> {
    let folder = device_folder(folder)?;
    let mut notes = Vec::new();
    let config = Json::read(&stated.configs.first().cloned().unwrap_or_else(|| folder.join("config.json")))?;
    let shape = shape_of(&config)?;
    let meta = folder.join("meta.json");
    let description = if meta.is_file() {
        Json::read(&meta)?.find("description").map(|text| text.text().map(str::to_string)).transpose()?
    } else {
        None
    };
    let board = board(stated, description.as_deref(), &mut notes)?;
    let cube = Cube::open(&folder.join(SAMPLES), None, Layout::parse("frame rx loop sample")?)?;
    let radar = radar(&config, &shape, board, cube.frames(), &mut notes)?;
    let radar = apply(radar, &stated.sets)?;
    cube.check(&radar)?;
    notes.extend(half_scale_note(&cube)?);
    if !folder.join("timestamps.csv").is_file() && !folder.join("radar_timestamp.csv").is_file() {
        notes.push("no time stamps: frames are taken to be evenly spaced".into());
    }
    Ok(Capture {
        source: folder.join(SAMPLES),
        radar,
        layout: IfLayout::RealCodes,
        notes,
        frame: Box::new(move |index| cube.frame(index)),
    })
}

/// The folder with the samples: this one, or the only one of its kind below.
fn device_folder(folder: &Path) -> Result<PathBuf> {
    if folder.join(SAMPLES).is_file() {
        return Ok(folder.into());
    }
    let mut below = entries(folder)?;
    below.retain(|path| path.join(SAMPLES).is_file());
    match &below[..] {
        [only] => Ok(only.clone()),
        [] => Err(Error::Usage {
            message: format!("{}: no {SAMPLES} here or one folder below", folder.display()),
            hint: Some("expected a recording of the Radar SDK: RadarIfxAvian_00/config.json and radar.npy".into()),
        }),
        several => Err(Error::Usage {
            message: format!("{}: {} devices", folder.display(), several.len()),
            hint: Some("import each device's folder by itself".into()),
        }),
    }
}

/// The part of a configuration that describes the chirps, under whichever of the SDK's names.
fn shape_of(config: &Json) -> Result<Json> {
    let device = config.find("device_config").unwrap_or_else(|| config.clone());
    let shape = device.find("fmcw_single_shape").unwrap_or(device);
    if shape.find("num_samples_per_chirp").is_none() {
        return Err(Error::field(
            config.file(),
            "device_config.fmcw_single_shape",
            format!("keys {:?}", shape.keys()),
            "one FMCW shape: num_samples_per_chirp, start_frequency_Hz, …",
        )
        .with_hint("sequences of several shapes are not read yet"));
    }
    Ok(shape)
}

fn board(stated: &Stated, description: Option<&str>, notes: &mut Vec<String>) -> Result<&'static Board> {
    if let Some(name) = &stated.board {
        return Board::named(name);
    }
    let named = description.and_then(|text| text.split_whitespace().find_map(|word| Board::named(word).ok()));
    Ok(named.unwrap_or_else(|| {
        notes.push("no board was named: taken for a BGT60TR13C; --board NAME says otherwise".into());
        Board::named("BGT60TR13C").expect("it is known")
    }))
}

fn radar(config: &Json, shape: &Json, board: &Board, frames: usize, notes: &mut Vec<String>) -> Result<Radar> {
    let number = |key: &str| shape.get(key)?.number();
    let antennas = |key: &str| -> Result<Vec<usize>> {
        shape
            .get(key)?
            .items()?
            .iter()
            .map(|entry| entry.count()?.checked_sub(1).ok_or_else(|| entry.wrong("antennas from 1 on")))
            .collect()
    };
    let (start_hz, end_hz) = (number("start_frequency_Hz")?, number("end_frequency_Hz")?);
    let (rate_hz, samples) = (number("sample_rate_Hz")?, shape.get("num_samples_per_chirp")?.count()?);
    let at = |index: usize, what: &str, place: Option<[f64; 3]>| {
        place.ok_or_else(|| {
            Error::field(config.file(), what, format!("antenna {}", index + 1), format!("those of the {}", board.name))
                .with_hint("name the board with --board")
        })
    };
    let place = |key: &str, of: &dyn Fn(usize) -> Option<[f64; 3]>| -> Result<Vec<[f64; 3]>> {
        antennas(key)?.into_iter().map(|index| at(index, key, of(index))).collect()
    };
    let tx_m = place("tx_antennas", &|index| board.tx_m(index))?;
    if tx_m.len() > 1 {
        return Err(shape.get("tx_antennas")?.wrong("one transmitter: several are not read yet"));
    }
    notes.push(format!("antennas of the {} ({})", board.name, board.source));
    notes.push("the first sample is taken to be at the start of the ramp".into());
    let bits =
        Json::read(&config.file().with_file_name("meta.json")).ok().and_then(|meta| meta.find("adc_resolution")?.count().ok());
    Ok(Radar {
        start_frequency_hz: start_hz,
        slope_hz_per_s: (end_hz - start_hz) * rate_hz / samples as f64,
        sample_rate_hz: rate_hz,
        sampling: Sampling::Real,
        samples_per_chirp: samples,
        loops_per_frame: shape.get("num_chirps_per_frame")?.count()?,
        adc_start_s: 0.0,
        chirp_period_s: number("chirp_repetition_time_s")?,
        frame_period_s: number("frame_repetition_time_s")?,
        frames,
        position_m: [0.0; 3],
        tx_m,
        rx_m: place("rx_antennas", &|index| board.rx_m(index))?,
        full_scale_codes: bits.map(|bits| f64::from(1u32 << bits.min(16)) - 1.0),
    })
}
