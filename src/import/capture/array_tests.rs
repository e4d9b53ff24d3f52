//! Captures that others have turned into arrays.

use std::fs;

use super::tests::*;
use super::{Layout, Stated, import, open};
use crate::data::IfLayout;
use crate::data::arrays::{Values, write_npy};
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

#[test]
fn a_folder_of_the_infineon_sdk_is_read() {
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
    let codes: Vec<f64> = (0..3 * 2 * 2 * 8).map(f64::from).collect();
    write_npy(device.join("radar.npy"), &[3, 2, 2, 8], Values::F64(&codes)).unwrap();
    let mut capture = open(&[folder.path().into()], &Stated::default()).unwrap();
    let radar = &capture.radar;
    assert_eq!((radar.dims(), radar.sampling), ([3, 1, 2, 2, 8], Sampling::Real));
    assert!((radar.slope_hz_per_s / 1.375e15 - 1.0).abs() < 1e-12);
    assert_eq!(radar.full_scale_codes, Some(4095.0));
    let frame = (capture.frame)(2).unwrap();
    assert_eq!(frame.sample(0, 1, 1, 7).re, 95.0);
    let out = folder.path().join("recording");
    let recording = import(capture, &out, [("action".into(), "sit".into())].into(), &mut |_, _| {}).unwrap();
    assert_eq!(recording.labels["action"], "sit");
    assert_eq!(recording.frame(2).unwrap(), frame);
}
