//! Traces of roverd: what `export` writes comes back sample by sample, and what contradicts itself is refused by name.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hybridsim::data::arrays::{Values, write_npy};
use hybridsim::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use hybridsim::import::capture::{self, Capture, Stated};
use hybridsim::radar::{Radar, SPEED_OF_LIGHT, Sampling};

const FRAMES: usize = 3;
/// Of one frame of `radar`: loops, transmitters, receivers, words, two bytes each.
const FRAME_BYTES: usize = 5 * 3 * 4 * 32 * 2;

fn run(words: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(words).env("NO_COLOR", "1").output().unwrap();
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{words:?}: {text}");
    text
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Three transmitters in the firing order 0, 2, 1 of an AWR1843BOOST, four receivers.
fn radar() -> Radar {
    Radar { samples_per_chirp: 16, loops_per_frame: 5, chirp_period_s: 61.37e-6, frame_period_s: 0.0333, ..Radar::mmmesh(FRAMES) }
}

/// A code that no other place has, but never the lowest one, whose negative is none.
fn code(place: usize, part: usize) -> f32 {
    let number = (place * 2 + part).wrapping_mul(40_503) % 65_536;
    (number as f32 - 32_768.0).max(-32_767.0)
}

/// A recording that lost a chirp in frame 1.
fn record(folder: &Path, radar: &Radar) -> PathBuf {
    let layout = if radar.sampling == Sampling::Complex { IfLayout::Codes } else { IfLayout::RealCodes };
    let contents =
        RecordingContents { radar, room: None, person: None, body_file: None, labels: Default::default(), layout, truth: None };
    let [frames, n_tx, n_rx, loops, samples] = radar.dims();
    let count = n_tx * n_rx * loops * samples;
    let frame = |index: usize| {
        let part = |part: usize| (0..count).map(|place| code(index * count + place, part)).collect::<Vec<f32>>();
        IfFrame::new([n_tx, n_rx, loops, samples], part(0), (radar.sampling == Sampling::Complex).then(|| part(1)))
    };
    write_recording(folder, &contents, &mut |index| Ok(frame(index))).unwrap();
    let mut chirps = vec![true; frames * n_tx * n_rx * loops];
    chirps[n_tx * n_rx * loops + 7] = false;
    write_npy(folder.join("valid.npy"), &[frames, n_tx, n_rx, loops], Values::Bool(&chirps)).unwrap();
    let settings = folder.join("recording.toml");
    let stated = fs::read_to_string(&settings).unwrap().replace("[files]", "[files]\nvalid = \"valid.npy\"");
    fs::write(&settings, stated).unwrap();
    folder.into()
}

/// The trace of `radar`, and its sensor.
fn trace() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let source = record(&folder.path().join("walk"), &radar());
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "rover", "--out", text(&out), "-q"]);
    let (trace, sensor) = (out.join("walk"), out.join("walk/radar"));
    assert_eq!(fs::read(sensor.join("valid")).unwrap(), [1, 0, 1]);
    assert_eq!(fs::read(sensor.join("iq")).unwrap().len(), FRAMES * FRAME_BYTES);
    (folder, trace, sensor)
}

fn opened(folder: &Path, stated: &Stated) -> Capture {
    capture::open(&[folder.into()], stated).unwrap()
}

#[track_caller]
fn refused(folder: &Path, stated: &Stated, message: &str) {
    let error = capture::open(&[folder.into()], stated).err().expect("it was accepted");
    assert_eq!(error.to_string(), message);
    assert!(error.hint().is_some(), "{error}");
}

fn write_times(sensor: &Path, times: &[f64]) {
    fs::write(sensor.join("ts"), times.iter().flat_map(|time| time.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
}

fn near(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 1e-9 * wanted.abs(), "{found:e} against {wanted:e}");
}

/// Antennas of a board whose receivers 1 and 3 are fed from the opposite side.
fn antennas_of_aop(radar: Radar) -> Radar {
    let half = SPEED_OF_LIGHT / 62.0e9 / 2.0;
    let place = |[x, z]: [f64; 2]| [x * half, 0.0, z * half];
    let tx_m = [[0.0, 0.0], [2.0, -2.0], [0.0, -2.0]].map(place).to_vec();
    let rx_m = [[1.0, -1.0], [1.0, 0.0], [0.0, -1.0], [0.0, 0.0]].map(place).to_vec();
    Radar { tx_m, rx_m, start_frequency_hz: 60.0e9, ..radar }
}

#[test]
fn a_trace_comes_back_sample_by_sample_and_knows_what_was_lost() {
    let real = Radar { sampling: Sampling::Real, ..radar() };
    for (radar, board) in [
        (radar(), None),
        (radar(), Some("AWR1843BOOST")),
        (antennas_of_aop(radar()), Some("IWR6843AOP")),
        (real.clone(), None),
        (real, Some("AWR1843BOOST")),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let source = record(&folder.path().join("walk"), &radar);
        let out = folder.path().join("out");
        let named: Vec<&str> = board.iter().flat_map(|board| ["--board", board]).collect();
        run(&[&["export", text(&source), "--to", "rover", "--out", text(&out), "-q"], &named[..]].concat());
        for (name, from) in [("by_trace", out.join("walk")), ("by_sensor", out.join("walk/radar"))] {
            let back = folder.path().join(name);
            // Codes that no two places share lie as no receiver's do.
            let told = run(&[&["import", text(&from), "--out", text(&back), "-q", "--as-stated"], &named[..]].concat());
            assert!(told.contains("60 of 180 chirps were lost (valid.npy): 1 of 3 frames are not whole"), "{told}");
            let [wanted, found] = [&source, &back].map(|folder| Recording::open(folder).unwrap());
            for index in 0..FRAMES {
                assert_eq!(found.frame(index).unwrap(), wanted.frame(index).unwrap(), "{board:?}, {:?}", radar.sampling);
            }
            assert_eq!(found.whole_frames().collect::<Vec<_>>(), [0, 2]);
            assert!(found.valid().unwrap().chirps(1).iter().all(|valid| !valid));
            assert_eq!((found.radar.dims(), found.radar.sampling), (radar.dims(), radar.sampling));
            near(found.radar.slope_hz_per_s, radar.slope_hz_per_s);
            near(found.radar.chirp_period_s, radar.chirp_period_s);
            near(found.radar.frame_period_s, radar.frame_period_s);
            let places = |radar: &Radar| [radar.tx_m.as_flattened(), radar.rx_m.as_flattened()].concat();
            assert!(places(&found.radar).iter().zip(places(&radar)).all(|(found, wanted)| (found - wanted).abs() < 1e-12));
        }
    }
}

#[test]
fn channels_that_contradict_each_other_are_refused_by_name() {
    let (_folder, trace, sensor) = trace();
    let [iq, ts, valid, meta] = ["iq", "ts", "valid", "meta.json"].map(|name| sensor.join(name));
    let (shown_iq, stated) = (iq.display(), Stated::default());
    let samples = fs::read(&iq).unwrap();
    fs::write(&iq, &samples[..samples.len() - 100]).unwrap();
    let expected = format!(
        "{shown_iq}: `samples` is 11420 bytes, expected whole frames of 3840 bytes: `iq.shape` is [5, 3, 4, 32] in {}",
        meta.display()
    );
    refused(&trace, &stated, &expected);
    fs::write(&iq, &samples).unwrap();
    write_times(&sensor, &[0.0, 0.0333]);
    let expected = format!("{}: `frames` is 2, expected 3 of 8 bytes each, as in {shown_iq}", ts.display());
    refused(&trace, &stated, &expected);
    fs::write(&ts, [0u8; 17]).unwrap();
    let expected = format!("{}: `frames` is 17 bytes, expected 3 of 8 bytes each, as in {shown_iq}", ts.display());
    refused(&trace, &stated, &expected);
    write_times(&sensor, &[0.0, f64::NAN, 0.0666]);
    refused(&trace, &stated, &format!("{}: `time of frame 1` is NaN, expected seconds", ts.display()));
    write_times(&sensor, &[0.0, 0.0333, 0.0666]);
    fs::write(&valid, [1u8; 4]).unwrap();
    let expected = format!("{}: `frames` is 4, expected 3 of 1 bytes each, as in {shown_iq}", valid.display());
    refused(&trace, &stated, &expected);
    fs::write(&valid, [0u8; 3]).unwrap();
    let expected = format!("{}: `valid` is 0 in every frame, expected one frame at least that is whole", valid.display());
    refused(&trace, &stated, &expected);
    fs::write(&valid, [1u8; 3]).unwrap();
    assert_eq!(opened(&trace, &stated).radar.frames, FRAMES);
    let mut compressed: serde_json::Value = serde_json::from_str(&fs::read_to_string(&meta).unwrap()).unwrap();
    compressed["iq"]["format"] = "lzma".into();
    fs::write(&meta, compressed.to_string()).unwrap();
    refused(&trace, &stated, &format!("{}: `iq.format` is \"lzma\", expected \"raw\"", meta.display()));
}

#[test]
fn time_stamps_that_contradict_the_frame_period_are_refused_and_gaps_are_marked() {
    let (_folder, trace, sensor) = trace();
    let ts = sensor.join("ts");
    write_times(&sensor, &[10.0, 10.05, 10.1]);
    let expected = format!("{}: `median spacing` is 0.050000 s, expected 0.0333 s, the radar's frame_period_s", ts.display());
    refused(&trace, &Stated::default(), &expected);
    let kept = opened(&trace, &Stated { sets: vec!["radar.frame_period_s=0.0333".into()], ..Stated::default() });
    let note = format!("{}: frames came every 0.050000 s by their time stamps; 0.0333 s is kept, as it was set", ts.display());
    assert!(kept.notes.contains(&note), "{:?}", kept.notes);
    write_times(&sensor, &[10.0, 10.0333, 10.1332]);
    let note = format!(
        "{}: by the time stamps 2 frames were lost, the first after frame 1; they are zeros here and marked as lost (valid.npy), so that \
         the others keep their times",
        ts.display()
    );
    let gap = opened(&trace, &Stated::default());
    assert!(gap.notes.contains(&note), "{:?}", gap.notes);
    // Frame 1 is one that `valid` says is not whole.
    assert_eq!((gap.radar.frames, &gap.lost[..]), (5, &[1, 2, 3][..]));
    near(gap.radar.frame_period_s, 0.0333);
    let asked = |frames: usize| Stated { sets: vec![format!("radar.frames={frames}")], ..Stated::default() };
    let first = opened(&trace, &asked(1));
    assert_eq!((first.radar.frames, &first.lost[..]), (1, &[][..]));
    let expected = format!("`radar.frames` is 4, expected at most 3, as many as {} holds", sensor.join("iq").display());
    refused(&trace, &asked(4), &expected);
    write_times(&sensor, &[10.0, 10.0333, 9.0]);
    let note = format!("{}: time stamps go back after frame 1: they do not say when frames came", ts.display());
    let back = opened(&trace, &Stated::default());
    assert!(back.notes.contains(&note), "{:?}", back.notes);
}

#[test]
fn without_radar_json_the_resolutions_are_not_compared_and_what_is_missing_is_named() {
    let (_folder, trace, sensor) = trace();
    let beside = sensor.join("radar.json");
    let whole = fs::read_to_string(&beside).unwrap();
    let changed = whole.replace("\"range_resolution\": ", "\"range_resolution\": 1");
    assert_ne!(changed, whole);
    fs::write(&beside, changed).unwrap();
    let error = capture::open(std::slice::from_ref(&trace), &Stated::default()).err().unwrap().to_string();
    assert!(error.starts_with(&format!("{}: `range_resolution` is 1", beside.display())), "{error}");
    fs::remove_file(&beside).unwrap();
    let note = format!("{}: missing: range and Doppler resolution are not held against the radar's settings", beside.display());
    let found = opened(&trace, &Stated::default());
    assert!(found.notes.contains(&note), "{:?}", found.notes);
    let config = trace.join("config.yaml");
    fs::remove_file(&config).unwrap();
    let expected = format!("{}: `radar.start_frequency_hz` is missing, expected a value", config.display());
    refused(&trace, &Stated::default(), &expected);
}

#[test]
fn resolutions_and_time_stamps_say_what_no_setting_does() {
    let (_folder, trace, sensor) = trace();
    fs::remove_file(trace.join("config.yaml")).unwrap();
    let sets = ["start_frequency_hz=77e9", "sample_rate_hz=4.4e6", "adc_start_s=6e-6"].map(|set| format!("radar.{set}")).to_vec();
    let stated = Stated { board: Some("AWR1843BOOST".into()), sets, ..Stated::default() };
    let (found, wanted) = (opened(&trace, &stated).radar, radar());
    near(found.slope_hz_per_s, wanted.slope_hz_per_s);
    near(found.chirp_period_s, wanted.chirp_period_s);
    near(found.frame_period_s, wanted.frame_period_s);
    let half = SPEED_OF_LIGHT / 77.0e9 / 2.0;
    assert_eq!(found.tx_m, [[0.0; 3], [2.0 * half, 0.0, half], [4.0 * half, 0.0, 0.0]]);
    // Another board has two transmitters alone.
    let other = Stated { board: Some("IWR1642BOOST".into()), ..stated };
    let expected = format!("{}: `radar.tx_m` is missing, expected a value", trace.join("config.yaml").display());
    refused(&trace, &other, &expected);
    assert!(sensor.is_dir());
}

#[test]
fn a_rovers_own_settings_are_read_in_their_units() {
    let (_folder, trace, sensor) = trace();
    fs::remove_file(sensor.join("radar.json")).unwrap();
    let config = "lidar:\n  args:\n    frequency: 10.0\nradar:\n  type: radar # of the front\n  args:\n    radar:\n      \
                  device: AWR1843\n      frequency: 77.0\n      idle_time: 5.37\n      adc_start_time: 6.0\n      \
                  ramp_end_time: 56.0\n      freq_slope: 60.012\n      adc_samples: 16\n      sample_rate: 4400\n      \
                  frame_length: 5\n      frame_period: 33.3\nimu:\n  frame_period: 7\n";
    fs::write(trace.join("config.yaml"), config).unwrap();
    let stated = Stated { board: Some("AWR1843".into()), ..Stated::default() };
    let (found, wanted) = (opened(&trace, &stated).radar, radar());
    assert_eq!(found.dims(), wanted.dims());
    near(found.start_frequency_hz, wanted.start_frequency_hz);
    near(found.slope_hz_per_s, wanted.slope_hz_per_s);
    near(found.sample_rate_hz, wanted.sample_rate_hz);
    near(found.adc_start_s, wanted.adc_start_s);
    near(found.chirp_period_s, wanted.chirp_period_s);
    near(found.frame_period_s, wanted.frame_period_s);
    fs::write(trace.join("config.yaml"), config.replace("adc_samples: 16", "adc_samples: 32")).unwrap();
    let expected = format!(
        "{}: `iq.shape` is [5, 3, 4, 32], expected [5, 3, 4, 64] by the radar's settings: loops, transmitters, receivers, words",
        sensor.join("meta.json").display()
    );
    refused(&trace, &stated, &expected);
}
