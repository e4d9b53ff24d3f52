//! Samples in an array of any order of axes: NumPy, MATLAB, HDF5.

use std::path::Path;

use toml::{Table, Value};

use super::boards::Board;
use super::cube::{Cube, half_scale_note};
use super::layout::Axis;
use super::{Capture, Stated};
use crate::data::read_toml;
use crate::data::settings::settings_from_table;
use crate::error::{Error, Result};
use crate::radar::Radar;

/// An array with `--layout`, and the radar of `--config`, `--board` and `--set`.
pub fn open(path: &Path, stated: &Stated) -> Result<Capture> {
    let preset = stated.preset.as_ref();
    let layout = match (&stated.layout, preset) {
        (Some(layout), _) => layout.clone(),
        (None, Some(preset)) => preset.layout()?,
        (None, None) => {
            return Err(Error::Usage {
                message: format!("{}: the order of its axes is not known", path.display()),
                hint: Some("write it from the outermost to the innermost, such as --layout \"frame chirp rx sample\"".into()),
            });
        }
    };
    let cube = Cube::open(path, stated.variable.as_deref(), layout)?;
    let mut notes: Vec<String> =
        preset.map(|preset| format!("laid out as {} ({})", preset.title, preset.page)).into_iter().collect();
    let radar = radar(&cube, stated, &mut notes)?;
    cube.check(&radar)?;
    notes.extend(half_scale_note(&cube)?);
    Ok(Capture { source: path.into(), layout: cube.stored_as(), radar, notes, frame: Box::new(move |index| cube.frame(index)) })
}

/// What the array itself says fills what the settings leave open.
fn radar(cube: &Cube, stated: &Stated, notes: &mut Vec<String>) -> Result<Radar> {
    #[derive(serde::Deserialize)]
    struct Settings {
        radar: Radar,
    }
    let mut table: Table = stated.configs.first().map(read_toml).transpose()?.unwrap_or_default();
    table.retain(|key, _| key == "radar");
    crate::data::settings::apply_sets(&mut table, &stated.sets)?;
    let radar = table.entry("radar").or_insert_with(|| Value::Table(Table::new()));
    let radar = radar.as_table_mut().ok_or_else(|| Error::setting("radar", "no table", "a table of the radar's settings"))?;
    let preset = stated.preset.as_ref();
    for (key, value) in preset.iter().flat_map(|preset| &preset.radar) {
        radar.entry(key).or_insert_with(|| value.clone());
    }
    let board = stated.board.as_ref().or_else(|| preset?.board.as_ref()).map(|name| Board::named(name)).transpose()?;
    let rows = |places: Vec<[f64; 3]>| {
        Value::Array(places.into_iter().map(|place| Value::Array(place.map(Value::Float).to_vec())).collect())
    };
    let antennas = |count: usize, of: &dyn Fn(usize) -> Option<[f64; 3]>| (0..count).map(of).collect::<Option<Vec<_>>>();
    if let Some(board) = board {
        notes.push(format!("antennas of the {} ({})", board.name, board.source));
        if let Some(rx) = antennas(cube.length(Axis::Rx), &|index| board.rx_m(index)) {
            radar.entry("rx_m").or_insert_with(|| rows(rx));
        }
        let count = if cube.has(Axis::Chirp) { board.tx_half_wavelengths.len() } else { cube.length(Axis::Tx) };
        let senders = preset.and_then(|preset| preset.transmitters.clone()).unwrap_or_else(|| (0..count).collect());
        if let Some(tx) = senders.iter().map(|&tx| board.tx_m(tx)).collect::<Option<Vec<_>>>() {
            radar.entry("tx_m").or_insert_with(|| rows(tx));
        }
    }
    let transmitters = radar.get("tx_m").and_then(Value::as_array).map_or(1, Vec::len).max(1);
    let whole = |number: usize| Value::Integer(number as i64);
    radar.entry("frames").or_insert(whole(cube.frames()));
    radar.entry("samples_per_chirp").or_insert(whole(cube.length(Axis::Sample)));
    let loops = cube.length(Axis::Loop) * cube.length(Axis::Chirp) / if cube.has(Axis::Chirp) { transmitters } else { 1 };
    radar.entry("loops_per_frame").or_insert(whole(loops));
    radar.entry("sampling").or_insert_with(|| Value::String(format!("{:?}", cube.sampling()).to_lowercase()));
    if !radar.contains_key("adc_start_s") {
        radar.insert("adc_start_s".into(), Value::Float(0.0));
        notes.push("adc_start_s is not stated: the first sample is taken to be at the start of the ramp".into());
    }
    let name = stated.configs.first().map_or(Path::new("--set"), |path| path.as_path());
    let settings: Settings = settings_from_table(table, name, &[])?;
    settings.radar.check("radar")?;
    Ok(settings.radar)
}
