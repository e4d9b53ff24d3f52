//! What Ctrl-C (SIGINT) and SIGTERM do: undo what is unfinished, say what was kept and how to go on, exit with 130 or 143.
//!
//! A thread of its own does it at once, in whatever the others are at. A second signal ends the process without further ado.

use std::sync::{Mutex, PoisonError};

type Text = Box<dyn Fn() -> String + Send>;

static KEPT: Mutex<Option<Text>> = Mutex::new(None);

/// What a verb says when it is interrupted: what was kept, and how to go on. Without it, nothing is kept.
pub(super) fn kept(text: impl Fn() -> String + Send + 'static) {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(text));
}

#[cfg(unix)]
fn kept_text() -> String {
    match &*KEPT.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(text) => text(),
        None => "nothing was finished, and nothing is left behind; the same command starts again".into(),
    }
}

/// The command that was typed, for a shell.
pub(super) fn typed() -> String {
    std::env::args_os().map(|word| quoted(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
}

/// A word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%".contains(letter);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// From here on signals end the program as described above.
pub(super) fn watch() {
    #[cfg(unix)]
    unix::watch();
}

#[cfg(unix)]
mod unix {
    use std::sync::atomic::Ordering;

    use signal_hook::{
        consts::{SIGINT, SIGTERM},
        flag,
        iterator::Signals,
        low_level,
    };

    use crate::data::unfinished;

    pub(super) fn watch() {
        let heeded: Vec<i32> = [SIGINT, SIGTERM].into_iter().filter(|&signal| !is_ignored(signal)).collect();
        for &signal in &heeded {
            // The second one, whatever the first is at. Both flags come before the thread is woken: it sets `ending`, too, and
            // the first signal would pass for the second.
            let again = flag::register_conditional_shutdown(signal, 128 + signal, unfinished::ending().clone());
            let first = flag::register(signal, unfinished::ending().clone());
            debug_assert!(again.is_ok() && first.is_ok());
        }
        // Where it cannot be set up, the second signal ends the program.
        let Ok(mut signals) = Signals::new(&heeded) else { return };
        std::thread::spawn(move || {
            if let Some(signal) = signals.forever().next() {
                end(signal);
            }
        });
    }

    /// Whoever started this may have asked that it is not interrupted, as a shell does for what runs in the background.
    fn is_ignored(signal: i32) -> bool {
        // SAFETY: all zeros are a valid value, and without a new action the old one is only read.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            libc::sigaction(signal, std::ptr::null(), &mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
        }
    }

    fn end(signal: i32) {
        unfinished::ending().store(true, Ordering::Relaxed);
        unfinished::abandon();
        // A progress bar stands on the line.
        let line = if std::io::IsTerminal::is_terminal(&std::io::stderr()) { "\n" } else { "" };
        super::super::complain(&format!("{line}interrupted: {}", super::kept_text()));
        low_level::exit(128 + signal);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_as_a_shell_reads_them() {
        assert_eq!(quoted("runs/a-2"), "runs/a-2");
        assert_eq!(quoted("it's mine"), "'it'\\''s mine'");
        assert_eq!(quoted(""), "''");
    }
}
