//! A process that ends with this one.
//!
//! It leads a group of its own, so that all it starts can be ended with it, and so that Ctrl-C on the terminal reaches this
//! process alone. Linux ends it, though not what it started, even when this process is killed.

use std::io;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use crate::data::unfinished::Undo;

pub struct Worker {
    process: Child,
    _undo: Undo,
}

impl Worker {
    pub fn start(command: &mut Command) -> io::Result<Self> {
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        die_with_this_process(command);
        let process = command.spawn()?;
        let id = process.id();
        Ok(Self { process, _undo: Undo::by(move || end_group(id)) })
    }

    /// How it ended; `None` if it takes longer than `limit`. Dropping ends it. `meanwhile` is called now and then.
    pub fn wait(&mut self, limit: Duration, meanwhile: &mut dyn FnMut()) -> io::Result<Option<ExitStatus>> {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait()? {
                return Ok(Some(status));
            }
            if begun.elapsed() > limit {
                return Ok(None);
            }
            meanwhile();
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // What it started may outlive it.
        end_group(self.process.id());
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn end_group(id: u32) {
    // SAFETY: the call touches no memory. A group keeps its number for as long as anybody is in it.
    #[cfg(unix)]
    unsafe {
        libc::kill(-(id as libc::pid_t), libc::SIGKILL);
    }
    #[cfg(not(unix))]
    let _ = id;
}

fn die_with_this_process(command: &mut Command) {
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::process::CommandExt;
        let this = std::process::id();
        // SAFETY: both calls are allowed between fork and exec.
        unsafe {
            command.pre_exec(move || {
                libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
                // It may have died before that.
                match libc::getppid() as u32 == this {
                    true => Ok(()),
                    false => Err(io::Error::from(io::ErrorKind::Interrupted)),
                }
            });
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = command;
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    /// Whether a process runs; one that waits to be reaped does not.
    fn runs(id: &str) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        stat.rsplit_once(") ").is_some_and(|(_, rest)| !rest.starts_with('Z'))
    }

    #[test]
    fn what_a_worker_started_ends_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("id");
        let script = format!("sleep 300 & echo $! > '{}.new'; mv '{0}.new' '{0}'; wait", note.display());
        let mut worker = Worker::start(Command::new("sh").args(["-c", &script])).unwrap();
        assert!(worker.wait(Duration::from_millis(1), &mut || ()).unwrap().is_none());
        while !note.exists() {
            std::thread::sleep(Duration::from_millis(10));
        }
        let id = std::fs::read_to_string(&note).unwrap().trim().to_string();
        assert!(runs(&id));
        drop(worker);
        let begun = Instant::now();
        while runs(&id) {
            assert!(begun.elapsed() < Duration::from_secs(10), "process {id} still runs");
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}
