//! What this program says of recordings of one radar in which nothing is missing: the law that its p-value has there.
//!
//! The p-value of a report is uniform on the nulls that it was tried on; on a radar of another structure it may not be. A table holds
//! the p-values of nulls of the user's own radar (`hybridsim challenge calibrate`), and a diagnosis that is given one ranks its own
//! among them: with r of n nulls that are at least as extreme, (r + 1)/(n + 1), which is exact where recording and nulls are alike (a
//! Monte Carlo test: Davison and Hinkley, Bootstrap Methods and their Application, 1997, section 4.2; Phipson and Smyth, Statistical
//! Applications in Genetics and Molecular Biology 9, 2010). It is never below 1/(n + 1): what no null has looked like is not known to
//! be rarer, and no law is fitted beyond them. The p-value as it was before stands beside it.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::config::DiagnosisConfig;
use super::cube::most_frames;
use crate::data::{Recording, files, hex};
use crate::error::{Error, Result};
use crate::radar::Radar;

/// Version of the table's format.
pub const FORMAT: u32 = 1;

/// `calibration.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    pub format: u32,
    /// The program that diagnosed: version and sources.
    pub program: String,
    /// SHA-256 of the executable.
    pub executable_sha256: String,
    pub structure: Structure,
    /// Those of the diagnosis, as TOML.
    pub settings: String,
    /// Nulls that were diagnosed, and those that came to an answer, in which alone there are p-values.
    pub nulls: usize,
    pub answered: usize,
    /// Of the recorder, one for each null.
    pub seeds: Vec<u64>,
    /// Ascending.
    pub p_values: Vec<f64>,
    /// The smallest corrected p-value of all detectors, ascending.
    #[serde(rename = "suspicion")]
    pub bounds: Vec<f64>,
    /// Per family of detectors its smallest p-value in each null in which it had something to say, ascending; 1 in the others.
    #[serde(rename = "suspects")]
    pub detectors: BTreeMap<String, Vec<f64>>,
    pub false_alarms: FalseAlarms,
    /// Chance that p-values lie as far from uniform (Kolmogorov and Smirnov).
    pub uniform_chance: f64,
}

/// Nulls on which something was claimed, at the level that the settings state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FalseAlarms {
    pub level: f64,
    pub alarms: usize,
    pub of: usize,
    pub share: f64,
    /// Clopper and Pearson's, 95 %.
    pub interval: [f64; 2],
}

/// What two recordings must share for their p-values to have one law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// With as many frames as a diagnosis looks at; the clipping level may differ.
    pub radar: Radar,
    pub room: bool,
    pub person: bool,
}

/// What a table makes of one report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibrated {
    pub format: u32,
    /// SHA-256 of the table.
    pub sha256: String,
    /// Nulls with a p-value, and those that are at least as extreme.
    pub nulls: usize,
    pub as_odd: usize,
    /// As it is without the table.
    pub p_value_raw: f64,
    /// Of families of detectors with something to say: their rank among the nulls, as p-values, not corrected for their number.
    #[serde(rename = "suspects")]
    pub detectors: BTreeMap<String, f64>,
}

/// The program as a table names it.
pub fn program() -> String {
    format!("hybridsim {}, sources {}", env!("CARGO_PKG_VERSION"), env!("HYBRIDSIM_SOURCES"))
}

impl Structure {
    /// # Errors
    /// No frame is whole.
    pub fn of(recording: &Recording) -> Result<Self> {
        let frames = recording.whole_stretch()?.len().min(most_frames(&recording.radar));
        let radar = Radar { frames, full_scale_codes: None, ..recording.radar.clone() };
        Ok(Self { radar, room: recording.room.is_some(), person: recording.person().is_some() })
    }
}

/// A table with the bytes that its hash is of.
#[derive(Clone, Debug)]
pub struct Table {
    pub calibration: Calibration,
    bytes: Vec<u8>,
}

impl Table {
    /// The table that the settings name; none without.
    ///
    /// # Errors
    /// A file that cannot be read, or is no table of this version and program.
    pub fn named(config: &DiagnosisConfig) -> Result<Option<Self>> {
        config.calibration.as_deref().map(Self::read).transpose()
    }

    /// # Errors
    /// As [`Self::named`].
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = files::read(path)?;
        let parse = |error: serde_json::Error| Error::Parse { path: path.into(), message: error.to_string() };
        let value: serde_json::Value = serde_json::from_slice(&bytes).map_err(parse)?;
        let hint = "make it anew with `hybridsim challenge calibrate`";
        if value["format"] != FORMAT {
            return Err(Error::field(path, "format", value["format"].to_string(), FORMAT.to_string()).with_hint(hint));
        }
        let calibration: Calibration = serde_json::from_value(value).map_err(parse)?;
        if calibration.program != program() {
            return Err(Error::field(path, "program", calibration.program, program())
                .with_hint(format!("another program's p-values have another law: {hint}")));
        }
        if calibration.p_values.len() != calibration.answered || !calibration.p_values.is_sorted() {
            let found = format!("{} numbers", calibration.p_values.len());
            return Err(Error::field(path, "p_values", found, format!("{} that ascend", calibration.answered)));
        }
        let of_detectors = calibration.detectors.iter().map(|(name, list)| (format!("suspects.{name}"), list));
        let unsorted = |(key, list): (String, &Vec<f64>)| (!list.is_sorted()).then_some(key);
        let key = of_detectors.chain([("suspicion".to_string(), &calibration.bounds)]).find_map(unsorted);
        if let Some(key) = key {
            return Err(Error::field(path, key, "numbers in another order", "numbers that ascend").with_hint(hint));
        }
        Ok(Self { calibration, bytes })
    }

    /// What of it is part of a report's settings: its name with the version, and its bytes.
    pub fn shaping(&self) -> (&'static str, Vec<u8>) {
        ("calibration table 1", self.bytes.clone())
    }

    /// Refuses a recording of another structure; `path` is the table's.
    ///
    /// # Errors
    /// The first key that differs, with both of its values.
    pub fn check(&self, recording: &Recording, path: &Path) -> Result<()> {
        // The last digit of a number may not survive being written: both were.
        let written = serde_json::to_string(&Structure::of(recording)?).expect("plain data");
        let theirs: serde_json::Value = serde_json::from_str(&written).expect("just written");
        let ours = serde_json::to_value(&self.calibration.structure).expect("plain data");
        let Some((key, found, expected)) = difference("structure", &ours, &theirs) else { return Ok(()) };
        let expected = format!("{expected}, as {} has it", recording.folder.display());
        Err(Error::field(path, key, found, expected).with_hint(
            "p-values of another structure have another law: make a table of this one with `hybridsim challenge calibrate`",
        ))
    }

    /// Ranks a report's p-value, and those of its detectors.
    pub fn calibrated(&self, p_value_raw: f64, detectors: &BTreeMap<String, f64>) -> Calibrated {
        let Calibration { p_values, detectors: known, answered, .. } = &self.calibration;
        let families = detectors.iter().map(|(name, value)| {
            let as_odd = known.get(name).map_or(0, |nulls| as_odd(nulls, *value));
            (name.clone(), ranked(as_odd, *answered))
        });
        Calibrated {
            format: FORMAT,
            sha256: hex(&Sha256::digest(&self.bytes)),
            nulls: *answered,
            as_odd: as_odd(p_values, p_value_raw),
            p_value_raw,
            detectors: families.collect(),
        }
    }
}

impl Calibrated {
    /// The calibrated p-value.
    pub fn p_value(&self) -> f64 {
        ranked(self.as_odd, self.nulls)
    }
}

/// How many ascending p-values are at most a value.
fn as_odd(ascending: &[f64], value: f64) -> usize {
    ascending.partition_point(|null| *null <= value)
}

fn ranked(as_odd: usize, nulls: usize) -> f64 {
    (as_odd + 1) as f64 / (nulls + 1) as f64
}

/// The first key at which two values differ, and both of them.
fn difference(key: &str, ours: &serde_json::Value, theirs: &serde_json::Value) -> Option<(String, String, String)> {
    match (ours.as_object(), theirs.as_object()) {
        (Some(a), Some(b)) => {
            let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
            keys.sort_unstable();
            keys.dedup();
            let null = serde_json::Value::Null;
            let of = |map: &serde_json::Map<String, serde_json::Value>, name: &str| map.get(name).unwrap_or(&null).clone();
            keys.into_iter().find_map(|name| difference(&format!("{key}.{name}"), &of(a, name), &of(b, name)))
        }
        _ => (ours != theirs).then(|| (key.into(), ours.to_string(), theirs.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(p_values: Vec<f64>) -> Table {
        let calibration = Calibration {
            format: FORMAT,
            program: program(),
            executable_sha256: String::new(),
            structure: Structure { radar: Radar::small(8), room: true, person: false },
            settings: String::new(),
            nulls: p_values.len(),
            answered: p_values.len(),
            seeds: vec![],
            bounds: vec![1.0; p_values.len()],
            detectors: [("spur".to_string(), vec![0.02])].into(),
            false_alarms: FalseAlarms { level: 0.01, alarms: 0, of: 0, share: 0.0, interval: [0.0, 1.0] },
            uniform_chance: 1.0,
            p_values,
        };
        let bytes = serde_json::to_vec(&calibration).unwrap();
        Table { calibration, bytes }
    }

    #[test]
    fn a_rank_among_nulls_is_a_p_value_and_never_below_what_they_show() {
        let table = table((1..=99).map(|rank| f64::from(rank) / 100.0).collect());
        let of = |raw: f64| table.calibrated(raw, &BTreeMap::new()).p_value();
        assert_eq!([1e-30, 0.005, 0.01, 0.5, 1.0].map(of), [0.01, 0.01, 0.02, 0.51, 1.0]);
        let families = [("spur".to_string(), 1e-9), ("noise".to_string(), 1e-9)].into();
        let calibrated = table.calibrated(0.5, &families);
        assert_eq!(calibrated.detectors, [("spur".to_string(), 0.01), ("noise".to_string(), 0.01)].into());
        assert_eq!(table.calibrated(0.5, &[("spur".to_string(), 0.03)].into()).detectors["spur"], 0.02);
        // A p-value that is twice too small on these nulls is put right.
        let small = super::tests::table((1..=99).map(|rank| f64::from(rank) / 200.0).collect());
        assert_eq!(small.calibrated(0.025, &BTreeMap::new()).p_value(), 0.06);
    }

    #[test]
    fn a_table_survives_its_file_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calibration.json");
        let table = table(vec![0.2, 0.7]);
        std::fs::write(&path, &table.bytes).unwrap();
        // As it is read: the last digit of a number may not survive being written.
        let read: Calibration = serde_json::from_slice(&table.bytes).unwrap();
        assert_eq!(Table::read(&path).unwrap().calibration, read);
        let with = |key: &str, value: serde_json::Value| {
            let mut changed = serde_json::to_value(&table.calibration).unwrap();
            changed[key] = value;
            std::fs::write(&path, changed.to_string()).unwrap();
            Table::read(&path).unwrap_err().to_string()
        };
        assert!(with("format", 2.into()).contains("`format` is 2, expected 1"));
        assert!(with("program", "hybridsim 0".into()).contains("`program` is hybridsim 0"));
        assert!(with("p_values", serde_json::json!([0.7, 0.2])).contains("`p_values`"));
        assert!(with("suspects", serde_json::json!({"spur": [0.7, 0.2]})).contains("`suspects.spur`"));
        assert!(with("suspicion", serde_json::json!([0.7, 0.2])).contains("`suspicion`"));
        assert!(with("seeds", serde_json::json!("none")).contains("calibration.json"));
    }

    #[test]
    fn the_first_key_that_differs_is_named() {
        let [a, b] = [48, 64].map(|samples| {
            let radar = Radar { samples_per_chirp: samples, ..Radar::small(8) };
            serde_json::to_value(Structure { radar, room: true, person: false }).unwrap()
        });
        assert_eq!(difference("structure", &a, &a), None);
        let found = difference("structure", &a, &b).unwrap();
        assert_eq!(found, ("structure.radar.samples_per_chirp".into(), "48".into(), "64".into()));
    }
}
