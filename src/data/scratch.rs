//! Folders in the system's temporary directory for work that leaves nothing there.

use std::fs::{self, File};
use std::path::Path;

use tempfile::TempDir;

use super::leftovers::{locked, orphaned};
use super::unfinished::{Undo, remove_in_use};
use crate::error::{Error, Result};

const PREFIX: &str = ".hybridsim-scratch-";

/// A private folder. It goes with this value, or with the signal that ends the process; where neither is possible, the next
/// process that needs one removes it.
pub struct Scratch {
    folder: TempDir,
    _lock: Option<File>,
    _undo: Undo,
}

impl Scratch {
    /// Makes a folder that is removed on drop, after removing those of dead processes.
    ///
    /// # Errors
    /// A temporary directory that cannot be written.
    pub fn new() -> Result<Self> {
        let parent = std::env::temp_dir();
        sweep(&parent);
        let make = || tempfile::Builder::new().prefix(PREFIX).tempdir_in(&parent);
        let (folder, lock) = locked(make, |folder| File::open(folder.path()), |folder| folder.path().to_path_buf())
            .map_err(|source| Error::write(&parent, source))?;
        let doomed = folder.path().to_path_buf();
        Ok(Self { folder, _lock: lock, _undo: Undo::by(move || remove_in_use(&doomed)) })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes those of dead processes.
fn sweep(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let ours = entry.file_name().as_encoded_bytes().starts_with(PREFIX.as_bytes());
        if ours
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
            && let Some(_lock) = orphaned(&entry.path())
        {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_of_dead_processes_go_and_those_of_living_ones_stay() {
        let parent = tempfile::tempdir().unwrap();
        let of = |name: &str| parent.path().join(format!("{PREFIX}{name}"));
        fs::create_dir_all(of("dead").join("recording")).unwrap();
        fs::create_dir(of("living")).unwrap();
        let lock = File::open(of("living")).unwrap();
        lock.try_lock().unwrap();
        fs::create_dir(parent.path().join("other")).unwrap();
        sweep(parent.path());
        assert_eq!(crate::data::test_support::names(parent.path()), [format!("{PREFIX}living"), "other".into()]);

        let scratch = Scratch::new().unwrap();
        let path = scratch.path().to_path_buf();
        drop(Scratch::new().unwrap());
        assert!(path.is_dir());
        drop(scratch);
        assert!(!path.exists());
    }
}
