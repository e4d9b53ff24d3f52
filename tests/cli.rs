//! The program as its user meets it: help, results, errors with their hints, exit status.

use crate::support;

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn hybridsim(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(arguments).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn test_config() -> String {
    root().join("configs/test.toml").display().to_string()
}

/// A recording of `configs/test.toml`, made once by the program itself.
fn recording() -> PathBuf {
    static ONCE: std::sync::OnceLock<(tempfile::TempDir, PathBuf)> = std::sync::OnceLock::new();
    let (_, folder) = ONCE.get_or_init(|| {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("recording");
        let output = hybridsim(&["record", &test_config(), "-q", "--out", folder.to_str().unwrap()], parent.path());
        assert!(output.status.success(), "{}", err(&output));
        (parent, folder)
    });
    folder.clone()
}

/// A copy of the recording to spoil.
fn spoiled(spoil: impl FnOnce(&Path)) -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(recording()).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, copy.path().join(path.file_name().unwrap())).unwrap();
    }
    spoil(copy.path());
    copy
}

fn replace(file: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no `{from}`:\n{text}", file.display());
    std::fs::write(file, text.replace(from, to)).unwrap();
}

fn assert_refused(output: &Output, status: i32, parts: &[&str]) {
    let text = err(output);
    assert_eq!(output.status.code(), Some(status), "{text}");
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing in:\n{text}");
    }
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
fn help_names_every_verb_and_where_to_start() {
    let output = hybridsim(&["--help"], &root());
    assert!(output.status.success());
    for word in ["check", "record", "train", "infer", "evaluate", "--set", "--device", "configs/quickstart.toml"] {
        assert!(out(&output).contains(word), "{word} is missing in:\n{}", out(&output));
    }
    for verb in ["check", "record", "train", "infer", "evaluate", "compare"] {
        let output = hybridsim(&[verb, "--help"], &root());
        assert!(out(&output).lines().count() > 10, "{verb} --help teaches nothing:\n{}", out(&output));
    }
}

#[test]
fn a_run_leaves_pictures_numbers_and_a_model_that_infers_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = format!("data.recordings=[{:?}]", recording().display().to_string());
    let arguments =
        ["train", &test_config(), "-q", "--device", "flex", "--set", "training.epochs=2", "--set", &recordings, "--out", "run"];
    let output = hybridsim(&arguments, folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(out(&output).contains("PSNR") && out(&output).contains("report: run/report.html"), "{}", out(&output));
    let run = folder.path().join("run");
    for file in [
        "config.toml",
        "metrics.json",
        "run.json",
        "report.md",
        "report.html",
        "loss.png",
        "range_doppler.png",
        "range_doppler_moving.png",
        "time_doppler.png",
        "best/weights.safetensors",
        "last/checkpoint.toml",
    ] {
        assert!(run.join(file).is_file(), "{file} is missing");
    }

    let output = hybridsim(&arguments, folder.path());
    assert_refused(&output, 2, &["run: already holds a run", "--resume"]);

    let output = hybridsim(
        &["infer", "--checkpoint", "run/best", "--action", "lunge", "--frames", "2", "-q", "--out", "made"],
        folder.path(),
    );
    assert!(output.status.success(), "{}", err(&output));
    assert!(folder.path().join("made/recording/if.npy").is_file());
    assert!(folder.path().join("made/range_doppler.png").is_file());

    let recorded = recording().display().to_string();
    let arguments =
        ["baseline", "two-bounce", &recorded, "--checkpoint", "run/best", "-q", "--device", "flex", "--out", "mirrors"];
    let output = hybridsim(&arguments, folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(folder.path().join("mirrors/recording/if.npy").is_file());
    let output = hybridsim(&["evaluate", "--checkpoint", "run/best", &recorded, "-q"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(out(&output).contains("person's cells") && !out(&output).contains("LPIPS"), "{}", out(&output));
}

#[test]
fn two_folders_of_recordings_are_compared_by_name_with_an_interval_over_them() {
    let folder = tempfile::tempdir().unwrap();
    let recorded = recording().display().to_string();
    let output = hybridsim(&["compare", &recorded, &recorded, "-q", "--set", "metrics.span_db=60"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(out(&output).contains("60 dB below") && out(&output).contains("PSNR 100.00"), "{}", out(&output));
    assert!(!out(&output).contains("LPIPS") && !out(&output).contains("together"), "{}", out(&output));

    // a site, and a method's simulations of it, the second in a folder of results as `infer` leaves it
    for (from, to) in [("measured", ["a", "b", "c"]), ("simulated", ["a", "b/recording", ""])] {
        for name in to.into_iter().filter(|name| !name.is_empty()) {
            let target = folder.path().join(from).join(name);
            std::fs::create_dir_all(&target).unwrap();
            for entry in std::fs::read_dir(recording()).unwrap() {
                let path = entry.unwrap().path();
                std::fs::copy(&path, target.join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    let output = hybridsim(&["compare", "measured", "simulated", "-q", "--out", "found"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(out(&output).contains("2 sequences") && err(&output).contains("1 of 3 measured recordings"), "{}", out(&output));
    let found: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("found/metrics.json")).unwrap()).unwrap();
    assert_eq!(found["recordings"]["b"]["global"]["psnr_db"]["interval"], serde_json::Value::Null);
    assert_eq!(found["over_sequences"]["global"]["psnr_db"]["interval"], 0.0);
    assert!(folder.path().join("found/config.toml").is_file());
    assert_refused(&hybridsim(&["compare", "measured", "simulated", "--out", "found"], folder.path()), 2, &["exists already"]);
    assert_refused(&hybridsim(&["compare", "measured", "found"], folder.path()), 2, &["found: holds no recording"]);
    assert_refused(&hybridsim(&["compare", "simulated", "measured"], folder.path()), 2, &["c: no measured recording"]);
}

#[test]
fn a_network_without_its_files_is_no_network() {
    let folder = tempfile::tempdir().unwrap();
    let recorded = recording().display().to_string();
    let compare = ["compare", &recorded, &recorded, "--out", "found", "--lpips", "squeeze"];
    assert_refused(&hybridsim(&compare, folder.path()), 2, &["--lpips-weights", "--lpips-heads"]);
    std::fs::write(folder.path().join("wrong.pth"), "no weights").unwrap();
    let files = ["--lpips-weights", "wrong.pth", "--lpips-heads", "heads.npz"];
    assert_refused(&hybridsim(&[&compare[..], &files].concat(), folder.path()), 2, &["wrong.pth: cannot be read as torch"]);
    assert!(!folder.path().join("found").exists());
}

#[test]
fn baselines_write_recordings_with_the_labels_of_what_they_imitate() {
    let folder = tempfile::tempdir().unwrap();
    let recorded = recording().display().to_string();
    for method in ["mmgpe", "mmgpe-surface", "rf-genesis", "rf-genesis-released"] {
        let arguments = ["baseline", method, &recorded, "-q", "--device", "flex", "--calibrate", &recorded, "--out", method];
        let output = hybridsim(&arguments, folder.path());
        assert!(output.status.success(), "{method}: {}", err(&output));
        let made = folder.path().join(method);
        assert!(made.join("recording/if.npy").is_file() && made.join("range_doppler.png").is_file());
        let settings = std::fs::read_to_string(made.join("recording/recording.toml")).unwrap();
        assert!(settings.contains("walk_back_forth"), "the action is missing in:\n{settings}");
        let about = std::fs::read_to_string(made.join("baseline.json")).unwrap();
        let about: serde_json::Value = serde_json::from_str(&about).unwrap();
        assert_eq!(about["method"], method);
        assert!(about["gain"].as_f64().unwrap() > 0.0);
        let run = std::fs::read_to_string(made.join("run.json")).unwrap();
        let run: serde_json::Value = serde_json::from_str(&run).unwrap();
        assert!(run["seconds_per_frame"].as_f64().unwrap() > 0.0);
        assert_eq!(about["noise_rate"], 0.025);
    }
    let arguments = ["baseline", "mmgpe", &recorded, "-q", "--device", "flex", "--out", "noisy", "--receiver-noise", &recorded];
    assert!(hybridsim(&arguments, folder.path()).status.success());
    let about = std::fs::read_to_string(folder.path().join("noisy/baseline.json")).unwrap();
    let about: serde_json::Value = serde_json::from_str(&about).unwrap();
    assert!(about["noise_rate"].is_null() && about["noise_level"].as_f64().unwrap() > 0.0, "{about}");
    let refused = |arguments: &[&str]| hybridsim(&[&["baseline"], arguments].concat(), folder.path());
    assert_refused(&refused(&["two-bounce", &recorded]), 2, &["--checkpoint belongs to two-bounce", "hint: "]);
    assert_refused(&refused(&["mmgpe", &recorded, "--set", "diffus=1"]), 2, &["unknown key `diffus`", "`diffuse`"]);
    assert_refused(&refused(&["mmgpe", &recorded, "--gain", "-1"]), 2, &["--gain"]);
}

/// Record, diagnose, add, train: one command.
#[test]
fn a_simulator_is_trained_with_what_the_diagnosis_finds() {
    let folder = tempfile::tempdir().unwrap();
    let highpass = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/highpass.toml").display().to_string();
    let recorded = hybridsim(&["record", &highpass, "-q", "--out", "recorded"], folder.path());
    assert!(recorded.status.success(), "{}", err(&recorded));
    let data = format!("data.recordings=[{:?}]", folder.path().join("recorded").display().to_string());
    let (config, sets) = (test_config(), [data.as_str(), "training.epochs=1", "diagnosis.limits=false", "diagnosis.epochs=0"]);
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    let arguments: Vec<&str> =
        ["train", &config, "-q", "--device", "flex", "--out", "with", "--diagnose"].into_iter().chain(sets).collect();
    let output = hybridsim(&arguments, folder.path());
    assert!(output.status.success(), "{}", err(&output));
    let text = |path: &str| std::fs::read_to_string(folder.path().join("with").join(path)).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text("diagnosis/effects.json")).unwrap();
    assert_eq!(found[0]["id"], "if_highpass");
    let corner_hz = found[0]["parameters"]["corner_hz"][0].as_f64().unwrap();
    assert!((300e3..400e3).contains(&corner_hz), "planted at 350 kHz, found at {corner_hz}");
    assert!(text("config.toml").contains("if_highpass") && text("diagnosis/report.json").contains("if_highpass"));
    assert!(text("report.md").contains("found: if_highpass (`diagnosis/report.html`)"), "{}", text("report.md"));
    // It is part of what was trained.
    let shown = hybridsim(&["check", "with/best"], folder.path());
    assert!(String::from_utf8_lossy(&shown.stdout).contains("effect if_highpass: corner_hz"), "{shown:?}");
    let resumed = hybridsim(&["train", "--resume", "with", "--diagnose"], folder.path());
    assert_refused(&resumed, 2, &["--diagnose", "--resume"]);
    // Left out of the library it has no name.
    let without = |id: &str| {
        let left_out = format!("diagnosis.left_out=[{id:?}]");
        let sets = ["--set", "diagnosis.limits=false", "--set", "diagnosis.epochs=0", "--set", &left_out];
        hybridsim(&[&["diagnose", "recorded", "-q", "--out", "unnamed"][..], &sets].concat(), folder.path())
    };
    assert!(without("if_highpass").status.success());
    let report = std::fs::read_to_string(folder.path().join("unnamed/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let named = |list: &str| report[list].as_array().unwrap().iter().any(|entry| entry["id"] == "if_highpass");
    assert!(!named("effects") && !named("not_detectable"), "{report:#}");
    // What is left of it is said all the same.
    let lead = std::fs::read_to_string(folder.path().join("unnamed/report.html")).unwrap();
    assert!(report["verdict"] != "no_mismatch" || lead.contains("Nothing was located, and yet"), "{report:#}");
    assert!(report["settings"].as_str().unwrap().contains("left_out"), "{report:#}");
    assert_refused(&without("if_hipass"), 2, &["`diagnosis.left_out`", "if_hipass", "hybridsim effects"]);
}

#[test]
fn effects_are_part_of_the_checkpoint_and_can_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let recordings = format!("data.recordings=[{:?}]", recording().display().to_string());
    let effects = "simulator.effects=[{id=\"if_highpass\",parameters={corner_hz=[4e5]}}]";
    let sets = ["--set", "training.epochs=1", "--set", &recordings, "--set", effects];
    let output =
        hybridsim(&[&["train", &test_config(), "-q", "--device", "flex", "--out", "run"], &sets[..]].concat(), folder.path());
    assert!(output.status.success(), "{}", err(&output));
    let infer = |name: &str, more: &[&str]| {
        let arguments =
            ["infer", "--checkpoint", "run/best", "--action", "lunge", "--frames", "1", "--clean", "-q", "--out", name];
        let output = hybridsim(&[&arguments, more].concat(), folder.path());
        assert!(output.status.success(), "{}", err(&output));
        std::fs::read(folder.path().join(name).join("recording/if.npy")).unwrap()
    };
    let with = infer("with", &[]);
    let without = infer("without", &["--without-effects"]);
    assert_ne!(with, without);
    assert_eq!(without, infer("named", &["--without-effect", "if_highpass"]));
    // What acts on the sum of the parts leaves no part alone; without it, the three of them are the whole.
    let part = |name: &str, more: &[&str]| {
        let arguments = ["infer", "--checkpoint", "run/best", "--action", "lunge", "--frames", "2", "-q", "--out", name];
        hybridsim(&[&arguments, more].concat(), folder.path())
    };
    assert_refused(
        &part("direct", &["--only", "direct"]),
        2,
        &["--only direct: the checkpoint has effects", "--without-effects"],
    );
    let samples = |name: &str, more: &[&str]| -> Vec<f32> {
        let output = part(name, &[&["--without-effects"], more].concat());
        assert!(output.status.success(), "{}", err(&output));
        assert!(folder.path().join(name).join("range_doppler.png").is_file());
        let recording = hybridsim::data::Recording::open(folder.path().join(name).join("recording")).unwrap();
        let frame = recording.frame(1).unwrap();
        frame.re.iter().chain(frame.im.iter().flatten()).copied().collect()
    };
    let whole = samples("whole", &[]);
    let parts = ["direct", "indirect", "noise"].map(|name| samples(name, &["--only", name]));
    let largest = |values: &[f32]| values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
    assert!(parts.iter().all(|part| largest(part) > 1e-3 * largest(&whole)));
    let apart: Vec<f32> = (0..whole.len()).map(|n| whole[n] - parts.iter().map(|part| part[n]).sum::<f32>()).collect();
    assert!(largest(&apart) < 1e-5 * largest(&whole), "{} of {}", largest(&apart), largest(&whole));
    let arguments = ["infer", "--checkpoint", "run/best", "--action", "lunge", "--without-effect", "dc_offset"];
    assert_refused(&hybridsim(&arguments, folder.path()), 2, &["the checkpoint has no such effect", "if_highpass"]);
    let wrong = ["train", &test_config(), "--set", "simulator.effects=[{id=\"if_hipass\"}]"];
    assert_refused(&hybridsim(&wrong, folder.path()), 2, &["`simulator.effects.0.id` is if_hipass", "if_highpass"]);
    let recorded = recording().display().to_string();
    let output = hybridsim(&["evaluate", "--checkpoint", "run/best", &recorded, "-q", "--without-effects"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    let shown = hybridsim(&["check", "run/best"], folder.path());
    assert!(String::from_utf8_lossy(&shown.stdout).contains("effect if_highpass: corner_hz"), "{shown:?}");
    // Another training may start from its weights with other effects.
    let start = format!("training.start_from={:?}", folder.path().join("run/best").display().to_string());
    let sets = ["--set", "training.epochs=1", "--set", &recordings, "--set", "simulator.effects=[]", "--set", &start];
    let output =
        hybridsim(&[&["train", &test_config(), "-q", "--device", "flex", "--out", "onwards"], &sets[..]].concat(), folder.path());
    assert!(output.status.success(), "{}", err(&output));
}

#[test]
fn a_misspelt_key_is_named_with_the_one_that_was_meant() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.toml"), "[training]\nepoch = 3\n").unwrap();
    let output = hybridsim(&["train", "bad.toml"], folder.path());
    assert_refused(&output, 2, &["error: bad.toml", "unknown key `", "epoch`", "`epochs`", "hint: "]);
    let output = hybridsim(&["train", &test_config(), "--set", "training.epochz=3"], folder.path());
    assert_refused(&output, 2, &["epochz`", "`epochs`"]);
    assert!(!folder.path().join("runs").exists(), "something was left behind");
}

#[test]
fn an_unknown_device_is_refused_with_those_that_work() {
    let output = hybridsim(&["train", &test_config(), "--device", "abacus"], &root());
    assert_refused(&output, 2, &["no device `abacus` here, available: flex"]);
}

#[test]
fn a_room_beyond_the_unambiguous_range_stops_training_and_is_a_warning_elsewhere() {
    let far = spoiled(|folder| {
        let file = folder.join("recording.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let front = text.lines().find(|line| line.starts_with("front_m")).unwrap().to_string();
        replace(&file, &front, "front_m = 40.0");
    });
    let path = far.path().display().to_string();
    let recordings = format!("data.recordings=[{path:?}]");
    let output = hybridsim(&["train", &test_config(), "--set", &recordings, "--out", "run"], far.path());
    assert_refused(&output, 2, &["recording.toml: `room` is up to 40.00 m away", "unambiguous range", "hint: "]);
    let output = hybridsim(&["check", &path], far.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(err(&output).contains("warning: ") && err(&output).contains("folds back"), "{}", err(&output));
}

#[test]
fn truncated_samples_are_refused_before_hours_are_spent() {
    let cut = spoiled(|folder| {
        let file = folder.join("if.npy");
        let bytes = std::fs::read(&file).unwrap();
        std::fs::write(&file, &bytes[..bytes.len() - 100]).unwrap();
    });
    let path = cut.path().display().to_string();
    let recordings = format!("data.recordings=[{path:?}]");
    let output = hybridsim(&["train", &test_config(), "--set", &recordings, "--out", "run"], cut.path());
    assert_refused(&output, 2, &["if.npy"]);
    assert!(!cut.path().join("run/last").exists());
    assert_refused(&hybridsim(&["check", &path], cut.path()), 2, &["if.npy"]);
}

#[test]
fn a_missing_config_is_said_to_be_missing() {
    let output = hybridsim(&["train", "nowhere.toml"], &root());
    assert_refused(&output, 2, &["error: nowhere.toml: cannot be read", "hint: check the path"]);
}

#[test]
fn a_folder_without_a_checkpoint_is_no_checkpoint() {
    let output = hybridsim(&["infer", "--checkpoint", "src", "--action", "lunge"], &root());
    assert_refused(&output, 2, &["src: not a checkpoint", "`best` and `last`"]);
    let output = hybridsim(&["infer", "--checkpoint", "src", "--action", "flying"], &root());
    assert_refused(&output, 2, &["torso_rotation"]);
}

#[test]
fn a_full_disk_stops_with_what_to_do_and_leaves_nothing() {
    let full = Path::new("/dev/full");
    if !full.exists() {
        support::skip("/dev/full");
        return;
    }
    // A folder on a full disk cannot be had without privileges; a file that cannot be created behaves alike.
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("file");
    std::fs::write(&target, "in the way").unwrap();
    let below = target.join("run").display().to_string();
    let recordings = format!("data.recordings=[{:?}]", recording().display().to_string());
    let output = hybridsim(&["train", &test_config(), "-q", "--set", &recordings, "--out", &below], folder.path());
    assert_refused(&output, 1, &["cannot be written"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
