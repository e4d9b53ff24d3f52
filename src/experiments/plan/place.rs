//! Where measured recordings come from: a site that a stage records, or a folder of the user's.

use std::path::Path;

use super::{Again, FIRST, Place, Planner};
use crate::data::{entries::entries, files};
use crate::error::{Error, Result};
use crate::experiments::config::SubjectSplit;
use crate::experiments::preflight::Board;
use crate::experiments::stage::{Key, read_record};
use crate::experiments::takes::{Take, read_takes, takes_in};
use crate::experiments::task::Task;
use crate::site::{self, SiteConfig};

impl Planner<'_> {
    /// A site that is recorded, or a folder of recordings.
    pub(super) fn place(&mut self, name: &str, path: &Path) -> Result<Place> {
        if path.is_dir() {
            let recordings = files::absolute(path)?;
            let mut board = None;
            let takes = read_takes(&recordings, &mut |recording| Board::join(&mut board, recording))?;
            let (_, board) = board.expect("no takes are refused");
            let key = Key::new(name, &(&recordings, &takes, contents(&recordings)?), &[]);
            return Ok(Place { stage: None, key, recordings, again: Again::default(), other_mesh: None, takes, board });
        }
        let config = SiteConfig::read(path, &[])?;
        let board = Board::of_site(&config)?;
        if config.unseen.contains(&self.config.split.training) {
            let expected = format!("a subject that {} does not list as unseen", path.display());
            return Err(Error::setting("split.training", &self.config.split.training, expected));
        }
        let settings_folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let again = config.again.clone();
        let other_mesh = self.other_mesh(name, &config, &settings_folder);
        let task = Task::Site { config: Box::new(config.clone()), settings_folder: settings_folder.clone() };
        let stage = self.add(name.into(), vec![], None, task);
        let folder = self.folder(stage);
        // Posing everybody, as the plan of a site does, is not needed again once they are recorded.
        let takes = match read_record(&folder) {
            Some(_) => takes_in(&folder.join("recordings"))?,
            None => planned((self.sequences)(&config, &settings_folder)?),
        };
        let key = self.plan.stages[stage].key.clone();
        Ok(Place {
            stage: Some(stage),
            key,
            recordings: folder.join("recordings"),
            again: Again { folder: folder.join("again"), subjects: again },
            other_mesh,
            takes,
            board,
        })
    }

    /// The compared subjects of the first site as another mesh of the same error has them, and the subject on whom the
    /// receiver's gain is settled.
    pub(super) fn other_mesh(&mut self, name: &str, config: &SiteConfig, settings_folder: &Path) -> Option<usize> {
        if !(self.config.other_mesh && name == FIRST && config.record.mesh_error_m > 0.0) {
            return None;
        }
        let SubjectSplit { training, unseen, .. } = &self.config.split;
        let settled = config.subjects.first()?;
        let compared = |subject: &&String| [training, unseen, settled].contains(subject);
        let mut config = SiteConfig { again: vec![], ..config.clone() };
        config.subjects.retain(|subject| compared(&subject));
        config.unseen.retain(|subject| compared(&subject));
        config.record.redraw += 1;
        let task = Task::Site { config: Box::new(config), settings_folder: settings_folder.to_path_buf() };
        Some(self.add("other_mesh".into(), vec![], None, task))
    }
}

/// The recordings that a site will have, in the order in which [`takes_in`] finds them afterwards: keys depend on it.
pub(super) fn planned(sequences: Vec<site::Sequence>) -> Vec<Take> {
    let take =
        |sequence: site::Sequence| Take { name: sequence.name, subject: sequence.subject, action: sequence.action.name().into() };
    let mut takes: Vec<Take> = sequences.into_iter().map(take).collect();
    takes.sort();
    takes
}

/// Every file below a folder with its size and when it was written: what is changed there is done again.
fn contents(folder: &Path) -> Result<Vec<(String, u64, u128)>> {
    let mut found = vec![];
    let mut folders = vec![folder.to_path_buf()];
    while let Some(at) = folders.pop() {
        for path in entries(&at)? {
            let about = std::fs::metadata(&path).map_err(|error| Error::read(&path, error))?;
            if about.is_dir() {
                folders.push(path);
                continue;
            }
            let written = about.modified().ok().and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
            found.push((name, about.len(), written.map_or(0, |since| since.as_nanos())));
        }
    }
    found.sort();
    Ok(found)
}
