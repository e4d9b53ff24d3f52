//! Bringing files and folders to the disk before they get their names.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Every file and folder in a folder, and the folder itself.
pub(super) fn sync_tree(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let kind = entry.file_type()?;
        if kind.is_dir() {
            sync_tree(&entry.path())?;
        } else if kind.is_file() {
            sync_file(&File::open(entry.path())?, &entry.path())?;
        }
    }
    sync_folder(folder);
    Ok(())
}

pub(super) fn sync_file(file: &File, path: &Path) -> io::Result<()> {
    note(path);
    file.sync_all()
}

/// The names in a folder. Some systems cannot; there they are as safe as that system makes them.
pub(super) fn sync_folder(folder: &Path) {
    note(folder);
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

#[cfg(not(test))]
fn note(_: &Path) {}

#[cfg(test)]
fn note(path: &Path) {
    SYNCED.with_borrow_mut(|synced| synced.push(path.to_path_buf()));
}

#[cfg(test)]
thread_local! {
    /// What this thread has brought to the disk, in order.
    pub(super) static SYNCED: std::cell::RefCell<Vec<std::path::PathBuf>> = const { std::cell::RefCell::new(vec![]) };
}
