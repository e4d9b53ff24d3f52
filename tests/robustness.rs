//! What a user's results go through: kills, signals, two runs at once, folders that cannot be written, hostile names.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use hybridsim::challenge::commitment::{Commitment, merkle_root};

const PROGRAM: &str = env!("CARGO_BIN_EXE_hybridsim");

fn hybridsim(arguments: &[&str], folder: &Path) -> Output {
    Command::new(PROGRAM).args(arguments).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
}

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

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn assert_done(output: &Output) {
    assert!(output.status.success(), "{}", err(output));
}

#[track_caller]
fn assert_refused(output: &Output, status: i32, parts: &[&str]) {
    let text = err(output);
    assert_eq!(output.status.code(), Some(status), "{text}");
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing in:\n{text}");
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn test_config() -> String {
    root().join("configs/test.toml").display().to_string()
}

/// A recording of `configs/test.toml` and a run trained on it.
fn made() -> &'static Path {
    static ONCE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = ONCE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        assert_done(&hybridsim(&["record", &test_config(), "-q", "--out", "recording"], folder.path()));
        assert_done(&train(folder.path(), &folder.path().join("recording"), "run"));
        folder
    });
    folder.path()
}

fn train(folder: &Path, recording: &Path, run: &str) -> Output {
    let recordings = format!("data.recordings=[{recording:?}]");
    let sets = ["--set", "training.epochs=2", "--set", &recordings];
    hybridsim(&[&["train", &test_config(), "-q", "--device", "flex", "--out", run], &sets[..]].concat(), folder)
}

/// Every file below a folder, hidden ones included.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_path_buf(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Names below a folder that begin with a dot.
fn hidden(folder: &Path) -> Vec<PathBuf> {
    let mut found = vec![];
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).into_iter().flatten().flatten() {
            if entry.file_name().as_encoded_bytes().starts_with(b".") {
                found.push(entry.path());
            } else if entry.path().is_dir() {
                open.push(entry.path());
            }
        }
    }
    found
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

/// Inputs that do not exist would be complained of, too: whoever complains of the output first has tried it first.
#[test]
fn every_output_is_tried_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "in the way").unwrap();
    let checkpoint = made().join("run/best").display().to_string();
    let recording = made().join("recording").display().to_string();
    let (challenge, site) = (root().join("configs/challenge_smoke.toml"), root().join("configs/site_smoke.toml"));
    let (challenge, site, config) = (challenge.display().to_string(), site.display().to_string(), test_config());
    let verbs: [&[&str]; 13] = [
        &["record", &config],
        &["site", &site],
        &["train", &config],
        &["infer", "--checkpoint", &checkpoint, "--recording", "nowhere"],
        &["import", "nowhere"],
        &["baseline", "mmgpe", "nowhere"],
        &["evaluate", "nowhere", "--checkpoint", "nowhere"],
        &["compare", "nowhere", "nowhere"],
        &["recognize", "--train", "nowhere", "--test", "nowhere"],
        &["diagnose", "nowhere"],
        &["challenge", "seal", &challenge],
        &["challenge", "run", "nowhere"],
        &["check", &recording],
    ];
    for verb in verbs {
        for out in ["file", "file/below"] {
            let output = hybridsim(&[verb, &["-q", "--out", out]].concat(), folder.path());
            let text = err(&output);
            assert!(
                text.contains(&format!("error: {out}")) && text.contains("hint: ") != text.contains("written"),
                "{verb:?}: {text}"
            );
            assert_eq!(output.stdout, b"", "{verb:?} worked before it tried");
        }
    }
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn an_empty_folder_behind_a_link_is_filled() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("disk")).unwrap();
    std::os::unix::fs::symlink("disk", folder.path().join("link")).unwrap();
    assert_done(&hybridsim(&["record", &test_config(), "-q", "--out", "link"], folder.path()));
    assert!(folder.path().join("link").is_symlink());
    assert!(folder.path().join("disk/recording.toml").is_file() && hidden(folder.path()).is_empty());
}

#[test]
fn weights_have_the_mode_of_their_neighbours_and_equal_runs_write_equal_bytes() {
    let (folder, recording) = (tempfile::tempdir().unwrap(), made().join("recording"));
    // The same commands in two folders: what a page says of its checkpoint is how the command named it.
    let once = |run: &str| {
        let folder = folder.path().join(run);
        fs::create_dir(&folder).unwrap();
        assert_done(&train(&folder, &recording, "run"));
        let infer = ["infer", "--checkpoint", "run/best", "--action", "lunge", "--frames", "2", "-q", "--out", "run/made"];
        assert_done(&hybridsim(&infer, &folder));
        let recording = recording.display().to_string();
        let baseline = ["baseline", "mmgpe", &recording, "-q", "--device", "flex", "--out", "run/lobes"];
        assert_done(&hybridsim(&baseline, &folder));
        let evaluate = ["evaluate", &recording, "--checkpoint", "run/best", "-q", "--device", "flex", "--out", "run/scores"];
        assert_done(&hybridsim(&evaluate, &folder));
        files(&folder.join("run"))
    };
    let (first, second) = (once("first"), once("second"));
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    // What differs between equal runs is in one file.
    let differ: Vec<&PathBuf> = first.iter().filter(|(path, bytes)| second[*path] != **bytes).map(|(path, _)| path).collect();
    assert!(differ.iter().all(|path| path.ends_with("run.json")), "{differ:?}");
    assert!(differ.len() == 2, "{differ:?}");

    let modes: BTreeMap<u32, &PathBuf> = first
        .keys()
        .map(|path| (fs::metadata(folder.path().join("first/run").join(path)).unwrap().mode() & 0o777, path))
        .collect();
    fs::write(folder.path().join("ordinary"), "").unwrap();
    let ordinary = fs::metadata(folder.path().join("ordinary")).unwrap().permissions().mode() & 0o777;
    assert!(modes.keys().eq([&ordinary]), "{modes:?}, an ordinary file has {ordinary}");
}

#[test]
fn what_a_terminal_would_obey_is_printed_written_out() {
    let folder = tempfile::tempdir().unwrap();
    let evil = "red\u{1b}[31m";
    let measured = folder.path().join(evil);
    fs::create_dir(&measured).unwrap();
    for entry in fs::read_dir(made().join("recording")).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, measured.join(path.file_name().unwrap())).unwrap();
    }
    let settings = measured.join("recording.toml");
    let text = fs::read_to_string(&settings).unwrap();
    fs::write(&settings, text.replace("walk_back_forth", "walk\\u001b[2J")).unwrap();
    let checkpoint = made().join("run/best").display().to_string();
    let (plain, missing) = (made().join("recording").display().to_string(), format!("{evil}/missing"));
    let commands: [&[&str]; 5] = [
        &["check", evil],
        &["check", &missing],
        &["compare", evil, evil],
        &["compare", &plain, evil],
        &["evaluate", evil, "--checkpoint", &checkpoint],
    ];
    // Of a wrong command without it.
    assert!(!err(&hybridsim(&["check", "one", evil], folder.path())).contains('\u{1b}'));
    for command in commands {
        let output = hybridsim(command, folder.path());
        let text = out(&output) + &err(&output);
        assert!(text.contains("\\u{1b}"), "{command:?} prints no name:\n{text}");
        assert!(!text.contains('\u{1b}'), "{command:?}:\n{text:?}");
    }
}

#[test]
fn a_recording_without_a_signal_is_not_scored() {
    let folder = tempfile::tempdir().unwrap();
    let dead = folder.path().join("dead");
    fs::create_dir(&dead).unwrap();
    for entry in fs::read_dir(made().join("recording")).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, dead.join(path.file_name().unwrap())).unwrap();
    }
    let mut samples = fs::read(dead.join("if.npy")).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([samples[8], samples[9]]));
    samples[header..].fill(0);
    fs::write(dead.join("if.npy"), samples).unwrap();
    let (dead, checkpoint) = (dead.display().to_string(), made().join("run/best").display().to_string());
    let refused = ["dead/if.npy: `if` is the same along every chirp of 5 frames, such as 0, expected an echo", "hint: "];
    assert_refused(&hybridsim(&["evaluate", &dead, "--checkpoint", &checkpoint, "-q"], folder.path()), 2, &refused);
    assert_refused(&hybridsim(&["compare", &dead, &dead, "-q"], folder.path()), 2, &refused);
    assert_refused(&train(folder.path(), Path::new(&dead), "run"), 2, &refused);
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

#[test]
#[cfg(target_os = "linux")]
fn a_mount_point_is_filled() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("disk")).unwrap();
    let unshared = |script: &str| {
        Command::new("unshare").args(["--map-root-user", "--mount", "sh", "-c", script]).current_dir(folder.path()).output()
    };
    if !unshared("mount -t tmpfs none disk").is_ok_and(|output| output.status.success()) {
        println!("skipped: nothing can be mounted here");
        return;
    }
    let script = format!("mount -t tmpfs none disk && '{PROGRAM}' record '{}' -q --out disk && ls -A disk", test_config());
    let output = unshared(&script).unwrap();
    assert_done(&output);
    let listed = out(&output);
    assert!(listed.contains("recording.toml") && listed.contains("if.npy") && !listed.contains(".hybridsim"), "{listed}");
}
