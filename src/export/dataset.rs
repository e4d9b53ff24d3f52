//! Several recordings in one folder: a shard for each, `labels.csv` and `card.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::{ExportConfig, Source, Target, card};
use crate::data::Recording;
use crate::data::atomic::write_text;
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

/// Writes a data set into a folder that is there: a recording's files alone, or `NAME/` for every recording with `labels.csv` and
/// `card.md`. `progress` receives how many frames are done, and of which recording. The notes name the recordings that they are of.
///
/// # Errors
/// What the target refuses, samples that cannot be read, files that cannot be written.
pub fn write_dataset(dataset: &Dataset, folder: &Path, progress: &mut dyn FnMut(usize, &str)) -> Result<Vec<String>> {
    let mut notes: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut before = 0;
    for shard in &dataset.shards {
        let place = if dataset.is_set() { folder.join(&shard.name) } else { folder.to_path_buf() };
        fs::create_dir_all(&place).map_err(|source| Error::write(&place, source))?;
        let mut source = Source {
            recording: &shard.recording,
            name: shard.name.clone(),
            board: dataset.board,
            config: &dataset.config,
            progress: &mut |done| progress(before + done, &shard.name),
        };
        let file = shard.recording.folder.join("recording.toml");
        let found = dataset.target.write(&mut source, &place).map_err(|error| match &error {
            Error::Setting { key, .. } if key.starts_with("radar.") => error.in_file(file),
            _ => error,
        })?;
        found.into_iter().for_each(|note| notes.entry(note).or_default().push(&shard.name));
        before += shard.recording.frames();
    }
    let all = dataset.shards.len();
    let told: Vec<String> = notes
        .into_iter()
        .map(|(note, of)| match of.len() {
            count if count == all => note,
            1 => format!("{}: {note}", of[0]),
            count => format!("{} and {} more recordings: {note}", of[0], count - 1),
        })
        .collect();
    if dataset.is_set() {
        write_text(folder.join("labels.csv"), &labels_csv(dataset))?;
        write_text(folder.join("card.md"), &card::text(dataset, &told))?;
    }
    Ok(told)
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

/// One line for each recording; texts are quoted as RFC 4180 has it.
fn labels_csv(dataset: &Dataset) -> String {
    const OWN: [&str; 4] = ["recording", "split", "frames", "duration_s"];
    let keys: BTreeSet<&String> = dataset.shards.iter().flat_map(|shard| shard.recording.labels.keys()).collect();
    let title = |key: &&String| if OWN.contains(&key.as_str()) { format!("label_{key}") } else { key.to_string() };
    let mut rows = vec![OWN.iter().map(ToString::to_string).chain(keys.iter().map(title)).collect::<Vec<_>>()];
    for Shard { name, recording, split } in &dataset.shards {
        let duration_s = recording.frames() as f64 * recording.radar.frame_period_s;
        let mut row =
            vec![name.clone(), split.unwrap_or_default().into(), recording.frames().to_string(), format!("{duration_s:.6}")];
        row.extend(keys.iter().map(|key| recording.labels.get(*key).cloned().unwrap_or_default()));
        rows.push(row);
    }
    let line = |row: Vec<String>| row.iter().map(|field| quoted(field)).collect::<Vec<_>>().join(",") + "\r\n";
    rows.into_iter().map(line).collect()
}

fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_with_a_comma_or_a_quote_is_quoted() {
        assert_eq!(quoted("walk"), "walk");
        assert_eq!(quoted("sit, \"slowly\""), "\"sit, \"\"slowly\"\"\"");
    }
}
