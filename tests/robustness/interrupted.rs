//! Runs that are killed, interrupted or not alone.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use hybridsim::challenge::commitment::{Commitment, merkle_root};

use super::{PROGRAM, assert_done, assert_refused, err, files, hidden, hybridsim, made, root, test_config};

/// A run that is going to be interrupted; it does not outlive the test.
struct Running(Option<Child>);

impl Running {
    fn start(arguments: &[&str], folder: &Path) -> Self {
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(folder).env("NO_COLOR", "1").env("TMPDIR", folder.join("tmp"));
        fs::create_dir_all(folder.join("tmp")).unwrap();
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        // SAFETY: `signal` is allowed between fork and exec. Whoever started the tests may have SIGINT ignored.
        unsafe {
            command.pre_exec(|| {
                libc::signal(libc::SIGINT, libc::SIG_DFL);
                Ok(())
            });
        }
        Self(Some(command.spawn().unwrap()))
    }

    fn child(&mut self) -> &mut Child {
        self.0.as_mut().unwrap()
    }

    /// Waits for something that the run does.
    fn until(&mut self, what: &str, mut happens: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !happens() {
            if self.child().try_wait().unwrap().is_some() {
                let output = self.0.take().unwrap().wait_with_output().unwrap();
                panic!("ended before {what}: {output:?}");
            }
            assert!(begun.elapsed() < Duration::from_secs(120), "no {what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn finished(mut self) -> Output {
        self.0.take().unwrap().wait_with_output().unwrap()
    }

    /// Sends a signal and waits for the end.
    fn ended_by(mut self, signal: i32) -> Output {
        let child = self.0.take().unwrap();
        // SAFETY: the call touches no memory, and the process has not been waited for.
        unsafe { libc::kill(child.id() as i32, signal) };
        child.wait_with_output().unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn is_partial(path: impl AsRef<Path>) -> bool {
    path.as_ref().to_string_lossy().contains(".hybridsim-partial-")
}

/// A site of two recordings, each of which takes a moment.
fn small_site(folder: &Path) {
    let text = format!(
        "extends = {:?}\nsubjects = [\"s1\", \"s2\"]\nunseen = [\"s2\"]\nagain = []\nactions = [\"lunge\"]\n[record]\nframes = 6\n",
        root().join("configs/site_smoke.toml")
    );
    fs::write(folder.join("site.toml"), text).unwrap();
}

#[test]
fn a_site_that_was_killed_again_and_again_is_in_the_end_the_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    small_site(folder.path());
    let at = |name: &str| folder.path().join(name);
    assert_done(&hybridsim(&["site", "site.toml", "-q", "--out", "whole"], folder.path()));
    for kill in 0..5 {
        let mut run = Running::start(&["site", "site.toml", "-q", "--out", "killed"], folder.path());
        run.until("a recording that is being written", || hidden(&at("killed/recordings")).iter().any(is_partial));
        std::thread::sleep(Duration::from_millis(20 * kill));
        run.ended_by(libc::SIGKILL);
    }
    assert!(!hidden(&at("killed")).is_empty());
    assert_done(&hybridsim(&["site", "site.toml", "-q", "--out", "killed"], folder.path()));
    assert!(hidden(&at("killed")).is_empty());
    assert!(files(&at("killed")) == files(&at("whole")));
    // A site that is whole is swept, too.
    fs::create_dir(at("killed/recordings/.s9.hybridsim-partial-abcdef")).unwrap();
    assert_done(&hybridsim(&["site", "site.toml", "-q", "--out", "killed"], folder.path()));
    assert!(hidden(&at("killed")).is_empty());
}

#[test]
fn a_reproduction_that_was_killed_while_it_recorded_goes_on_and_reads_no_leftover() {
    let folder = tempfile::tempdir().unwrap();
    small_site(folder.path());
    let config = "seed = 2\nsite = 'site.toml'\nvariants = ['ours']\nbaselines = ['mmgpe']\nprotocols = []\n\
        [split]\ntraining = 's1'\nunseen = 's2'\n\
        [simulator.room]\npatches = 60\n[simulator.triplane]\nresolution = 8\nfeatures = 2\n\
        [simulator.decoders.network]\nhidden = [8]\n[training]\nepochs = 1\n[adaptation]\nframes = [0]\nsteps = 1\n";
    fs::write(folder.path().join("all.toml"), config).unwrap();
    let arguments = ["reproduce", "all.toml", "-q", "--device", "flex", "--out", "out"];
    let out = folder.path().join("out");
    let mut run = Running::start(&arguments, folder.path());
    let recorded = |path: &PathBuf| is_partial(path) && path.parent().unwrap().ends_with("recordings");
    run.until("a recording that is being written", || hidden(&out.join("unfinished")).iter().any(recorded));
    run.ended_by(libc::SIGKILL);
    assert_done(&hybridsim(&arguments, folder.path()));
    assert!(hidden(&out).is_empty());
    assert!(out.join("results.md").is_file());
}

#[test]
fn an_interrupted_training_says_what_is_kept_and_how_to_go_on_and_nobody_else_works_there() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = format!("data.recordings=[{:?}]", made().join("recording"));
    let sets = ["--set", "training.epochs=100000", "--set", &recordings];
    let config = test_config();
    let arguments = [&["train", config.as_str(), "-q", "--device", "flex", "--out", "my run"], &sets[..]].concat();
    let run_folder = folder.path().join("my run");
    let state = run_folder.join("last/checkpoint.toml");
    let mut run = Running::start(&arguments, folder.path());
    run.until("a checkpoint", || state.is_file());
    let number = run.child().id();
    let refused = hybridsim(&arguments, folder.path());
    assert_refused(&refused, 2, &["my run: "]);
    let resume = ["train", "--resume", "my run", "-q"];
    let expected = format!("my run: another process, number {number}, works here");
    assert_refused(&hybridsim(&resume, folder.path()), 2, &[&expected, "hint: wait for it"]);
    let output = run.ended_by(libc::SIGINT);
    let said = " of 100000 epochs are kept in my run; go on with: ";
    assert_refused(&output, 130, &["interrupted: ", said, "train --resume 'my run' --device flex"]);
    assert!(hidden(&run_folder).is_empty());

    let kept = |output: &Output| -> usize {
        let text = err(output);
        text.split("interrupted: ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    let before = kept(&output);
    let epochs = || {
        let text = fs::read_to_string(&state).unwrap_or_default();
        let table: toml::Table = text.parse().unwrap_or_default();
        table.get("progress").and_then(|progress| progress["epochs_done"].as_integer()).unwrap_or(0) as usize
    };
    let mut run = Running::start(&resume, folder.path());
    run.until("a further epoch", || epochs() > before);
    let output = run.ended_by(libc::SIGTERM);
    assert_refused(&output, 143, &["interrupted: "]);
    assert!(kept(&output) > before);
}

#[test]
fn an_interrupted_recording_leaves_nothing_and_a_second_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let config = test_config();
    let arguments = ["record", config.as_str(), "-q", "--set", "record.frames=4000", "--out", "made"];
    let mut run = Running::start(&arguments, folder.path());
    run.until("a recording that is being written", || hidden(folder.path()).iter().any(is_partial));
    assert_refused(&hybridsim(&arguments, folder.path()), 2, &["made: another process, number "]);
    let output = run.ended_by(libc::SIGINT);
    assert_refused(&output, 130, &["interrupted: nothing was finished", "the same command starts again"]);
    assert_eq!(files(folder.path()).len(), 0);
    assert!(!folder.path().join("made").exists());
}

/// A challenge of one case, which is diagnosed by a shell script.
fn challenge(folder: &Path, script: &str) {
    fs::create_dir_all(folder.join("challenge/cases/a")).unwrap();
    fs::write(folder.join("challenge/cases/a/recording.toml"), "").unwrap();
    let leaves = BTreeMap::from([("a".to_string(), "leaf".to_string())]);
    let hash = || String::from("0");
    let commitment = Commitment {
        format: 1,
        shard: [1, 1],
        cases: 1,
        config_sha256: hash(),
        executable_sha256: hash(),
        secret_sha256: hash(),
        root: merkle_root(&leaves),
        leaves,
        left_out: BTreeMap::new(),
    };
    fs::write(folder.join("challenge/commitment.json"), serde_json::to_string(&commitment).unwrap()).unwrap();
    fs::write(folder.join("program"), format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(folder.join("program"), fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(target_os = "linux")]
fn assert_ends(id: &str) {
    let runs = || {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        stat.rsplit_once(") ").is_some_and(|(_, rest)| !rest.starts_with('Z'))
    };
    let begun = Instant::now();
    while runs() {
        assert!(begun.elapsed() < Duration::from_secs(10), "process {id} still runs");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_challenge_that_ends_leaves_no_process_no_folder_and_no_failure() {
    let arguments = ["challenge", "run", "challenge", "-q", "--out", "answers", "--program", "program"];
    for (signal, script) in [
        // With a process of its own, which must end, too.
        (libc::SIGINT, "sleep 300 & echo $! > \"$TMPDIR/id\"; mv \"$TMPDIR/id\" \"$NOTE\"; wait"),
        (libc::SIGTERM, "sleep 300 & echo $! > \"$TMPDIR/id\"; mv \"$TMPDIR/id\" \"$NOTE\"; wait"),
        (libc::SIGKILL, "echo $$ > \"$TMPDIR/id\"; mv \"$TMPDIR/id\" \"$NOTE\"; exec sleep 300"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let note = folder.path().join("note");
        challenge(folder.path(), &script.replace("$NOTE", &note.display().to_string()));
        let mut run = Running::start(&arguments, folder.path());
        run.until("a worker", || note.is_file());
        let id = fs::read_to_string(&note).unwrap().trim().to_string();
        let output = run.ended_by(signal);
        assert_ends(&id);
        assert!(!folder.path().join("answers/a").exists(), "an interruption is no answer");
        let temporary = || fs::read_dir(folder.path().join("tmp")).unwrap().count();
        if signal == libc::SIGKILL {
            challenge(folder.path(), "exit 1");
            assert_done(&Running::start(&arguments, folder.path()).finished());
            assert!(folder.path().join("answers/a/failure.json").is_file());
        } else {
            assert_refused(
                &output,
                128 + signal,
                &["interrupted: the answers are kept; go on with: ", "challenge run challenge"],
            );
        }
        assert_eq!(temporary(), 0, "after signal {signal}");
    }
}
