//! Recordings that go out and come back: every sample equal, and every change to a file noticed.

mod targets;

use crate::support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hybridsim::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use hybridsim::radar::{Radar, Sampling};

const FRAMES: usize = 3;

fn hybridsim(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(words).env("NO_COLOR", "1").output().unwrap()
}

fn run(words: &[&str]) -> String {
    let output = hybridsim(words);
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{words:?}: {text}");
    text
}

fn refused(words: &[&str], parts: &[&str]) {
    let output = hybridsim(words);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {text}");
    parts.iter().for_each(|part| assert!(text.contains(part), "`{part}` is missing in:\n{text}"));
    assert!(!text.contains("panicked"), "{text}");
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Three transmitters in the firing order 0, 2, 1 of an AWR1843BOOST, four receivers, and times that are no round numbers.
fn radar(frames: usize) -> Radar {
    Radar { samples_per_chirp: 16, loops_per_frame: 5, chirp_period_s: 61.37e-6, frame_period_s: 0.0333, ..Radar::mmmesh(frames) }
}

/// A code that no other place has, over the whole range of int16.
fn code(place: usize, part: usize) -> f32 {
    let number = (place * 2 + part).wrapping_mul(40_503) % 65_536;
    number as f32 - 32_768.0
}

fn frame(radar: &Radar, index: usize, value: impl Fn(usize, usize) -> f32) -> IfFrame {
    let [_, tx, rx, loops, samples] = radar.dims();
    let count = tx * rx * loops * samples;
    let part = |part: usize| (0..count).map(|place| value(index * count + place, part)).collect::<Vec<f32>>();
    IfFrame::new([tx, rx, loops, samples], part(0), (radar.sampling == Sampling::Complex).then(|| part(1)))
}

fn record(
    folder: &Path,
    radar: &Radar,
    layout: IfLayout,
    labels: &[(&str, &str)],
    value: impl Fn(usize, usize) -> f32,
) -> PathBuf {
    let contents = RecordingContents {
        radar,
        room: None,
        person: None,
        body_file: None,
        labels: labels.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect(),
        layout,
        truth: None,
    };
    write_recording(folder, &contents, &mut |index| Ok(frame(radar, index, &value))).unwrap();
    folder.into()
}

/// Frames in which the recordings differ.
fn different(one: &Path, other: &Path) -> Vec<usize> {
    let [one, other] = [one, other].map(|folder| Recording::open(folder).unwrap());
    assert_eq!(one.radar.dims(), other.radar.dims());
    (0..one.frames()).filter(|&index| one.frame(index).unwrap() != other.frame(index).unwrap()).collect()
}

/// Everything about the chirps; the antennas are compared by themselves.
fn assert_same_radar(found: &Radar, wanted: &Radar) {
    assert_eq!((found.dims(), found.sampling), (wanted.dims(), wanted.sampling));
    for (name, found, wanted) in [
        ("start_frequency_hz", found.start_frequency_hz, wanted.start_frequency_hz),
        ("slope_hz_per_s", found.slope_hz_per_s, wanted.slope_hz_per_s),
        ("sample_rate_hz", found.sample_rate_hz, wanted.sample_rate_hz),
        ("adc_start_s", found.adc_start_s, wanted.adc_start_s),
        ("chirp_period_s", found.chirp_period_s, wanted.chirp_period_s),
        ("frame_period_s", found.frame_period_s, wanted.frame_period_s),
    ] {
        assert!((found - wanted).abs() <= 1e-12 * wanted.abs(), "{name}: {found:e} against {wanted:e}");
    }
}

/// The step from the first to every other antenna.
fn assert_same_steps(found: &[[f64; 3]], wanted: &[[f64; 3]]) {
    for (found_at, wanted_at) in found.iter().zip(wanted) {
        for axis in 0..3 {
            let (step, wanted) = (found_at[axis] - found[0][axis], wanted_at[axis] - wanted[0][axis]);
            assert!((step - wanted).abs() < 1e-9, "{found:?} against {wanted:?}");
        }
    }
}

#[test]
fn a_capture_comes_back_as_it_went_out_for_every_kind_of_lane() {
    for (board, sampling) in [
        (None, Sampling::Complex),
        (Some("AWR1843BOOST"), Sampling::Complex),
        (Some("IWR1443BOOST"), Sampling::Complex),
        (Some("AWR1843BOOST"), Sampling::Real),
        (Some("IWR1443BOOST"), Sampling::Real),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let radar = Radar { sampling, ..radar(FRAMES) };
        let layout = if sampling == Sampling::Complex { IfLayout::Codes } else { IfLayout::RealCodes };
        let source = record(&folder.path().join("walk"), &radar, layout, &[("action", "walk")], code);
        let (out, back) = (folder.path().join("out"), folder.path().join("back"));
        let named: Vec<&str> = board.iter().flat_map(|board| ["--board", board]).collect();
        // Files that end within a chirp.
        let words = [&["export", text(&source), "--to", "dca1000", "--out", text(&out), "-q"], &named[..]].concat();
        let told = run(&[&words[..], &["--set", "capture.file_bytes=3334"]].concat());
        assert!(told.contains("not carried: labels"), "{told}");
        assert!(out.join("walk_Raw_1.bin").is_file() && out.join("walk.mmwave.json").is_file());
        let setup = out.join("walk.setup.json");
        // Codes that no two places share lie as no receiver's do.
        run(&[&["import", text(&setup), "--out", text(&back), "-q", "--as-stated"], &named[..]].concat());
        assert_eq!(different(&source, &back), [0usize; 0], "{board:?}, {sampling:?}");
        let found = Recording::open(&back).unwrap().radar;
        assert_same_radar(&found, &radar);
        if board.is_some() {
            assert_same_steps(&found.tx_m, &radar.tx_m);
            assert_same_steps(&found.rx_m, &radar.rx_m);
        }
    }
}

/// The layout of SWRA581B once more, written out by hand: two lanes carry I0 I1 Q0 Q1 of one receiver after the other.
#[test]
fn two_lanes_are_as_the_document_draws_them() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(1);
    let source = record(&folder.path().join("a"), &radar, IfLayout::Codes, &[], code);
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "dca1000", "--out", text(&out), "-q"]);
    let bytes = fs::read(out.join("a_Raw_0.bin")).unwrap();
    let words: Vec<i16> = bytes.as_chunks().0.iter().map(|&word| i16::from_le_bytes(word)).collect();
    let [_, n_tx, n_rx, loops, samples] = radar.dims();
    let mut wanted = Vec::new();
    for index in 0..loops {
        for tx in 0..n_tx {
            for rx in 0..n_rx {
                for pair in 0..samples / 2 {
                    let place = |step: usize| ((tx * n_rx + rx) * loops + index) * samples + 2 * pair + step;
                    let [first, second] = [place(0), place(1)];
                    wanted.extend([code(first, 0), code(second, 0), code(first, 1), code(second, 1)].map(|code| code as i16));
                }
            }
        }
    }
    assert_eq!(words, wanted);
}

/// A capture that a board made, converted by hand, goes out as the board's own bytes.
#[test]
fn a_real_capture_goes_out_as_the_bytes_that_came_in() {
    let (Some(source), Some(raw)) =
        (support::shared("recordings/real/room_60ghz"), support::shared("fixtures/raw/ti_iwr6843_mmwave_eyes/adc_data.bin"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "dca1000", "--board", "IWR6843ISK", "--out", text(&out), "-q"]);
    let (found, wanted) = (fs::read(out.join("room_60ghz_Raw_0.bin")).unwrap(), fs::read(raw).unwrap());
    assert_eq!(found.len(), wanted.len());
    assert!(found == wanted, "first other byte: {:?}", found.iter().zip(&wanted).position(|(found, wanted)| found != wanted));
}

#[test]
fn whatever_is_changed_in_a_capture_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let source = record(&folder.path().join("a"), &radar(FRAMES), IfLayout::Codes, &[], code);
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "dca1000", "--out", text(&out), "-q"]);
    let (bin, json) = (out.join("a_Raw_0.bin"), out.join("a.mmwave.json"));
    let (bytes, description) = (fs::read(&bin).unwrap(), fs::read_to_string(&json).unwrap());
    let mut count = 0;
    let mut back = || {
        count += 1;
        let back = folder.path().join(format!("back{count}"));
        run(&["import", text(&bin), "--out", text(&back), "-q"]);
        different(&source, &back)
    };
    assert_eq!(back(), [0usize; 0]);
    // I and Q the other way round, in the words and in the description.
    let mut swapped = bytes.clone();
    swapped.chunks_exact_mut(8).for_each(|group| group.rotate_left(4));
    fs::write(&bin, &swapped).unwrap();
    assert_eq!(back(), [0, 1, 2]);
    fs::write(&json, description.replace("\"iqSwapSel\": 0", "\"iqSwapSel\": 1")).unwrap();
    assert_eq!(back(), [0usize; 0]);
    fs::write(&bin, &bytes).unwrap();
    assert_eq!(back(), [0, 1, 2]);
    fs::write(&json, &description).unwrap();
    // One bit of the last frame; two chirps of the first.
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    fs::write(&bin, &changed).unwrap();
    assert_eq!(back(), [2]);
    let chirp = 4 * 16 * 4;
    let mut changed = bytes.clone();
    changed[..2 * chirp].rotate_left(chirp);
    fs::write(&bin, &changed).unwrap();
    assert_eq!(back(), [0]);
}

#[test]
fn a_receiver_that_a_board_feeds_from_the_other_side_is_turned_both_ways() {
    let folder = tempfile::tempdir().unwrap();
    let half = hybridsim::radar::SPEED_OF_LIGHT / 62.0e9 / 2.0;
    let place = |[x, z]: [f64; 2]| [x * half, 0.0, z * half];
    let tx_m = [[0.0, 0.0], [2.0, -2.0], [0.0, -2.0]].map(place).to_vec();
    let rx_m = [[1.0, -1.0], [1.0, 0.0], [0.0, -1.0], [0.0, 0.0]].map(place).to_vec();
    let radar = Radar { tx_m, rx_m, start_frequency_hz: 60.0e9, ..radar(FRAMES) };
    // The negative of the lowest code is no code.
    let value = |place: usize, part: usize| code(place, part).max(-32_767.0);
    let source = record(&folder.path().join("a"), &radar, IfLayout::Codes, &[], value);
    let (out, back) = (folder.path().join("out"), folder.path().join("back"));
    run(&["export", text(&source), "--to", "dca1000", "--board", "IWR6843AOP", "--out", text(&out), "-q"]);
    run(&["import", text(&out.join("a_Raw_0.bin")), "--board", "IWR6843AOP", "--out", text(&back), "-q"]);
    assert_eq!(different(&source, &back), [0usize; 0]);
    let found = Recording::open(&back).unwrap().radar;
    assert_eq!((found.tx_m, found.rx_m), (radar.tx_m, radar.rx_m));
}

#[test]
fn numbers_that_are_no_codes_are_rounded_to_a_full_scale_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let value = |place: usize, part: usize| code(place, part) * 1e-7;
    let source = record(&folder.path().join("a"), &radar(1), IfLayout::Complex, &[], value);
    let (out, back) = (folder.path().join("out"), folder.path().join("back"));
    let told = run(&["export", text(&source), "--to", "dca1000", "--out", text(&out), "-q"]);
    assert!(told.contains("complex64 samples were rounded to codes of 16 bits: 3.27"), "{told}");
    run(&["import", text(&out.join("a_Raw_0.bin")), "--out", text(&back), "-q"]);
    let [found, wanted] = [&back, &source].map(|folder| Recording::open(folder).unwrap().frame(0).unwrap());
    let peak = wanted.re.iter().chain(wanted.im.iter().flatten()).fold(0f32, |peak, value| peak.max(value.abs()));
    for (found, wanted) in found.re.iter().zip(&wanted.re) {
        assert!((found * peak / 32_767.0 - wanted).abs() <= 0.51 * peak / 32_767.0, "{found} against {wanted}");
    }
    let clipped = folder.path().join("clipped");
    let told =
        run(&["export", text(&source), "--to", "dca1000", "--set", "capture.full_scale=1e-3", "--out", text(&clipped), "-q"]);
    assert!(told.contains("parts of samples were beyond int16"), "{told}");
}

#[test]
fn what_a_capture_cannot_hold_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let odd = record(&folder.path().join("odd"), &Radar { samples_per_chirp: 15, ..radar(1) }, IfLayout::Codes, &[], code);
    let out = folder.path().join("out");
    let to = |target| ["export", text(&odd), "--to", target, "--out", text(&out), "-q"];
    refused(&to("dca1000"), &["recording.toml: `radar.samples_per_chirp` is 15, expected a multiple of 2", "hint: "]);
    refused(&to("mat"), &["no target `mat`, known are npz, hdf5, dca1000"]);
    let with = |more: &[&'static str]| [&to("dca1000")[..], more].concat();
    refused(&with(&["--board", "IWR6843ISK"]), &["hint: "]);
    refused(&with(&["--board", "BGT60TR13C"]), &["no board of TI"]);
    refused(&with(&["--set", "capture.fullscale=3"]), &["unknown key `capture.fullscale`", "`full_scale`"]);
    refused(&with(&["--set", "capture.full_scale=-1"]), &["`capture.full_scale` is -1, expected a positive number"]);
    refused(&with(&["--split-by", "subject"]), &["`labels.subject` is missing", "no label at all"]);
    assert!(!out.exists());
}
