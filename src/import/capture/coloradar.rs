//! `waveform_cfg.txt` and `antenna_cfg.txt` of ColoRadar's folder `calib`: a key and its value on every line.
//!
//! Source: ColoRadar development kit and github.com/azinke/coloradar, `core/calibration.py`: `num_tx`, `num_rx`,
//! `num_adc_samples_per_chirp`, `num_chirps_per_frame` (of each transmitter), `adc_sample_frequency`, `start_frequency`, `idle_time`,
//! `adc_start_time`, `ramp_end_time`, `frequency_slope` in SI units; `f_design` in GHz, and `rx` and `tx` with index, azimuth and
//! elevation in half wavelengths of it.

use std::collections::BTreeMap;
use std::path::Path;

use toml::{Table, Value};

use super::radar_table::rows;
use crate::data::files;
use crate::error::{Error, Result};
use crate::radar::SPEED_OF_LIGHT;

/// Fills what a table of the radar's settings leaves open.
///
/// # Errors
/// A line that is none of such a file's.
pub fn fill(path: &Path, radar: &mut Table) -> Result<()> {
    let text = files::read_text(path)?;
    let mut values: BTreeMap<String, f64> = BTreeMap::new();
    let mut antennas: BTreeMap<&str, Vec<[f64; 3]>> = BTreeMap::new();
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim().starts_with('#')) {
        let wrong = |found: &str| {
            Error::field(
                path,
                format!("line {}", index + 1),
                found,
                "a key and its numbers, as in waveform_cfg.txt or antenna_cfg.txt",
            )
        };
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or_default().to_lowercase();
        let numbers = words
            .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
            .collect::<Option<Vec<f64>>>()
            .ok_or_else(|| wrong(line))?;
        match (key.as_str(), &numbers[..]) {
            ("rx", &[at, x, z]) => antennas.entry("rx_m").or_default().push([at, x, z]),
            ("tx", &[at, x, z]) => antennas.entry("tx_m").or_default().push([at, x, z]),
            (_, &[value]) => drop(values.insert(key.clone(), value)),
            _ => return Err(wrong(line)),
        }
    }
    let mut set = |key: &str, value: Value| {
        radar.entry(key).or_insert(value);
    };
    let floats = [
        ("start_frequency_hz", "start_frequency"),
        ("slope_hz_per_s", "frequency_slope"),
        ("sample_rate_hz", "adc_sample_frequency"),
        ("adc_start_s", "adc_start_time"),
    ];
    for (own, theirs) in floats {
        values.get(theirs).into_iter().for_each(|&value| set(own, Value::Float(value)));
    }
    for (own, theirs) in [("samples_per_chirp", "num_adc_samples_per_chirp"), ("loops_per_frame", "num_chirps_per_frame")] {
        values.get(theirs).into_iter().for_each(|&value| set(own, Value::Integer(value as i64)));
    }
    if let (Some(idle_s), Some(ramp_s)) = (values.get("idle_time"), values.get("ramp_end_time")) {
        set("chirp_period_s", Value::Float(idle_s + ramp_s));
    }
    if let Some(&design_ghz) = values.get("f_design") {
        let half_m = SPEED_OF_LIGHT / (design_ghz * 1e9) / 2.0;
        for (key, mut places) in antennas {
            places.sort_by(|a, b| a[0].total_cmp(&b[0]));
            set(key, rows(places.into_iter().map(|[_, x, z]| [x * half_m, 0.0, z * half_m]).collect()));
        }
    } else if !antennas.is_empty() {
        return Err(Error::field(path, "f_design", "missing", "the frequency, in GHz, of whose half wavelengths the places are"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waveform_and_antennas_are_read_and_other_files_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let mut radar: Table = [("start_frequency_hz".to_string(), Value::Float(77.5e9))].into_iter().collect();
        let waveform = "# of the cascade\nnum_tx 12\nnum_adc_samples_per_chirp 256\nnum_chirps_per_frame 16\nadc_sample_frequency 8000000\n\
                        start_frequency 7.7e10\nidle_time 5e-6\nadc_start_time 6e-6\nramp_end_time 4e-5\nfrequency_slope 7.9e13\n";
        fill(&file("waveform_cfg.txt", waveform), &mut radar).unwrap();
        assert_eq!((radar["start_frequency_hz"].as_float(), radar["loops_per_frame"].as_integer()), (Some(77.5e9), Some(16)));
        assert!((radar["chirp_period_s"].as_float().unwrap() - 45e-6).abs() < 1e-12);
        fill(&file("antenna_cfg.txt", "num_rx 2\nf_design 76.8\nrx 1 3 0\nrx 0 0 0\ntx 0 9 1\n"), &mut radar).unwrap();
        let half = SPEED_OF_LIGHT / 76.8e9 / 2.0;
        let places: Vec<Vec<f64>> = radar["rx_m"].clone().try_into().unwrap();
        assert_eq!(places, [[0.0; 3], [3.0 * half, 0.0, 0.0]]);
        assert!(fill(&file("notes.txt", "walk 1 2 3 4\n"), &mut radar).unwrap_err().to_string().contains("line 1"));
        assert!(fill(&file("antenna_cfg.txt", "rx 0 0 0\n"), &mut radar).unwrap_err().to_string().contains("f_design"));
    }
}
