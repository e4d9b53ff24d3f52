//! What is stated of a capture besides its files: boards against bands and antennas, what is missing, profiles of a frame.

use std::fs;
use std::path::{Path, PathBuf};

use super::tests::*;
use super::{Layout, Preset, Stated, open, profiles};
use crate::data::arrays::{Values, write_npy};
use crate::error::Error;
use crate::support::numbers;

fn refused(sources: &[PathBuf], stated: &Stated) -> Error {
    let error = open(sources, stated).err().expect("it was accepted");
    assert!(error.hint().is_some(), "{error}");
    error
}

fn on(board: &str) -> Stated {
    Stated { board: Some(board.into()), ..Stated::default() }
}

#[test]
fn a_chirp_of_another_band_than_the_boards_is_refused() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let sources = [bin];
    for board in ["AWR1843", "IWR1443BOOST"] {
        let error = refused(&sources, &on(board)).to_string();
        assert!(error.contains("`radar.start_frequency_hz` is 60 GHz, expected 76 to 81 GHz, the band of the "), "{error}");
    }
    open(&sources, &on("AWR6843ISK")).unwrap();
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.cfg", &CFG.replace("profileCfg 0 60", "profileCfg 0 77"));
    let sources = [bin];
    let error = refused(&sources, &on("IWR6843ISK")).to_string();
    assert!(error.contains("`radar.start_frequency_hz` is 77 GHz, expected 60 to 64 GHz"), "{error}");
    open(&sources, &on("IWR1843")).unwrap();
    // The last of 8 samples at 1 MHz after 6 us, 100 MHz/us: 1.3 GHz.
    let sets = vec!["radar.start_frequency_hz=79.8e9".to_string()];
    let error = refused(&sources, &Stated { sets, ..on("IWR1843") }).to_string();
    assert!(error.contains("`frequency at the last sample` is 81.1 GHz, expected 76 to 81 GHz"), "{error}");
    // Antennas that are stated have no board.
    open(&sources, &Stated::default()).unwrap();
}

#[test]
fn a_board_is_held_against_the_transmitters_that_send() {
    let cfg = CFG.replace("profileCfg 0 60", "profileCfg 0 77");
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.cfg", &cfg);
    let error = refused(&[bin], &on("IWR1642")).to_string();
    let expected = "`transmitters` is number 2 (from 0) is on, expected numbers below 2: the IWR1642BOOST has 2 transmitters";
    assert!(error.ends_with(expected), "{error}");
    // Of an array, too.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.npy");
    let values = numbers(3, FRAMES * TX * RX * LOOPS * SAMPLES * 2, -200.0, 200.0);
    write_npy(&path, &[FRAMES, TX, RX, LOOPS, SAMPLES, 2], Values::F64(&values)).unwrap();
    let stated = Stated { sets: settings(), layout: Some(Layout::parse("frame tx rx loop sample iq").unwrap()), ..on("IWR1642") };
    let error = refused(std::slice::from_ref(&path), &stated);
    assert!(error.to_string().ends_with("with 3 transmitters, expected at most 2, those of the IWR1642BOOST"), "{error}");
    open(&[path], &Stated { board: Some("IWR1843".into()), ..stated }).unwrap();
}

fn settings() -> Vec<String> {
    ["start_frequency_hz=77e9", "slope_hz_per_s=60e12", "sample_rate_hz=4e6", "chirp_period_s=60e-6", "frame_period_s=0.1"]
        .map(|set| format!("radar.{set}"))
        .to_vec()
}

#[test]
fn the_note_on_antennas_asks_for_what_is_not_stated() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let row = |count: usize| (0..count).map(|at| format!("[{at}e-3, 0.0, 0.0]")).collect::<Vec<_>>().join(", ");
    let [tx, rx] = [("tx_m", TX), ("rx_m", RX)].map(|(key, count)| format!("radar.{key}=[{}]", row(count)));
    let note = |sets: &[&String]| {
        let stated = Stated { sets: sets.iter().map(|set| set.to_string()).collect(), ..Stated::default() };
        let notes = open(std::slice::from_ref(&bin), &stated).unwrap().notes;
        notes.into_iter().find(|note| note.starts_with("no board was named")).unwrap()
    };
    assert!(note(&[]).contains("--set radar.tx_m and radar.rx_m, says where they are"));
    assert!(note(&[&rx]).contains("--set radar.tx_m, says where they are"));
    let all = note(&[&tx, &rx]);
    assert!(all.contains("antennas are those of --set radar.tx_m and radar.rx_m") && !all.contains("mean nothing"), "{all}");
}

#[test]
fn a_capture_that_nothing_describes_is_asked_for_a_layout() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "notes.txt", "");
    let hint = refused(std::slice::from_ref(&bin), &Stated { sets: settings(), ..isk() }).hint().unwrap();
    assert!(hint.contains("--layout \"frame loop tx rx sample iq lane\"") && hint.contains("--set radar.KEY=VALUE"), "{hint}");
    // As the hint says.
    let lengths = [format!("radar.samples_per_chirp={SAMPLES}"), format!("radar.loops_per_frame={LOOPS}")];
    let sets = settings().into_iter().chain(lengths).collect();
    let layout = Some(Layout::parse("frame loop tx rx sample iq lane").unwrap());
    assert_frames(&mut open(&[bin], &Stated { sets, layout, ..on("IWR1843") }).unwrap(), code);
}

#[test]
fn all_that_is_missing_is_named_at_once_with_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("000000.npy");
    write_npy(&path, &[SAMPLES, TX * RX, LOOPS], Values::F64(&numbers(3, SAMPLES * TX * RX * LOOPS, -1.0, 1.0))).unwrap();
    let preset = |name: &str| Stated { preset: Some(Preset::named(name).unwrap()), ..Stated::default() };
    let error = refused(&[path], &preset("raddet"));
    let open = "slope_hz_per_s, sample_rate_hz, chirp_period_s, frame_period_s, tx_m, rx_m";
    assert!(error.to_string().ends_with(&format!("`radar` is without {open}, expected all of its settings")), "{error}");
    let hint = error.hint().unwrap();
    assert!(hint.starts_with("https://github.com/ZhangAoCanada/RADDet") && hint.contains("--board"), "{hint}");
    // Words alone.
    let path = folder.path().join("adc_data.bin");
    fs::write(&path, [0; 64]).unwrap();
    let error = refused(&[path], &preset("hupr"));
    let open = "start_frequency_hz, slope_hz_per_s, sample_rate_hz, chirp_period_s";
    assert!(error.to_string().ends_with(&format!("`radar` is without {open}, expected all of its settings")), "{error}");
}

/// The SDK's order: receivers of the first transmitter, then of the second.
#[test]
fn of_two_transmitters_of_infineon_each_is_imported_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    let device = folder.path().join("RadarIfxAvian_00");
    fs::create_dir(&device).unwrap();
    let config = r#"{"device_config": {"fmcw_single_shape": {"chirp_repetition_time_s": 0.0005, "frame_repetition_time_s": 0.05,
        "start_frequency_Hz": 58000000000, "end_frequency_Hz": 63500000000, "num_chirps_per_frame": 3, "num_samples_per_chirp": 8,
        "rx_antennas": [1, 2], "tx_antennas": [1], "mimo_mode": "tdm", "sample_rate_Hz": 2000000}}}"#;
    fs::write(device.join("config.json"), config).unwrap();
    fs::write(device.join("meta.json"), r#"{"description": "BGT60ATR24C FMCW Radar Sensor"}"#).unwrap();
    let samples: Vec<f64> = (0..2 * 4 * 3 * 8).map(f64::from).collect();
    write_npy(device.join("radar.npy"), &[2, 4, 3, 8], Values::F64(&samples)).unwrap();
    let sets = ["radar.tx_m=[[0.0, 0.0, 0.0]]", "radar.rx_m=[[0.0, 0.0, 0.0], [0.0025, 0.0, 0.0]]"].map(String::from).to_vec();
    let sources = [folder.path().to_path_buf()];
    let stated = |tx: Option<usize>| Stated { tx, sets: sets.clone(), ..Stated::default() };
    let error = refused(&sources, &stated(None));
    assert!(error.to_string().contains("the second sends right after the first"), "{error}");
    assert!(error.hint().unwrap().contains("--tx 0, --tx 1"), "{error}");
    for tx in [0, 1] {
        let mut capture = open(&sources, &stated(Some(tx))).unwrap();
        assert_eq!((capture.radar.dims(), capture.radar.chirp_period_s), ([2, 1, 2, 3, 8], 0.0005));
        let found = (capture.frame)(1).unwrap();
        let rank = |rx: usize, index: usize, sample: usize| ((4 + 2 * tx + rx) * 3 + index) * 8 + sample;
        assert_eq!(found.sample(0, 1, 2, 7).re, rank(1, 2, 7) as f32);
        assert_eq!(found.sample(0, 0, 0, 0).re, rank(0, 0, 0) as f32);
    }
    assert!(refused(&sources, &stated(Some(2))).to_string().contains("number 3, as --tx 2 asks for"));
}

#[test]
fn the_profiles_of_a_frame_are_listed() {
    let cfg = CFG
        .replace("frameCfg 0 2 4 2 50 1 0", "profileCfg 1 61 30 6 20 0 0 50 1 8 1000 0 0 30\nframeCfg 0 1 6 2 50 1 0")
        .replace("chirpCfg 1 1 0", "chirpCfg 1 1 1");
    let (folder, bin) = capture_folder(&two_lane_words(), "profile.cfg", &cfg);
    assert_eq!(profiles(std::slice::from_ref(&bin), &isk()).unwrap(), [0, 1]);
    assert_eq!(profiles(&[folder.path().into()], &isk()).unwrap(), [0, 1]);
    for profile in [0, 1] {
        let capture = open(std::slice::from_ref(&bin), &Stated { profile: Some(profile), ..isk() }).unwrap();
        assert_eq!(capture.radar.start_frequency_hz, [60e9, 61e9][profile]);
    }
    let array = Path::new("cube.npy").to_path_buf();
    let error = profiles(&[array], &isk()).unwrap_err();
    assert!(error.to_string().contains("no description with chirp profiles") && error.hint().is_some(), "{error}");
}

/// Whatever way a board's raw samples come in, its inverted receivers are turned back; of an array the note says how to keep them.
#[test]
fn inverted_receivers_are_turned_back_under_a_layout_as_without_one() {
    let lengths = [format!("radar.samples_per_chirp={SAMPLES}"), format!("radar.loops_per_frame={LOOPS}")];
    let sets: Vec<String> = settings().into_iter().chain(lengths).map(|set| set.replace("=77e9", "=60e9")).collect();
    let layout = |text: &str| Some(Layout::parse(text).unwrap());
    let (folder, bin) = capture_folder(&two_lane_words(), "a.mmwave.json", &mmwave_json());
    let cube = folder.path().join("cube.npy");
    let frame_files: Vec<PathBuf> = (0..FRAMES).map(|frame| folder.path().join(format!("frame_{frame}.npy"))).collect();
    let mut codes = Vec::new();
    for place in (0..FRAMES * LOOPS * TX * RX * SAMPLES).map(|at| {
        let (rest, sample) = (at / SAMPLES, at % SAMPLES);
        let (rest, rx) = (rest / RX, rest % RX);
        [rest / TX / LOOPS, rest / TX % LOOPS, rest % TX, rx, sample]
    }) {
        codes.extend(code(place));
    }
    write_npy(&cube, &[FRAMES, LOOPS, TX, RX, SAMPLES, 2], Values::I16(&codes)).unwrap();
    for (path, own) in frame_files.iter().zip(codes.chunks(codes.len() / FRAMES)) {
        write_npy(path, &[LOOPS, TX, RX, SAMPLES, 2], Values::I16(own)).unwrap();
    }
    for (board, inverted) in [("IWR6843AOP", [0, 2]), ("IWR6843ODS", [1, 2])] {
        let wanted = |place: [usize; 5]| if inverted.contains(&place[3]) { code(place).map(|part| -part) } else { code(place) };
        let said = format!("receivers {inverted:?} are fed from the opposite side: their samples are negated");
        let mut by_json = open(std::slice::from_ref(&bin), &on(board)).unwrap();
        assert!(by_json.notes.contains(&said), "{:?}", by_json.notes);
        assert_frames(&mut by_json, wanted);
        let stated = |text: &str| Stated { sets: sets.clone(), layout: layout(text), ..on(board) };
        let mut words = open(std::slice::from_ref(&bin), &stated("frame loop tx rx sample iq lane")).unwrap();
        assert!(words.notes.contains(&said), "{:?}", words.notes);
        assert_frames(&mut words, wanted);
        let whole = stated("frame loop tx rx sample iq");
        for (sources, stated) in [(vec![cube.clone()], whole), (frame_files.clone(), stated("loop tx rx sample iq"))] {
            let mut array = open(&sources, &stated).unwrap();
            let note = array.notes.iter().find(|note| note.starts_with(&said)).unwrap();
            assert!(note.ends_with("without --board: give --set radar.tx_m=[…] and --set radar.rx_m=[…] instead"), "{note}");
            assert_frames(&mut array, wanted);
        }
    }
    // As the note says.
    let row = |count: usize| (0..count).map(|at| format!("[{at}e-3, 0.0, 0.0]")).collect::<Vec<_>>().join(", ");
    let antennas = [("tx_m", TX), ("rx_m", RX)].map(|(key, count)| format!("radar.{key}=[{}]", row(count)));
    let sets = sets.into_iter().chain(antennas).collect();
    assert_frames(
        &mut open(&[cube], &Stated { sets, layout: layout("frame loop tx rx sample iq"), ..Stated::default() }).unwrap(),
        code,
    );
}

#[test]
fn receivers_one_after_the_other_on_a_board_that_sends_them_side_by_side_are_said() {
    let (_folder, bin) = capture_folder(&two_lane_words(), "a.cfg", &CFG.replace("profileCfg 0 60", "profileCfg 0 77"));
    let is_said = |board: &str| {
        let notes = open(std::slice::from_ref(&bin), &on(board)).unwrap().notes;
        notes.iter().any(|note| note.contains("sends its receivers side by side (SWRA581B), but"))
    };
    assert!(is_said("IWR1443BOOST") && !is_said("AWR1843"));
}
