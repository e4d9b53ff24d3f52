//! What would be found in a recording of one's own, and what its p-values are worth: `challenge salt` and `challenge calibrate`, on tiny
//! recordings.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

use hybridsim::challenge::salt::{ANSWERS, dose};
use hybridsim::data::Recording;
use hybridsim::diagnosis::calibration::Calibration;
use serde_json::Value;

/// An empty room before a small radar; `samples` per chirp.
fn config(folder: &Path, name: &str, samples: usize) -> PathBuf {
    let path = folder.join(format!("{name}.toml"));
    let text = format!(
        "[record]\nseed = 5\nempty = true\n[record.receiver]\nsnr_db = 50.0\n[record.radar]\nstart_frequency_hz = 77e9\n\
         slope_hz_per_s = 60.012e12\nsample_rate_hz = 2.2e6\nsamples_per_chirp = {samples}\nloops_per_frame = 16\n\
         adc_start_s = 6e-6\nchirp_period_s = 72e-6\nframe_period_s = 0.05\nframes = 8\ntx_m = [[0.0, 0.0, 0.0]]\n\
         rx_m = [[0.0, 0.0, 0.0], [0.001916, 0.0, 0.0]]\n"
    );
    fs::write(&path, text).unwrap();
    path
}

fn run(arguments: &[&str]) -> Output {
    let always = ["--quiet", "--device", "flex"];
    Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(arguments).args(always).output().unwrap()
}

fn done(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn refused(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Every file below a folder with its contents and the time of its last change.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>, SystemTime)> {
    let mut found = vec![];
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push((path.clone(), fs::read(&path).unwrap(), entry.metadata().unwrap().modified().unwrap()));
        }
    }
    found.sort();
    found
}

#[test]
fn strong_effects_are_found_in_a_recording_weak_ones_are_not_and_nothing_is_done_twice() {
    let parent = tempfile::tempdir().unwrap();
    let (recording, out) = (parent.path().join("recording"), parent.path().join("salt"));
    done(&["record", text(&config(parent.path(), "a", 48)), "--out", text(&recording)]);
    let untouched = files(&recording);
    let salt = [
        "challenge",
        "salt",
        text(&recording),
        "--out",
        text(&out),
        "--effects",
        "gain_drift,interference",
        "--grades",
        "2",
        "--seed",
        "t",
    ];
    // Stopped after one copy, as if killed: no truth is opened.
    let printed = done(&[&salt[..], &["--most", "1"]].concat());
    assert!(printed.contains("1 copies are answered, not all") && !out.join("results.md").exists(), "{printed}");
    let printed = done(&salt);
    assert!(printed.contains("| gain_drift |"), "{printed}");
    let result = json(&out.join("dose.json"));
    let rows = result["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let found = row["found"].as_u64().unwrap() + row["nameless"].as_u64().unwrap();
        assert_eq!(found, row["grade"].as_u64().unwrap(), "{row}");
        assert_eq!(
            (row["wrong"].as_u64(), row["unanswered"].as_u64(), row["copies"].as_u64()),
            (Some(0), Some(0), Some(1)),
            "{row}"
        );
    }
    assert_eq!(result["background"], serde_json::json!([]));
    assert!(result["refused"].as_array().unwrap().iter().any(|refused| refused[0] == "breathing"));
    assert!(fs::metadata(out.join("dose.png")).unwrap().len() > 500);
    // Another time nothing is salted or diagnosed, and the same comes out.
    let kept = ["cases", "sealed", ANSWERS, "background"];
    let before: Vec<_> =
        kept.iter().flat_map(|part| files(&out.join(part))).filter(|(path, ..)| !path.ends_with("answers.json")).collect();
    done(&salt);
    let after: Vec<_> =
        kept.iter().flat_map(|part| files(&out.join(part))).filter(|(path, ..)| !path.ends_with("answers.json")).collect();
    assert_eq!(before, after);
    assert_eq!(json(&out.join("dose.json")), result);
    assert_eq!(files(&recording), untouched);
    // Another recording, other effects or another seed are other copies.
    let other = refused(&[&salt[..6], &["spur", "--grades", "2", "--seed", "t"]].concat());
    assert!(other.contains("begun with another seed or other settings"), "{other}");
    // What is changed afterwards is noticed.
    let read = Recording::open(&recording).unwrap();
    dose::dose(&read, &out).unwrap();
    let case = fs::read_dir(out.join("cases")).unwrap().flatten().next().unwrap().path();
    let mut bytes = fs::read(case.join("if.npy")).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(case.join("if.npy"), bytes).unwrap();
    let error = dose::dose(&read, &out).unwrap_err().to_string();
    assert!(error.contains(text(Path::new(case.file_name().unwrap()))), "{error}");
}

#[test]
fn effects_that_samples_alone_cannot_be_given_are_refused_by_name() {
    let parent = tempfile::tempdir().unwrap();
    let (recording, out) = (parent.path().join("recording"), parent.path().join("salt"));
    done(&["record", text(&config(parent.path(), "a", 32)), "--out", text(&recording)]);
    for (effect, reason) in
        [("breathing", "it acts on the person"), ("if_highpass", "before and after the window"), ("gost", "no such effect")]
    {
        let printed = refused(&["challenge", "salt", text(&recording), "--out", text(&out), "--effects", effect]);
        assert!(printed.contains(effect) && printed.contains(reason), "{printed}");
    }
    assert!(!out.exists());
}

#[test]
fn a_table_of_nulls_calibrates_p_values_of_its_radar_and_of_no_other() {
    let parent = tempfile::tempdir().unwrap();
    let (own, out) = (config(parent.path(), "own", 48), parent.path().join("calibration"));
    let calibrate = ["challenge", "calibrate", text(&own), "--out", text(&out), "--nulls", "4"];
    let printed = done(&[&calibrate[..], &["--most", "1"]].concat());
    assert!(printed.contains("3 of 4 nulls are missing yet"), "{printed}");
    done(&calibrate);
    let path = out.join("calibration.json");
    let table: Calibration = serde_json::from_value(json(&path)).unwrap();
    assert_eq!((table.nulls, table.answered, table.p_values.len(), table.seeds.len()), (4, 4, 4, 4));
    assert!(table.p_values.is_sorted() && table.detectors.len() > 10 && table.false_alarms.of == 4);
    // Clopper and Pearson's upper limit of none of four: 1 − 0.025^(1/4).
    assert_eq!(table.false_alarms.alarms, 0, "{:?}", table.false_alarms);
    assert!((table.false_alarms.interval[1] - 0.6024).abs() < 1e-3, "{:?}", table.false_alarms);
    for file in ["results.md", "p_values.png"] {
        assert!(fs::metadata(out.join(file)).unwrap().len() > 500, "{file}");
    }
    let recorded = |config: &Path| {
        let folder = config.with_extension("");
        done(&["record", text(config), "--out", text(&folder)]);
        folder
    };
    let with = format!("diagnosis.calibration={}", path.display());
    let (recording, report) = (recorded(&own), parent.path().join("why"));
    let quick = ["--set", "diagnosis.epochs=0", "--set", "diagnosis.limits=false"];
    done(&[&["diagnose", text(&recording), "--out", text(&report), "--set", &with], &quick[..]].concat());
    let report = json(&report.join("report.json"));
    let (p_value, calibration) = (report["p_value"].as_f64().unwrap(), &report["calibration"]);
    let raw = calibration["p_value_raw"].as_f64().unwrap();
    let as_odd = table.p_values.iter().filter(|null| **null <= raw).count();
    assert!((p_value - (as_odd as f64 + 1.0) / 5.0).abs() < 1e-12, "{p_value} {raw} {as_odd}");
    assert_eq!((calibration["nulls"].as_u64(), calibration["format"].as_u64()), (Some(4), Some(1)));
    assert!(report["settings"].as_str().unwrap().contains("calibration table 1 "), "{}", report["settings"]);
    // Another radar, and another program.
    let other = recorded(&config(parent.path(), "other", 32));
    let printed = refused(&["diagnose", text(&other), "--out", text(&parent.path().join("no")), "--set", &with]);
    assert!(
        printed.contains("`structure.radar.samples_per_chirp` is 48, expected 32, as ") && printed.contains("calibrate"),
        "{printed}"
    );
    let foreign = parent.path().join("foreign.json");
    fs::write(&foreign, fs::read_to_string(&path).unwrap().replace("sources ", "sources of ")).unwrap();
    let printed = refused(&["diagnose", text(&recording), "--set", &format!("diagnosis.calibration={}", foreign.display())]);
    assert!(printed.contains("`program` is hybridsim"), "{printed}");
    // The nulls of a recording have its structure.
    let of_recording = parent.path().join("of_recording");
    done(&["challenge", "calibrate", text(&recording), "--out", text(&of_recording), "--nulls", "2"]);
    let second: Calibration = serde_json::from_value(json(&of_recording.join("calibration.json"))).unwrap();
    assert_eq!(second.structure, table.structure);
}
