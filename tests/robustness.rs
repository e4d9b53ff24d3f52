//! What a user's results go through: kills, signals, two runs at once, folders that cannot be written, hostile names.
#![cfg(unix)]

mod interrupted;

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const PROGRAM: &str = env!("CARGO_BIN_EXE_hybridsim");

fn hybridsim(arguments: &[&str], folder: &Path) -> Output {
    Command::new(PROGRAM).args(arguments).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
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
