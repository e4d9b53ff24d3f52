//! Captures of four devices, written here by TI's layout and read back; every way in which their files can contradict each other.

use std::fs;
use std::path::{Path, PathBuf};

use num_complex::Complex64;

use super::super::{Stated, open};
use crate::data::IfFrame;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::support::numbers;

const DEVICES: [&str; 4] = ["master", "slave1", "slave2", "slave3"];
const FRAMES: usize = 3;
const LOOPS: usize = 8;
const TX: usize = 12;
const RX: usize = 16;
const SAMPLES: usize = 32;
const FRAME_WORDS: usize = LOOPS * TX * SAMPLES * 8;

/// What mmWave Studio writes of four devices: in chirp c transmitter 12 − c sends, three of each device.
fn mmwave_json() -> String {
    let device = |id: usize| {
        let chirp = |chirp: usize| {
            let tx = TX - 1 - chirp;
            let mask = if tx / 3 == id { 1 << (tx % 3) } else { 0 };
            format!(
                r#"{{"rlChirpCfg_t": {{"chirpStartIdx": {chirp}, "chirpEndIdx": {chirp}, "profileId": 0, "startFreqVar_MHz": 0.0,
                "freqSlopeVar_KHz_usec": 0.0, "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": "0x{mask:X}"}}}}"#
            )
        };
        format!(
            r#"{{"mmWaveDeviceId": {id}, "rfConfig": {{"waveformType": "legacyFrameChirp", "MIMOScheme": "TDM",
            "rlChanCfg_t": {{"rxChannelEn": "0xF", "txChannelEn": "0x7", "cascading": {}}},
            "rlAdcOutCfg_t": {{"fmt": {{"b2AdcBits": 2, "b2AdcOutFmt": 1}}}},
            "rlProfiles": [{{"rlProfileCfg_t": {{"profileId": 0, "startFreqConst_GHz": 77.0, "idleTimeConst_usec": 5.0,
                "adcStartTimeConst_usec": 6.0, "rampEndTime_usec": 40.0, "freqSlopeConst_MHz_usec": 79.0, "numAdcSamples": {SAMPLES},
                "digOutSampleRate": 8000}}}}],
            "rlChirps": [{}],
            "rlFrameCfg_t": {{"chirpStartIdx": 0, "chirpEndIdx": 11, "numLoops": {LOOPS}, "numFrames": {FRAMES},
                "framePeriodicity_msec": 100.0}}}},
            "rawDataCaptureConfig": {{"rlDevDataFmtCfg_t": {{"iqSwapSel": 0, "chInterleave": 1}}}}}}"#,
            if id == 0 { 1 } else { 2 },
            (0..TX).map(chirp).collect::<Vec<_>>().join(",")
        )
    };
    // In another order than their numbers.
    format!(r#"{{"mmWaveDevices": [{}]}}"#, [2, 0, 1, 3].map(device).join(","))
}

/// The index of so many frames from a time on, a frame period apart.
fn index(frames: usize, first: u64) -> Vec<u8> {
    let bytes = 2 * FRAME_WORDS as u64;
    let mut index =
        [[1u32, 1, 0, frames as u32].map(u32::to_le_bytes).as_flattened(), &(frames as u64 * bytes).to_le_bytes()].concat();
    for frame in 0..frames as u64 {
        index.extend([1u16, 1].map(u16::to_le_bytes).as_flattened());
        index.extend(0u32.to_le_bytes());
        index.extend([SAMPLES as u16, (LOOPS * TX) as u16].map(u16::to_le_bytes).as_flattened());
        index.extend([bytes as u32, 0, 0, 0, bytes as u32].map(u32::to_le_bytes).as_flattened());
        index.extend([first + 100_000 * frame, bytes * frame].map(u64::to_le_bytes).as_flattened());
    }
    index
}

/// A folder of a capture in parts of so many frames each, of codes of frame, loop, chirp, receiver and sample.
fn capture(parts: &[usize], code: impl Fn([usize; 5]) -> [i16; 2]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("radar.mmwave.json"), mmwave_json()).unwrap();
    let mut first = 0;
    for (part, &frames) in parts.iter().enumerate() {
        for (device, name) in DEVICES.iter().enumerate() {
            let mut words = Vec::with_capacity(frames * FRAME_WORDS);
            for row in 0..frames * LOOPS * TX * SAMPLES {
                let (rest, sample) = (row / SAMPLES, row % SAMPLES);
                let (rest, chirp) = (rest / TX, rest % TX);
                for rx in 4 * device..4 * device + 4 {
                    words.extend(code([first + rest / LOOPS, rest % LOOPS, chirp, rx, sample]));
                }
            }
            let bytes: Vec<u8> = words.iter().flat_map(|word: &i16| word.to_le_bytes()).collect();
            fs::write(folder.path().join(format!("{name}_{part:04}_data.bin")), bytes).unwrap();
            fs::write(folder.path().join(format!("{name}_{part:04}_idx.bin")), index(frames, 100_000 * first as u64)).unwrap();
        }
        first += frames;
    }
    folder
}

fn code([frame, index, chirp, rx, sample]: [usize; 5]) -> [i16; 2] {
    let number = ((((frame * LOOPS + index) * TX + chirp) * RX + rx) * SAMPLES + sample) % 9973;
    [number as i16 * 3 - 9000, 7000 - number as i16 * 2]
}

fn opened(folder: &Path) -> crate::error::Result<super::super::Capture> {
    open(&[folder.into()], &Stated::default())
}

#[track_caller]
fn refused(folder: &Path, parts: &[&str]) {
    let error = opened(folder).err().expect("it was accepted");
    for part in parts {
        assert!(error.to_string().contains(part), "`{part}` is missing in: {error}");
    }
    assert!(error.hint().is_some(), "{error}");
}

#[test]
fn samples_come_back_one_by_one_from_one_part_and_from_two() {
    for parts in [&[3][..], &[2, 1], &[2, 1, 0]] {
        let folder = capture(parts, code);
        for source in [folder.path().to_path_buf(), folder.path().join("slave2_0000_data.bin")] {
            let mut capture = open(&[source], &Stated::default()).unwrap();
            assert_eq!(capture.radar.dims(), [FRAMES, TX, RX, LOOPS, SAMPLES]);
            for [frame, tx, rx, index, sample] in [[0, 0, 0, 0, 0], [1, 11, 15, 7, 31], [2, 5, 6, 3, 17], [2, 0, 9, 7, 30]] {
                let found = (capture.frame)(frame).unwrap().sample(tx, rx, index, sample);
                assert_eq!([found.re, found.im], code([frame, index, tx, rx, sample]).map(f32::from), "{parts:?}, frame {frame}");
            }
        }
    }
}

#[test]
fn the_radar_is_that_of_the_description_or_of_a_file_of_settings() {
    let folder = capture(&[3], code);
    let described = opened(folder.path()).unwrap().radar;
    let half = SPEED_OF_LIGHT / 76.8e9 / 2.0;
    // Transmitter 12 fires first, at the end of the row; transmitter 1, the highest, last.
    assert!((described.tx_m[0][0], described.tx_m[0][2]) == (0.0, 0.0) && (described.tx_m[11][2] - 6.0 * half).abs() < 1e-12);
    assert!((described.rx_m[4][0] - 50.0 * half).abs() < 1e-12 && described.rx_m[12] == [0.0; 3]);
    assert!((described.chirp_period_s - 45e-6).abs() < 1e-12);
    fs::remove_file(folder.path().join("radar.mmwave.json")).unwrap();
    let config = folder.path().join("radar.toml");
    let text = format!(
        "[radar]\nstart_frequency_hz = 77e9\nslope_hz_per_s = 79e12\nsample_rate_hz = 8e6\nsamples_per_chirp = {SAMPLES}\n\
         loops_per_frame = {LOOPS}\nadc_start_s = 6e-6\nchirp_period_s = 45e-6\nframe_period_s = 0.1\n"
    );
    fs::write(&config, text).unwrap();
    let stated = Stated { configs: vec![config], board: Some("MMWCAS-RF-EVM".into()), ..Stated::default() };
    let mut by_file = open(&[folder.path().into()], &stated).unwrap();
    let near = |a: &[[f64; 3]], b: &[[f64; 3]]| a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(&by_file.radar.tx_m, &described.tx_m) && near(&by_file.radar.rx_m, &described.rx_m));
    assert_eq!(by_file.radar.dims(), described.dims());
    let found = (by_file.frame)(2).unwrap().sample(7, 13, 5, 3);
    assert_eq!([found.re, found.im], code([2, 5, 7, 13, 3]).map(f32::from));
    let asked = |frames: usize| {
        let sets = vec![format!("radar.frames={frames}")];
        open(&[folder.path().into()], &Stated { sets, ..stated.clone() }).map(|capture| capture.radar.frames)
    };
    assert_eq!(asked(2).unwrap(), 2);
    let refused = |stated: Stated| open(&[folder.path().into()], &stated).err().unwrap();
    let sets = vec!["radar.sampling=\"real\"".to_string()];
    let error = refused(Stated { sets, ..stated.clone() }).to_string();
    assert!(error.ends_with("radar.toml: `radar.sampling` is real, expected complex, as cascades are captured"), "{error}");
    let error = refused(Stated { board: Some("AWR2243".into()), ..stated.clone() });
    assert_eq!(error.to_string(), "--board AWR2243BOOST: 4 receivers, expected 16, four a device");
    assert!(error.hint().unwrap().contains("is the MMWCAS-RF-EVM"), "{error}");
    let error = asked(4).unwrap_err().to_string();
    assert!(
        error.starts_with("`radar.frames` is 4, expected at most 3, as many as ") && error.contains("master_0000"),
        "{error}"
    );
}

/// The strongest range, Doppler bin and sine of the azimuth of a frame, over the level antennas.
fn strongest(radar: &Radar, frame: &IfFrame) -> (usize, usize, f64) {
    let turn = |cycles: f64| Complex64::from_polar(1.0, -std::f64::consts::TAU * cycles);
    let level: Vec<usize> = (0..TX).filter(|&tx| radar.tx_m[tx][2] == 0.0).collect();
    let mut best = (0.0, (0, 0, 0.0));
    for range in 0..SAMPLES {
        for doppler in 0..LOOPS {
            let signed = if doppler >= LOOPS / 2 { doppler as f64 - LOOPS as f64 } else { doppler as f64 };
            let cell = |tx: usize, rx: usize| -> Complex64 {
                // What the velocity gathers until this transmitter's turn is taken away.
                let slot = turn(signed * tx as f64 / (TX * LOOPS) as f64);
                let of = |index: usize, sample: usize| {
                    let value = frame.sample(tx, rx, index, sample);
                    let cycles = (range * sample) as f64 / SAMPLES as f64 + (doppler * index) as f64 / LOOPS as f64;
                    Complex64::new(value.re.into(), value.im.into()) * turn(cycles)
                };
                slot * (0..LOOPS)
                    .flat_map(|index| (0..SAMPLES).map(move |sample| (index, sample)))
                    .map(|(i, s)| of(i, s))
                    .sum::<Complex64>()
            };
            // One channel says whether anything is there.
            if cell(0, 0).norm() < 1e3 * (LOOPS * SAMPLES) as f64 / 2.0 {
                continue;
            }
            let cells: Vec<(f64, Complex64)> = level
                .iter()
                .flat_map(|&tx| (0..RX).map(move |rx| (tx, rx)))
                .map(|(tx, rx)| ((radar.tx_m[tx][0] + radar.rx_m[rx][0]) / radar.wavelength_m(), cell(tx, rx)))
                .collect();
            for step in -90..=90 {
                let sine = f64::from(step) / 90.0;
                // The phase of the array falls towards the target.
                let power = cells.iter().map(|(place, value)| value * turn(-place * sine)).sum::<Complex64>().norm();
                if power > best.0 {
                    best = (power, (range, doppler, sine));
                }
            }
        }
    }
    best.1
}

/// Codes of points: amplitude, range, sine of azimuth, velocity, by the law of the signal (delay to and from every antenna).
fn points(points: &[[f64; 4]]) -> impl Fn([usize; 5]) -> [i16; 2] {
    let radar = {
        let folder = capture(&[1], code);
        opened(folder.path()).unwrap().radar
    };
    let points = points.to_vec();
    move |[frame, index, chirp, rx, sample]| {
        let time = radar.frame_period_s * frame as f64 + radar.chirp_period_s * (index * TX + chirp) as f64;
        let path = |&[amplitude, range, sine, velocity]: &[f64; 4]| {
            let now = range + velocity * time;
            let place = [now * sine, now * (1.0 - sine * sine).sqrt(), 0.0];
            let to = |from: [f64; 3]| (0..3).map(|axis| (place[axis] - from[axis]).powi(2)).sum::<f64>().sqrt();
            let delay = (to(radar.tx_m[chirp]) + to(radar.rx_m[rx])) / SPEED_OF_LIGHT;
            let opens = radar.start_frequency_hz + radar.slope_hz_per_s * radar.adc_start_s;
            let cycles = opens * delay + radar.slope_hz_per_s * sample as f64 / radar.sample_rate_hz * delay;
            Complex64::from_polar(amplitude, std::f64::consts::TAU * cycles)
        };
        let value: Complex64 = points.iter().map(path).sum();
        [value.re.round() as i16, value.im.round() as i16]
    }
}

#[test]
fn a_point_comes_out_at_its_range_angle_and_velocity() {
    let radar = opened(capture(&[1], code).path()).unwrap().radar;
    let (range, sine) = (9.0 * radar.range_resolution_m(), 0.4);
    let velocity = 2.0 * radar.velocity_resolution_mps();
    let folder = capture(&[1], points(&[[2000.0, range, sine, velocity]]));
    let mut capture = opened(folder.path()).unwrap();
    let frame = (capture.frame)(0).unwrap();
    let (bin, doppler, found) = strongest(&capture.radar, &frame);
    assert!(bin.abs_diff(9) <= 1 && doppler == 2, "range bin {bin}, Doppler bin {doppler}");
    assert!((found - sine).abs() < 0.03, "sine {found} against {sine}");
}

#[test]
fn files_that_were_exchanged_between_devices_are_refused_by_their_samples() {
    let scene: Vec<[f64; 4]> =
        numbers(4, 12, -0.7, 0.7).iter().enumerate().map(|(at, sine)| [400.0, 1.5 + 0.9 * at as f64, *sine, 0.0]).collect();
    let noise = numbers(5, 1 << 14, -20.0, 20.0);
    let of_points = points(&scene);
    let noisy = |place: [usize; 5]| {
        let at = place.iter().fold(7usize, |at, index| at.wrapping_mul(31).wrapping_add(*index));
        let [i, q] = of_points(place);
        [i + noise[at % (1 << 14)] as i16, q + noise[(at * 7 + 3) % (1 << 14)] as i16]
    };
    let folder = capture(&[1], noisy);
    let look = |out: &str| {
        let draft =
            super::super::draft(opened(folder.path()).unwrap(), &folder.path().join(out), Default::default(), &mut |_, _| ());
        let draft = draft.unwrap();
        draft.findings.iter().find(|finding| finding.check == "devices").unwrap().clone()
    };
    let right = look("right");
    assert!(right.ok && right.decided, "{right:?}");
    let file = |device: &str| folder.path().join(format!("{device}_0000_data.bin"));
    fs::rename(file("slave1"), file("other")).unwrap();
    fs::rename(file("slave2"), file("slave1")).unwrap();
    fs::rename(file("other"), file("slave2")).unwrap();
    let exchanged = look("exchanged");
    assert!(exchanged.is_refusal() && exchanged.found.contains("[0, 2, 1, 3]"), "{exchanged:?}");
}

#[test]
fn a_file_that_is_missing_is_named() {
    for (missing, part) in [("slave3_0000_data.bin", "slave3_0000_data.bin"), ("master_0001_data.bin", "master_0001_data.bin")] {
        let folder = capture(&[2, 1], code);
        fs::remove_file(folder.path().join(missing)).unwrap();
        refused(folder.path(), &[part, "missing"]);
    }
}

/// Without indices, files that are cut off alike keep their whole frames; of one that is cut off by itself the whole frames are not those
/// of the others.
#[test]
fn every_length_of_a_file_ends_in_frames_or_in_an_exact_error() {
    let folder = capture(&[3], code);
    let data = folder.path().join("slave2_0000_data.bin");
    let whole = fs::read(&data).unwrap();
    let lengths = || (0..whole.len()).step_by(4999).chain([1, 2 * FRAME_WORDS, 4 * FRAME_WORDS - 1, whole.len() - 1]);
    for length in lengths() {
        fs::write(&data, &whole[..length]).unwrap();
        refused(folder.path(), &["slave2_0000_data.bin"]);
    }
    DEVICES.iter().for_each(|device| fs::remove_file(folder.path().join(format!("{device}_0000_idx.bin"))).unwrap());
    for length in lengths() {
        fs::write(&data, &whole[..length]).unwrap();
        if length / (2 * FRAME_WORDS) < FRAMES {
            refused(folder.path(), &["slave2_0000_data.bin"]);
        }
    }
    let cut = 4 * FRAME_WORDS + 10;
    DEVICES.iter().for_each(|device| fs::write(folder.path().join(format!("{device}_0000_data.bin")), &whole[..cut]).unwrap());
    let capture = opened(folder.path()).unwrap();
    assert_eq!(capture.radar.frames, 2);
    assert!(capture.notes.iter().any(|note| note.contains("10 bytes after the last whole frame")), "{:?}", capture.notes);
}

fn idx(folder: &Path, device: &str) -> PathBuf {
    folder.join(format!("{device}_0000_idx.bin"))
}

#[test]
fn an_index_that_contradicts_itself_or_its_file_is_refused() {
    let folder = capture(&[3], code);
    let path = idx(folder.path(), "slave1");
    let whole = fs::read(&path).unwrap();
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        refused(folder.path(), &["slave1_0000_idx.bin"]);
    }
    let changed = |at: usize, value: &[u8]| {
        let mut bytes = whole.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        fs::write(&path, bytes).unwrap();
    };
    changed(12, &2u32.to_le_bytes());
    refused(folder.path(), &["144 bytes of records", "48 bytes for each of the 2 frames"]);
    changed(16, &7u64.to_le_bytes());
    refused(folder.path(), &["dataFileSize", "7 bytes", &(6 * FRAME_WORDS).to_string()]);
    changed(24 + 48 + 28, &100u32.to_le_bytes());
    refused(folder.path(), &["size of frame 1", "100 bytes"]);
    // A frame of the device came a period late: what follows are not the frames of the others.
    changed(24 + 2 * 48 + 32, &300_000u64.to_le_bytes());
    refused(folder.path(), &["slave1_0000_data.bin", "frame 2 in frame period 3", "period 2"]);
    fs::write(&path, index(2, 0)).unwrap();
    refused(folder.path(), &["slave1_0000_data.bin", "2", "3, as in"]);
}

/// Files are made before the capture, so that what follows the last frame of the index is not of it; frames that all devices lost, within a
/// part or between two, are put in as lost.
#[test]
fn what_follows_the_index_is_left_out_and_lost_frames_keep_their_places() {
    for (parts, late) in [(&[3][..], "0000"), (&[2, 1], "0001")] {
        let folder = capture(parts, code);
        for device in DEVICES {
            let of = |end: &str| folder.path().join(format!("{device}_{late}_{end}.bin"));
            let bytes = [fs::read(of("data")).unwrap(), vec![0; 4096]].concat();
            fs::write(of("data"), bytes).unwrap();
            let mut index = fs::read(of("idx")).unwrap();
            let last = index.len() - 16;
            index[last..last + 8].copy_from_slice(&300_000u64.to_le_bytes());
            fs::write(of("idx"), index).unwrap();
        }
        let mut capture = opened(folder.path()).unwrap();
        assert_eq!((capture.radar.frames, &capture.lost[..]), (FRAMES + 1, &[2][..]), "{parts:?}");
        let found = [2, 3].map(|frame| (capture.frame)(frame).unwrap().sample(4, 6, 3, 17));
        assert_eq!(found.map(|found| [found.re, found.im]), [[0.0; 2], code([2, 3, 4, 6, 17]).map(f32::from)]);
        for part in ["4096 bytes after the last frame", "1 frames were lost, the first after frame 1"] {
            assert!(capture.notes.iter().any(|note| note.contains(part)), "{part}: {:?}", capture.notes);
        }
        let stated = Stated { sets: vec!["radar.frames=2".into()], ..Stated::default() };
        let first = open(&[folder.path().into()], &stated).unwrap();
        assert_eq!((first.radar.frames, &first.lost[..]), (2, &[][..]));
    }
}

#[test]
fn a_description_of_other_devices_is_refused() {
    for (from, to, part) in [
        (r#""mmWaveDeviceId": 3"#, r#""mmWaveDeviceId": 1"#, "mmWaveDeviceId"),
        (r#""rxChannelEn": "0xF""#, r#""rxChannelEn": "0x3""#, "all four receivers"),
        (r#""numAdcSamples": 32"#, r#""numAdcSamples": 16"#, "devices that sample alike"),
        (r#""b2AdcOutFmt": 1"#, r#""b2AdcOutFmt": 0"#, "complex"),
    ] {
        let folder = capture(&[1], code);
        fs::write(folder.path().join("radar.mmwave.json"), mmwave_json().replacen(from, to, 1)).unwrap();
        let error = opened(folder.path()).err().unwrap();
        assert!(error.to_string().contains(part), "{part}: {error}");
    }
    let folder = capture(&[1], code);
    fs::write(folder.path().join("radar.mmwave.json"), mmwave_json().replace(r#""numLoops": 8"#, r#""numLoops": 16"#)).unwrap();
    refused(folder.path(), &["dataFileSize"]);
}

#[test]
fn a_setup_names_the_files_of_all_devices() {
    let folder = capture(&[1], code);
    let name = |device: &str| format!(r#"{{"processedFileName": "", "rawFileName": "C:\\capture\\{device}_0000_data.bin"}}"#);
    let files: Vec<String> = DEVICES.iter().map(|device| name(device)).collect();
    let setup = folder.path().join("a.setup.json");
    let text =
        format!(r#"{{"configUsed": "C:\\capture\\radar.mmwave.json", "capturedFiles": {{"files": [{}]}}}}"#, files.join(","));
    fs::write(&setup, text).unwrap();
    let mut capture = open(&[setup], &Stated::default()).unwrap();
    let found = (capture.frame)(0).unwrap().sample(3, 5, 2, 9);
    assert_eq!([found.re, found.im], code([0, 2, 3, 5, 9]).map(f32::from));
}
