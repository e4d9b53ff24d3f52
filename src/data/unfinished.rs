//! What this process has begun and not finished, and how to undo it when a signal ends the process.
//!
//! A signal ends a process between any two instructions, and no `Drop` runs. Whatever must not be left (temporaries,
//! processes that were started) is therefore listed here, and [`abandon`] undoes it. Results get their names under the
//! lock of the same list: a result is whole before, or it never appears.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// Most removals of one folder: a thread adds a file between two of them, at most.
const REMOVALS: usize = 100;

type Action = Box<dyn FnOnce() + Send>;

static BEGUN: Mutex<Vec<(u64, Action)>> = Mutex::new(Vec::new());
static ENDING: LazyLock<Arc<AtomicBool>> = LazyLock::new(Default::default);

fn begun() -> MutexGuard<'static, Vec<(u64, Action)>> {
    // A panic elsewhere must not keep temporaries alive.
    BEGUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An entry of the list; it goes when this is dropped, without being carried out.
#[derive(Debug)]
pub struct Undo(u64);

impl Undo {
    /// `action` is carried out if the process is ended by a signal while this lives.
    pub fn by(action: impl FnOnce() + Send + 'static) -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        begun().push((number, Box::new(action)));
        Self(number)
    }
}

impl Drop for Undo {
    fn drop(&mut self) {
        begun().retain(|(number, _)| *number != self.0);
    }
}

/// Removes a folder in which other threads may be at work until a signal's handler ends the process: what they add meanwhile goes, too.
pub fn remove_in_use(folder: &Path) {
    for _ in 0..REMOVALS {
        if matches!(fs::remove_dir_all(folder), Err(error) if error.kind() == ErrorKind::NotFound) {
            return;
        }
    }
}

/// Gives a result its name, where no signal comes between. `name` must neither make nor drop an [`Undo`].
pub fn publish<T>(name: impl FnOnce() -> T) -> T {
    let _held = begun();
    name()
}

/// Undoes all that is unfinished, the last first. From here on this process publishes nothing and begins nothing: whoever
/// tries, waits for the end of the process.
pub fn abandon() {
    let mut list = begun();
    while let Some((_, action)) = list.pop() {
        action();
    }
    std::mem::forget(list);
}

/// Set by the handler of the signal, before anything else happens.
pub fn ending() -> &'static Arc<AtomicBool> {
    &ENDING
}

/// Waits for the end, if a signal has asked for it. To be called where a failure may be a consequence of the signal, so
/// that it is neither told nor kept.
pub fn wait_if_ending() {
    while ENDING.load(Ordering::Relaxed) {
        std::thread::park();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_goes_though_somebody_fills_it() {
        let folder = tempfile::tempdir().unwrap();
        let doomed = folder.path().join("doomed");
        for _ in 0..20 {
            fs::create_dir(&doomed).unwrap();
            let stop = AtomicBool::new(false);
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    // As a writer does, until its folder is gone.
                    let write =
                        |name: &u32| fs::write(doomed.join(name.to_string()), "x").is_ok() && !stop.load(Ordering::Relaxed);
                    (0..).take_while(write).last()
                });
                remove_in_use(&doomed);
                stop.store(true, Ordering::Relaxed);
            });
            assert!(!doomed.exists());
        }
    }
}
