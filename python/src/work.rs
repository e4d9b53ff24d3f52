//! Work that Python can watch and end: it runs on a thread of its own, while the thread that asked receives the notices, calls
//! Python, and looks for Ctrl-C.

use std::{
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use hybridsim::{
    Result,
    data::{program, unfinished},
    verbs::Notify,
};
use pyo3::{exceptions::PyRuntimeError, prelude::*};

use crate::{errors::raised, notice::Message};

/// How often Ctrl-C is looked for: people notice 100 ms (Nielsen, Usability Engineering, 1993, sec. 5.5).
const LOOK: Duration = Duration::from_millis(50);
/// How long an interrupted caller waits for the work to undo what is unfinished: after a second people lose the thread (the same).
/// Work that takes longer to its next step undoes it there.
const PATIENCE: Duration = Duration::from_secs(1);
/// Of the thread: what the main thread of a program has.
const STACK_BYTES: usize = 8 << 20;

/// What unwinds from work that is to end.
struct Ended;

/// Does `work` without Python's lock, calling `notify(kind, text, number)` in the calling thread.
///
/// # Errors
/// The work's error; KeyboardInterrupt; whatever `notify` raises. After the latter two the work ends at its next notice, and
/// leaves nothing half-written.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    notify: &Bound<'_, PyAny>,
    work: impl FnOnce(&mut Notify<'_>) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let ended = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = mpsc::channel();
    let flag = ended.clone();
    let working = move || {
        catch_unwind(AssertUnwindSafe(|| {
            work(&mut |notice| {
                if flag.load(Ordering::Relaxed) {
                    resume_unwind(Box::new(Ended));
                }
                Message::of(&notice).into_iter().for_each(|message| drop(sender.send(message)));
            })
        }))
    };
    let worker = thread::Builder::new().name("hybridsim".into()).stack_size(STACK_BYTES).spawn(working)?;
    loop {
        let receiver = &mut receiver;
        let received = py.detach(move || receiver.recv_timeout(LOOK));
        let gone = matches!(received, Err(RecvTimeoutError::Disconnected));
        let answered = received.map_or(Ok(()), |message: Message| message.call(py, notify));
        if let Err(error) = answered.and_then(|()| py.check_signals()) {
            ended.store(true, Ordering::Relaxed);
            py.detach(|| {
                let start = Instant::now();
                while !worker.is_finished() && start.elapsed() < PATIENCE {
                    thread::sleep(LOOK / 10);
                }
            });
            return Err(error);
        }
        if gone {
            break;
        }
    }
    match py.detach(|| worker.join()).and_then(|caught| caught) {
        Ok(result) => result.map_err(|error| raised(py, &error)),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            Err(PyRuntimeError::new_err(format!("a bug in hybridsim: {}", text.unwrap_or("a panic without words"))))
        }
    }
}

/// Says which file this module was loaded from.
#[pyfunction]
pub fn is_library(file: PathBuf) {
    program::is_library(file);
}

/// Undoes what is unfinished; called when the interpreter ends, whatever still works then.
#[pyfunction]
pub fn abandon(py: Python<'_>) {
    py.detach(unfinished::abandon);
}
