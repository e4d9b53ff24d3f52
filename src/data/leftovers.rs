//! The names of temporaries, and what becomes of those whose writer is dead.
//!
//! A temporary is `.NAME.hybridsim-partial-XXXXXX` beside its target (`.hybridsim-partial-XXXXXX` inside a folder that is
//! filled in place). Its writer holds a lock on it, which the system releases with the process. Making and locking it are
//! two steps, between which it looks forgotten; so whoever removes one holds its lock, and a writer that finds its own
//! gone or locked makes another.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// A file or folder that is being written.
pub(super) const PARTIAL: &str = ".hybridsim-partial-";
/// A whole folder whose entries are being moved to where they belong.
pub(super) const READY: &str = ".hybridsim-ready-";
/// A folder that gives way to another one.
pub(super) const OLD: &str = ".hybridsim-old-";
const LOCK: &str = ".hybridsim-lock";

/// The lock of a folder, beside it under its name or inside it under none.
pub(crate) fn lock_name(name: Option<&OsStr>) -> OsString {
    marked(name.unwrap_or_default(), LOCK)
}

/// `.NAME` and a mark, which begins with a dot itself.
fn marked(name: &OsStr, mark: &str) -> OsString {
    let mut text = OsString::new();
    if !name.is_empty() {
        text.push(".");
        text.push(name);
    }
    text.push(mark);
    text
}

/// What a temporary's name begins with. `None`: for one inside a folder.
pub(super) fn prefix(name: Option<&OsStr>, mark: &str) -> OsString {
    marked(name.unwrap_or_default(), mark)
}

pub(crate) fn parent_of(target: &Path) -> &Path {
    target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Everything beside `target` that is named `.NAME` and the mark.
pub(super) fn siblings(target: &Path, mark: &str) -> Vec<PathBuf> {
    let prefix = prefix(target.file_name(), mark);
    let Ok(entries) = fs::read_dir(parent_of(target)) else { return vec![] };
    let named = |entry: &fs::DirEntry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes());
    entries.flatten().filter(named).map(|entry| entry.path()).collect()
}

/// Makes a temporary and locks it. The lock lasts as long as the handle; there is none where nothing can be locked.
pub(crate) fn locked<T>(
    make: impl Fn() -> io::Result<T>,
    open: impl Fn(&T) -> io::Result<File>,
    path: impl Fn(&T) -> PathBuf,
) -> io::Result<(T, Option<File>)> {
    loop {
        let made = make()?;
        let Ok(handle) = open(&made) else {
            // Swept already, or a system that opens no folders.
            if path(&made).exists() {
                return Ok((made, None));
            }
            continue;
        };
        match handle.try_lock() {
            // Being swept.
            Err(TryLockError::WouldBlock) => continue,
            Err(TryLockError::Error(_)) => return Ok((made, None)),
            Ok(()) if path(&made).exists() => return Ok((made, Some(handle))),
            Ok(()) => continue,
        }
    }
}

/// Whether a file is still what its path leads to.
pub(crate) fn is_linked(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let id = |metadata: &fs::Metadata| (metadata.dev(), metadata.ino());
        matches!((file.metadata(), fs::metadata(path)), (Ok(open), Ok(named)) if id(&open) == id(&named))
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

/// The lock of something whose writer is dead; `None` where it lives, or where that cannot be known.
pub(crate) fn orphaned(path: &Path) -> Option<File> {
    // A pipe would be waited for.
    let ordinary = path.symlink_metadata().is_ok_and(|metadata| metadata.is_dir() || metadata.is_file());
    ordinary.then(|| File::open(path).ok()).flatten().filter(|handle| handle.try_lock().is_ok() && is_linked(handle, path))
}

/// Removes what dead writers of `target` left beside it, and an old version once there is a newer one.
pub(super) fn remove_beside(target: &Path) {
    siblings(target, PARTIAL).iter().for_each(|path| remove(path));
    if target.exists() {
        siblings(target, OLD).iter().for_each(|path| drop(fs::remove_dir_all(path)));
    }
}

/// Removes a temporary, unless its writer lives.
fn remove(path: &Path) {
    if let Some(_lock) = orphaned(path) {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
}

/// Removes what dead writers left in a folder. A folder that was complete and about to be published is published.
pub fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        sweep_entry(&entry);
    }
}

/// The same for the folders below it, too.
pub fn sweep_all(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        // Not through links.
        if !hidden && entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            sweep_all(&entry.path());
        } else {
            sweep_entry(&entry);
        }
    }
}

fn sweep_entry(entry: &fs::DirEntry) {
    let (name, path) = (entry.file_name(), entry.path());
    let Some(name) = name.to_str().filter(|name| name.starts_with('.')) else { return };
    if name.contains(PARTIAL) || name.ends_with(LOCK) {
        remove(&path);
    } else if name.starts_with(READY) {
        if let Some(_lock) = orphaned(&path) {
            let _ = move_out(&path);
        }
    } else if let Some(end) = name.find(OLD) {
        // Without a newer one it is the only one: `recover` brings it back.
        if path.with_file_name(&name[1..end]).exists() {
            let _ = fs::remove_dir_all(&path);
        }
    }
}

/// Moves the entries of a folder into the one around it: settings last, for a folder without them is no recording.
pub(super) fn move_out(ready: &Path) -> io::Result<()> {
    let mut entries = fs::read_dir(ready)?.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(|path| (path.extension().is_some_and(|extension| extension == "toml"), path.clone()));
    for entry in entries {
        fs::rename(&entry, parent_of(ready).join(named(&entry)?))?;
    }
    fs::remove_dir(ready)
}

/// The last part of a path.
pub(super) fn named(target: &Path) -> io::Result<&std::ffi::OsStr> {
    target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no name at its end"))
}
