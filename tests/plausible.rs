//! A scene that cannot be is refused by every verb with the same sentence, and scenes that can be are not.

use crate::support;

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use hybridsim::config::Config;
use hybridsim::data::{Recording, Shard, write_body};
use hybridsim::person::Person;
use hybridsim::person::procedural::{self, PersonConfig};
use hybridsim::plausibility::{CodeFacts, Facts, Finding, Kind, findings};
use hybridsim::radar::Radar;
use hybridsim::recorder::{Interpolation, body::MovingBody};
use hybridsim::room::Room;
use hybridsim::site::{SiteConfig, implausible};

fn hybridsim(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(arguments).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn root(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path).display().to_string()
}

/// A folder with `recording`, one of `configs/test.toml` in which `from` became `to`.
fn recorded(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let output = hybridsim(&["record", &root("configs/test.toml"), "-q", "--out", "recording"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    let settings = folder.path().join("recording/recording.toml");
    let text = std::fs::read_to_string(&settings).unwrap();
    let line = text.lines().find(|line| line.starts_with(from)).unwrap_or_else(|| panic!("no `{from}` in\n{text}"));
    std::fs::write(&settings, text.replace(line, to)).unwrap();
    folder
}

/// The arguments of every verb that is given `recording` in a folder.
fn verbs_of_a_recording(folder: &Path) -> Vec<Vec<String>> {
    let text = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<String>>();
    let model = root("models/quickstart");
    // The paths of a config start from its folder.
    let learnt = format!("data.recordings=[{:?}]", folder.join("recording").display().to_string());
    vec![
        text(&["check", "recording"]),
        text(&["train", &root("configs/test.toml"), "--set", &learnt, "--out", "run"]),
        text(&["baseline", "mmgpe", "recording", "--device", "flex"]),
        text(&["diagnose", "recording", "--device", "flex"]),
        text(&["evaluate", "--checkpoint", &model, "recording", "--device", "flex"]),
        text(&["infer", "--checkpoint", &model, "--recording", "recording", "--device", "flex"]),
    ]
}

fn assert_all_say(folder: &Path, verbs: &[Vec<String>], sentence: &str, hint: &str) {
    for verb in verbs {
        let verb: Vec<&str> = verb.iter().map(String::as_str).collect();
        let output = hybridsim(&verb, folder);
        let text = err(&output);
        assert_eq!(output.status.code(), Some(2), "{verb:?}:\n{text}");
        assert!(text.contains(sentence), "{verb:?} does not say `{sentence}`:\n{text}");
        assert!(text.contains(hint) && text.contains("--as-stated"), "{verb:?}:\n{text}");
    }
}

#[test]
fn every_verb_refuses_a_radar_in_other_units_with_the_same_words() {
    let folder = recorded("slope_hz_per_s", "slope_hz_per_s = 60.012");
    let slope = "record.radar.slope_hz_per_s=60.012".to_string();
    let mut verbs = verbs_of_a_recording(folder.path());
    // A site's and an experiment's own settings.
    verbs.push(vec!["record".into(), root("configs/test.toml"), "--set".into(), slope.clone(), "--out".into(), "made".into()]);
    verbs.push(vec!["site".into(), root("configs/site_smoke.toml"), "--set".into(), slope, "--out".into(), "site".into()]);
    let sentence = "`radar.slope_hz_per_s` is 60.012, expected 1e9 to 1e15 Hz/s";
    assert_all_say(folder.path(), &verbs, sentence, "in MHz/us it would be 6.0012e13 Hz/s: multiply by 1e12");
    assert!(!folder.path().join("made").exists() && !folder.path().join("run/last").exists());
}

#[test]
fn every_verb_refuses_a_person_behind_the_wall_and_a_user_can_keep_his_word() {
    let folder = recorded("origin_m", "origin_m = [0.0, 8.0, -1.0]");
    let mut verbs = verbs_of_a_recording(folder.path());
    let far = |verb: &[&str]| verb.iter().map(ToString::to_string).collect::<Vec<String>>();
    verbs.push(far(&["record", &root("configs/test.toml"), "--set", "record.person.distance_m=8.0", "--out", "made"]));
    verbs.push(far(&["site", &root("configs/site_smoke.toml"), "--set", "style.distance_m=[8.0, 8.0]", "--out", "site"]));
    let model = root("models/quickstart");
    verbs.push(far(&[
        "infer",
        "--checkpoint",
        &model,
        "--action",
        "lunge",
        "--distance",
        "8",
        "--frames",
        "2",
        "--device",
        "flex",
    ]));
    let sentence = " m beyond the front boundary at ";
    assert_all_say(folder.path(), &verbs, sentence, "move the person with motion.origin_m, person.distance_m or --distance");

    let output = hybridsim(&["check", "recording", "--as-stated"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    assert!(err(&output).contains("front boundary") && err(&output).contains(", taken as stated"), "{}", err(&output));
}

#[test]
fn a_person_too_far_around_the_radar_or_behind_it_is_not_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let model = root("models/quickstart");
    for (place, message) in [
        ("--distance=20", "expected a body within the radar's unambiguous range of"),
        ("--distance=0", "the body around the radar at "),
        ("--distance=-2", "expected a body before the radar, which looks along +y"),
        ("--raise=-1.5", "m (infer --raise) it would stand on it"),
    ] {
        let infer = ["infer", "--checkpoint", &model, "--action", "torso_rotation", place, "--frames", "2", "--device", "flex"];
        let output = hybridsim(&infer, folder.path());
        assert_eq!(output.status.code(), Some(2), "{}", err(&output));
        assert!(err(&output).contains(message), "{place}: {}", err(&output));
    }
}

#[test]
fn check_says_what_a_body_or_a_motion_is() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = procedural::person(&PersonConfig::default()).unwrap();
    let body = folder.path().join("body.npz");
    write_body(&body, &model).unwrap();
    let output = hybridsim(&["check", "body.npz"], folder.path());
    assert!(output.status.success(), "{}", err(&output));
    for part in ["body: body.npz", "24, ", "rest pose", "closed, volume 0.0"] {
        assert!(out(&output).contains(part), "`{part}` is missing in:\n{}", out(&output));
    }
    model.faces.iter_mut().for_each(|face| face.swap(1, 2));
    write_body(&body, &model).unwrap();
    let output = hybridsim(&["check", "body.npz"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(err(&output).contains("body.npz: `f` is a mesh turned inside out"), "{}", err(&output));
    model.template.iter_mut().flatten().for_each(|x| *x *= 1000.0);
    write_body(&body, &model).unwrap();
    let text = err(&hybridsim(&["check", "body.npz"], folder.path()));
    assert!(
        text.contains("error: body.npz: `v_template` is a body 1") && text.contains("in millimetres it would be 1."),
        "{text}"
    );

    let made = recorded("origin_m", "origin_m = [0.0, 3.0, -1.0]");
    let output = hybridsim(&["check", "recording/motion.npz"], made.path());
    assert!(output.status.success(), "{}", err(&output));
    for part in ["motion: recording/motion.npz", "mocap_framerate", " Hz, ", "speed ", "deg from y"] {
        assert!(out(&output).contains(part), "`{part}` is missing in:\n{}", out(&output));
    }
    // The hint of a motion that seems to lie is one that `check` takes, and nothing else does.
    let lying = hybridsim(&["check", "recording/motion.npz", "--up", "z"], made.path());
    assert!(format!("{}{}", out(&lying), err(&lying)).contains("lies"), "{}{}", out(&lying), err(&lying));
    for path in ["recording", "body.npz"] {
        let path = if path == "recording" { made.path().join(path) } else { body.clone() };
        let output = hybridsim(&["check", path.to_str().unwrap(), "--up", "z"], folder.path());
        assert!(output.status.code() == Some(2) && err(&output).contains("--up: no motion's file is read"), "{}", err(&output));
    }
    std::fs::write(folder.path().join("nothing.bvh"), "no hierarchy").unwrap();
    assert_eq!(hybridsim(&["check", "nothing.bvh"], folder.path()).status.code(), Some(2));
}

#[test]
fn check_says_what_a_mesh_is() {
    let folder = tempfile::tempdir().unwrap();
    let faces = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let cuboid = |height: f64| {
        let corner = |x: f64, y: f64, z: f64| format!("v {x} {y} {z}\n");
        let level = |z: f64| [corner(0.0, 0.0, z), corner(0.5, 0.0, z), corner(0.5, 0.3, z), corner(0.0, 0.3, z)].concat();
        format!("{}{}{faces}", level(0.0), level(height))
    };
    let path = folder.path().join("body.obj");
    std::fs::write(&path, cuboid(1.7)).unwrap();
    let output = hybridsim(&["check", "body.obj"], folder.path());
    let text = out(&output);
    assert!(output.status.success() && text.contains("8 x 12, one pose") && text.contains("closed, volume 0.2550 m3"), "{text}");
    assert!(err(&output).contains("metres are assumed"), "{}", err(&output));
    // With y up, as many tools write.
    let y_up = |line: &str| match line.split(' ').collect::<Vec<_>>()[..] {
        ["v", x, y, z] => format!("v {x} {z} -{y}\n"),
        _ => format!("{line}\n"),
    };
    std::fs::write(&path, cuboid(1.7).lines().map(y_up).collect::<String>()).unwrap();
    let output = hybridsim(&["check", "body.obj"], folder.path());
    assert!(output.status.success() && err(&output).contains("90 deg from z"), "{}", err(&output));
    // In millimetres along one axis, and inside out.
    std::fs::write(&path, cuboid(1700.0)).unwrap();
    let text = err(&hybridsim(&["check", "body.obj"], folder.path()));
    assert!(text.contains("a body 1700.0000 m long") && text.contains("millimetres"), "{text}");
    let upright = cuboid(1.7);
    let turned = upright.lines().map(|line| match line.strip_prefix("f ") {
        Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    });
    std::fs::write(&path, turned.collect::<String>()).unwrap();
    let output = hybridsim(&["check", "body.obj"], folder.path());
    assert!(output.status.code() == Some(2) && err(&output).contains("turned inside out"), "{}", err(&output));
}

#[test]
fn check_states_no_velocity_of_one_chirp_a_frame_and_reads_a_falling_one() {
    let folder = recorded("slope_hz_per_s", "slope_hz_per_s = -60.012e12");
    let output = hybridsim(&["check", "recording"], folder.path());
    assert!(output.status.success() && out(&output).contains(", falling"), "{}", err(&output));
    let output = hybridsim(&["diagnose", "recording", "--device", "flex"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    let message = "recording.toml: `radar.slope_hz_per_s` is -60012000000000, expected a rising chirp (above zero)";
    assert!(err(&output).contains(message), "{}", err(&output));
    let one = hybridsim(&["check", &root("configs/test.toml"), "--set", "record.radar.loops_per_frame=1"], folder.path());
    assert!(out(&one).contains("one chirp a frame measures none"), "{}\n{}", out(&one), err(&one));
}

/// What all checks find of a scene that the library has read.
fn look(radar: &Radar, room: Option<&Room>, person: Option<&Person>, codes: Option<CodeFacts>) -> Vec<Finding> {
    let body = person.map(|person| MovingBody::new(person, Interpolation::Linear).unwrap());
    let pose = |pose| body.as_ref().map_or_else(Vec::new, |body| body.pose(pose));
    findings(&Facts { codes, ..Facts::new(Some(radar), room, person, &pose) })
}

fn refusals(found: Vec<Finding>) -> Vec<Finding> {
    found.into_iter().filter(|finding| finding.kind == Kind::Refuse).collect()
}

#[test]
fn recordings_of_others_are_plausible() {
    for group in ["planted", "structures", "real"] {
        let Some(folder) = support::shared(&format!("recordings/{group}")) else { return };
        let folders = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let folders: Vec<PathBuf> = folders.filter(|path| path.join("recording.toml").is_file()).collect();
        assert!(folders.len() >= 3, "{group} holds recordings");
        for folder in folders {
            let recording = Recording::open(&folder).unwrap();
            let codes = CodeFacts::new(&recording.number_type(), recording.frame(0).unwrap().re.iter());
            let found = look(&recording.radar, recording.room.as_ref(), recording.person(), codes);
            // Notes may be: one chirp a frame measures no velocity of a walker.
            assert_eq!(refusals(found), [], "{}", folder.display());
        }
    }
}

#[test]
fn configs_describe_plausible_scenes() {
    let folder = root("configs");
    let mut looked = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".toml") || name.starts_with("challenge") || name.starts_with("reproduce") {
            continue;
        }
        if name.starts_with("site") {
            // Minutes of motion take too long to look at here.
            if name.contains("mmmesh") || name.contains("paper") || name.contains("skin") {
                continue;
            }
            let config = SiteConfig::read(&path, &[]).unwrap();
            for (sequence, found) in implausible(&config, Path::new(&folder), false, Shard::ALL).unwrap() {
                assert_eq!(refusals(found), [], "{name}: {sequence}");
            }
        } else {
            let config = Config::read(&path, &[]).unwrap();
            let Some(record) = &config.record else { continue };
            let world = record.world(Path::new(&folder)).unwrap();
            assert_eq!(refusals(look(&world.radar, Some(&world.room), world.person.as_ref(), None)), [], "{name}");
        }
        looked += 1;
    }
    assert!(looked >= 3);
}
