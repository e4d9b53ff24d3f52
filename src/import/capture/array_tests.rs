//! Captures that others have turned into arrays.

use std::fs;
use std::path::{Path, PathBuf};

use num_complex::Complex32;

use super::tests::*;
use super::{Capture, Layout, Stated, import, open};
use crate::data::arrays::{Values, write_npy};
use crate::data::{IfLayout, Recording};
use crate::radar::Sampling;
use crate::support::numbers;

#[test]
fn an_array_is_read_in_any_order_of_axes() {
    let folder = tempfile::tempdir().unwrap();
    let radar = folder.path().join("radar.toml");
    fs::write(
        &radar,
        "[radar]\nstart_frequency_hz = 77e9\nslope_hz_per_s = 60e12\nsample_rate_hz = 4e6\nchirp_period_s = 60e-6\nframe_period_s = 0.1\n",
    )
    .unwrap();
    let stated = |layout: &str| Stated {
        configs: vec![radar.clone()],
        board: Some("AWR1843".into()),
        layout: Some(Layout::parse(layout).unwrap()),
        ..Stated::default()
    };
    let chirps = LOOPS * TX;
    let path = folder.path().join("cube.npy");
    // Chirps outermost but frames, then samples, receivers, I and Q.
    let mut codes = Vec::new();
    for frame in 0..FRAMES {
        for chirp in 0..chirps {
            for sample in 0..SAMPLES {
                for rx in 0..RX {
                    codes.extend(code([frame, chirp / TX, chirp % TX, rx, sample]));
                }
            }
        }
    }
    write_npy(&path, &[FRAMES, chirps, SAMPLES, RX, 2], Values::I16(&codes)).unwrap();
    let mut capture = open(std::slice::from_ref(&path), &stated("frame chirp sample rx iq")).unwrap();
    assert_eq!((capture.radar.dims(), capture.layout), ([FRAMES, TX, RX, LOOPS, SAMPLES], IfLayout::Codes));
    assert_frames(&mut capture, code);
    // Frames innermost: gathered from the whole file.
    let mut codes = Vec::new();
    for tx in 0..TX {
        for index in 0..LOOPS {
            for rx in 0..RX {
                for sample in 0..SAMPLES {
                    for part in 0..2 {
                        codes.extend((0..FRAMES).map(|frame| code([frame, index, tx, rx, sample])[part]));
                    }
                }
            }
        }
    }
    write_npy(&path, &[TX, LOOPS, RX, SAMPLES, 2, FRAMES], Values::I16(&codes)).unwrap();
    assert_frames(&mut open(std::slice::from_ref(&path), &stated("tx loop rx sample iq frame")).unwrap(), code);
    let error = open(&[path], &stated("frame chirp rx sample")).err().unwrap();
    assert!(error.to_string().contains("int16 [3, 4, 4, 8, 2, 2]") && error.hint().is_some(), "{error}");
}

/// The import's error, of an array of `frame chirp sample rx` or of its frames in files of their own.
fn refused(sources: &[PathBuf], layout: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let keys =
        ["start_frequency_hz=77e9", "slope_hz_per_s=60e12", "sample_rate_hz=4e6", "chirp_period_s=60e-6", "frame_period_s=0.1"];
    let stated = Stated {
        board: Some("AWR1843".into()),
        layout: Some(Layout::parse(layout).unwrap()),
        sets: keys.map(|key| format!("radar.{key}")).to_vec(),
        ..Stated::default()
    };
    let capture = open(sources, &stated).unwrap();
    let error = import(capture, &folder.path().join("out"), Default::default(), &mut |_, _| {}).err().unwrap();
    assert!(error.hint().is_some(), "{error}");
    error.to_string()
}

#[test]
fn a_sample_that_is_not_finite_is_named_by_the_users_file_and_its_place() {
    let folder = tempfile::tempdir().unwrap();
    // Transmitters take turns: chirp 7 is loop 2 of transmitter 1.
    let frame = |bad: f64| {
        let mut values = numbers(3, LOOPS * TX * SAMPLES * RX, -1.0, 1.0);
        values[(7 * SAMPLES + 5) * RX + 3] = bad;
        values
    };
    for bad in [f64::NAN, f64::NEG_INFINITY, 1e39] {
        let whole = folder.path().join("cube.npy");
        let values = [frame(0.0), frame(bad)].concat();
        write_npy(&whole, &[2, LOOPS * TX, SAMPLES, RX], Values::F64(&values)).unwrap();
        let place = "tx 1, rx 3, loop 2, sample 5, expected finite samples";
        let error = refused(std::slice::from_ref(&whole), "frame chirp sample rx");
        assert_eq!(error, format!("{}: `cube` is NaN or infinite at frame 1, {place}", whole.display()));
        let files = [0.0, bad].map(|bad| {
            let file = folder.path().join(format!("part_{}.npy", usize::from(bad != 0.0)));
            write_npy(&file, &[LOOPS * TX, SAMPLES, RX], Values::F64(&frame(bad))).unwrap();
            file
        });
        assert_eq!(refused(&files, "chirp sample rx"), format!("{}: `part_1` is NaN or infinite at {place}", files[1].display()));
    }
}

#[test]
fn signed_words_stored_as_unsigned_are_recognised_and_offset_codes_are_not_touched() {
    let folder = tempfile::tempdir().unwrap();
    let stated = Stated {
        board: Some("BGT60UTR11".into()),
        layout: Some(Layout::parse("loop sample").unwrap()),
        sets: [
            "start_frequency_hz=58e9",
            "slope_hz_per_s=60e12",
            "sample_rate_hz=2e6",
            "chirp_period_s=1e-3",
            "frame_period_s=0.1",
        ]
        .map(|set| format!("radar.{set}"))
        .to_vec(),
        ..Stated::default()
    };
    let noise = numbers(3, 4 * SAMPLES, -200.0, 200.0);
    for (offset, wrapped) in [(65536.0, true), (32768.0, false)] {
        let path = folder.path().join("codes.npy");
        let codes: Vec<f64> = noise.iter().map(|value| (value.round() + offset) % 65536.0).collect();
        write_npy(&path, &[4, SAMPLES], Values::F64(&codes)).unwrap();
        let mut capture = open(&[path], &stated).unwrap();
        assert_eq!(capture.radar.sampling, Sampling::Real);
        let found = (capture.frame)(0).unwrap().re;
        let wanted: Vec<f32> = noise.iter().map(|value| (value.round() + if wrapped { 0.0 } else { offset }) as f32).collect();
        assert_eq!(found, wanted);
    }
}

/// A folder of the Radar SDK: chirps of 8 samples, two of each of two receivers, frames 50 ms apart.
fn infineon(frames: usize, samples: impl Fn(usize) -> f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let device = folder.path().join("RadarIfxAvian_00");
    fs::create_dir(&device).unwrap();
    fs::write(
        device.join("config.json"),
        r#"{"device_config": {"fmcw_single_shape": {"chirp_repetition_time_s": 0.0005, "frame_repetition_time_s": 0.05,
        "start_frequency_Hz": 58000000000, "end_frequency_Hz": 63500000000, "num_chirps_per_frame": 2, "num_samples_per_chirp": 8,
        "rx_antennas": [1, 3], "tx_antennas": [1], "sample_rate_Hz": 2000000}}}"#,
    )
    .unwrap();
    fs::write(device.join("meta.json"), r#"{"adc_resolution": 12, "description": "BGT60TR13C FMCW Radar Sensor"}"#).unwrap();
    let samples: Vec<f64> = (0..frames * 2 * 2 * 8).map(samples).collect();
    write_npy(device.join("radar.npy"), &[frames, 2, 2, 8], Values::F64(&samples)).unwrap();
    folder
}

fn import_all(capture: Capture, folder: &Path) -> Recording {
    import(capture, folder, [("action".into(), "sit".into())].into(), &mut |_, _| {}).unwrap()
}

#[test]
fn a_folder_of_the_infineon_sdk_is_read() {
    let folder = infineon(3, |place| place as f64);
    let mut capture = open(&[folder.path().into()], &Stated::default()).unwrap();
    let radar = &capture.radar;
    assert_eq!((radar.dims(), radar.sampling), ([3, 1, 2, 2, 8], Sampling::Real));
    assert!((radar.slope_hz_per_s / 1.375e15 - 1.0).abs() < 1e-12);
    assert_eq!(radar.full_scale_codes, Some(4095.0));
    let frame = (capture.frame)(2).unwrap();
    assert_eq!(frame.sample(0, 1, 1, 7).re, 95.0);
    let recording = import_all(capture, &folder.path().join("recording"));
    assert_eq!(recording.labels["action"], "sit");
    assert_eq!(recording.frame(2).unwrap(), frame);
}

#[test]
fn receivers_of_the_infineon_sdk_come_in_the_order_of_their_numbers() {
    let folder = infineon(3, |place| place as f64);
    let config = folder.path().join("RadarIfxAvian_00/config.json");
    let text = fs::read_to_string(&config).unwrap();
    let of = |list: &str| {
        fs::write(&config, text.replace(r#""rx_antennas": [1, 3]"#, &format!(r#""rx_antennas": {list}"#))).unwrap();
        open(&[folder.path().into()], &Stated::default()).unwrap()
    };
    let (plain, turned) = (of("[1, 3]"), of("[3, 1]"));
    assert_eq!(plain.radar.rx_m, turned.radar.rx_m);
    let is_said = |capture: &Capture| capture.notes.iter().any(|note| note.starts_with("receivers [3, 1] of "));
    assert!(is_said(&turned) && !is_said(&plain), "{:?}", turned.notes);
}

#[test]
fn fractions_of_full_scale_are_kept_and_codes_are_codes() {
    let noise = numbers(9, 3 * 2 * 2 * 8, -0.5, 0.5);
    let folder = infineon(3, |place| noise[place]);
    let capture = open(&[folder.path().into()], &Stated::default()).unwrap();
    assert_eq!((capture.layout, capture.radar.full_scale_codes), (IfLayout::Real, None));
    assert!(capture.notes.iter().any(|note| note.starts_with("samples are floats up to 0.")), "{:?}", capture.notes);
    let recording = import_all(capture, &folder.path().join("recording"));
    assert_eq!(recording.frame(1).unwrap().re, noise[32..64].iter().map(|value| *value as f32).collect::<Vec<_>>());
}

/// Its devices have no Q, and none of it is left out in silence; as an array such a file is read whole.
#[test]
fn complex_numbers_in_a_folder_of_the_infineon_sdk_are_refused_and_read_by_a_layout() {
    let folder = infineon(3, |place| place as f64);
    let device = folder.path().join("RadarIfxAvian_00");
    let samples = device.join("radar.npy");
    let values: Vec<Complex32> = (0..3 * 32).map(|place| Complex32::new(place as f32, 0.5 - place as f32)).collect();
    write_npy(&samples, &[3, 2, 2, 8], Values::Complex64(&values)).unwrap();
    let set_complex = Stated { sets: vec!["radar.sampling=\"complex\"".into()], ..Stated::default() };
    for (source, stated) in [(folder.path(), &Stated::default()), (&samples, &Stated::default()), (&device, &set_complex)] {
        let error = open(&[source.into()], stated).err().unwrap();
        let said = "`radar` is complex64 [3, 2, 2, 8], expected real numbers: a receiver that config.json describes has no Q";
        assert_eq!(error.to_string(), format!("{}: {said}", samples.display()));
        assert!(error.hint().unwrap().contains("--layout \"frame rx loop sample\""), "{error}");
    }
    let settings = "start_frequency_hz=58e9 slope_hz_per_s=1e14 sample_rate_hz=2e6 chirp_period_s=5e-4 frame_period_s=0.05 \
                    tx_m=[[0.0,0.0,0.0]] rx_m=[[0.0,0.0,0.0],[0.0025,0.0,0.0]]";
    let mut stated = Stated {
        layout: Some(Layout::parse("frame rx loop sample").unwrap()),
        sets: settings.split_whitespace().map(|set| format!("radar.{set}")).collect(),
        ..Stated::default()
    };
    for source in [&device, &samples] {
        let mut capture = open(std::slice::from_ref(source), &stated).unwrap();
        assert_eq!((capture.radar.sampling, capture.layout), (Sampling::Complex, IfLayout::Complex));
        assert_eq!((capture.frame)(2).unwrap().sample(0, 1, 1, 7), values[95]);
    }
    stated.sets.push("radar.sampling=\"real\"".into());
    let error = open(std::slice::from_ref(&samples), &stated).err().unwrap();
    let said = "`radar` is complex64 [3, 2, 2, 8], expected real numbers, as radar.sampling states";
    assert_eq!(error.to_string(), format!("{}: {said}", samples.display()));
    assert!(error.hint().unwrap().starts_with("leave radar.sampling out"), "{error}");
}

#[test]
fn antennas_of_a_board_that_is_not_known_must_be_stated() {
    let folder = infineon(3, |place| place as f64);
    let meta = folder.path().join("RadarIfxAvian_00/meta.json");
    fs::write(&meta, r#"{"description": "BGT60ATR24C FMCW Radar Sensor"}"#).unwrap();
    let error = open(&[folder.path().into()], &Stated::default()).err().unwrap();
    assert!(error.to_string().contains("no board `BGT60ATR24C`") && error.hint().unwrap().contains("radar.rx_m"), "{error}");
    let sets = ["radar.tx_m=[[0.0, 0.0, 0.0]]", "radar.rx_m=[[0.0, 0.0, 0.0], [0.0025, 0.0, 0.0]]"].map(String::from).to_vec();
    let capture = open(&[folder.path().into()], &Stated { sets, ..Stated::default() }).unwrap();
    assert_eq!(capture.radar.rx_m, [[0.0; 3], [0.0025, 0.0, 0.0]]);
}

#[test]
fn time_stamps_say_which_frames_were_lost() {
    let noise = numbers(9, 20 * 32, 0.0, 4000.0);
    let folder = infineon(20, |place| noise[place].round());
    let stamps = folder.path().join("RadarIfxAvian_00/radar_timestamp.csv");
    let write = |period: f64, lost: usize| {
        // Up to a fifth of a period late; after frame 11 some were lost.
        let late = numbers(10, 20, 0.0, 0.2);
        let slot = |index: usize| index + if index > 11 { lost } else { 0 };
        let line = |index: usize| format!("{:.6}\n", 1.7e9 + period * (slot(index) as f64 + late[index]));
        fs::write(&stamps, (0..20).map(line).collect::<String>()).unwrap();
    };
    write(0.05, 2);
    let opened = |stated: &Stated| open(&[folder.path().into()], stated);
    let capture = opened(&Stated::default()).unwrap();
    assert_eq!((capture.radar.frames, &capture.lost[..]), (22, &[12, 13][..]));
    assert!(
        capture.notes.iter().any(|note| note.contains("2 frames were lost, the first after frame 11")),
        "{:?}",
        capture.notes
    );
    let sets = vec!["radar.frames=13".to_string()];
    let first = opened(&Stated { sets, ..Stated::default() }).unwrap();
    assert_eq!((first.radar.frames, &first.lost[..]), (15, &[12, 13][..]));
    let recording = import_all(capture, &folder.path().join("recording"));
    assert_eq!(recording.whole_frames().collect::<Vec<_>>(), (0..12).chain(14..22).collect::<Vec<_>>());
    for (frame, read) in [(11, 11), (14, 12), (21, 19)] {
        let wanted: Vec<f32> = noise[read * 32..(read + 1) * 32].iter().map(|value| value.round() as f32).collect();
        assert_eq!(recording.frame(frame).unwrap().re, wanted);
    }
    // More than are there: where the clock was set, nothing is filled in.
    write(0.05, 4000);
    let capture = opened(&Stated::default()).unwrap();
    assert_eq!((capture.radar.frames, &capture.lost[..]), (20, &[][..]));
    let said = "the first after frame 11; more than are there";
    assert!(capture.notes.iter().any(|note| note.contains(said)), "{:?}", capture.notes);
    write(0.08, 0);
    let error = opened(&Stated::default()).err().unwrap();
    assert!(error.to_string().ends_with("s, expected 0.05 s, the radar's frame_period_s"), "{error}");
    let sets = vec!["radar.frame_period_s=0.08".to_string()];
    assert_eq!(opened(&Stated { sets, ..Stated::default() }).unwrap().radar.frames, 20);
    let text = fs::read_to_string(&stamps).unwrap();
    for (text, part) in [
        (format!("time\n{text}"), "`line 1` is time, expected seconds since 1970"),
        (text.lines().skip(1).collect::<Vec<_>>().join("\n"), "`lines` is 19, expected 20, as in"),
    ] {
        fs::write(&stamps, text).unwrap();
        let error = opened(&Stated::default()).err().unwrap();
        assert!(error.to_string().contains(part) && error.hint().is_some(), "{error}");
    }
}
