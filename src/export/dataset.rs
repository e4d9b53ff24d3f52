//! Several recordings that are exported into one folder, a shard for each.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::{ExportConfig, Target};
use crate::data::Recording;
use crate::data::entries::{is_recording, recordings_in};
use crate::error::{Error, Result};
use crate::import::capture::boards::Board;
use crate::site::SiteConfig;

/// What is exported, and how.
pub struct Dataset {
    pub target: Target,
    pub board: Option<&'static Board>,
    pub config: ExportConfig,
    /// The label by which recordings are divided.
    pub split_by: Option<String>,
    pub shards: Vec<Shard>,
    /// The folders that were named hold the settings of a site.
    pub from_site: bool,
}

/// A recording of a data set.
pub struct Shard {
    pub name: String,
    pub recording: Recording,
    /// `train`, `validation` or `test`, where they were divided.
    pub split: Option<&'static str>,
}

impl Dataset {
    /// Opens recordings, folders of them and sites; whatever can be refused is refused here.
    ///
    /// # Errors
    /// A folder without recordings, two of one name, one that lacks the label by which they are divided, too few values of it.
    pub fn open(
        sources: &[PathBuf],
        target: Target,
        board: Option<&'static Board>,
        config: ExportConfig,
        split_by: Option<String>,
    ) -> Result<Self> {
        let mut shards: Vec<Shard> = Vec::new();
        let mut unseen = Vec::new();
        let mut from_site = false;
        for source in sources {
            let site = source.join("site.toml");
            if !is_recording(source) && site.is_file() {
                unseen.extend(SiteConfig::read(&site, &[])?.unseen);
                from_site = true;
            }
            for folder in recordings_of(source)? {
                let recording = Recording::open(&folder)?;
                let name = name_of(&recording.folder)?;
                if let Some(other) = shards.iter().find(|other| other.name == name) {
                    return Err(Error::Usage {
                        message: format!(
                            "{} and {}: two recordings of one name",
                            other.recording.folder.display(),
                            folder.display()
                        ),
                        hint: Some("rename one of the folders, or export them one by one".into()),
                    });
                }
                shards.push(Shard { name, recording, split: None });
            }
        }
        let mut dataset = Self { target, board, config, split_by, shards, from_site };
        dataset.divide(&unseen)?;
        Ok(dataset)
    }

    fn divide(&mut self, unseen: &[String]) -> Result<()> {
        let Some(key) = &self.split_by else { return Ok(()) };
        let mut values = Vec::new();
        for shard in &self.shards {
            let labels = &shard.recording.labels;
            values.push(labels.get(key).cloned().ok_or_else(|| {
                let has = labels.keys().cloned().collect::<Vec<_>>().join(", ");
                let has = if has.is_empty() { "no label at all".into() } else { format!("the labels {has}") };
                Error::field(
                    shard.recording.folder.join("recording.toml"),
                    format!("labels.{key}"),
                    "missing",
                    "a text in every recording",
                )
                .with_hint(format!("it has {has}"))
            })?);
        }
        let unseen = if key == "subject" { unseen } else { &[] };
        let distinct: BTreeSet<String> = values.iter().cloned().collect();
        let splits = self.config.split.divide(key, &distinct, unseen)?;
        self.shards.iter_mut().zip(&values).for_each(|(shard, value)| shard.split = Some(splits[value]));
        Ok(())
    }

    /// All frames of all recordings.
    pub fn frames(&self) -> usize {
        self.shards.iter().map(|shard| shard.recording.frames()).sum()
    }

    /// Whether this is more than one recording's files.
    pub fn is_set(&self) -> bool {
        self.shards.len() > 1 || self.split_by.is_some() || self.from_site
    }
}

/// A recording, the recordings of a folder, or those of a site.
fn recordings_of(source: &Path) -> Result<Vec<PathBuf>> {
    if is_recording(source) || source.is_file() {
        return Ok(vec![source.into()]);
    }
    let within = source.join("recordings");
    let found = recordings_in(if within.is_dir() { &within } else { source })?;
    if found.is_empty() {
        return Err(Error::Usage {
            message: format!("{}: neither a recording, a folder of recordings nor a site", source.display()),
            hint: Some("a recording is a folder with recording.toml; hybridsim import and record make one".into()),
        });
    }
    Ok(found)
}

/// The name of the folder, wherever it was seen from.
fn name_of(folder: &Path) -> Result<String> {
    let whole = folder.canonicalize().map_err(|source| Error::read(folder, source))?;
    Ok(whole.file_name().map_or_else(|| "recording".into(), |name| name.to_string_lossy().into_owned()))
}
