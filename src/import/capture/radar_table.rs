//! The radar's settings as a table, and the radar that a whole one makes.

use std::path::Path;

use toml::{Table, Value};

use crate::data::read_toml;
use crate::data::settings::{apply_sets, settings_from_table};
use crate::error::{Error, Result};
use crate::radar::Radar;

/// Settings of a file and `--set`s over them.
pub fn table_of(config: Option<&Path>, sets: &[String]) -> Result<Table> {
    let mut table: Table = config.map(read_toml).transpose()?.unwrap_or_default();
    table.retain(|key, _| key == "radar");
    apply_sets(&mut table, sets)?;
    Ok(table)
}

/// The table `radar` in others.
pub fn radar_table(table: &mut Table) -> Result<&mut Table> {
    let radar = table.entry("radar").or_insert_with(|| Value::Table(Table::new()));
    radar.as_table_mut().ok_or_else(|| Error::setting("radar", "no table", "a table of the radar's settings"))
}

/// Places as a setting.
pub fn rows(places: Vec<[f64; 3]>) -> Value {
    Value::Array(places.into_iter().map(|place| Value::Array(place.map(Value::Float).to_vec())).collect())
}

/// The radar of a table that says all but perhaps when the ADC starts.
pub fn finished(mut table: Table, name: &Path, notes: &mut Vec<String>) -> Result<Radar> {
    #[derive(serde::Deserialize)]
    struct Whole {
        radar: Radar,
    }
    let radar = radar_table(&mut table)?;
    if !radar.contains_key("adc_start_s") {
        radar.insert("adc_start_s".into(), Value::Float(0.0));
        notes.push("adc_start_s is not stated: the first sample is taken to be at the start of the ramp".into());
    }
    let whole: Whole = settings_from_table(table, name, &[])?;
    whole.radar.check("radar")?;
    Ok(whole.radar)
}

/// `--set radar.KEY=VALUE` over what was read.
pub fn apply(radar: Radar, sets: &[String]) -> Result<Radar> {
    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Settings {
        radar: Radar,
    }
    let table = toml::Table::try_from(Settings { radar }).expect("a radar is plain data");
    let settings: Settings = settings_from_table(table, "--set", sets)?;
    settings.radar.check("radar")?;
    Ok(settings.radar)
}
