//! Motions that are stated at a wrong place, heading and time are found again from the recording alone, or nothing is claimed.

use std::path::{Path, PathBuf};
use std::process::Command;

use hybridsim::alignment::{Alignment, Search, Verdict, align};
use hybridsim::data::settings::read_text;
use hybridsim::data::{Recording, recording::RecordingSettings, write_motion, write_placement};
use hybridsim::person::Placement;
use hybridsim::person::actions::{self, Action, StyleConfig};
use hybridsim::person::procedural::{self, PersonConfig};
use hybridsim::radar::Radar;
use hybridsim::recorder::{self, RecorderConfig};

/// Cells of 8.6 cm and 0.28 m/s; four receivers half a wavelength apart.
const RADAR: &str = r#"
[radar]
start_frequency_hz = 77.0e9
slope_hz_per_s = 60.012e12
sample_rate_hz = 4.4e6
samples_per_chirp = 128
loops_per_frame = 32
adc_start_s = 6.0e-6
chirp_period_s = 216.0e-6
frame_period_s = 0.1
frames = 24
tx_m = [[-0.0153, 0.0, 0.0]]
rx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]
"#;

/// Where the recorded motion happens. It begins before the recording.
fn truth() -> Placement {
    let straight = Placement { start_s: -1.0, origin_m: [0.3, 2.9, -1.0], ..Placement::default() };
    straight.turned(30.0)
}

/// 0.37 s late, 0.4 m off, 25 degrees turned.
fn wrong() -> Placement {
    let off = truth().turned(25.0);
    Placement { start_s: off.start_s + 0.37, origin_m: [off.origin_m[0] + 0.24, off.origin_m[1] - 0.32, off.origin_m[2]], ..off }
}

/// Records with the true placement; the recording states another one.
fn recorded(folder: &Path, text: &str, receivers: usize, stated: &Placement) -> PathBuf {
    recorded_by(folder, text, |radar| radar.rx_m.truncate(receivers), stated)
}

fn recorded_by(folder: &Path, text: &str, change: impl Fn(&mut Radar), stated: &Placement) -> PathBuf {
    let mut config: RecorderConfig = read_text(&format!("seed = 5\nmesh_error_m = 2e-3\n{text}\n{RADAR}")).unwrap();
    config.person.placement = Some(truth());
    let mut radar = config.radar.radar().unwrap();
    change(&mut radar);
    config.radar = recorder::RadarChoice::Full(Box::new(radar));
    let out = folder.join("recording");
    recorder::record_to(&config, Path::new("."), &out, &mut |_, _| {}).unwrap();
    write_placement(&out.join("recording.toml"), stated).unwrap();
    out
}

const WALK: &str = "[person]\naction = \"walk_back_forth_armswing\"\n[surface]\nedge_m = 0.012";
const CIRCLE: &str = "[person]\naction = \"walk_counterclockwise\"\nstyle.variation = 0.0\n[surface]\nedge_m = 0.012";

fn aligned(folder: &Path) -> Alignment {
    let alignment = align(&Recording::open(folder).unwrap(), &Search::default(), &mut |_| {}).unwrap();
    println!("{}\n{}{:?}", alignment.sentence, alignment.lines(), alignment.gain);
    alignment
}

/// Found within its interval and within a tolerance.
#[track_caller]
fn found(alignment: &Alignment, name: &str, wanted: f64, tolerance: f64) {
    let estimate = &alignment.estimates[name];
    let [low, high] = estimate.ci90.unwrap_or_else(|| panic!("{name} is not identified: {:?}", estimate.why_not));
    assert!((low..=high).contains(&wanted), "{name}: {wanted} is not in [{low}, {high}]");
    assert!((estimate.value - wanted).abs() < tolerance, "{name}: {} and not {wanted}", estimate.value);
}

#[test]
fn a_motion_that_is_late_turned_and_aside_is_put_back() {
    let folder = tempfile::tempdir().unwrap();
    let alignment = aligned(&recorded(folder.path(), WALK, 4, &wrong()));
    assert_eq!(alignment.verdict, Verdict::Aligned, "{}", alignment.sentence);
    assert!(!alignment.as_stated && alignment.gain.held_out_over_stated > 0.0, "{:?}", alignment.gain);
    found(&alignment, "start_s", truth().start_s, 0.03);
    found(&alignment, "rotation_deg", -25.0, 5.0);
    found(&alignment, "origin_x_m", truth().origin_m[0], 0.1);
    found(&alignment, "origin_y_m", truth().origin_m[1], 0.1);
    // No antenna is higher than another.
    assert!(!alignment.estimates["origin_z_m"].identified);
}

/// Two transmitters that take turns, and receivers in a square.
#[test]
fn antennas_above_each_other_tell_the_height() {
    let folder = tempfile::tempdir().unwrap();
    let square = |radar: &mut Radar| {
        radar.tx_m = vec![[-0.0153, 0.0, 0.0], [-0.0115, 0.0, 0.0]];
        radar.rx_m = vec![[0.0; 3], [0.0019, 0.0, 0.0], [0.0, 0.0, 0.0019], [0.0019, 0.0, 0.0019]];
        radar.chirp_period_s *= 0.5;
    };
    let mut stated = wrong();
    stated.origin_m[2] += 0.2;
    let alignment = aligned(&recorded_by(folder.path(), WALK, square, &stated));
    assert_eq!(alignment.verdict, Verdict::Aligned, "{}", alignment.sentence);
    found(&alignment, "origin_z_m", truth().origin_m[2], 0.1);
    found(&alignment, "rotation_deg", -25.0, 5.0);
}

#[test]
fn a_motion_that_is_stated_right_stays() {
    let folder = tempfile::tempdir().unwrap();
    let alignment = aligned(&recorded(folder.path(), WALK, 4, &truth()));
    assert_eq!(alignment.verdict, Verdict::Aligned, "{}", alignment.sentence);
    assert!(alignment.as_stated, "{:?}", alignment.estimates);
    found(&alignment, "start_s", truth().start_s, 0.03);
    found(&alignment, "range_m", alignment.estimates["range_m"].stated, 0.05);
}

/// A step later and farther round the circle, a walker does the same again.
#[test]
fn a_circle_of_equal_steps_is_placed_at_several_clocks() {
    let folder = tempfile::tempdir().unwrap();
    let alignment = aligned(&recorded(folder.path(), CIRCLE, 4, &wrong()));
    assert_eq!(alignment.verdict, Verdict::Ambiguous, "{}", alignment.sentence);
    let start = &alignment.estimates["start_s"];
    assert!(!start.identified && start.ci90.is_none() && !alignment.alternatives.is_empty(), "{start:?}");
    let starts = alignment.alternatives.iter().map(|other| other.values["start_s"]).chain([start.value]);
    assert!(starts.clone().any(|start| (start - truth().start_s).abs() < 0.03), "{:?}", starts.collect::<Vec<_>>());
}

#[test]
fn one_receiver_tells_no_direction() {
    let folder = tempfile::tempdir().unwrap();
    let alignment = aligned(&recorded(folder.path(), WALK, 1, &wrong()));
    assert_eq!(alignment.verdict, Verdict::Aligned, "{}", alignment.sentence);
    for name in ["azimuth_deg", "rotation_deg", "origin_x_m", "origin_y_m", "origin_z_m"] {
        let estimate = &alignment.estimates[name];
        assert!(!estimate.identified && estimate.ci90.is_none(), "{name}: {estimate:?}");
    }
    assert!(alignment.estimates["azimuth_deg"].why_not.as_ref().unwrap().contains("circle"));
    found(&alignment, "start_s", truth().start_s, 0.03);
}

#[test]
fn another_motion_than_the_recorded_one_is_placed_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(folder.path(), WALK, 4, &truth());
    let model = procedural::person(&PersonConfig::default()).unwrap();
    let betas = vec![0.0; model.shape_directions.len()];
    let style = StyleConfig { seed: 3, ..StyleConfig::default() };
    let other = actions::motion(Action::Lunge, &style, &model, &betas, 4.5, 60.0).unwrap();
    write_motion(recording.join("motion.npz"), &other).unwrap();
    let alignment = aligned(&recording);
    assert_eq!(alignment.verdict, Verdict::CannotTell, "{}", alignment.sentence);
}

#[test]
fn a_person_who_stands_still_is_placed_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let model = procedural::person(&PersonConfig::default()).unwrap();
    let betas = vec![0.0; model.shape_directions.len()];
    let mut motion = actions::motion(Action::Drink, &StyleConfig::default(), &model, &betas, 4.5, 60.0).unwrap();
    motion.poses = vec![motion.poses[0].clone(); motion.poses.len()];
    motion.translations = vec![motion.translations[0]; motion.translations.len()];
    let file = folder.path().join("still.npz");
    write_motion(&file, &motion).unwrap();
    let text = format!("[person]\nmotion = {file:?}\n[surface]\nedge_m = 0.012");
    let alignment = aligned(&recorded(folder.path(), &text, 4, &wrong()));
    assert_eq!(alignment.verdict, Verdict::CannotTell, "{}", alignment.sentence);
}

#[test]
fn the_program_writes_what_it_found_and_agrees_with_it_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(folder.path(), WALK, 4, &wrong());
    let run = |out: &str, apply: bool| {
        let out = folder.path().join(out);
        let mut command = Command::new(env!("CARGO_BIN_EXE_hybridsim"));
        command.arg("align").arg(&recording).arg("--out").arg(&out).arg("--quiet");
        command.args(apply.then_some("--apply"));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (String::from_utf8(output.stdout).unwrap(), out)
    };
    let (text, out) = run("first", true);
    assert!(text.starts_with("The placement as stated is wrong: the motion starts 0.3"), "{text}");
    assert!(out.join("align.png").is_file());
    let snippet: toml::Table = std::fs::read_to_string(out.join("motion.toml")).unwrap().parse().unwrap();
    let settings: RecordingSettings = read_text(&std::fs::read_to_string(recording.join("recording.toml")).unwrap()).unwrap();
    let written: Placement = snippet["motion"].clone().try_into().unwrap();
    assert_eq!(settings.motion, Some(written.clone()));
    assert!((written.start_s - truth().start_s).abs() < 0.03);
    let (text, out) = run("second", false);
    assert!(text.starts_with("The recording agrees with the placement as stated"), "{text}");
    let report: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out.join("align.json")).unwrap()).unwrap();
    assert_eq!((&report["verdict"], &report["as_stated"]), (&"aligned".into(), &true.into()));
}
