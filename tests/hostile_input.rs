//! What nobody means: numbers that nothing can have, files that are none, names that are no text. Every verb refuses them
//! with an exact error, exit status 2, within seconds, and never panics.

use std::{
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the program; one that does not end is killed and fails the test.
fn hybridsim(arguments: &[OsString], folder: &Path) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hybridsim"))
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

fn arguments(words: &[&str]) -> Vec<OsString> {
    words.iter().map(OsString::from).collect()
}

#[track_caller]
fn assert_refused(what: &[OsString], output: &Output, parts: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{what:?}: {text}");
    assert!(!text.contains("panicked"), "{what:?}: {text}");
    for part in parts {
        assert!(text.contains(part), "{what:?}: `{part}` is missing in:\n{text}");
    }
}

/// The checkpoint that ships, with a line of its state changed.
fn checkpoint(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(root().join("models/quickstart")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    let state = folder.path().join("checkpoint.toml");
    let text = std::fs::read_to_string(&state).unwrap();
    assert!(text.contains(from), "the checkpoint has no `{from}`");
    std::fs::write(state, text.replacen(from, to, 1)).unwrap();
    folder
}

#[test]
fn a_checkpoint_is_checked_as_a_config_is() {
    for (from, to, message) in [
        (
            "layers = 2",
            "layers = 9223372036854775807",
            "`simulator.graph.layers` is 9223372036854775807, expected a whole number",
        ),
        ("layers = 2", "layers = 65", "`simulator.graph.layers` is 65, expected 1 to 64"),
        ("layers = 2", "layers = 0", "`simulator.graph.layers` is 0, expected 1 to 64"),
        (
            "resolution = 64",
            "resolution = 100000",
            "`simulator.triplane.resolution` is 3 x 100000 x 100000 x 16, expected at most",
        ),
        ("hidden = [64, 64]", "hidden = [64, 1000000]", "`simulator.decoders.network.hidden[1]` is 1000000, expected 1 to 2048"),
        ("patches = 1500", "patches = 0", "`simulator.room.patches` is 0, expected 1 to"),
        ("flip_exponent = 2.25", "flip_exponent = 99.0", "`simulator.flip_exponent` is 99, expected 0 to 10"),
        ("left_m = 1.9", "left_m = nan", "`site.room.left_m` is NaN, expected a finite number"),
        ("left_m = 1.9", "left_m = 1e300", "`site.room.left_m` is 1e300, expected at most 1.000e5 metres"),
        ("left_m = 1.9", "left_m = -1.9", "`site.room.left_m` is -1.9, expected a distance above zero"),
        ("low_m = [-0.99", "low_m = [5.99", "`site.body_extent` is"),
        ("low_m = [-0.99", "low_m = [inf, -0.99", "`site.body_extent.low_m.0` is inf, expected a finite number"),
    ] {
        let folder = checkpoint(from, to);
        let path = folder.path().display().to_string();
        for words in [
            &["check", &path][..],
            &["infer", "--device", "flex", "--action", "lunge", "--checkpoint", &path, "--out", "made"],
            &["evaluate", "--device", "flex", &path, "--checkpoint", &path],
        ] {
            let what = arguments(words);
            assert_refused(&what, &hybridsim(&what, folder.path()), &["checkpoint.toml: ", message]);
        }
        assert!(!folder.path().join("made").exists());
    }
}

#[test]
fn a_setting_that_nothing_can_have_is_refused_by_its_key_before_anything_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let (train, site) = (root().join("configs/test.toml"), root().join("configs/site_smoke.toml"));
    let challenge = root().join("configs/challenge_smoke.toml");
    let [train, site, challenge] = [train, site, challenge].map(|path| path.display().to_string());
    for (words, set, key) in [
        (&["train", &train][..], "training.epochs=9223372036854775807", "`training.epochs`"),
        (&["train", &train], "training.repeats=2000000", "`training.repeats`"),
        (&["train", &train], "training.learning_rate=nan", "`training.learning_rate`"),
        (&["train", &train], "simulator.graph.layers=1000000", "`simulator.graph.layers`"),
        (&["train", &train], "simulator.triplane.features=100000", "`simulator.triplane.features`"),
        (&["train", &train], "simulator.room.proxies_per_boundary=1000000000", "`simulator.room.proxies_per_boundary`"),
        (&["train", &train], "simulator.room.patch_spacing_m=1e300", "`simulator.room.patch_spacing_m`"),
        (&["train", &train], "training.heatmap.floor_db=-1e9", "`training.heatmap.floor_db`"),
        (&["record", &train], "record.frames=1000000000", "`radar.frames`"),
        (&["record", &train], "record.frames=9000000", "`motion.duration_s x rate_hz`"),
        (&["record", &train], "record.room.left_m=nan", "`record.room.left_m`"),
        (&["record", &train], "record.room.left_m=1e300", "`record.room.left_m`"),
        (&["record", &train], "record.room.left_m=90000", "`walls.patch_m`"),
        (&["record", &train], "record.person.distance_m=-inf", "`record.person.distance_m`"),
        (&["record", &train], "record.person.betas=[1e9]", "the rest pose"),
        (&["site", &site], "repetitions=100000000", "`repetitions`"),
        (&["challenge", "seal", &challenge], "cases=2000000000", "`cases`"),
        (&["challenge", "seal", &challenge], "radar.samples_per_chirp=2000000000", "`radar.samples_per_chirp`"),
        (&["challenge", "seal", &challenge], "radar.loops_per_frame=20000", "`radar.loops_per_frame`"),
        (&["challenge", "seal", &challenge], "radar.start_frequency_hz=1e300", "`radar.start_frequency_hz`"),
    ] {
        let what = arguments(&[words, &["--set", set, "--out", "made"]].concat());
        assert_refused(&what, &hybridsim(&what, folder.path()), &[key, "expected"]);
        assert!(!folder.path().join("made").exists(), "{what:?} left something behind");
    }
    let far = ["infer", "--device", "flex", "--action", "lunge", "--checkpoint"];
    let quickstart = root().join("models/quickstart").display().to_string();
    for (option, value, message) in
        [("--distance", "1e300", "`motion.origin_m`"), ("--frames", "9223372036854775807", "`motion.duration_s x rate_hz`")]
    {
        let what = arguments(&[&far[..], &[&quickstart, option, value, "--out", "made"]].concat());
        assert_refused(&what, &hybridsim(&what, folder.path()), &[message, "expected"]);
    }
}

/// A pipe that nobody writes into: opening it waits for ever.
#[test]
#[cfg(unix)]
fn a_pipe_or_a_device_is_refused_by_every_verb_that_reads_and_none_waits() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = |name: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        path.display().to_string()
    };
    let [plain, bvh, npz] = ["pipe", "pipe.bvh", "pipe.npz"].map(pipe);
    let quickstart = root().join("models/quickstart").display().to_string();
    let infer = ["infer", "--device", "flex", "--out", "made", "--checkpoint", &quickstart];
    let pipes = "this is a named pipe, expected a regular file";
    for (words, message) in [
        (vec!["check", &plain], pipes),
        (vec!["check", "/dev/zero"], "/dev/zero: this is a device, expected a regular file"),
        (vec!["train", &plain, "--out", "made"], pipes),
        (vec!["record", &plain, "--out", "made"], pipes),
        (vec!["site", &plain, "--out", "made"], pipes),
        (vec!["reproduce", &plain, "--out", "made"], pipes),
        (vec!["challenge", "seal", &plain, "--out", "made"], pipes),
        (vec!["recognize", "--config", &plain, "--train", "a", "--test", "b", "--out", "made"], pipes),
        (vec!["diagnose", &plain, "--out", "made"], "cannot be read"),
        (vec!["compare", &plain, &plain], "cannot be read"),
        ([&infer[..], &["--motion", &bvh]].concat(), pipes),
        ([&infer[..], &["--motion", &npz]].concat(), pipes),
        ([&infer[..], &["--action", "lunge", "--body", &plain]].concat(), pipes),
    ] {
        let what = arguments(&words);
        assert_refused(&what, &hybridsim(&what, folder.path()), &[message]);
        assert!(!folder.path().join("made").exists(), "{what:?} left something behind");
    }
    // Inside a checkpoint and a recording.
    let state = checkpoint("layers = 2", "layers = 2");
    std::fs::remove_file(state.path().join("weights.safetensors")).unwrap();
    assert!(Command::new("mkfifo").arg(state.path().join("weights.safetensors")).status().unwrap().success());
    let what = arguments(&["check", &state.path().display().to_string()]);
    assert_refused(&what, &hybridsim(&what, folder.path()), &["weights.safetensors: this is a named pipe"]);
    let made = root().join("configs/test.toml").display().to_string();
    let what = arguments(&["record", &made, "-q", "--set", "record.frames=1", "--out", "recording"]);
    assert!(hybridsim(&what, folder.path()).status.success());
    for file in ["if.npy", "body.npz", "motion.npz", "recording.toml"] {
        let path = folder.path().join("recording").join(file);
        let kept = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        let what = arguments(&["check", "recording"]);
        assert_refused(&what, &hybridsim(&what, folder.path()), &[&format!("{file}: this is a named pipe")]);
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, kept).unwrap();
    }
    assert!(hybridsim(&arguments(&["check", "recording"]), folder.path()).status.success());
}

#[test]
#[cfg(unix)]
fn a_name_that_is_no_text_is_refused_by_every_verb() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"r\xffx");
    std::fs::create_dir(folder.path().join(name)).unwrap();
    for words in [
        &["check"][..],
        &["record"],
        &["site", "--out", "made"],
        &["train"],
        &["infer", "--action", "lunge", "--checkpoint"],
        &["baseline", "mmgpe"],
        &["evaluate", "a", "--checkpoint"],
        &["compare", "a"],
        &["recognize", "--test", "a", "--out", "made", "--train"],
        &["diagnose", "--out", "made"],
        &["challenge", "seal", "--out", "made"],
        &["challenge", "run", "--out", "made"],
        &["challenge", "score", "--out", "made", "a"],
        &["reproduce"],
        // As the place for results, too.
        &["record", "a.toml", "--out"],
        &["train", "a.toml", "--out"],
    ] {
        let mut what = arguments(words);
        what.push(name.into());
        assert_refused(&what, &hybridsim(&what, folder.path()), &["is not UTF-8", "hint: rename"]);
        assert!(!folder.path().join("made").exists());
    }
    // Nor is it written into settings where it is the name of a folder above.
    let inside = folder.path().join(name);
    std::fs::create_dir(inside.join("recording")).unwrap();
    std::fs::write(inside.join("a.toml"), "[data]\nrecordings = [\"recording\"]\n").unwrap();
    let what = arguments(&["train", "a.toml", "--device", "flex", "--out", "run"]);
    assert_refused(&what, &hybridsim(&what, &inside), &["is not UTF-8", "hint: rename"]);
    assert!(!inside.join("run").exists());
}
