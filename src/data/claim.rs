//! One process at a time where results are written.
//!
//! A claim is a lock on a file that the system releases with the process, however it ends. The file names the process for
//! whoever is refused. It goes with the claim; one that a killed process left is taken over.

use std::fs::{self, File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::Shard;
use super::files;
use super::leftovers::{is_linked, lock_name, parent_of};
use super::unfinished::Undo;
use crate::error::{Error, Result};

/// Who lets a claim go, or looks whether its holder is dead, has the lock alone while a file is removed. That is no refusal: a lock
/// is asked for so often, within half of what a person notices (100 ms: Nielsen, Usability Engineering, 1993, sec. 5.5).
const ASKED: usize = 5;
const INSTANT: Duration = Duration::from_millis(10);

/// Held for as long as results are written into a folder.
#[derive(Debug)]
pub struct Claim {
    locks: Vec<Lock>,
    /// A folder that was made for this, to be removed if nothing is put into it.
    made: Option<PathBuf>,
}

#[derive(Debug)]
struct Lock {
    path: PathBuf,
    file: File,
    /// Where a signal ends the process.
    _undo: Option<Undo>,
}

#[derive(Clone, Copy)]
enum Kind {
    Alone,
    Shared,
}

impl Claim {
    /// Of a folder that results are added to, which is made where it is absent. This tries whether it can be written into.
    ///
    /// # Errors
    /// A folder that cannot be made or written into, or that another process works in.
    pub fn take(folder: &Path) -> Result<Self> {
        Self::try_take(folder)?.ok_or_else(|| refusal(folder, &folder.join(lock_name(None))))
    }

    /// The same; `None` where another process works.
    pub fn try_take(folder: &Path) -> Result<Option<Self>> {
        let mut claim = Self::of_made(folder)?;
        let taken = claim.lock(folder, folder.join(lock_name(None)), Kind::Alone)?;
        Ok(taken.then_some(claim))
    }

    /// Of one part of a folder that several processes fill together: refuses the same part, and who wants all of it.
    pub fn part(folder: &Path, shard: Shard) -> Result<Self> {
        if shard.of == 1 {
            return Self::take(folder);
        }
        Self::piece(folder, &format!("part-{}-of-{}", shard.number, shard.of))
    }

    /// The same of a piece that has a name.
    pub fn piece(folder: &Path, name: &str) -> Result<Self> {
        let mut claim = Self::of_made(folder)?;
        for (path, kind) in [(lock_name(None), Kind::Shared), (lock_name(Some(name.as_ref())), Kind::Alone)] {
            let path = folder.join(path);
            if !claim.lock(folder, path.clone(), kind)? {
                return Err(refusal(folder, &path));
            }
        }
        Ok(claim)
    }

    /// Of a folder that appears when it is complete: the lock lies beside it.
    pub fn beside(target: &Path) -> Result<Self> {
        let mut claim = Self { locks: vec![], made: None };
        let path = parent_of(target).join(lock_name(target.file_name()));
        match claim.lock(target, path.clone(), Kind::Alone)? {
            true => Ok(claim),
            false => Err(refusal(target, &path)),
        }
    }

    fn of_made(folder: &Path) -> Result<Self> {
        let made = (!folder.exists()).then(|| folder.to_path_buf());
        fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
        Ok(Self { locks: vec![], made })
    }

    /// False where another process holds it. `folder`: what an error names.
    fn lock(&mut self, folder: &Path, path: PathBuf, kind: Kind) -> Result<bool> {
        let write_error = |source| Error::write(folder, source);
        let mut asked = 0;
        loop {
            let mut options = File::options();
            let mut file = options.read(true).write(true).create(true).truncate(false).open(&path).map_err(write_error)?;
            let tried = match kind {
                Kind::Alone => file.try_lock(),
                Kind::Shared => file.try_lock_shared(),
            };
            if matches!(tried, Err(TryLockError::WouldBlock)) {
                asked += 1;
                if asked == ASKED {
                    return Ok(false);
                }
                std::thread::sleep(INSTANT);
                continue;
            }
            // Who held it before has removed it since it was opened.
            if !is_linked(&file, &path) {
                continue;
            }
            file.set_len(0).and_then(|()| write!(file, "{}", std::process::id())).map_err(write_error)?;
            let undo = file.try_clone().ok().map(|file| {
                let (path, made) = (path.clone(), self.made.clone());
                Undo::by(move || release(&path, &file, made.as_deref()))
            });
            self.locks.push(Lock { path, file, _undo: undo });
            return Ok(true);
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        for lock in self.locks.drain(..).rev() {
            release(&lock.path, &lock.file, self.made.as_deref());
        }
    }
}

fn release(path: &Path, file: &File, made: Option<&Path>) {
    // Others may share it; who locks it alone may remove it.
    if !matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        let _ = fs::remove_file(path);
    }
    if let Some(made) = made {
        // Fails where something is in it.
        let _ = fs::remove_dir(made);
    }
}

fn refusal(folder: &Path, lock: &Path) -> Error {
    let mut text = String::new();
    let read = files::regular(lock).and_then(|file| file.take(20).read_to_string(&mut text));
    let who = match read.ok().and_then(|_| text.trim().parse::<u32>().ok()) {
        Some(id) => format!("another process, number {id}, works here"),
        None => "another process works here".into(),
    };
    Error::Busy { folder: folder.into(), who }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_support::names;

    #[test]
    fn one_works_in_a_folder_and_the_other_is_told_who() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("run");
        let first = Claim::take(&folder).unwrap();
        let error = Claim::take(&folder).unwrap_err();
        assert!(matches!(error, Error::Busy { .. }) && error.hint().is_some());
        let expected = format!("{}: another process, number {}, works here", folder.display(), std::process::id());
        assert_eq!(error.to_string(), expected);
        assert!(Claim::try_take(&folder).unwrap().is_none());
        fs::write(folder.join("result"), "").unwrap();
        drop(first);
        assert_eq!(names(&folder), ["result"]);
        drop(Claim::take(&folder).unwrap());
    }

    #[test]
    fn a_folder_that_nothing_was_put_into_goes_again() {
        let parent = tempfile::tempdir().unwrap();
        drop(Claim::take(&parent.path().join("run")).unwrap());
        drop(Claim::beside(&parent.path().join("result")).unwrap());
        assert!(names(parent.path()).is_empty());
    }

    #[test]
    fn parts_share_a_folder_and_neither_the_same_part_nor_the_whole_is_taken_twice() {
        let folder = tempfile::tempdir().unwrap();
        let part = |number| Claim::part(folder.path(), Shard { number, of: 2 });
        let (first, second) = (part(1).unwrap(), part(2).unwrap());
        assert!(part(1).unwrap_err().to_string().contains("another process"));
        drop(first);
        assert!(Claim::part(folder.path(), Shard::ALL).is_err(), "the second part is at work");
        drop(second);
        let all = Claim::part(folder.path(), Shard::ALL).unwrap();
        assert!(part(1).is_err());
        drop(all);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    #[cfg(unix)]
    fn a_folder_that_cannot_be_written_into_is_named() {
        let parent = tempfile::tempdir().unwrap();
        fs::write(parent.path().join("file"), "").unwrap();
        let error = Claim::take(&parent.path().join("file")).unwrap_err();
        assert!(matches!(&error, Error::Write { path, .. } if path.ends_with("file")), "{error}");
    }
}
