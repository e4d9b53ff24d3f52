//! What folders hold.

use std::path::{Path, PathBuf};

use crate::data::files;
use crate::error::{Error, Result};

/// The settings of a recording, by which a folder is one.
pub const SETTINGS_FILE: &str = "recording.toml";

/// Whether a name begins with a dot. Such names are no data anywhere: temporaries of writers that were killed have them,
/// and so have the files that systems leave in every folder.
pub fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// Everything in a folder that is not hidden, in the order of the names.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = std::fs::read_dir(folder).map_err(|source| Error::read(folder, source))?;
    let mut found = list
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<std::io::Result<Vec<PathBuf>>>()
        .map_err(|source| Error::read(folder, source))?;
    found.retain(|path| !is_hidden(path));
    found.sort();
    Ok(found)
}

/// Whether a folder is a recording.
pub fn is_recording(folder: &Path) -> bool {
    folder.join(SETTINGS_FILE).is_file()
}

/// The recordings in a folder, in the order of their names, all of which are text.
pub fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let found: Vec<PathBuf> = entries(folder)?.into_iter().filter(|path| is_recording(path)).collect();
    found.iter().try_for_each(files::utf8)?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_names_are_no_data() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b", "a", ".a.hybridsim-partial-abcdef", ".git"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
            std::fs::write(folder.path().join(name).join(SETTINGS_FILE), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("c")).unwrap();
        let names = |paths: Vec<PathBuf>| -> Vec<String> {
            paths.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect()
        };
        assert_eq!(names(entries(folder.path()).unwrap()), ["a", "b", "c"]);
        assert_eq!(names(recordings_in(folder.path()).unwrap()), ["a", "b"]);
        assert!(entries(&folder.path().join("nowhere")).is_err());
    }
}
