//! What is said of damaged samples, and that nothing is said of whole ones: each check has a recording on which it fails and one on which
//! it does not.

#[path = "support/damage.rs"]
mod damage;

use std::path::Path;

use damage::{Damage, damaged};
use hybridsim::config::Config;
use hybridsim::data::Recording;
use hybridsim::data::settings::read_text;
use hybridsim::diagnosis::report::{Report, Verdict};
use hybridsim::diagnosis::{DiagnosisConfig, diagnose};
use hybridsim::integrity::{Finding, damage as damage_of, inspect};
use hybridsim::recorder::{self, RecorderConfig};

use crate::scenes::{ONE, TWO, recorded};
use crate::support;

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
