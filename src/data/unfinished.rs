//! What this process has begun and not finished, and how to undo it when a signal ends the process.
//!
//! A signal ends a process between any two instructions, and no `Drop` runs. Whatever must not be left (temporaries,
//! processes that were started) is therefore listed here, and [`abandon`] undoes it. Results get their names under the
//! lock of the same list: a result is whole before, or it never appears.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

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
