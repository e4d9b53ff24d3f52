//! The recordings of a site, by who does what in them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::data::{Recording, entries};
use crate::error::{Error, Result};

/// One recording of a site.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Take {
    pub name: String,
    pub subject: String,
    pub action: String,
}

/// The recordings in a folder's folders, in the order of their names.
///
/// # Errors
/// A folder without any; a recording that cannot be read or lacks one of the labels.
pub fn takes_in(folder: &Path) -> Result<Vec<Take>> {
    read_takes(folder, &mut |_| Ok(()))
}

/// The same; `look` sees every recording while it is open.
pub fn read_takes(folder: &Path, look: &mut dyn FnMut(&Recording) -> Result<()>) -> Result<Vec<Take>> {
    let found = entries::recordings_in(folder)?;
    if found.is_empty() {
        return Err(Error::Usage {
            message: format!("{}: holds no recordings", folder.display()),
            hint: Some("name a folder whose folders are recordings, or the config of a site".into()),
        });
    }
    let mut read = |path: &PathBuf| {
        let recording = Recording::open(path)?;
        let take = take(path, &recording)?;
        look(&recording)?;
        Ok(take)
    };
    found.iter().map(&mut read).collect()
}

fn take(folder: &Path, recording: &Recording) -> Result<Take> {
    let label = |name: &str| {
        recording.labels.get(name).cloned().ok_or_else(|| {
            Error::field(folder.join("recording.toml"), format!("labels.{name}"), "missing", format!("the {name}"))
        })
    };
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Take { name, subject: label("subject")?, action: label("action")? })
}

/// Whether a site can be split as asked for.
///
/// # Errors
/// A subject that nobody recorded; an action of the unseen subject that the training subject does not show.
pub fn check_split(takes: &[Take], training: &str, unseen: &str, additional: Option<&str>) -> Result<()> {
    let subjects: BTreeSet<&str> = takes.iter().map(|take| take.subject.as_str()).collect();
    let names = subjects.iter().copied().collect::<Vec<_>>().join(", ");
    let unseen = [("split.unseen", unseen)].into_iter().chain(additional.map(|subject| ("split.additional", subject)));
    for (key, subject) in std::iter::once(("split.training", training)).chain(unseen.clone()) {
        if !subjects.contains(subject) {
            return Err(Error::setting(key, subject, format!("one of the site's subjects: {names}")));
        }
    }
    let actions = |subject: &str| -> BTreeSet<&str> {
        takes.iter().filter(|take| take.subject == subject).map(|take| take.action.as_str()).collect()
    };
    for (key, subject) in unseen {
        if let Some(strange) = actions(subject).difference(&actions(training)).next() {
            let found = format!("{subject}, who does `{strange}`");
            return Err(Error::setting(key, found, format!("only what {training} does")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_needs_both_subjects_and_their_actions() {
        let take = |subject: &str, action: &str| Take { name: String::new(), subject: subject.into(), action: action.into() };
        let takes = [take("s1", "lunge"), take("s2", "lunge"), take("s3", "arm_swing")];
        assert!(check_split(&takes, "s1", "s2", None).is_ok());
        let error = check_split(&takes, "s1", "s9", None).unwrap_err().to_string();
        assert!(error.contains("`split.unseen` is s9") && error.contains("s1, s2, s3"), "{error}");
        assert!(check_split(&takes, "s1", "s3", None).unwrap_err().to_string().contains("arm_swing"));
        let error = check_split(&takes, "s1", "s2", Some("s3")).unwrap_err().to_string();
        assert!(error.contains("`split.additional`") && error.contains("arm_swing"), "{error}");
    }

    #[test]
    fn a_folder_without_recordings_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(takes_in(folder.path()).unwrap_err().to_string().contains("holds no recordings"));
    }
}
