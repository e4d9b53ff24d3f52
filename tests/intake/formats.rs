//! Files of other programs, and numbers of other types.

use std::fs;
use std::path::Path;

use hybridsim::data::Recording;
use hybridsim::import::capture::{self, Layout, Preset, Stated};

use super::{CFG, captured, hybridsim, text, words};
use crate::support;

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
