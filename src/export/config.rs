//! What may be chosen of an export, beside its target: `--set KEY=VALUE`.

use serde::{Deserialize, Serialize};
use toml::Table;

use super::{capture_files::CaptureConfig, maps::MapsConfig, points::PointsConfig, split::SplitConfig};
use crate::data::settings::settings_from_table;
use crate::error::Result;

/// The settings of all targets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExportConfig {
    pub capture: CaptureConfig,
    pub maps: MapsConfig,
    pub points: PointsConfig,
    pub split: SplitConfig,
}

impl ExportConfig {
    /// The defaults, changed by `sets`, each `a.b=value`.
    ///
    /// # Errors
    /// Unknown keys, values of another type or beyond what can be.
    pub fn new(sets: &[String]) -> Result<Self> {
        let table = Table::try_from(Self::default()).expect("settings are plain data");
        let config: Self = settings_from_table(table, "--set", sets)?;
        config.capture.check()?;
        config.maps.check()?;
        config.points.check()?;
        config.split.check()?;
        Ok(config)
    }
}
