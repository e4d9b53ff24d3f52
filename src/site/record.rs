//! Recording a site, in parts, again and again until it is whole.

use std::fs;
use std::path::{Path, PathBuf};

use super::config::SiteConfig;
use super::plan::{self, Sequence, sequences_for};
use crate::data::atomic::{sweep_all, write_text};
use crate::data::{Recording, Shard, files};
use crate::error::{Error, Result};
use crate::recorder::{Labels, RecorderConfig, write_world};

/// What has been done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Site {
    /// Sequences of the shard, and of the site.
    pub sequences: usize,
    pub of: usize,
    /// Recordings that were there already.
    pub kept: usize,
    pub recorded: usize,
}

/// A recording to make: where, with what.
struct Job {
    folder: PathBuf,
    /// The settings beside it, a text that must agree when the recording exists.
    settings_file: PathBuf,
    settings: String,
    recorder: RecorderConfig,
    labels: Labels,
}

/// Records the sequences of a shard into `out`: `recordings/<name>/`, `again/<name>/` for the subjects in
/// `again`, `settings/…/<name>.toml` with each recording's resolved settings, and `site.toml`.
///
/// Recordings that are there are kept if their settings agree; sequences may be added to a site, never changed.
/// `progress` receives how many of how many recordings are done, and the name of the next, at each of its frames.
///
/// # Errors
/// Whatever [`super::sequences`] refuses of the shard's sequences; a recording made with other settings or with labels that are not its name's. All of
/// this before the first is recorded.
pub fn record(
    config: &SiteConfig,
    settings_folder: &Path,
    out: &Path,
    shard: Shard,
    progress: &mut dyn FnMut(usize, usize, &str),
) -> Result<Site> {
    let all = sequences_for(config, settings_folder, shard)?;
    let mine: Vec<&Sequence> = all.iter().enumerate().filter(|(index, _)| shard.holds(*index)).map(|(_, one)| one).collect();
    let mut jobs = Vec::new();
    for sequence in &mine {
        jobs.push(job(out, "recordings", sequence, sequence.recorder.clone()));
        if config.again.contains(&sequence.subject) {
            jobs.push(job(out, "again", sequence, plan::again(config, sequence)));
        }
    }
    let count = jobs.len();
    let mut open = Vec::new();
    for job in jobs {
        if !job.is_there()? {
            open.push(job);
        }
    }
    sweep_all(out);
    for folder in ["settings/recordings", "settings/again"] {
        let folder = out.join(folder);
        fs::create_dir_all(&folder).map_err(|source| Error::write(&folder, source))?;
    }
    write_text(out.join("site.toml"), &config.to_toml())?;
    let (kept, recorded) = (count - open.len(), open.len());
    for (index, job) in open.into_iter().enumerate() {
        let name = job.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut within = |_, _| progress(kept + index, count, &name);
        // The settings first: a recording never stands beside those of another.
        write_text(&job.settings_file, &job.settings)?;
        write_world(&job.recorder.world(settings_folder)?, job.labels, &job.folder, &mut within)?;
    }
    progress(count, count, "");
    Ok(Site { sequences: mine.len(), of: all.len(), kept, recorded })
}

fn job(out: &Path, take: &str, sequence: &Sequence, recorder: RecorderConfig) -> Job {
    let labels = [
        ("subject", sequence.subject.clone()),
        ("action", sequence.action.name().into()),
        ("repetition", sequence.repetition.to_string()),
    ];
    let text = toml::to_string_pretty(&recorder).expect("settings are plain data");
    Job {
        folder: out.join(take).join(&sequence.name),
        settings_file: out.join("settings").join(take).join(format!("{}.toml", sequence.name)),
        settings: format!("# recorded by hybridsim {}\n{text}", env!("CARGO_PKG_VERSION")),
        recorder,
        labels: labels.into_iter().map(|(key, value)| (key.to_string(), value)).collect(),
    }
}

impl Job {
    /// Whether the recording exists as it should be; one that is something else is refused.
    fn is_there(&self) -> Result<bool> {
        if !self.folder.join("recording.toml").is_file() {
            return Ok(false);
        }
        let hint = "record into another folder, or remove this recording";
        let found = files::read_text(&self.settings_file)?;
        if let Some((was, is)) = found.lines().zip(self.settings.lines()).find(|(was, is)| was != is) {
            return Err(Error::field(&self.settings_file, "the settings", format!("`{was}`"), format!("`{is}`")).with_hint(hint));
        }
        if found != self.settings {
            return Err(Error::field(&self.settings_file, "the settings", "of another length", "the site's").with_hint(hint));
        }
        let labels = Recording::open(&self.folder)?.labels;
        if labels != self.labels {
            let file = self.folder.join("recording.toml");
            return Err(Error::field(file, "labels", format!("{labels:?}"), format!("{:?}", self.labels)).with_hint(hint));
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests;
