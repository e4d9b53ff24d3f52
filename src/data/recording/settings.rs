//! `recording.toml`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serialize};

use super::check_placement;
use crate::data::settings::read_toml;
use crate::error::{Error, Result};
use crate::person::Placement;
use crate::radar::Radar;
use crate::room::Room;

/// The version of the contract that is read and written.
pub const FORMAT: i64 = 1;

/// All that `recording.toml` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingSettings {
    pub format: i64,
    pub radar: Radar,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<Room>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Placement>,
    pub files: Files,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty", deserialize_with = "texts")]
    pub labels: BTreeMap<String, String>,
}

/// Which files hold what, relative to the recording's folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Files {
    #[serde(rename = "if")]
    pub samples: PathBuf,
    /// Which chirps were recorded; absent: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertices: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faces: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_times: Option<PathBuf>,
}

impl RecordingSettings {
    /// Reads and checks the settings; errors name the file.
    pub(super) fn read(path: &Path) -> Result<Self> {
        // The version first: another one may have other keys.
        let table: toml::Table = read_toml(path)?;
        if let Some(format) = table.get("format").filter(|format| format.as_integer() != Some(FORMAT)) {
            return Err(Error::field(path, "format", format.to_string(), FORMAT.to_string())
                .with_hint("the recording was written for another version of this program"));
        }
        let settings: Self = read_toml(path)?;
        settings.radar.check("radar").map_err(|error| error.in_file(path))?;
        if let Some(room) = &settings.room {
            room.check("room").map_err(|error| error.in_file(path))?;
        }
        if let Some(placement) = &settings.motion {
            check_placement(path, placement)?;
        }
        Ok(settings)
    }
}

/// Labels are free: numbers and switches are taken as their text.
fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<BTreeMap<String, String>, D::Error> {
    let table = BTreeMap::<String, toml::Value>::deserialize(deserializer)?;
    let text = |(key, value): (String, toml::Value)| match value {
        toml::Value::String(text) => Ok((key, text)),
        toml::Value::Table(_) | toml::Value::Array(_) => {
            Err(serde::de::Error::custom(format!("the label `{key}` is no text, number or switch")))
        }
        other => Ok((key, other.to_string())),
    };
    table.into_iter().map(text).collect()
}
