//! Captures at the door: what is refused and with which words, what is kept, what is lost and known to be. Each wrong convention has a
//! capture that is refused for it alone, and the capture as it was taken is not.

mod formats;
mod lost;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hybridsim::data::Recording;
use hybridsim::data::settings::read_text;
use hybridsim::integrity;
use hybridsim::recorder::{self, RecorderConfig};

const FRAMES: usize = 16;
const LOOPS: usize = 16;
const RX: usize = 4;
const SAMPLES: usize = 128;
/// Words of one chirp of all receivers.
const CHIRP: usize = 2 * RX * SAMPLES;

/// Settings of a board of four receivers that fires one transmitter: times before and of a ramp in µs, slope in MHz/µs.
macro_rules! cfg {
    ($idle:literal, $ramp:literal, $slope:literal, $samples:literal, $loops:literal) => {
        concat!(
            "channelCfg 15 1 0\nadcCfg 2 1\nadcbufCfg -1 0 0 1 1\n",
            "profileCfg 0 77 ",
            $idle,
            " 6 ",
            $ramp,
            " 0 0 ",
            $slope,
            " 1 ",
            $samples,
            " 4400 0 0 30\n",
            "chirpCfg 0 0 0 0 0 0 0 1\nframeCfg 0 0 ",
            $loops,
            " 16 100 1 0\nsensorStart\n"
        )
    };
}

const CFG: &str = cfg!("48", "60", "60.012", "128", "16");

/// Somebody who walks in a room.
fn recording() -> &'static Path {
    static ONCE: std::sync::OnceLock<(tempfile::TempDir, PathBuf)> = std::sync::OnceLock::new();
    let (_, folder) = ONCE.get_or_init(|| {
        let parent = tempfile::tempdir().unwrap();
        let config: RecorderConfig = read_text(&format!(
            "seed = 41\nmesh_error_m = 2e-3\n[surface]\nedge_m = 0.012\n[radar]\nstart_frequency_hz = 77.0e9\nslope_hz_per_s = 60.012e12\nsample_rate_hz = 4.4e6\n\
             samples_per_chirp = {SAMPLES}\nloops_per_frame = {LOOPS}\nadc_start_s = 6.0e-6\nchirp_period_s = 108.0e-6\n\
             frame_period_s = 0.1\nframes = {FRAMES}\ntx_m = [[-0.0153, 0.0, 0.0]]\n\
             rx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]"
        ))
        .unwrap();
        let out = parent.path().join("recording");
        recorder::record_to(&config, Path::new("."), &out, &mut |_, _| {}).unwrap();
        (parent, out)
    });
    folder
}

/// The recording as a board with two lanes sends it: I I Q Q, one receiver after the other.
fn words() -> Vec<i16> {
    let recording = Recording::open(recording()).unwrap();
    let mut words = Vec::with_capacity(FRAMES * LOOPS * CHIRP);
    for frame in 0..FRAMES {
        let frame = recording.frame(frame).unwrap();
        for (index, rx) in (0..LOOPS).flat_map(|index| (0..RX).map(move |rx| (index, rx))) {
            for pair in 0..SAMPLES / 2 {
                let [first, second] = [0, 1].map(|step| frame.sample(0, rx, index, 2 * pair + step));
                words.extend([first.re, second.re, first.im, second.im].map(|value| value as i16));
            }
        }
    }
    words
}

/// A folder with such a capture after a change.
fn captured(cfg: &str, change: impl FnOnce(&mut Vec<i16>)) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut words = words();
    change(&mut words);
    let bin = folder.path().join("adc_data.bin");
    fs::write(&bin, words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    fs::write(folder.path().join("radar.cfg"), cfg).unwrap();
    (folder, bin)
}

fn hybridsim(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(arguments).current_dir(folder).env("NO_COLOR", "1").output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Names in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_capture_as_it_is_stated_is_kept_and_the_table_says_so() {
    let (folder, bin) = captured(CFG, |_| {});
    let output = hybridsim(&["import", bin.to_str().unwrap(), "--out", "kept"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for part in
        ["convention", "the data say", "byte order", "iq order", "word order", "chirp start", "frame boundary", "adc start"]
    {
        assert!(table.contains(part), "{part} in {table}");
    }
    assert!(table.contains("as stated, undecided") && !table.contains("refused"), "{table}");
    let (kept, wanted) = (Recording::open(folder.path().join("kept")).unwrap(), Recording::open(recording()).unwrap());
    assert_eq!(kept.frame(5).unwrap(), wanted.frame(5).unwrap());
    // `check` prints the same rows.
    let check = text(&hybridsim(&["check", "kept"], folder.path()).stdout);
    let rows = |text: &str| {
        text.lines()
            .skip_while(|line| !line.contains("convention"))
            .take_while(|line| line.starts_with("  "))
            .map(str::to_string)
            .collect::<Vec<_>>()
    };
    assert_eq!(rows(&check), rows(&table));
    for finding in integrity::inspect(&kept, FRAMES).unwrap() {
        assert!(finding.ok, "{finding:?}");
        let decided = [
            "byte_order",
            "number_format",
            "chirp_length",
            "loop_length",
            "chirp_start",
            "frame_boundary",
            "integrity_word_order",
            "iq_order",
        ];
        assert!(finding.decided || !decided.contains(&finding.check), "{finding:?}");
    }
}

type Change = fn(&mut Vec<i16>);

/// Each wrong convention: a change of the words or of the description, the check that refuses, and words of its message.
const WRONG: [(&str, &str, Change, &str, &str); 10] = [
    (
        "bytes",
        CFG,
        |words| words.iter_mut().for_each(|word| *word = word.swap_bytes()),
        "byte order",
        "bytes of every word are exchanged",
    ),
    ("offset", CFG, |words| words.iter_mut().for_each(|word| *word ^= i16::MIN), "number format", "offset binary"),
    (
        "q first",
        CFG,
        |words| words.as_chunks_mut::<4>().0.iter_mut().for_each(|[a, b, c, d]| ([*a, *b], [*c, *d]) = ([*c, *d], [*a, *b])),
        "iq order",
        "I and Q are exchanged",
    ),
    ("one lane", CFG, |words| words.as_chunks_mut::<4>().0.iter_mut().for_each(|four| four.swap(1, 2)), "word order", "I I Q Q"),
    (
        "lanes",
        CFG,
        |words| words.as_chunks_mut::<4>().0.iter_mut().for_each(|[a, b, c, d]| ([*a, *b], [*c, *d]) = ([*b, *a], [*d, *c])),
        "lane order",
        "two lanes were exchanged",
    ),
    ("header", CFG, |words| drop(words.drain(..2 * 40)), "chirp start", "a header lies before the first sample"),
    ("loops", CFG, |words| drop(words.drain(..5 * CHIRP)), "frame boundary", "between the loops 10 and 11"),
    ("another capture's", cfg!("48", "60", "60.012", "90", "16"), |_| {}, "loop length", "shifted by 512 samples"),
    (
        "samples and loops exchanged",
        cfg!("48", "60", "60.012", "16", "128"),
        |_| {},
        "chirp length",
        "begins anew every 128 samples, not every 16",
    ),
    (
        "twice the samples",
        cfg!("28", "80", "40.012", "256", "8"),
        |_| {},
        "chirp length",
        "begins anew every 128 samples, not every 256",
    ),
];

#[test]
fn what_cannot_be_right_is_refused_by_name_and_leaves_nothing() {
    for (name, cfg, change, check, part) in WRONG {
        let (folder, bin) = captured(cfg, change);
        let output = hybridsim(&["import", bin.to_str().unwrap(), "--out", "out"], folder.path());
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {error}{}", text(&output.stdout));
        assert!(
            error.contains(&format!("`{check}`")) && error.contains(part) && error.contains("--as-stated"),
            "{name}: {error}"
        );
        assert!(text(&output.stdout).lines().any(|line| line.trim().starts_with(check) && line.contains("refused")), "{name}");
        assert_eq!(names(folder.path()), ["adc_data.bin", "radar.cfg"], "{name}");
    }
}

#[test]
fn the_user_may_keep_his_word() {
    let (folder, bin) = captured(CFG, WRONG[2].2);
    for word in ["--as-stated", "--yes-as-stated"] {
        let out = word.trim_start_matches('-');
        let output = hybridsim(&["import", bin.to_str().unwrap(), "--out", out, word], folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(text(&output.stdout).contains("as stated, against the data"), "{}", text(&output.stdout));
        assert!(text(&output.stderr).contains("wrong: "), "{}", text(&output.stderr));
        let findings = integrity::inspect(&Recording::open(folder.path().join(out)).unwrap(), FRAMES).unwrap();
        let check = |more: &[&str]| hybridsim(&[&["check", out], more].concat(), folder.path()).status.code();
        assert_eq!([check(&[]), check(&[word])], [Some(2), Some(0)]);
        let wrong: Vec<&str> = findings.iter().filter(|finding| !finding.ok).map(|finding| finding.check).collect();
        assert_eq!(wrong, ["iq_order"], "{findings:?}");
    }
}

/// Two profiles in turn: a recording of each, as `--profile` makes it, or nothing.
#[test]
fn a_frame_of_several_profiles_is_split() {
    let cfg = CFG.replace(
        "chirpCfg 0 0 0 0 0 0 0 1\nframeCfg 0 0 16 ",
        "profileCfg 1 77.05 48 6 60 0 0 60.012 1 128 4400 0 0 30\nchirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 1 0 0 0 0 1\nframeCfg 0 1 8 ",
    );
    assert_ne!(cfg, CFG);
    let (folder, bin) = captured(&cfg, |_| {});
    let import = |profile: &str, out: &str| {
        hybridsim(&["import", bin.to_str().unwrap(), "--profile", profile, "--out", out], folder.path())
    };
    let output = import("all", "out");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(names(&folder.path().join("out")), ["profile0", "profile1"]);
    for (profile, start_hz) in [("0", 77e9), ("1", 77.05e9)] {
        let alone = format!("alone{profile}");
        assert!(import(profile, &alone).status.success());
        let [split, alone] = [format!("out/profile{profile}"), alone].map(|name| folder.path().join(name));
        for file in ["if.npy", "recording.toml"] {
            assert_eq!(fs::read(split.join(file)).unwrap(), fs::read(alone.join(file)).unwrap(), "{file} of {profile}");
        }
        let radar = Recording::open(&split).unwrap().radar;
        assert_eq!((radar.start_frequency_hz, radar.loops_per_frame), (start_hz, LOOPS / 2));
    }
    assert!(text(&import("both", "x").stderr).contains("expected the number of a profile, or all"));
    let (folder, bin) = captured(&cfg, WRONG[0].2);
    let output = hybridsim(&["import", bin.to_str().unwrap(), "--profile", "all", "--out", "out"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert_eq!(names(folder.path()), ["adc_data.bin", "radar.cfg"]);
}
