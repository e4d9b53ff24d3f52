//! Captures are read as the programs read them that their makers publish (`scripts/golden_captures.py`).

use std::fs;
use std::path::{Path, PathBuf};

use hybridsim::data::arrays::{Values, write_npy};
use hybridsim::import::capture::{self, Preset, Stated};
use serde_json::json;

use crate::golden::Golden;

const GOLDEN: Golden = Golden("captures");
const FRAMES: usize = 2;
const TX: usize = 3;
const RX: usize = 4;
const LOOPS: usize = 5;
const SAMPLES: usize = 8;

fn words() -> Vec<i16> {
    GOLDEN.values("in_words").into_iter().map(|word| word as i16).collect()
}

fn write_words(path: &Path, words: &[i16]) {
    fs::write(path, words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
}

/// Lengths, antennas and what else a description leaves open.
fn sets() -> Vec<String> {
    let row = |count: usize| (0..count).map(|at| format!("[{at}e-3, 0.0, 0.0]")).collect::<Vec<_>>().join(", ");
    let settings = [
        ("start_frequency_hz", "77e9".to_string()),
        ("slope_hz_per_s", "60e12".into()),
        ("sample_rate_hz", "4e6".into()),
        ("chirp_period_s", "60e-6".into()),
        ("frame_period_s", "0.1".into()),
        ("samples_per_chirp", SAMPLES.to_string()),
        ("loops_per_frame", LOOPS.to_string()),
        ("tx_m", format!("[{}]", row(TX))),
        ("rx_m", format!("[{}]", row(RX))),
    ];
    settings.iter().map(|(key, value)| format!("radar.{key}={value}")).collect()
}

/// Every frame is the wanted `[tx, rx, loop, sample]`, to the last bit.
#[track_caller]
fn assert_read(name: &str, source: &Path, stated: &Stated, is_complex: bool) {
    let mut capture =
        capture::open(&[source.into()], stated).unwrap_or_else(|error| panic!("{name}: {error} {:?}", error.hint()));
    let part = |part: &str| GOLDEN.values(&format!("{name}{part}"));
    let (re, im) = if is_complex { (part("_re"), Some(part("_im"))) } else { (part(""), None) };
    assert_eq!(capture.radar.frames, FRAMES, "{name}");
    let count = re.len() / FRAMES;
    for frame in 0..FRAMES {
        let of_frame = |values: &Vec<f64>| values[frame * count..(frame + 1) * count].iter().map(|value| *value as f32).collect();
        let found = (capture.frame)(frame).unwrap();
        let wanted: (Vec<f32>, Option<Vec<f32>>) = (of_frame(&re), im.as_ref().map(of_frame));
        assert_eq!((found.re, found.im), wanted, "{name}, frame {frame}");
    }
}

fn by_preset(name: &str) -> Stated {
    Stated { sets: sets(), preset: Some(Preset::named(name).unwrap()), ..Stated::default() }
}

#[test]
fn words_of_public_data_sets_are_read_as_by_their_programs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("adc_data.bin");
    write_words(&path, &words());
    for name in ["mmmesh", "hupr"] {
        assert_read(name, &path, &by_preset(name), true);
    }
    // One frame a file.
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).unwrap();
    for (index, frame) in words().chunks(words().len() / FRAMES).enumerate() {
        write_words(&frames.join(format!("frame_{}.bin", 9 + index)), frame);
    }
    assert_read("coloradar_single_chip", &frames, &by_preset("coloradar_single_chip"), true);
}

#[test]
fn arrays_of_public_data_sets_are_read_as_by_their_programs() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("0_0_0.npy");
    write_npy(&path, &[2, FRAMES, LOOPS, TX * RX, SAMPLES], Values::F64(&GOLDEN.values("in_words"))).unwrap();
    assert_read("cubelearn", &path, &by_preset("cubelearn"), true);
}

#[test]
fn traces_of_roverd_are_read_as_by_xwr() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = folder.path().join("radar");
    fs::create_dir(&sensor).unwrap();
    write_words(&sensor.join("iq"), &words());
    let times = [10.0f64, 10.1].map(f64::to_le_bytes);
    fs::write(sensor.join("ts"), times.as_flattened()).unwrap();
    let meta = json!({
        "iq": { "format": "raw", "type": "i2", "shape": [LOOPS, TX, RX, 2 * SAMPLES], "desc": "" },
        "ts": { "format": "raw", "type": "f8", "shape": [], "desc": "" },
    });
    fs::write(sensor.join("meta.json"), meta.to_string()).unwrap();
    assert_read("rover", folder.path(), &Stated { sets: sets(), ..Stated::default() }, true);
}

#[test]
fn folders_of_infineon_are_read_as_numpy_reads_them() {
    let folder = tempfile::tempdir().unwrap();
    let config = json!({ "device_config": { "fmcw_single_shape": {
        "chirp_repetition_time_s": 0.0005, "frame_repetition_time_s": 0.05, "start_frequency_Hz": 58e9, "end_frequency_Hz": 63.5e9,
        "num_chirps_per_frame": 4, "num_samples_per_chirp": SAMPLES, "rx_antennas": [1, 2, 3], "tx_antennas": [1],
        "sample_rate_Hz": 2e6,
    } } });
    fs::write(folder.path().join("config.json"), config.to_string()).unwrap();
    let codes: Vec<i16> = GOLDEN.values("in_codes").into_iter().map(|code| code as i16).collect();
    write_npy(folder.path().join("radar.npy"), &[FRAMES, 3, 4, SAMPLES], Values::I16(&codes)).unwrap();
    assert_read("infineon", folder.path(), &Stated::default(), false);
}
