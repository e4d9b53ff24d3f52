//! Files and folders that are either whole or absent.
//!
//! Everything is written under a temporary name beside its target, `.NAME.partial-XXXX`, brought to the disk, and
//! only then renamed. An error or a drop removes the temporary. A killed process cannot; it leaves the temporary,
//! never a half-written target, and the next writer of the same target removes it: a writer holds a lock on its
//! temporary, which the system releases with the process, so an unlocked one belongs to nobody.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tempfile::{NamedTempFile, TempDir};

use crate::error::{Error, Result};

/// A file that appears under its name when `finish` is called, and not at all otherwise.
pub struct AtomicFile {
    target: PathBuf,
    file: BufWriter<NamedTempFile>,
}

impl AtomicFile {
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref().to_path_buf();
        let write_error = |source| Error::write(&target, source);
        let parent = parent_of(&target);
        remove_leftovers(&target);
        let prefix = temporary_prefix(&target, "partial").map_err(write_error)?;
        let file = builder(&prefix, 0o666).tempfile_in(parent).map_err(write_error)?;
        // Without a lock (a file system that has none) leftovers of a killed process merely stay.
        let _ = file.as_file().try_lock();
        Ok(Self { file: BufWriter::with_capacity(1 << 20, file), target })
    }

    /// Brings the content to the disk and gives it its name, replacing what had it before.
    pub fn finish(self) -> Result<()> {
        let Self { target, file } = self;
        let result = file
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| file.as_file().sync_all().map(|()| file))
            .and_then(|file| file.persist(&target).map_err(|error| error.error));
        result.map(drop).map_err(|source| Error::write(&target, source))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a whole file through `fill`; when that fails, whatever was at `target` before is still there.
pub fn write_file(target: impl AsRef<Path>, fill: impl FnOnce(&mut AtomicFile) -> io::Result<()>) -> Result<()> {
    let mut file = AtomicFile::create(&target)?;
    fill(&mut file).map_err(|source| Error::write(&target, source))?;
    file.finish()
}

pub fn write_text(target: impl AsRef<Path>, text: &str) -> Result<()> {
    write_file(target, |file| file.write_all(text.as_bytes()))
}

/// A folder that is filled under a temporary name and appears under its own when `finish` is called.
pub struct AtomicFolder {
    target: PathBuf,
    folder: TempDir,
    /// Held until the folder has its name or is gone; absent where folders cannot be locked.
    _lock: Option<File>,
    replace: bool,
}

impl AtomicFolder {
    /// For a folder that must not exist yet, or be empty. Creates the folders above it.
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref();
        if fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_some()) || target.is_file() {
            return Err(Error::Usage {
                message: format!("{}: exists already and is not an empty folder", target.display()),
                hint: Some("choose another folder, or remove this one first".into()),
            });
        }
        Self::begin(target, false)
    }

    /// For a folder that takes the place of an older one. Between taking the old one away and naming the new one
    /// a killed process leaves neither; `recover` then brings the old one back.
    pub fn replacing(target: impl AsRef<Path>) -> Result<Self> {
        recover(&target)?;
        Self::begin(target.as_ref(), true)
    }

    fn begin(target: &Path, replace: bool) -> Result<Self> {
        let write_error = |source| Error::write(target, source);
        let parent = parent_of(target);
        fs::create_dir_all(parent).map_err(write_error)?;
        remove_leftovers(target);
        let prefix = temporary_prefix(target, "partial").map_err(write_error)?;
        let folder = builder(&prefix, 0o777).tempdir_in(parent).map_err(write_error)?;
        let lock = File::open(folder.path()).ok().filter(|handle| handle.try_lock().is_ok());
        Ok(Self { target: target.to_path_buf(), folder, _lock: lock, replace })
    }

    /// Where to put the files for now.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder its name.
    pub fn finish(self) -> Result<()> {
        let Self { target, folder, _lock, replace } = self;
        let write_error = |source| Error::write(&target, source);
        let old = replace.then(|| take_away(&target)).transpose().map_err(write_error)?.flatten();
        // An empty folder may stand at the target; some systems rename over it, some do not.
        let _ = fs::remove_dir(&target);
        if let Err(source) = fs::rename(folder.path(), &target) {
            if let Some(old) = old {
                let _ = fs::rename(old, &target);
            }
            return Err(write_error(source));
        }
        // The temporary name is gone: nothing is left to remove.
        let _ = folder.keep();
        if let Some(old) = old {
            let _ = fs::remove_dir_all(old);
        }
        Ok(())
    }
}

/// Brings back a folder whose replacement was killed between the two renames; call it before reading one that
/// `AtomicFolder::replacing` writes.
pub fn recover(target: impl AsRef<Path>) -> Result<()> {
    let target = target.as_ref();
    if target.exists() {
        return Ok(());
    }
    match siblings(target, "old").into_iter().next() {
        Some(old) => fs::rename(old, target).map_err(|source| Error::write(target, source)),
        None => Ok(()),
    }
}

/// Renames what is at `target` to `.NAME.old-…`; `None` where nothing is.
fn take_away(target: &Path) -> io::Result<Option<PathBuf>> {
    let prefix = temporary_prefix(target, "old")?;
    // A temporary folder reserves a name that nobody else uses; renaming needs the name free again.
    let reserved = builder(&prefix, 0o777).tempdir_in(parent_of(target))?.path().to_path_buf();
    match fs::rename(target, &reserved) {
        Ok(()) => Ok(Some(reserved)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Removes what killed writers of `target` left: temporaries that are not new and that nobody holds a lock on.
fn remove_leftovers(target: &Path) {
    let forgotten = |path: &Path| {
        let modified = path.metadata().and_then(|metadata| metadata.modified()).unwrap_or_else(|_| SystemTime::now());
        // Between making a temporary and locking it lies an instant in which it looks forgotten.
        let settled = modified.elapsed().is_ok_and(|age| age > Duration::from_secs(60));
        settled && File::open(path).is_ok_and(|handle| handle.try_lock().is_ok())
    };
    for path in siblings(target, "partial").into_iter().filter(|path| forgotten(path)) {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    if target.exists() {
        siblings(target, "old").into_iter().for_each(|path| drop(fs::remove_dir_all(path)));
    }
}

/// Everything beside `target` that is named `.NAME.<what>-…`.
fn siblings(target: &Path, what: &str) -> Vec<PathBuf> {
    let Ok(prefix) = temporary_prefix(target, what) else { return vec![] };
    let Ok(entries) = fs::read_dir(parent_of(target)) else { return vec![] };
    let named = |entry: &fs::DirEntry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes());
    entries.flatten().filter(named).map(|entry| entry.path()).collect()
}

fn temporary_prefix(target: &Path, what: &str) -> io::Result<OsString> {
    let name = target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no name at its end"))?;
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(format!(".{what}-"));
    Ok(prefix)
}

fn parent_of(target: &Path) -> &Path {
    target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporaries are private by default; results have the permissions of any other file, less the umask.
fn builder(prefix: &OsString, mode: u32) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_support::names;

    #[test]
    fn a_file_appears_whole_and_leaves_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        let mut file = AtomicFile::create(&target).unwrap();
        file.write_all(b"half").unwrap();
        file.flush().unwrap();
        assert!(!target.exists());
        file.write_all(b" and half").unwrap();
        file.finish().unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "half and half");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_writer_that_fails_leaves_the_old_file_and_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        write_text(&target, "old").unwrap();
        let error = write_file(&target, |file| {
            file.write_all(&vec![0; 3 << 20])?;
            Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"))
        })
        .unwrap_err();
        assert_eq!(error.to_string(), format!("{}: cannot be written: no space left on device", target.display()));
        assert!(error.hint().unwrap().contains("nothing half-written was left"));
        assert_eq!(fs::read_to_string(&target).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.bin");
        let mut full = File::options().write(true).open("/dev/full").unwrap();
        let error = write_file(&target, |_| full.write_all(&[1; 64])).unwrap_err();
        assert!(matches!(&error, Error::Write { path, source } if *path == target && source.kind() == io::ErrorKind::StorageFull));
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_folder_that_cannot_be_written_into_is_an_error() {
        let error = write_text("/no/such/folder/a.txt", "x").unwrap_err();
        assert!(error.to_string().starts_with("/no/such/folder/a.txt: cannot be written: "), "{error}");
        assert!(matches!(AtomicFile::create("/"), Err(Error::Write { .. })));
    }

    #[test]
    fn a_dropped_folder_vanishes_and_a_finished_one_appears_whole() {
        let parent = tempfile::tempdir().unwrap();
        let target = parent.path().join("above").join("recording");
        let folder = AtomicFolder::create(&target).unwrap();
        write_text(folder.path().join("a.txt"), "x").unwrap();
        drop(folder);
        assert!(names(target.parent().unwrap()).is_empty());

        let folder = AtomicFolder::create(&target).unwrap();
        write_text(folder.path().join("a.txt"), "x").unwrap();
        assert!(!target.exists());
        folder.finish().unwrap();
        assert_eq!(names(target.parent().unwrap()), ["recording"]);
        assert_eq!(names(&target), ["a.txt"]);
    }

    #[test]
    fn a_folder_with_something_in_it_is_not_overwritten() {
        let parent = tempfile::tempdir().unwrap();
        write_text(parent.path().join("a.txt"), "x").unwrap();
        let error = AtomicFolder::create(parent.path()).err().unwrap();
        assert_eq!(error.to_string(), format!("{}: exists already and is not an empty folder", parent.path().display()));
    }

    #[test]
    fn a_replaced_folder_is_the_old_or_the_new_one() {
        let parent = tempfile::tempdir().unwrap();
        let target = parent.path().join("last");
        for text in ["first", "second"] {
            let folder = AtomicFolder::replacing(&target).unwrap();
            write_text(folder.path().join(text), text).unwrap();
            folder.finish().unwrap();
            assert_eq!(names(&target), [text]);
        }
        assert_eq!(names(parent.path()), ["last"]);
        // As if killed between the two renames.
        fs::rename(&target, parent.path().join(".last.old-abc")).unwrap();
        recover(&target).unwrap();
        assert_eq!(names(&target), ["second"]);
    }

    #[test]
    fn leftovers_of_a_killed_writer_go_and_those_of_a_living_one_stay() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        let long_ago = SystemTime::now() - Duration::from_secs(3600);
        let dead = folder.path().join(".a.txt.partial-dead");
        let other = folder.path().join(".b.txt.partial-dead");
        for path in [&dead, &other] {
            File::create(path).unwrap().set_modified(long_ago).unwrap();
        }
        let living = AtomicFile::create(&target).unwrap();
        living.file.get_ref().as_file().set_modified(long_ago).unwrap();
        assert!(!dead.exists() && other.exists());
        write_text(&target, "second").unwrap();
        living.finish().unwrap();
        assert_eq!(names(folder.path()), [".b.txt.partial-dead", "a.txt"]);
    }
}
