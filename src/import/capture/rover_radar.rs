//! The radar of a trace of `roverd`: `--set` and `--config`, then the trace's `config.yaml` and `radar.json`, then what its shapes,
//! resolutions and time stamps say.
//!
//! Source: RadarML/red-rover, collect/rover/radar_api/config.py (`RadarConfig`, units and resolutions) and awr_api.py (`setup`: three
//! transmitters fire in their order; of two, the second of three is left out).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::boards::Board;
use super::json::Json;
use super::radar_table::{finished, hold_frames, missing, place_antennas, radar_table, table_of};
use super::time_stamps::Grid;
use super::{Stated, inverted};
use crate::data::files;
use crate::error::{Error, Result};
use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};

/// Most that resolutions may differ from those of the radar's settings: `RadarConfig` computes them by the same laws, so that they differ
/// by rounding alone, at most that of single precision.
const RESOLUTION_SHARE: f64 = f32::EPSILON as f64;
const PERIOD: &str = "frame_period_s";
/// In the `config.yaml` of `hybridsim export`: places of the receivers whose samples in `iq` are turned by half a turn.
pub const INVERTED_RX: &str = "inverted_rx";

/// What the channels say.
pub struct Frames<'a> {
    pub meta: &'a Path,
    pub stamps: &'a Path,
    /// Loops, transmitters, receivers, words.
    pub shape: [usize; 4],
    pub frames: usize,
    /// By their time stamps.
    pub grid: Option<&'a Grid>,
}

/// The radar, and the receivers whose samples are turned by half a turn: as the trace says, or by the board.
///
/// # Errors
/// Settings that are missing, or that contradict the channels or `radar.json`.
pub fn radar_of(sensor: &Path, found: &Frames, stated: &Stated, notes: &mut Vec<String>) -> Result<(Radar, Vec<usize>)> {
    let mut table = table_of(stated.configs.first().map(PathBuf::as_path), &stated.sets)?;
    let config = match sensor.file_name() {
        Some(_) => sensor.with_file_name("config.yaml"),
        None => sensor.join("../config.yaml"),
    };
    let beside = sensor.join("radar.json");
    let intrinsics = if beside.is_file() {
        Some(Json::read(&beside)?)
    } else {
        notes.push(format!(
            "{}: missing: range and Doppler resolution are not held against the radar's settings",
            beside.display()
        ));
        None
    };
    let radar = radar_table(&mut table)?;
    // Of a trace that broke off, `config.yaml` counts more than there are.
    radar.entry("frames").or_insert(Value::Integer(found.frames as i64));
    let carried = fill_from_config(radar, &config, sensor, notes)?;
    if let Some(intrinsics) = &intrinsics {
        fill_from_properties(radar, &properties_of(intrinsics)?);
    }
    fill_from_channels(radar, found, notes)?;
    let board = stated.board.as_ref().map(|name| Board::named(name)).transpose()?;
    let [_, tx, rx, _] = found.shape;
    match board {
        None if carried.is_some() => {}
        None => notes.push("no board was named: no receiver is taken to be fed from the opposite side".into()),
        Some(board) => notes.extend(place_antennas(radar, board, &board.senders(tx), rx).into_iter().map(|key| {
            let (what, name, source) = (if key == "tx_m" { "transmitters" } else { "receivers" }, board.name, board.source);
            format!("{what} of the {name} ({source}), in the order in which a rover fires them")
        })),
    }
    if let Some(intrinsics) = &intrinsics {
        fill_from_resolutions(radar, intrinsics, found.shape, notes)?;
    }
    refuse_missing(radar, &config, board)?;
    let radar = finished(table, stated.configs.first().unwrap_or(&config), notes)?;
    hold_against_channels(&radar, found, stated, notes)?;
    if let Some(intrinsics) = &intrinsics {
        hold_against_intrinsics(&radar, intrinsics)?;
    }
    let is_carried = carried.is_some();
    let inverted_rx = carried.or_else(|| Some(inverted::places(board?, 0..rx))).unwrap_or_default();
    notes.extend(inverted::note(&inverted_rx).map(|note| match is_carried {
        true => format!("{note}, as {} says, whatever the board", config.display()),
        false => note,
    }));
    Ok((radar, inverted_rx))
}

fn float(table: &Table, key: &str) -> Option<f64> {
    let value = table.get(key)?;
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// `config.yaml` of the trace: that of `hybridsim export` holds the radar itself, that of a rover its properties. Which receivers' samples
/// are turned by half a turn, where it says so.
fn fill_from_config(radar: &mut Table, config: &Path, sensor: &Path, notes: &mut Vec<String>) -> Result<Option<Vec<usize>>> {
    if !config.is_file() {
        return Ok(None);
    }
    let text = files::read_text(config)?;
    let value: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    if let Some(own) = value.get("radar").filter(|radar| radar.get("start_frequency_hz").is_some()) {
        let own: Radar = serde_json::from_value(own.clone())
            .map_err(|error| Error::Parse { path: config.into(), message: format!("radar: {error}") })?;
        let own = Table::try_from(own).expect("a radar is plain data");
        for (key, value) in own {
            radar.entry(key).or_insert(value);
        }
        if value.get("labels").and_then(|labels| labels.as_object()).is_some_and(|labels| !labels.is_empty()) {
            notes.push(format!("{}: labels are not read: give them with --label", config.display()));
        }
        return Json::read(config)?.find(INVERTED_RX).map(|places| places.items()?.iter().map(Json::count).collect()).transpose();
    }
    fill_from_properties(radar, &properties_in(&text, &sensor.file_name().unwrap_or_default().to_string_lossy()));
    Ok(None)
}

/// Names of a rover's properties of a radar.
const PROPERTIES: [&str; 8] =
    ["frequency", "idle_time", "adc_start_time", "ramp_end_time", "freq_slope", "adc_samples", "sample_rate", "frame_length"];
const PROPERTY_PERIOD: &str = "frame_period";

/// `key: number` below the sensor's name in a rover's YAML.
fn properties_in(text: &str, sensor: &str) -> BTreeMap<String, f64> {
    let (mut is_inside, mut found) = (false, BTreeMap::new());
    let plain = |word: &str| word.trim().trim_matches(['"', '\'']).to_string();
    for line in text.lines().map(|line| line.split(" #").next().unwrap_or_default()) {
        let Some((key, value)) = line.split_once(':') else { continue };
        if !line.starts_with([' ', '\t', '#']) {
            is_inside = plain(key) == sensor;
        } else if is_inside && let Some(number) = value.trim().parse().ok().filter(|number: &f64| number.is_finite()) {
            found.insert(plain(key), number);
        }
    }
    found
}

/// The same properties in `radar.json`.
fn properties_of(intrinsics: &Json) -> Result<BTreeMap<String, f64>> {
    let stated = PROPERTIES.into_iter().chain([PROPERTY_PERIOD]).filter_map(|key| Some((key, intrinsics.find(key)?)));
    stated.map(|(key, value)| Ok((key.to_string(), value.number()?))).collect()
}

/// Properties have units of their own: GHz, µs, MHz/µs, kHz and ms.
fn fill_from_properties(radar: &mut Table, properties: &BTreeMap<String, f64>) {
    for (own, theirs, unit) in [
        ("start_frequency_hz", "frequency", 1e9),
        ("slope_hz_per_s", "freq_slope", 1e12),
        ("sample_rate_hz", "sample_rate", 1e3),
        ("adc_start_s", "adc_start_time", 1e-6),
        (PERIOD, PROPERTY_PERIOD, 1e-3),
    ] {
        if let Some(value) = properties.get(theirs) {
            radar.entry(own).or_insert(Value::Float(value * unit));
        }
    }
    for (own, theirs) in [("samples_per_chirp", "adc_samples"), ("loops_per_frame", "frame_length")] {
        if let Some(&value) = properties.get(theirs) {
            radar.entry(own).or_insert(Value::Integer(value as i64));
        }
    }
    if let (Some(idle), Some(ramp)) = (properties.get("idle_time"), properties.get("ramp_end_time")) {
        radar.entry("chirp_period_s").or_insert(Value::Float((idle + ramp) * 1e-6));
    }
}

/// Lengths and, where nothing states it, the frame period.
fn fill_from_channels(radar: &mut Table, found: &Frames, notes: &mut Vec<String>) -> Result<()> {
    let [loops, _, _, words] = found.shape;
    let is_real = radar.get("sampling").and_then(Value::as_str) == Some("real");
    if !is_real && !words.is_multiple_of(4) {
        let expected = "a multiple of 4 words: Q of two samples, then I of both";
        return Err(Error::field(found.meta, "iq.shape", format!("{:?}", found.shape), expected));
    }
    let samples = if is_real { words } else { words / 2 };
    radar.entry("loops_per_frame").or_insert(Value::Integer(loops as i64));
    radar.entry("samples_per_chirp").or_insert(Value::Integer(samples as i64));
    radar.entry("full_scale_codes").or_insert(Value::Float(f64::from(i16::MAX)));
    if let Some(spacing_s) = found.grid.map(|grid| grid.period).filter(|_| !radar.contains_key(PERIOD)) {
        notes.push(format!("{PERIOD} is not stated: {spacing_s:.6} s is the median spacing of {}", found.stamps.display()));
        radar.insert(PERIOD.into(), Value::Float(spacing_s));
    }
    Ok(())
}

/// The slope and the chirp period that the resolutions of `radar.json` leave, where nothing states them.
fn fill_from_resolutions(radar: &mut Table, intrinsics: &Json, shape: [usize; 4], notes: &mut Vec<String>) -> Result<()> {
    let (Some(rate_hz), Some(samples)) = (float(radar, "sample_rate_hz"), float(radar, "samples_per_chirp")) else {
        return Ok(());
    };
    let mut fill = |radar: &mut Table, key: &str, value: f64, from: &str| {
        radar.insert(key.into(), Value::Float(value));
        notes.push(format!("{key} is not stated: {value:e} is what `{from}` of {} leaves", intrinsics.file().display()));
    };
    if let Some(range_m) = resolution(intrinsics, "range_resolution")?.filter(|_| !radar.contains_key("slope_hz_per_s")) {
        fill(radar, "slope_hz_per_s", SPEED_OF_LIGHT * rate_hz / (2.0 * range_m * samples), "range_resolution");
    }
    let (Some(start_hz), Some(slope)) = (float(radar, "start_frequency_hz"), float(radar, "slope_hz_per_s")) else {
        return Ok(());
    };
    let middle_s = float(radar, "adc_start_s").unwrap_or(0.0) + samples / rate_hz / 2.0;
    let wavelength_m = SPEED_OF_LIGHT / (start_hz + slope * middle_s);
    let [loops, tx, ..] = shape;
    if let Some(velocity) = resolution(intrinsics, "doppler_resolution")?.filter(|_| !radar.contains_key("chirp_period_s")) {
        fill(radar, "chirp_period_s", wavelength_m / (2.0 * velocity * (tx * loops) as f64), "doppler_resolution");
    }
    Ok(())
}

/// A resolution that is known: zero is none.
fn resolution(intrinsics: &Json, key: &str) -> Result<Option<f64>> {
    let value = intrinsics.find(key).map(|value| value.number()).transpose()?;
    Ok(value.filter(|value| *value > 0.0))
}

fn refuse_missing(radar: &Table, config: &Path, board: Option<&Board>) -> Result<()> {
    let open = missing(radar);
    let Some(key) = open.first() else { return Ok(()) };
    let antennas = match board {
        _ if !open.iter().any(|key| key.ends_with("x_m")) => String::new(),
        None => "; --board NAME places antennas".into(),
        Some(board) => format!(
            "; the {} has {} transmitters and {} receivers, fewer than the trace",
            board.name,
            board.tx_half_wavelengths.len(),
            board.rx_half_wavelengths.len()
        ),
    };
    let hint = format!(
        "a rover's trace says its radar in config.yaml beside the folder of the radar (frequency, idle_time, adc_start_time, ramp_end_time, \
         freq_slope, sample_rate, frame_period), and its resolutions in radar.json; without them give {} with --set radar.KEY=VALUE or \
         --config FILE.toml{antennas}",
        open.join(", ")
    );
    Err(Error::field(config, format!("radar.{key}"), "missing", "a value").with_hint(hint))
}

/// The settings against what the channels hold.
fn hold_against_channels(radar: &Radar, found: &Frames, stated: &Stated, notes: &mut Vec<String>) -> Result<()> {
    let [_, tx, rx, loops, samples] = radar.dims();
    let words = samples * if radar.sampling == Sampling::Complex { 2 } else { 1 };
    let wanted = [loops, tx, rx, words];
    if wanted != found.shape {
        let expected = format!("{wanted:?} by the radar's settings: loops, transmitters, receivers, words");
        return Err(Error::field(found.meta, "iq.shape", format!("{:?}", found.shape), expected)
            .with_hint("the settings or the board are of another capture"));
    }
    hold_frames(radar, found.frames, &found.meta.with_file_name("iq"))?;
    let Some(grid) = found.grid else { return Ok(()) };
    grid.hold(found.stamps, radar.frame_period_s, stated.has_set("radar.frame_period_s"), notes)
}

/// The settings against `radar.json`.
fn hold_against_intrinsics(radar: &Radar, intrinsics: &Json) -> Result<()> {
    let hint = "radar.json or the settings are of another capture";
    let [_, tx, rx, loops, samples] = radar.dims();
    if let Some(shape) = intrinsics.find("shape") {
        let wanted = [loops, tx, rx, samples];
        if shape.items()?.iter().map(Json::count).collect::<Result<Vec<usize>>>()? != wanted {
            return Err(shape.wrong(&format!("{wanted:?} by the radar's settings")).with_hint(hint));
        }
    }
    for (key, unit, wanted) in
        [("range_resolution", "m", radar.range_resolution_m()), ("doppler_resolution", "m/s", radar.velocity_resolution_mps())]
    {
        if let Some(value) = resolution(intrinsics, key)?.filter(|value| (value / wanted - 1.0).abs() > RESOLUTION_SHARE) {
            let expected = format!("{wanted:.6} {unit} by the radar's settings");
            return Err(Error::field(intrinsics.file(), key, format!("{value:.6} {unit}"), expected).with_hint(hint));
        }
    }
    Ok(())
}
