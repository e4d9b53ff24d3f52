//! Captures at the door: what is refused and with which words, what is kept, what is lost and known to be. Each wrong convention has a
//! capture that is refused for it alone, and the capture as it was taken is not.

use crate::support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hybridsim::data::settings::read_text;
use hybridsim::data::{Recording, Valid};
use hybridsim::diagnosis::cube::Loaded;
use hybridsim::import::capture::{self, Layout, Preset, Stated};
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
        let wrong: Vec<&str> = findings.iter().filter(|finding| !finding.ok).map(|finding| finding.check).collect();
        assert_eq!(wrong, ["iq_order"], "{findings:?}");
    }
}

/// 16-bit words in a packet of the capture card.
const PACKET: usize = 728;

#[test]
fn packets_of_zeros_are_lost_and_known() {
    // Two packets, in the frames 3 and 9.
    let (folder, bin) = captured(CFG, |words| {
        for start in [3 * LOOPS * CHIRP + 100, 9 * LOOPS * CHIRP + 4 * CHIRP + 40] {
            words[start..start + PACKET].fill(0);
        }
    });
    let output = hybridsim(&["import", bin.to_str().unwrap(), "--out", "out"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("2 of 16 frames are not whole and are used for nothing"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("what was lost is left out"), "{}", text(&output.stdout));
    let recording = Recording::open(folder.path().join("out")).unwrap();
    let broken: Vec<usize> = (0..FRAMES).filter(|frame| !recording.is_whole(*frame)).collect();
    assert_eq!((broken, recording.whole_stretch().unwrap()), (vec![3, 9], 10..16));
    // What is left is whole, and `check` says how much that is.
    let findings = integrity::inspect(&recording, FRAMES).unwrap();
    assert_eq!(integrity::damage(&findings), None, "{findings:?}");
    let check = hybridsim(&["check", "out"], folder.path());
    assert!(text(&check.stdout).contains("all 14 frames can be read"), "{}", text(&check.stdout));
    // The diagnosis looks at the longest stretch, at its own times.
    let loaded = Loaded::read(&recording, usize::MAX).unwrap();
    assert_eq!((loaded.radar.frames, (loaded.starts_s[0] * 10.0).round()), (6, 10.0));
    assert_eq!(loaded.cube.samples[7].re, f64::from(recording.frame(10).unwrap().re[7]));
}

#[test]
fn a_mask_is_read_as_bool_or_bytes_and_refused_in_another_shape() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["if.npy", "recording.toml"] {
        fs::copy(recording().join(name), folder.path().join(name)).unwrap();
    }
    let file = folder.path().join("recording.toml");
    let plain: String = fs::read_to_string(&file).unwrap();
    let without_person: Vec<&str> = plain
        .lines()
        .filter(|line| !["body =", "motion =", "vertices =", "faces =", "pose_times ="].iter().any(|key| line.starts_with(key)))
        .collect();
    let plain = without_person.join("\n").replace("[files]", "[files]\nvalid = \"valid.npy\"");
    fs::write(&file, &plain).unwrap();
    let write = |kind: &str, shape: &str, values: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        let padded = format!("{header:<117}\n");
        let bytes = [b"\x93NUMPY\x01\x00\x76\x00".as_slice(), padded.as_bytes(), values].concat();
        fs::write(folder.path().join("valid.npy"), bytes).unwrap();
        Recording::open(folder.path())
    };
    let mut values = vec![1; FRAMES * RX * LOOPS];
    values[2 * RX * LOOPS + 5] = 0;
    for kind in ["|b1", "|u1"] {
        let recording = write(kind, "(16, 1, 4, 16)", &values).unwrap();
        assert_eq!(recording.whole_frames().count(), FRAMES - 1);
        assert!(!recording.is_whole(2) && recording.notes.iter().any(|note| note.contains("1 of 1024 chirps were lost")));
    }
    let error = write("|b1", "(16, 4, 16)", &values).unwrap_err();
    assert!(
        error.to_string().contains("valid") && error.to_string().contains("[frame = 16, tx = 1, rx = 4, loop = 16]"),
        "{error}"
    );
    values.fill(0);
    let error = write("|b1", "(16, 1, 4, 16)", &values).unwrap().whole_stretch().unwrap_err();
    assert!(error.to_string().contains("lost chirps in every frame"), "{error}");
    assert_eq!(Valid::without(&Recording::open(recording()).unwrap().radar, [[2, 0, 0, 5]]).lost(), 1);
}

/// A capture that ends anywhere: whole frames are kept, less is refused, and half a word is said to be one.
#[test]
fn a_capture_that_is_cut_off_gives_its_whole_frames_or_an_error() {
    let (folder, bin) = captured(CFG, |_| {});
    let whole = fs::read(&bin).unwrap();
    let frame = 2 * LOOPS * CHIRP;
    for (bytes, wanted) in [
        (0, Err("an empty file")),
        (1, Err("whole 16-bit samples")),
        (frame - 2, Err("at least 32768 bytes, one frame")),
        (frame + 1, Err("whole 16-bit samples")),
        (2 * frame, Ok(2)),
        (3 * frame - 2, Ok(2)),
        (whole.len(), Ok(FRAMES)),
    ] {
        fs::write(&bin, &whole[..bytes]).unwrap();
        match (capture::open(std::slice::from_ref(&bin), &Stated::default()), wanted) {
            (Ok(capture), Ok(frames)) => assert_eq!(capture.radar.frames, frames, "{bytes} bytes"),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{bytes} bytes: {error}"),
            (found, _) => panic!("{bytes} bytes: {:?}", found.err()),
        }
    }
    drop(folder);
}

/// A packet of zeros in every frame, and in the only one; the only one without the packet.
#[test]
fn nothing_whole_is_nothing_imported() {
    let refused = |frames: usize, change: &dyn Fn(&mut Vec<i16>)| {
        let (folder, bin) = captured(CFG, |words| {
            words.truncate(frames * LOOPS * CHIRP);
            change(words);
        });
        let error = capture::open(std::slice::from_ref(&bin), &Stated::default())
            .and_then(|capture| capture::import(capture, &folder.path().join("out"), Default::default(), &mut |_, _| ()))
            .unwrap_err();
        assert_eq!(names(folder.path()), ["adc_data.bin", "radar.cfg"]);
        assert!(error.hint().is_some(), "{error}");
        error.to_string()
    };
    for frames in [FRAMES, 1] {
        let error = refused(frames, &|words| {
            (0..frames).for_each(|frame| words[frame * LOOPS * CHIRP + 3 * CHIRP + 300 * frame..][..PACKET].fill(0));
        });
        let spot = "the first from frame 0, loop 3, tx 0, rx 0, sample 0 on, expected one frame at least that is whole";
        assert!(error.contains("adc_data.bin: `samples` is lost chirps in every frame: exact zeros in"), "{error}");
        assert!(error.contains(spot), "{error}");
    }
    let error = refused(1, &|words| drop(words.drain(3 * CHIRP..3 * CHIRP + PACKET)));
    let bytes = 2 * (LOOPS * CHIRP - PACKET);
    assert!(error.contains(&format!("`samples` is {bytes} bytes, expected at least 32768 bytes, one frame of")), "{error}");
}

/// A MAT-file of version 5 with one complex array of int16, as MATLAB lays it out: first axis fastest, all real parts first.
fn mat(shape: [usize; 4], code: impl Fn(usize) -> [i16; 2]) -> Vec<u8> {
    let count: usize = shape.iter().product();
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let part = |part: usize| (0..count).flat_map(|n| code(n)[part].to_le_bytes()).collect::<Vec<u8>>();
    let matrix = [
        element(6, &[[10, 0x08, 0, 0], [0; 4]].concat()),
        element(5, &shape.map(|length| (length as u32).to_le_bytes()).concat()),
        element(1, b"adcData"),
        element(3, &part(0)),
        element(3, &part(1)),
    ];
    let mut bytes = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    bytes.extend(b"\x00\x01IM");
    bytes.extend(element(14, &matrix.concat()));
    bytes
}

#[test]
fn a_public_data_set_is_read_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("000000.mat");
    // Samples fastest, then chirps, receivers, transmitters.
    let code = |n: usize| [(n % 997) as i16, -((n % 991) as i16)];
    fs::write(&path, mat([128, 255, 4, 2], code)).unwrap();
    let stated = Stated { preset: Some(Preset::named("uw_raw_adc").unwrap()), ..Stated::default() };
    let mut capture = capture::open(std::slice::from_ref(&path), &stated).unwrap();
    assert_eq!(capture.radar.dims(), [1, 2, 4, 255, 128]);
    // The horizontal transmitters, four half wavelengths apart.
    assert!((capture.radar.tx_m[1][0] - 4.0 * 0.5 * 299_792_458.0 / 77e9).abs() < 1e-9 && capture.radar.tx_m[1][2] == 0.0);
    assert!(capture.notes[0].contains("https://"), "{:?}", capture.notes);
    let frame = (capture.frame)(0).unwrap();
    let value = frame.sample(1, 2, 17, 33);
    let n = 33 + 128 * (17 + 255 * (2 + 4));
    assert_eq!([value.re, value.im], code(n).map(f32::from));
    // The same file by its layout; another layout does not fit.
    let sets: Vec<String> = [
        "start_frequency_hz=77e9",
        "slope_hz_per_s=21e12",
        "sample_rate_hz=4e6",
        "chirp_period_s=60e-6",
        "frame_period_s=0.0334",
        "tx_m=[[0.0, 0.0, 0.0], [0.008, 0.0, 0.0]]",
    ]
    .map(|set| format!("radar.{set}"))
    .to_vec();
    let stated = |layout: &str| Stated {
        layout: Some(Layout::parse(layout).unwrap()),
        board: Some("AWR1843".into()),
        sets: sets.clone(),
        ..Stated::default()
    };
    let mut by_layout = capture::open(std::slice::from_ref(&path), &stated("sample loop rx tx")).unwrap();
    assert_eq!((by_layout.frame)(0).unwrap(), frame);
    let error = capture::open(&[path], &stated("sample loop tx rx")).err().unwrap();
    assert!(error.to_string().contains("int16 in two parts [128, 255, 4, 2]"), "{error}");
}

#[test]
fn real_captures_are_what_they_are_stated_to_be() {
    for (source, board) in
        [("fixtures/raw/ti_iwr6843_mmwave_eyes/adc_data.bin", Some("IWR6843ISK")), ("fixtures/raw/infineon_avian_folder", None)]
    {
        let Some(source) = support::shared(source) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let stated = Stated { board: board.map(String::from), ..Stated::default() };
        let capture = capture::open(&[source], &stated).unwrap();
        let draft = capture::draft(capture, &folder.path().join("out"), Default::default(), &mut |_, _| ()).unwrap();
        assert!(draft.findings.iter().all(|finding| finding.ok), "{:#?}", draft.findings);
        draft.publish(false).unwrap();
    }
}

#[test]
fn samples_that_were_written_as_wider_numbers_are_refused_by_their_type() {
    let error = |bin: &Path| capture::open(&[bin.into()], &Stated::default()).err().map(|error| error.to_string());
    let (_folder, bin) = captured(CFG, |_| {});
    assert_eq!(error(&bin), None);
    let words = words();
    for (kind, bytes) in [
        ("<i4", words.iter().flat_map(|&word| i32::from(word).to_le_bytes()).collect::<Vec<u8>>()),
        ("<f4", words.iter().flat_map(|&word| f32::from(word).to_le_bytes()).collect()),
        ("<f8", words.iter().flat_map(|&word| (f64::from(word) / 32768.0).to_le_bytes()).collect()),
    ] {
        fs::write(&bin, bytes).unwrap();
        let found = error(&bin).unwrap_or_default();
        assert!(found.contains(&format!("`samples` is numbers of type {kind}, expected 16-bit integers")), "{kind}: {found}");
    }
    // A frame that another program kept as complex numbers of twice 64 bits, beside its capture: its type is asked for.
    let Some(frame) = support::shared("fixtures/raw/ti_iwr6843_mmwave_eyes/frame_1.bin") else { return };
    let found = capture::open(std::slice::from_ref(&frame), &Stated::default()).err().unwrap();
    assert!(found.to_string().contains("numbers of type <f8"), "{found}");
    assert!(found.hint().unwrap().contains("--layout \"frame loop tx rx sample complex128\""), "{:?}", found.hint());
    let folder = tempfile::tempdir().unwrap();
    let settings = [
        "start_frequency_hz=77e9",
        "slope_hz_per_s=46.85e12",
        "sample_rate_hz=5e6",
        "chirp_period_s=131.09e-6",
        "frame_period_s=0.1",
        "samples_per_chirp=128",
        "loops_per_frame=128",
    ]
    .map(|set| format!("radar.{set}"));
    let layout = ["--layout", "frame sample loop rx tx complex128", "--board", "IWR1843"];
    let sets: Vec<&str> = settings.iter().flat_map(|set| ["--set", set]).collect();
    let words = [&["import", frame.to_str().unwrap(), "--out", "out"], &layout[..], &sets[..]].concat();
    // The stream was cut within a chirp (`import::capture::numbers`).
    let refused = hybridsim(&words, folder.path());
    let error = text(&refused.stderr);
    assert!(error.contains("`chirp start`") && error.contains("breaks most at sample 31"), "{error}");
    let kept = hybridsim(&[&words[..], &["--yes-as-stated"]].concat(), folder.path());
    assert!(kept.status.success(), "{}", text(&kept.stderr));
    assert_eq!(Recording::open(folder.path().join("out")).unwrap().radar.dims(), [1, 3, 4, 128, 128]);
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
