//! The radar's settings as a table, and the radar that a whole one makes.

use std::path::Path;

use toml::{Table, Value};

use super::boards::Board;
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

/// Settings of nothing but a radar.
#[derive(serde::Deserialize)]
struct Whole {
    radar: Radar,
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

/// A board's antennas, its transmitters by number, where the table states no others. Which keys were filled; none of an array that has
/// more antennas than the board.
pub fn place_antennas(radar: &mut Table, board: &Board, transmitters: &[usize], receivers: usize) -> Vec<&'static str> {
    let tx = transmitters.iter().map(|&tx| board.tx_m(tx)).collect::<Option<Vec<_>>>();
    let rx = (0..receivers).map(|rx| board.rx_m(rx)).collect::<Option<Vec<_>>>();
    let mut filled = vec![];
    for (key, places) in [("tx_m", tx), ("rx_m", rx)] {
        if let Some(places) = places.filter(|_| !radar.contains_key(key)) {
            radar.insert(key.into(), rows(places));
            filled.push(key);
        }
    }
    filled
}

/// What a radar's table must state, and this one does not.
pub fn missing(radar: &Table) -> Vec<&'static str> {
    let mut keys = vec![
        "start_frequency_hz",
        "slope_hz_per_s",
        "sample_rate_hz",
        "samples_per_chirp",
        "loops_per_frame",
        "chirp_period_s",
        "frame_period_s",
        "frames",
        "tx_m",
        "rx_m",
    ];
    keys.retain(|key| !radar.contains_key(*key));
    keys
}

/// Refuses a key that no radar has, before another is missed because of it.
pub fn refuse_unknown(radar: &Table, name: &Path) -> Result<()> {
    // Each by itself: what else is wrong or missing says nothing of it.
    let refuse = |(key, value): (&String, &Value)| {
        let alone = Table::from_iter([(key.clone(), value.clone())]);
        match settings_from_table::<Whole>(Table::from_iter([("radar".into(), Value::Table(alone))]), name, &[]) {
            Err(unknown @ Error::UnknownKey { .. }) => Err(unknown),
            _ => Ok(()),
        }
    };
    radar.iter().try_for_each(refuse)
}

/// The radar of a table that says all but perhaps when the ADC starts.
pub fn finished(mut table: Table, name: &Path, notes: &mut Vec<String>) -> Result<Radar> {
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
    let table = toml::Table::try_from(Settings { radar: radar.clone() }).expect("a radar is plain data");
    let settings: Settings = settings_from_table(table, "--set", sets)?;
    settings.radar.check("radar")?;
    keeps_its_shape(&radar, &settings.radar)?;
    Ok(settings.radar)
}

/// Refuses more frames than a capture holds; fewer can be taken.
pub fn hold_frames(radar: &Radar, frames: usize, source: &Path) -> Result<()> {
    if radar.frames <= frames {
        return Ok(());
    }
    let expected = format!("at most {frames}, as many as {} holds", source.display());
    Err(Error::setting("radar.frames", radar.frames, expected)
        .with_hint("leave it out to take all frames; the settings may be of another capture"))
}

/// Where a sample lies follows from what was read: of frames and loops fewer can be taken, all else must stay.
fn keeps_its_shape(read: &Radar, set: &Radar) -> Result<()> {
    let ([frames, tx, rx, loops, samples], of) = (set.dims(), read.dims());
    let wrong = [
        ("frames", frames, of[0], frames > of[0]),
        ("tx_m", tx, of[1], tx != of[1]),
        ("rx_m", rx, of[2], rx != of[2]),
        ("loops_per_frame", loops, of[3], loops > of[3]),
        ("samples_per_chirp", samples, of[4], samples != of[4]),
    ];
    let hint = "correct the description that the capture was read by, or describe the array itself with --layout";
    if let Some((key, found, there, _)) = wrong.into_iter().find(|(.., wrong)| *wrong) {
        let expected = if ["frames", "loops_per_frame"].contains(&key) { format!("at most {there}") } else { there.to_string() };
        let found = if key.ends_with("_m") { format!("{found} places") } else { found.to_string() };
        return Err(
            Error::setting(format!("radar.{key}"), found, format!("{expected}, as the capture is described")).with_hint(hint)
        );
    }
    if set.sampling != read.sampling {
        let expected = format!("{:?}, as the capture is described", read.sampling).to_lowercase();
        return Err(Error::setting("radar.sampling", format!("{:?}", set.sampling).to_lowercase(), expected).with_hint(hint));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_key_is_named_with_the_nearest_one() {
        let whole = Radar { full_scale_codes: Some(2047.0), ..Radar::small(1) };
        let mut table = Table::try_from(whole).unwrap();
        refuse_unknown(&table, Path::new("radar.toml")).unwrap();
        let slope = table.remove("slope_hz_per_s").unwrap();
        table.insert("slope_mhz_us".into(), slope);
        let error = refuse_unknown(&table, Path::new("radar.toml")).unwrap_err();
        let wanted = "radar.toml: unknown key `radar.slope_mhz_us`, the nearest known one is `slope_hz_per_s`";
        assert_eq!(error.to_string(), wanted);
    }

    #[test]
    fn what_shapes_the_samples_cannot_be_set_but_fewer_frames_and_loops_can() {
        let radar = Radar::small(4);
        let set = |text: &str| apply(radar.clone(), &[text.to_string()]);
        assert_eq!(set("radar.frames=2").unwrap().frames, 2);
        assert_eq!(set("radar.frame_period_s=0.2").unwrap().frame_period_s, 0.2);
        for (text, message) in [
            ("radar.frames=5", "`radar.frames` is 5, expected at most 4, as the capture is described"),
            ("radar.samples_per_chirp=8", "`radar.samples_per_chirp` is 8"),
            ("radar.loops_per_frame=1000", "`radar.loops_per_frame` is 1000, expected at most"),
            ("radar.rx_m=[[0.0, 0.0, 0.0]]", "`radar.rx_m` is 1 places"),
        ] {
            let error = set(text).unwrap_err();
            assert!(error.to_string().starts_with(message) && error.hint().is_some(), "{error}");
        }
    }
}
