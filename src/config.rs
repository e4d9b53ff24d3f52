//! One experiment as one TOML file: the parts' settings gathered, read and checked.

use std::path::{Path, PathBuf};

use burn::tensor::Device;
use serde::{Deserialize, Serialize};

use crate::{
    data::settings,
    diagnosis::DiagnosisConfig,
    error::{Error, Result},
    recorder::RecorderConfig,
    simulator::SimulatorConfig,
    training::{LoadedRecording, Trainer, TrainingConfig, site_from},
};

/// What a config file may hold. Every section has defaults but one of `data` and `record` must say what to learn from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    pub seed: u64,
    pub data: DataConfig,
    pub simulator: SimulatorConfig,
    pub training: TrainingConfig,
    pub diagnosis: DiagnosisConfig,
    /// A recording to make, where none is at hand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<RecorderConfig>,
}

/// Which recordings an experiment is made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DataConfig {
    /// Recording folders, relative to the config file's folder; those of `--set` to the working folder.
    pub recordings: Vec<PathBuf>,
}

impl Config {
    /// What trains as this config says; `config_toml` is its resolved text.
    ///
    /// # Errors
    /// A checkpoint to start from that cannot be read.
    pub fn trainer<'a>(
        &'a self,
        recordings: &'a [LoadedRecording],
        config_toml: &'a str,
        folder: &'a Path,
        devices: &'a [Device],
    ) -> Result<Trainer<'a>> {
        Ok(Trainer {
            config: &self.training,
            simulator_config: &self.simulator,
            seed: self.seed,
            recordings,
            site: site_from(recordings, &self.simulator, self.training.start_from.as_deref())?,
            config_toml,
            folder,
            devices,
        })
    }

    /// Reads a config file with its `extends` parents, changed by `--set key=value`.
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let mut config: Self = settings::read_settings(path, sets)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for path in &mut config.data.recordings {
            settings::place_path(path, "data.recordings", folder, sets)?;
        }
        let person = config.record.as_mut().map(|record| &mut record.person);
        let (body, motion) = person.map_or((None, None), |person| (person.body.as_mut(), person.motion.as_mut()));
        // Those of a recording are found beside the file when it is made.
        let later = Path::new("");
        for (key, folder, path) in [
            ("training.start_from", folder, config.training.start_from.as_mut()),
            ("diagnosis.calibration", folder, config.diagnosis.calibration.as_mut()),
            ("record.person.body", later, body),
            ("record.person.motion", later, motion),
        ] {
            path.map_or(Ok(()), |path| settings::place_path(path, key, folder, sets))?;
        }
        config.training.check()?;
        config.simulator.check()?;
        config.diagnosis.check()?;
        Ok(config)
    }

    /// The settings that apply without a file, changed by `--set key=value`.
    pub fn defaults(sets: &[String]) -> Result<Self> {
        let config: Self = settings::settings_from_table(toml::Table::new(), "the defaults", sets)?;
        config.training.check()?;
        config.simulator.check()?;
        config.diagnosis.check()?;
        Ok(config)
    }

    /// The resolved configuration, as kept beside each result.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("settings are plain data")
    }

    /// The `[record]` section, or what to do without it.
    pub fn record(&self, path: &Path) -> Result<&RecorderConfig> {
        self.record.as_ref().ok_or_else(|| {
            Error::field(path, "record", "missing", "a [record] section").with_hint(
                "name recordings that exist, `--set 'data.recordings=[\"DIR\"]'`; or write a [record] section, such as that of \
                     configs/quickstart.toml",
            )
        })
    }
}
