//! What is said of damaged samples and of conventions that are wrong, and that nothing is said where all is well: each check has a
//! recording on which it fails and one on which it does not.

use crate::support;
#[path = "support/damage.rs"]
mod damage;

use std::path::{Path, PathBuf};

use damage::{Damage, damaged};
use hybridsim::config::Config;
use hybridsim::data::Recording;
use hybridsim::data::settings::read_text;
use hybridsim::diagnosis::audit::{Check, audit};
use hybridsim::diagnosis::cube::Loaded;
use hybridsim::diagnosis::report::{Report, Verdict};
use hybridsim::diagnosis::{BodyPrediction, DiagnosisConfig, Evidence, diagnose};
use hybridsim::integrity::{Finding, damage as damage_of, inspect};
use hybridsim::person::Person;
use hybridsim::recorder::{self, RecorderConfig};

/// One transmitter, four receivers half a wavelength apart.
const ONE: &str =
    "tx_m = [[-0.0153, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// Two transmitters that make eight receivers of four.
const TWO: &str = "tx_m = [[-0.0153, 0.0, 0.0], [-0.0077, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// Three transmitters in turn, one of them higher.
const THREE: &str = "tx_m = [[-0.0153, 0.0, 0.0], [-0.0115, 0.0, 0.0019], [-0.0077, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// A square of receivers.
const SQUARE: &str =
    "tx_m = [[-0.0153, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0, 0.0, 0.0019], [0.0019, 0.0, 0.0019]]";

/// `text` is TOML over the recorder's defaults; ten frames a second.
fn recorded(folder: &Path, text: &str, antennas: &str) -> PathBuf {
    recorded_as("loops_per_frame = 32\nchirp_period_s = 108.0e-6\nframe_period_s = 0.1", folder, text, antennas)
}

fn recorded_as(timing: &str, folder: &Path, text: &str, antennas: &str) -> PathBuf {
    let radar = format!(
        "[radar]\nstart_frequency_hz = 77.0e9\nslope_hz_per_s = 60.012e12\nsample_rate_hz = 4.4e6\nsamples_per_chirp = 128\n\
         adc_start_s = 6.0e-6\n{timing}\nframes = 12\n{antennas}"
    );
    let surface = if text.contains("[surface]") { "" } else { "[surface]\nedge_m = 0.012" };
    let config: RecorderConfig = read_text(&format!("{text}\n{surface}\n{radar}")).unwrap();
    let out = folder.join("recording");
    recorder::record_to(&config, Path::new("."), &out, &mut |_, _| {}).unwrap();
    out
}

fn inspected(folder: &Path) -> Vec<Finding> {
    inspect(&Recording::open(folder).unwrap(), usize::MAX).unwrap()
}

/// The only check that fails.
#[track_caller]
fn only(findings: &[Finding], check: &str) -> Finding {
    let failed: Vec<&Finding> = findings.iter().filter(|finding| !finding.ok).collect();
    assert_eq!(failed.iter().map(|finding| finding.check).collect::<Vec<_>>(), [check], "{findings:?}");
    assert!(failed[0].p_value.unwrap() < 1e-3);
    failed[0].clone()
}

#[test]
fn every_damage_is_told_by_name_and_whole_recordings_are_whole() {
    let folder = tempfile::tempdir().unwrap();
    let whole = recorded(folder.path(), "seed = 21\nmesh_error_m = 2e-3", ONE);
    assert_eq!(damage_of(&inspected(&whole)), None, "{:?}", inspected(&whole));
    let after = |name: &str, damage: Damage| {
        let to = folder.path().join(name);
        damaged(&whole, &to, damage);
        inspected(&to)
    };
    // The copy itself changes nothing.
    assert_eq!(after("copy", Damage::None), inspected(&whole));
    only(&after("words", Damage::WordOrder), "integrity_word_order");
    let zeros = only(&after("zeros", Damage::ZeroPackets(3)), "integrity_runs");
    assert!(zeros.found.contains("exact zeros in 3 runs of 364 samples") && !zeros.frames.is_empty(), "{}", zeros.found);
    let half = only(&after("half", Damage::HalfFrames), "integrity_runs");
    assert_eq!(half.frames, (0..12).collect::<Vec<_>>(), "{}", half.found);
    assert!(half.found.contains("50.00 %") && half.found.contains("frame 0, loop 16, tx 0, rx 0, sample 0"), "{}", half.found);
    let repeated = only(&after("repeated", Damage::RepeatedFrame(7)), "integrity_copies");
    assert_eq!(
        (repeated.frames.as_slice(), repeated.found.contains("frame 7 is frame 6")),
        (&[7][..], true),
        "{}",
        repeated.found
    );
    let loops = only(&after("loops", Damage::RepeatedLoops(5)), "integrity_copies");
    assert!(loops.found.contains("16 chirps") && loops.found.contains("loops 16, 17"), "{}", loops.found);
    let stuck = only(&after("stuck", Damage::Stuck { frame: 3, loops: 2 }), "integrity_runs");
    assert!(stuck.found.contains("a value that stands still in 2 runs") && stuck.frames == [3], "{}", stuck.found);
    // What was lost is filled up with zeros at the end: two findings.
    let lost = after("lost", Damage::LostPacket);
    let failed: Vec<&str> = lost.iter().filter(|finding| !finding.ok).map(|finding| finding.check).collect();
    assert_eq!(failed, ["integrity_runs", "integrity_stream"], "{lost:?}");
    let stream = lost.iter().find(|finding| finding.check == "integrity_stream").unwrap();
    assert!(stream.found.contains("364 places earlier") && stream.frames == [6], "{}", stream.found);
}

#[test]
fn transmitters_that_were_not_separated_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let whole = recorded(folder.path(), "seed = 22\nmesh_error_m = 2e-3", TWO);
    assert_eq!(damage_of(&inspected(&whole)), None, "{:?}", inspected(&whole));
    let to = folder.path().join("unseparated");
    damaged(&whole, &to, Damage::Unseparated);
    only(&inspected(&to), "integrity_transmitters");
    let to = folder.path().join("one");
    damaged(&whole, &to, Damage::OneTransmitter);
    let one = only(&inspected(&to), "transmitter_count");
    assert!(one.found.contains("loops of 2 kinds take turns"), "{}", one.found);
}

/// Noise that stays below the converter's step, an ADC that clips and a receiver that sees nothing but itself are no damage.
#[test]
fn quiet_clipped_and_still_recordings_are_whole() {
    for (name, text) in [
        ("still", "seed = 23\nempty = true"),
        ("clipped", "seed = 24\n[effects.adc_saturation]\nlevel = 0.5"),
        ("leaking", "seed = 25\n[effects.tx_leakage]\nrange_m = 0.09\nrelative = 3.0"),
        ("jittering", "seed = 26\n[effects.chirp_start_jitter]\njitter_s = 3e-9"),
        ("settling", "seed = 27\n[effects.chirp_settling]\ndepth = 0.5\nchirps = 6.0"),
        ("imaged", "seed = 28\n[effects.iq_imbalance]\ngain_db = 6.0\nphase_deg = 20.0"),
        ("dropping", "seed = 29\n[effects.frame_drop]\nat = 6\ncount = 2"),
        ("vibrating", "seed = 30\n[effects.radar_vibration]\namplitude_m = 2e-4\nfrequency_hz = 31.0"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let found = inspected(&recorded(folder.path(), text, ONE));
        assert_eq!(damage_of(&found), None, "{name}: {found:?}");
    }
}

/// Somebody who walks close by is nearly the same in all loops of a frame, and two receivers see nearly the same.
#[test]
fn recordings_of_two_receivers_are_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let sets = ["record.frames=160", "record.radar.loops_per_frame=32"].map(String::from);
    let config = Config::read(&path, &sets).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("long");
    recorder::record_to(config.record(&path).unwrap(), folder.path(), &recording, &mut |_, _| {}).unwrap();
    assert_eq!(damage_of(&inspected(&recording)), None);
    // Chirps of few samples, and somebody who comes near in the second frame.
    let near = "seed = 5\nperson.action = \"walk_back_forth\"\nwalls.patch_m = 0.2\n[surface]\nreturns = \"vertices\"\n\
                [room]\nleft_m = 2.2\nright_m = 2.5\nfront_m = 5.4\nback_m = 0.6\nfloor_m = 1.0\nceiling_m = 1.7";
    let radar = "[radar]\nstart_frequency_hz = 77.0e9\nslope_hz_per_s = 60.012e12\nsample_rate_hz = 4.4e6\nsamples_per_chirp = 64\n\
                 loops_per_frame = 32\nadc_start_s = 6.0e-6\nchirp_period_s = 216.0e-6\nframe_period_s = 0.1\nframes = 16\n\
                 tx_m = [[0.0, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019467, 0.0, 0.0]]";
    let config: RecorderConfig = read_text(&format!("{near}\n{radar}")).unwrap();
    let short = folder.path().join("short");
    recorder::record_to(&config, Path::new("."), &short, &mut |_, _| {}).unwrap();
    assert_eq!(damage_of(&inspected(&short)), None);
}

fn report(folder: &Path) -> Report {
    let config = DiagnosisConfig { epochs: 0, limits: false, ..DiagnosisConfig::default() };
    diagnose(&Recording::open(folder).unwrap(), &config, &mut |_| {}).unwrap().report
}

#[test]
fn a_damaged_recording_gets_that_verdict_and_no_effect() {
    let folder = tempfile::tempdir().unwrap();
    let whole = recorded(folder.path(), "seed = 21\nmesh_error_m = 2e-3", ONE);
    let to = folder.path().join("damaged");
    damaged(&whole, &to, Damage::ZeroPackets(2));
    let report = report(&to);
    assert_eq!(report.verdict, Verdict::Damaged);
    assert!(
        report.effects.is_empty() && report.unexplained.is_empty() && report.reason.contains("exact zeros"),
        "{}",
        report.reason
    );
    let check = report.audit.iter().find(|check| check.check == "integrity_runs").unwrap();
    assert!(!check.ok && check.frames.is_some() && check.p_value.unwrap() < 1e-3);
    assert!(hybridsim::diagnosis::html::lead(&report).starts_with("The recording is damaged: exact zeros"));
}

/// What the audit says of a recording, with another header where one is given.
fn audited(folder: &Path, change: &dyn Fn(String) -> String) -> Vec<Check> {
    audited_as(folder, change, &|_| {})
}

/// The same, with other samples where they are changed.
fn audited_as(folder: &Path, change: &dyn Fn(String) -> String, spoil: &dyn Fn(&mut Loaded)) -> Vec<Check> {
    let header = folder.join("recording.toml");
    let text = std::fs::read_to_string(&header).unwrap();
    let changed = change(text.clone());
    std::fs::write(&header, &changed).unwrap();
    let recording = Recording::open(folder).unwrap();
    std::fs::write(&header, &text).unwrap();
    let mut loaded = Loaded::read(&recording, 256).unwrap();
    spoil(&mut loaded);
    let body = recording.person().map(|person| BodyPrediction::new(person, &loaded.radar, &loaded.starts_s).unwrap());
    audit(&Evidence::new(loaded, recording.room.clone(), body), recording.person().and_then(Person::origin_m))
}

fn check<'a>(checks: &'a [Check], name: &str) -> &'a Check {
    checks.iter().find(|check| check.check == name).unwrap_or_else(|| panic!("{name} in {checks:?}"))
}

/// `key = [a, b, …]` with the entries in another order.
fn reordered(text: String, key: &str, order: &[usize]) -> String {
    let radar: toml::Table = text.parse().unwrap();
    let list = radar["radar"][key].as_array().unwrap();
    let entries: Vec<String> = order.iter().map(|&entry| list[entry].to_string()).collect();
    let mut lines: Vec<String> = vec![];
    let mut skipping = false;
    for line in text.lines() {
        if line.starts_with(&format!("{key} =")) {
            lines.push(format!("{key} = [{}]", entries.join(", ")));
            skipping = !line.trim_end().ends_with("]]") && line.trim_end().ends_with('[');
        } else if skipping {
            skipping = line.trim() != "]";
        } else {
            lines.push(line.into());
        }
    }
    lines.join("\n")
}

/// A person so many degrees to the right who comes and goes, 3 m away.
fn aside(seed: u64, degrees: f64) -> String {
    let (x, y) = (3.0 * degrees.to_radians().sin(), 3.0 * degrees.to_radians().cos());
    format!(
        "seed = {seed}\nmesh_error_m = 2e-3\n[room]\nleft_m = 3.0\nright_m = 3.0\nfront_m = 6.0\nfloor_m = 1.0\nceiling_m = 1.7\n\
         [person.placement]\norigin_m = [{x:.3}, {y:.3}, -1.0]"
    )
}

#[test]
fn receivers_in_reverse_are_found_with_the_person_well_aside() {
    for degrees in [17.0, 30.0] {
        let folder = tempfile::tempdir().unwrap();
        let plain = recorded(folder.path(), &aside(31, degrees), ONE);
        let stated = audited(&plain, &|text| text);
        assert!(stated.iter().all(|check| check.ok), "{degrees}: {stated:?}");
        let reversed = audited(&plain, &|text| reordered(text, "rx_m", &[3, 2, 1, 0]));
        let sides = check(&reversed, "sides");
        assert!(!sides.ok && sides.found.contains("the receivers in reverse order"), "{degrees}: {sides:?}");
        assert!(sides.found.contains("left and right exchanged"), "{degrees}: {sides:?}");
    }
}

#[test]
fn up_and_down_exchanged_are_told_from_left_and_right() {
    let folder = tempfile::tempdir().unwrap();
    // Two heights of receivers see little of an array's baseline: four seconds tell.
    let text = format!("frames = 40\n{}", aside(32, 15.0))
        .replace("-1.0]", "-1.6]")
        .replace("floor_m = 1.0", "floor_m = 1.6")
        .replace("ceiling_m = 1.7", "ceiling_m = 1.1");
    let plain = recorded(folder.path(), &text, SQUARE);
    let stated = audited(&plain, &|text| text);
    assert!(check(&stated, "sides").ok, "{stated:?}");
    let upside_down = audited(&plain, &|text| reordered(text, "rx_m", &[2, 3, 0, 1]));
    let sides = check(&upside_down, "sides");
    assert!(!sides.ok && sides.found.contains("up and down") && !sides.found.contains("left"), "{sides:?}");
    let mirrored = audited(&plain, &|text| reordered(text, "rx_m", &[1, 0, 3, 2]));
    let sides = check(&mirrored, "sides");
    assert!(!sides.ok && sides.found.contains("left and right") && !sides.found.contains("up and down"), "{sides:?}");
}

#[test]
fn two_transmitters_in_the_wrong_order_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(33, 25.0), TWO);
    let stated = audited(&plain, &|text| text);
    assert!(stated.iter().all(|check| check.ok), "{stated:?}");
    let swapped = audited(&plain, &|text| reordered(text, "tx_m", &[1, 0]));
    let order = check(&swapped, "tx_order");
    assert!(!order.ok && order.found.contains("the order [1, 0]"), "{order:?}");
    // Receivers and transmitters that differ by constant phases are in no other order.
    let folder = tempfile::tempdir().unwrap();
    let uneven = format!(
        "{}\n[effects.channel_mismatch]\ngain_db = [0.0, 1.0, -1.0, 0.5, 0.0, 1.0, 0.0, -1.0]\nphase_deg = [0.0, 40.0, -60.0, 120.0, 180.0, 100.0, -150.0, 30.0]",
        aside(34, 25.0)
    );
    let differ = audited(&recorded(folder.path(), &uneven, TWO), &|text| text);
    assert!(check(&differ, "tx_order").ok && check(&differ, "sides").ok, "{differ:?}");
}

/// Straight ahead a direction and its mirror image hardly differ, and which part of the body returns most decides between them.
#[test]
fn antennas_are_not_doubted_because_of_a_person_straight_ahead() {
    for seed in 0..6 {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("{}\n[surface]\nreturns = \"random\"\nedge_m = 0.012", aside(40 + seed, 0.0));
        let timing = "loops_per_frame = 16\nchirp_period_s = 72.0e-6\nframe_period_s = 0.1";
        let stated = audited(&recorded_as(timing, folder.path(), &text, THREE), &|text| text);
        assert!(check(&stated, "sides").ok && check(&stated, "tx_order").ok, "{seed}: {stated:?}");
    }
}

#[test]
fn a_heading_turned_by_half_a_turn_and_a_wrong_frame_period_are_found() {
    let folder = tempfile::tempdir().unwrap();
    // Half of the period shows half of the frames: twenty of them tell.
    let timing = "loops_per_frame = 64\nchirp_period_s = 216.0e-6\nframe_period_s = 0.2";
    let plain = recorded_as(timing, folder.path(), "seed = 35\nframes = 40\nmesh_error_m = 2e-3", ONE);
    let stated = audited(&plain, &|text| text);
    assert!(stated.iter().all(|check| check.ok), "{stated:?}");
    let turned = audited(&plain, &|text| {
        let mut table: toml::Table = text.parse().unwrap();
        let rows = table["motion"]["radar_from_motion"].as_array_mut().unwrap();
        for row in &mut rows[..2] {
            for value in row.as_array_mut().unwrap() {
                *value = toml::Value::Float(-value.as_float().unwrap());
            }
        }
        toml::to_string(&table).unwrap()
    });
    let heading = check(&turned, "heading");
    assert!(!heading.ok && heading.found.contains("180°"), "{heading:?}");
    let halved = audited(&plain, &|text| text.replace("frame_period_s = 0.2", "frame_period_s = 0.1"));
    let period = check(&halved, "frame_period");
    assert!(!period.ok && period.found.contains("should be 0.200000"), "{period:?}");
}

/// Loops in reverse order change the sign of all velocities.
#[test]
fn velocities_of_the_other_sign_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(36, 10.0), ONE);
    let reversed = audited_as(&plain, &|text| text, &|loaded| {
        let length = loaded.cube.dims[4];
        for (frame, channel) in (0..loaded.cube.dims[0]).flat_map(|frame| (0..4).map(move |channel| (frame, channel))) {
            let chirps: Vec<_> = loaded.cube.channel(frame, channel).chunks_exact(length).rev().flatten().copied().collect();
            loaded.cube.channel_mut(frame, channel).copy_from_slice(&chirps);
        }
    });
    let sign = check(&reversed, "doppler_sign");
    assert!(!sign.ok && sign.found.contains("the Doppler axis runs the other way"), "{sign:?}");
    assert!(check(&audited(&plain, &|text| text), "doppler_sign").ok);
}

/// Receivers whose phases grow by a constant step see everything in another direction.
#[test]
fn a_body_in_another_direction_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(37, 0.0), ONE);
    let turned = |radians: f64| {
        let checks = audited_as(&plain, &|text| text, &|loaded| {
            loaded.cube.each_chirp(|[_, channel, _], chirp| {
                chirp.iter_mut().for_each(|value| *value *= num_complex::Complex64::cis(radians * channel as f64));
            });
        });
        check(&checks, "body_direction").clone()
    };
    // Half a wavelength apart, π sin 40° each.
    let aside = turned(2.0);
    assert!(!aside.ok && aside.found.contains("farther to the"), "{aside:?}");
    assert!(turned(0.0).ok);
}

/// Of a room that is stated at a quarter of its size, all returns are beyond its farthest corner.
#[test]
fn a_room_that_is_smaller_than_its_returns_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let sides = "left_m = 3.2\nright_m = 3.2\nfront_m = 4.8\nfloor_m = 2.4\nceiling_m = 2.4";
    let plain = recorded(folder.path(), &format!("seed = 38\nmesh_error_m = 2e-3\n[room]\n{sides}"), ONE);
    assert!(check(&audited(&plain, &|text| text), "room").ok);
    let shrunk = |text: String| text.replace("m = 3.2", "m = 0.8").replace("m = 4.8", "m = 1.2").replace("m = 2.4", "m = 0.6");
    let shrunk = audited(&plain, &shrunk);
    let room = check(&shrunk, "room");
    assert!(!room.ok && room.found.contains("the room's size contradicts the ranges"), "{room:?}");
}

#[test]
fn samples_at_the_ends_of_the_converters_range_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), "seed = 39\nmesh_error_m = 2e-3", ONE);
    let clipped = audited_as(&plain, &|text| text, &|loaded| {
        let [low, high] = loaded.extremes.map(|extreme| 0.8 * extreme);
        loaded.extremes = [low, high];
        for value in &mut loaded.cube.samples {
            *value = num_complex::Complex64::new(value.re.clamp(low, high), value.im.clamp(low, high));
        }
    });
    let range = check(&clipped, "converter_range");
    assert!(!range.ok && !range.found.starts_with("0.0000 %"), "{range:?}");
    assert!(check(&audited(&plain, &|text| text), "converter_range").ok);
}

/// Points half a metre apart say nothing within a range bin of 7 cm.
#[test]
fn a_body_of_too_few_points_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(40, 10.0), ONE);
    let recording = Recording::open(&plain).unwrap();
    let loaded = Loaded::read(&recording, 256).unwrap();
    let sampled = |every: usize| {
        let mut body = BodyPrediction::new(recording.person().unwrap(), &loaded.radar, &loaded.starts_s).unwrap();
        for points in &mut body.frames {
            let kept: Vec<_> = points.iter().step_by(every).cloned().collect();
            let area_m2 = points.iter().map(|point| point.area_m2).sum::<f64>() / kept.len() as f64;
            *points = kept;
            points.iter_mut().for_each(|point| point.area_m2 = area_m2);
        }
        let checks = audit(&Evidence::new(loaded.clone(), recording.room.clone(), Some(body)), None);
        check(&checks, "surface_sampling").clone()
    };
    assert!(sampled(1).ok && !sampled(200).ok, "{:?}, {:?}", sampled(1), sampled(200));
}

/// All recordings at hand whose samples are whole, and those whose damage is known.
#[test]
fn shared_recordings_are_judged_rightly() {
    let Some(root) = support::shared("recordings") else { return };
    let mut seen = 0;
    for folder in ["planted", "structures", "real"].map(|name| root.join(name)) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if !path.join("recording.toml").is_file() {
                continue;
            }
            let name = path.file_name().unwrap().to_str().unwrap().to_string();
            let failed: Vec<&str> = inspected(&path).iter().filter(|finding| !finding.ok).map(|finding| finding.check).collect();
            let wanted: &[&str] = match name.as_str() {
                "t11" => &["integrity_runs", "integrity_copies"],
                "t11b" => &["integrity_runs", "integrity_stream"],
                _ => &[],
            };
            assert_eq!(failed, wanted, "{name}");
            seen += 1;
        }
    }
    assert!(seen >= 36, "{seen} recordings");
    let folder = tempfile::tempdir().unwrap();
    let wanted = [
        ("real/room_60ghz", Damage::WordOrder, "integrity_word_order"),
        ("real/room_60ghz", Damage::LostPacket, "integrity_stream"),
        ("real/room_60ghz", Damage::Unseparated, "integrity_transmitters"),
        ("real/two_people_77ghz", Damage::Unseparated, "integrity_transmitters"),
        ("real/two_people_77ghz", Damage::LostPacket, "integrity_stream"),
        ("real/two_people_77ghz", Damage::HalfFrames, "integrity_runs"),
        ("real/two_people_77ghz", Damage::ZeroPackets(5), "integrity_runs"),
        ("structures/tn10", Damage::LostPacket, "integrity_stream"),
        ("structures/tn01", Damage::ZeroPackets(5), "integrity_runs"),
    ];
    for (index, (name, damage, check)) in wanted.into_iter().enumerate() {
        let to = folder.path().join(index.to_string());
        damaged(&root.join(name), &to, damage);
        let found = inspected(&to);
        assert!(found.iter().any(|finding| finding.check == check && !finding.ok), "{name} {damage:?}: {found:?}");
    }
}
