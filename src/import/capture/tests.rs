//! Captures written here, by the layouts' documents, and read back; every way in which they can be wrong.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Capture, Stated, open};
use crate::data::IfFrame;
use crate::support::shared;

pub(super) const FRAMES: usize = 2;
pub(super) const LOOPS: usize = 4;
pub(super) const TX: usize = 3;
pub(super) const RX: usize = 4;
pub(super) const SAMPLES: usize = 8;

/// `[frame][loop][tx][rx][sample] -> [i, q]`
pub(super) fn code(place: [usize; 5]) -> [i16; 2] {
    let [frame, index, tx, rx, sample] = place;
    let number = ((((frame * LOOPS + index) * TX + tx) * RX + rx) * SAMPLES + sample) as i16;
    [number * 3 - 200, 150 - number * 2]
}

/// A 2-lane file as SWRA581B draws it: I0 I1 Q0 Q1 of one receiver after the other.
pub(super) fn two_lane_words() -> Vec<i16> {
    let mut words = Vec::new();
    for frame in 0..FRAMES {
        for index in 0..LOOPS {
            for tx in 0..TX {
                for rx in 0..RX {
                    for pair in 0..SAMPLES / 2 {
                        let [first, second] = [0, 1].map(|step| code([frame, index, tx, rx, 2 * pair + step]));
                        words.extend([first[0], second[0], first[1], second[1]]);
                    }
                }
            }
        }
    }
    words
}

fn write_words(path: &Path, words: &[i16]) {
    fs::write(path, words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
}

/// An mmWave Studio configuration of that capture.
pub(super) fn mmwave_json() -> String {
    let chirps: Vec<String> = (0..TX)
        .map(|tx| {
            format!(
                r#"{{"rlChirpCfg_t": {{"chirpStartIdx": {tx}, "chirpEndIdx": {tx}, "profileId": 0, "startFreqVar_MHz": 0.0,
                "freqSlopeVar_KHz_usec": 0.0, "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": "0x{:X}"}}}}"#,
                1 << tx
            )
        })
        .collect();
    format!(
        r#"{{"mmWaveDevices": [{{"rfConfig": {{"waveformType": "legacyFrameChirp",
        "rlChanCfg_t": {{"rxChannelEn": "0xF", "txChannelEn": "0x7"}},
        "rlAdcOutCfg_t": {{"fmt": {{"b2AdcBits": 2, "b2AdcOutFmt": 1}}}},
        "rlProfiles": [{{"rlProfileCfg_t": {{"profileId": 0, "startFreqConst_GHz": 60.0000000044704, "idleTimeConst_usec": 30.0,
            "adcStartTimeConst_usec": 6.0, "rampEndTime_usec": 20.0, "freqSlopeConst_MHz_usec": 100.0, "numAdcSamples": {SAMPLES},
            "digOutSampleRate": 1000}}}}],
        "rlChirps": [{}],
        "rlFrameCfg_t": {{"chirpStartIdx": 0, "chirpEndIdx": {}, "numLoops": {LOOPS}, "numFrames": {FRAMES}, "framePeriodicity_msec": 50.0}}}},
        "rawDataCaptureConfig": {{"rlDevDataFmtCfg_t": {{"iqSwapSel": 0, "chInterleave": 1}},
            "rlDevDataPathCfg_t": {{"transferFmtPkt0": "0x1"}}, "rlDevLaneEnable_t": {{"laneEn": "0x3"}}}}}}]}}"#,
        chirps.join(","),
        TX - 1
    )
}

pub(super) const CFG: &str = "
sensorStop % a comment
channelCfg 15 7 0
adcCfg 2 1
adcbufCfg -1 0 0 1 1
profileCfg 0 60 30 6 20 0 0 100 1 8 1000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 2
chirpCfg 2 2 0 0 0 0 0 4
frameCfg 0 2 4 2 50 1 0
sensorStart
";

/// A folder with `adc_data.bin` and its description.
pub(super) fn capture_folder(words: &[i16], config: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let bin = folder.path().join("adc_data.bin");
    write_words(&bin, words);
    fs::write(folder.path().join(config), text).unwrap();
    (folder, bin)
}

pub(super) fn isk() -> Stated {
    Stated { board: Some("IWR6843ISK".into()), ..Stated::default() }
}

pub(super) fn assert_frames(capture: &mut Capture, wanted: impl Fn([usize; 5]) -> [i16; 2]) {
    let [frames, n_tx, n_rx, loops, samples] = capture.radar.dims();
    for frame in 0..frames {
        let found: IfFrame = (capture.frame)(frame).unwrap();
        for tx in 0..n_tx {
            for rx in 0..n_rx {
                for index in 0..loops {
                    for sample in 0..samples {
                        let [i, q] = wanted([frame, index, tx, rx, sample]).map(f32::from);
                        let number = found.sample(tx, rx, index, sample);
                        assert_eq!(
                            (number.re, number.im),
                            (i, q),
                            "frame {frame}, tx {tx}, rx {rx}, loop {index}, sample {sample}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_two_lane_capture_comes_back_sample_by_sample() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let mut capture = open(&[bin], &isk()).unwrap();
    let radar = &capture.radar;
    assert_eq!(radar.dims(), [FRAMES, TX, RX, LOOPS, SAMPLES]);
    assert_eq!((radar.start_frequency_hz, radar.slope_hz_per_s, radar.sample_rate_hz), (60e9, 100e12, 1e6));
    assert!((radar.chirp_period_s - 50e-6).abs() < 1e-12 && (radar.adc_start_s - 6e-6).abs() < 1e-12);
    assert!(radar.tx_m[1][2] > 0.002 && radar.tx_m[1][2] < 0.003);
    assert_frames(&mut capture, code);
}

#[test]
fn a_cfg_describes_the_same_capture() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", CFG);
    let mut capture = open(&[bin], &isk()).unwrap();
    assert_eq!(capture.radar.frames, FRAMES);
    assert!((capture.radar.frame_period_s - 0.05).abs() < 1e-12);
    assert_frames(&mut capture, code);
    // With the halves of a word swapped Q goes out first.
    let swapped = CFG.replace("adcbufCfg -1 0 0 1 1", "adcbufCfg -1 0 1 1 1");
    let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &swapped);
    assert_frames(&mut open(&[bin], &isk()).unwrap(), |place| code(place).map_reverse());
}

trait MapReverse {
    fn map_reverse(self) -> Self;
}

impl MapReverse for [i16; 2] {
    fn map_reverse(self) -> Self {
        [self[1], self[0]]
    }
}

#[test]
fn several_files_are_one_stream() {
    let words = two_lane_words();
    let (folder, first) = capture_folder(&words[..701], "a.mmwave.json", &mmwave_json());
    let second = folder.path().join("adc_data_1.bin");
    write_words(&second, &words[701..]);
    assert_frames(&mut open(&[first, second], &isk()).unwrap(), code);
}

#[test]
fn a_setup_names_its_files_and_its_radar() {
    let (folder, _) = capture_folder(&two_lane_words(), "radar.mmwave.json", &mmwave_json());
    let setup = folder.path().join("a.setup.json");
    fs::write(
        &setup,
        r#"{"mmWaveDevice": "iwr6843", "configUsed": "C:\\captures\\radar.mmwave.json",
        "capturedFiles": {"files": [{"processedFileName": "", "rawFileName": "C:\\captures\\adc_data.bin"}]}}"#,
    )
    .unwrap();
    // An empty name of a file is no file: mmWave Studio writes one where nothing was processed.
    assert_frames(&mut open(std::slice::from_ref(&setup), &isk()).unwrap(), code);
    // A processed file that is not there leaves the raw one; one that is there is taken.
    let text =
        fs::read_to_string(&setup).unwrap().replace(r#""processedFileName": """#, r#""processedFileName": "processed.bin""#);
    fs::write(&setup, text).unwrap();
    assert_frames(&mut open(std::slice::from_ref(&setup), &isk()).unwrap(), code);
    let processed = folder.path().join("processed.bin");
    fs::copy(folder.path().join("adc_data.bin"), &processed).unwrap();
    assert_eq!(open(&[setup], &isk()).unwrap().source, processed);
}

#[test]
fn four_lanes_are_interleaved_by_receiver() {
    let mut words = Vec::new();
    for frame in 0..FRAMES {
        for index in 0..LOOPS {
            for tx in 0..TX {
                for sample in 0..SAMPLES {
                    for part in 0..2 {
                        words.extend((0..RX).map(|rx| code([frame, index, tx, rx, sample])[part]));
                    }
                }
            }
        }
    }
    let cfg = CFG.replace("adcbufCfg -1 0 0 1 1", "adcbufCfg 0 0 0 1").replace("profileCfg 0 60", "profileCfg 0 77");
    let (_folder, bin) = capture_folder(&words, "profile.cfg", &cfg);
    assert_frames(&mut open(&[bin], &Stated { board: Some("IWR1443".into()), ..Stated::default() }).unwrap(), code);
}

#[test]
fn a_loop_of_equal_chirps_is_as_many_loops() {
    let cfg = CFG
        .replace("chirpCfg 1 1 0 0 0 0 0 2", "chirpCfg 1 1 0 0 0 0 0 1")
        .replace("chirpCfg 2 2 0 0 0 0 0 4", "chirpCfg 2 2 0 0 0 0 0 1");
    let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &cfg);
    let mut capture = open(&[bin], &isk()).unwrap();
    assert_eq!(capture.radar.dims(), [FRAMES, 1, RX, LOOPS * TX, SAMPLES]);
    assert!((capture.radar.chirp_period_s - 50e-6).abs() < 1e-12);
    assert_frames(&mut capture, |[frame, index, _, rx, sample]| code([frame, index / TX, index % TX, rx, sample]));
}

#[test]
fn one_transmitter_can_be_taken_by_itself() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let mut capture = open(&[bin], &Stated { tx: Some(2), ..isk() }).unwrap();
    assert_eq!(capture.radar.dims(), [FRAMES, 1, RX, LOOPS, SAMPLES]);
    assert!((capture.radar.chirp_period_s - 150e-6).abs() < 1e-12);
    assert_frames(&mut capture, |[frame, index, _, rx, sample]| code([frame, index, 2, rx, sample]));
}

#[test]
fn chirps_at_uneven_steps_are_refused_and_one_transmitter_of_them_is_not() {
    let cfg = CFG.replace("chirpCfg 2 2 0 0 0 0 0 4", "chirpCfg 2 2 0 0 0 10 0 4");
    let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &cfg);
    let error = open(std::slice::from_ref(&bin), &isk()).err().unwrap();
    assert!(error.to_string().contains("even steps"), "{error}");
    assert!(error.hint().unwrap().contains("--tx 0"));
    let capture = open(&[bin], &Stated { tx: Some(0), ..isk() }).unwrap();
    assert!((capture.radar.chirp_period_s - 160e-6).abs() < 1e-12);
}

#[test]
fn subframes_that_are_sampled_in_different_formats_are_refused() {
    let advanced = "advFrameCfg 2 0 2 1 0\nsubFrameCfg 0 0 0 3 2 10 0 1 1 25\nsubFrameCfg 1 0 0 3 2 10 0 1 1 25\n";
    let cfg = |buffers: &str| CFG.replace("frameCfg 0 2 4 2 50 1 0\n", advanced).replace("adcbufCfg -1 0 0 1 1", buffers);
    let import = |cfg: String| {
        let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &cfg);
        open(&[bin], &Stated { subframe: Some(0), ..isk() })
    };
    assert_eq!(import(cfg("adcbufCfg 0 0 0 1 1\nadcbufCfg 1 0 0 1 1")).unwrap().radar.dims(), [FRAMES, TX, RX, 2, SAMPLES]);
    let error = import(cfg("adcbufCfg 0 0 0 1 1\nadcbufCfg 1 0 1 1 1")).err().unwrap().to_string();
    assert!(error.contains("line 6: adcbufCfg") && error.contains("0 1 1 1 for subframe 1"), "{error}");
    let error = import(cfg("adcbufCfg 0 0 0 1 1")).err().unwrap().to_string();
    assert!(error.contains("leave out some of 2 subframes"), "{error}");
}

#[test]
fn of_two_profiles_one_is_chosen() {
    let cfg = CFG
        .replace("frameCfg 0 2 4 2 50 1 0", "profileCfg 1 61 30 6 20 0 0 50 1 8 1000 0 0 30\nframeCfg 0 1 6 2 50 1 0")
        .replace("chirpCfg 1 1 0", "chirpCfg 1 1 1")
        .replace("0 0 0 0 2\n", "0 0 0 0 1\n");
    let (_folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &cfg);
    let error = open(std::slice::from_ref(&bin), &isk()).err().unwrap();
    assert!(error.hint().unwrap().contains("--profile, of [0, 1]"), "{error}");
    let mut capture = open(&[bin], &Stated { profile: Some(1), ..isk() }).unwrap();
    assert_eq!((capture.radar.start_frequency_hz, capture.radar.loops_per_frame), (61e9, 6));
    assert!((capture.radar.chirp_period_s - 100e-6).abs() < 1e-12);
    // Chirps alternate between the profiles: the second, the fourth, … of the file's order.
    assert_frames(&mut capture, |[frame, index, _, rx, sample]| {
        let chirp = 2 * index + 1;
        code([frame, chirp / TX, chirp % TX, rx, sample])
    });
}

#[test]
fn receivers_fed_from_the_other_side_are_negated() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let mut capture = open(&[bin], &Stated { board: Some("IWR6843AOP".into()), ..Stated::default() }).unwrap();
    assert!(capture.notes.iter().any(|note| note.contains("[0, 2]")), "{:?}", capture.notes);
    assert_frames(&mut capture, |place| if place[3] % 2 == 0 { code(place).map(|part| -part) } else { code(place) });
}

#[test]
fn a_capture_that_is_cut_off_keeps_its_whole_frames() {
    let words = two_lane_words();
    let (_folder, bin) = capture_folder(&words[..words.len() - 5], "a.mmwave.json", &mmwave_json());
    let mut capture = open(&[bin], &isk()).unwrap();
    assert_eq!(capture.radar.frames, 1);
    assert!(capture.notes.iter().any(|note| note.contains("2 frames were ordered, 1 are there")), "{:?}", capture.notes);
    assert_frames(&mut capture, code);
}

/// Half a word at the end is left out as what else follows the last frame; in the middle of a stream nothing fits any more.
#[test]
fn half_a_word_is_left_out_at_the_end_alone() {
    let mut bytes: Vec<u8> = two_lane_words().iter().flat_map(|word| word.to_le_bytes()).collect();
    bytes.push(7);
    let (folder, bin) = capture_folder(&[], "a.mmwave.json", &mmwave_json());
    fs::write(&bin, &bytes).unwrap();
    let mut capture = open(std::slice::from_ref(&bin), &isk()).unwrap();
    assert!(capture.notes.iter().any(|note| note.starts_with("1 bytes after the last whole frame")), "{:?}", capture.notes);
    assert_frames(&mut capture, code);
    let second = folder.path().join("adc_data_1.bin");
    fs::copy(&bin, &second).unwrap();
    let error = open(&[bin, second], &isk()).err().unwrap();
    assert!(error.to_string().ends_with("expected whole 16-bit samples") && error.hint().is_some(), "{error}");
}

#[test]
fn every_length_ends_in_frames_or_in_an_exact_error() {
    let bytes: Vec<u8> = two_lane_words().iter().flat_map(|word| word.to_le_bytes()).collect();
    let (_folder, bin) = capture_folder(&[], "a.mmwave.json", &mmwave_json());
    for length in (0..bytes.len()).step_by(97) {
        fs::write(&bin, &bytes[..length]).unwrap();
        match open(std::slice::from_ref(&bin), &isk()) {
            Ok(capture) => assert_eq!(capture.radar.frames, length / (bytes.len() / FRAMES)),
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains("adc_data.bin") && error.hint().is_some(), "{text}");
            }
        }
    }
}

#[test]
fn a_description_that_says_what_is_not_read_is_refused_by_name() {
    for (from, to, part) in [
        (r#""b2AdcBits": 2"#, r#""b2AdcBits": 1"#, "b2AdcBits"),
        (r#""transferFmtPkt0": "0x1""#, r#""transferFmtPkt0": "0x6""#, "transferFmtPkt0"),
        (r#""rxChannelEn": "0xF""#, r#""rxChannelEn": "four""#, "rxChannelEn"),
        (r#""numLoops": 4"#, r#""numLoops": 4000"#, "at least"),
        (r#""profileId": 0, "startFreqConst"#, r#""profileId": 3, "startFreqConst"#, "profile"),
    ] {
        let json = mmwave_json().replacen(from, to, 1);
        assert_ne!(json, mmwave_json(), "{from}");
        let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &json);
        let error = open(&[bin], &isk()).err().unwrap_or_else(|| panic!("{to} was accepted"));
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn without_a_description_or_with_two_nobody_guesses() {
    let (folder, bin) = capture_folder(&two_lane_words(), "a.txt", "");
    assert!(open(std::slice::from_ref(&bin), &isk()).err().unwrap().hint().unwrap().contains("--config"));
    fs::write(folder.path().join("a.cfg"), CFG).unwrap();
    fs::write(folder.path().join("b.cfg"), CFG).unwrap();
    assert!(open(&[bin], &isk()).err().unwrap().to_string().contains("2 files describe the radar"));
}

#[test]
fn a_setting_corrects_what_the_files_say() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let stated = Stated { sets: vec!["radar.frame_period_s=0.2".into()], ..isk() };
    assert_eq!(open(std::slice::from_ref(&bin), &stated).unwrap().radar.frame_period_s, 0.2);
    let stated = Stated { sets: vec!["radar.frame_perod_s=0.2".into()], ..isk() };
    assert!(open(&[bin], &stated).err().unwrap().to_string().contains("frame_perod_s"));
}

/// The real captures that were converted by hand come out as they were.
#[test]
fn real_captures_are_read_as_they_were_by_hand() {
    for (source, by_hand, stated) in [
        ("fixtures/raw/ti_iwr6843_mmwave_eyes/adc_data.bin", "recordings/real/room_60ghz", isk()),
        ("fixtures/raw/infineon_avian_folder", "recordings/real/breathing_60ghz", Stated::default()),
    ] {
        let (Some(source), Some(by_hand)) = (shared(source), shared(by_hand)) else { continue };
        let wanted = crate::data::Recording::open(&by_hand).unwrap();
        let mut capture = open(&[source], &stated).unwrap();
        assert_eq!(capture.radar.dims(), wanted.radar.dims());
        for (found, wanted) in [
            (capture.radar.start_frequency_hz, wanted.radar.start_frequency_hz),
            (capture.radar.slope_hz_per_s, wanted.radar.slope_hz_per_s),
            (capture.radar.sample_rate_hz, wanted.radar.sample_rate_hz),
            (capture.radar.chirp_period_s, wanted.radar.chirp_period_s),
            (capture.radar.frame_period_s, wanted.radar.frame_period_s),
            (capture.radar.adc_start_s, wanted.radar.adc_start_s),
        ] {
            assert!((found - wanted).abs() <= 1e-7 * wanted.abs(), "{found} against {wanted}");
        }
        for frame in 0..wanted.frames() {
            assert_eq!((capture.frame)(frame).unwrap(), wanted.frame(frame).unwrap(), "frame {frame} of {}", by_hand.display());
        }
    }
}
