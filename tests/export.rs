//! Recordings that go out and come back: every sample equal, and every change to a file noticed.

use crate::support;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use hybridsim::{
    data::{
        IfFrame, IfLayout, Recording, RecordingContents,
        arrays::{Array, Npz, Values, write_npy},
        write_recording,
    },
    radar::{Radar, Sampling},
};
use num_complex::Complex32;

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

fn samples(npz: &mut Npz, radar: &Radar) -> Vec<Complex32> {
    let [frames, tx, rx, loops, samples] = radar.dims();
    let axes = [("frame", frames), ("tx", tx), ("rx", rx), ("loop", loops), ("sample", samples)].map(|(name, n)| (name, Some(n)));
    let array: Array<Complex32> = npz.read("samples", &axes).unwrap();
    array.values
}

#[test]
fn an_archive_holds_the_samples_with_their_axes_and_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml");
    let (source, out) = (folder.path().join("walk"), folder.path().join("out"));
    run(&["record", text(&config), "--set", "record.frames=2", "--out", text(&source), "-q"]);
    run(&["export", text(&source), "--to", "npz", "--out", text(&out), "-q"]);
    let recording = Recording::open(&source).unwrap();
    let mut npz = Npz::open(out.join("walk.npz")).unwrap();
    let found = samples(&mut npz, &recording.radar);
    let mut place = 0;
    for index in 0..recording.frames() {
        let frame = recording.frame(index).unwrap();
        for (re, im) in frame.re.iter().zip(frame.im.as_ref().unwrap()) {
            assert_eq!(found[place], Complex32::new(*re, *im));
            place += 1;
        }
    }
    assert_eq!(place, found.len());
    let frames = recording.frames();
    let vertices = recording.person().unwrap().faces().iter().flatten().max().unwrap() + 1;
    let body: Array<f32> =
        npz.read("vertices", &[("frame", Some(frames)), ("vertex", Some(vertices)), ("xyz", Some(3))]).unwrap();
    // Somebody two to three metres ahead.
    let ahead = body.values.chunks(3).map(|vertex| vertex[1]).sum::<f32>() / (frames * vertices) as f32;
    assert!((1.0..4.0).contains(&ahead), "{ahead}");
    let ranges: Array<f64> = npz.read("range_m", &[("range", Some(32))]).unwrap();
    assert!((ranges.values[1] - recording.radar.range_resolution_m()).abs() < 1e-12);
    let velocities: Array<f64> = npz.read("velocity_m_s", &[("doppler", Some(16))]).unwrap();
    assert!((velocities.values[9] - recording.radar.velocity_resolution_mps()).abs() < 1e-12);
    for name in ["axes", "radar", "room", "labels", "faces", "tx_m", "rx_m", "time_s", "chirp_time_s", "sample_time_s"] {
        assert!(npz.has(name), "{name} of {:?}", npz.names());
    }
}

/// One point in every frame, by the formats' law.
fn point_recording(folder: &Path, position_m: [f64; 3]) -> (PathBuf, Radar) {
    let radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, ..Radar::mmmesh(2) };
    let distance = |a: [f64; 3]| (0..3).map(|axis| (a[axis] - position_m[axis]).powi(2)).sum::<f64>().sqrt();
    let [_, tx, rx, loops, samples] = radar.dims();
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32 - 0.5
    };
    let (mut re, mut im) = (Vec::new(), Vec::new());
    for from in 0..tx {
        for to in 0..rx {
            let delay =
                (distance(radar.tx_position_m(from)) + distance(radar.rx_position_m(to))) / hybridsim::radar::SPEED_OF_LIGHT;
            for chirp in 0..loops * samples {
                let time = (chirp % samples) as f64 / radar.sample_rate_hz;
                let angle = std::f64::consts::TAU * ((radar.carrier_hz() + radar.slope_hz_per_s * time) * delay).fract();
                re.push(angle.cos() as f32 + noise());
                im.push(angle.sin() as f32 + noise());
            }
        }
    }
    let contents = RecordingContents {
        radar: &radar,
        room: None,
        person: None,
        body_file: None,
        labels: Default::default(),
        layout: IfLayout::Complex,
        truth: None,
    };
    let frame = IfFrame::new([tx, rx, loops, samples], re, Some(im));
    write_recording(folder, &contents, &mut |_| Ok(frame.clone())).unwrap();
    (folder.into(), radar)
}

#[test]
fn maps_and_points_show_a_point_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let place = [1.5, 2.6, 0.0];
    let (source, radar) = point_recording(&folder.path().join("point"), place);
    let (range, azimuth) = ((1.5f64 * 1.5 + 2.6 * 2.6).sqrt(), (1.5f64 / 2.6).atan().to_degrees());
    let maps = folder.path().join("maps");
    run(&["export", text(&source), "--to", "maps", "--set", "maps.farthest_m=6", "--out", text(&maps), "-q"]);
    let mut npz = Npz::open(maps.join("point_maps.npz")).unwrap();
    let ranges: Array<f64> = npz.read("range_m", &[("range", None)]).unwrap();
    let azimuths: Array<f64> = npz.read("azimuth_deg", &[("azimuth", Some(61))]).unwrap();
    assert!(*ranges.values.last().unwrap() <= 6.0);
    let bins = ranges.values.len();
    let axes =
        [("frame", 2), ("doppler", 16), ("elevation", 1), ("azimuth", 61), ("range", bins)].map(|(name, n)| (name, Some(n)));
    let power: Array<f32> = npz.read("power_db", &axes).unwrap();
    let best = (0..power.values.len()).max_by(|a, b| power.values[*a].total_cmp(&power.values[*b])).unwrap();
    let index = power.index_of(best);
    assert_eq!(index[1], 8, "it stands still");
    assert!((azimuths.values[index[3]] - azimuth).abs() < 2.0, "{}° against {azimuth}°", azimuths.values[index[3]]);
    assert!((ranges.values[index[4]] - range).abs() < radar.range_resolution_m(), "{} m", ranges.values[index[4]]);
    assert!(power.values[best].abs() < 3.0, "{} dB", power.values[best]);

    let clouds = folder.path().join("points");
    for method in ["ca", "os"] {
        let out = clouds.with_extension(method);
        let set = format!("points.method={method}");
        run(&["export", text(&source), "--to", "points", "--set", &set, "--out", text(&out), "-q"]);
        let mut npz = Npz::open(out.join("point_points.npz")).unwrap();
        let [x, y, snr] = ["x_m", "y_m", "snr_db"].map(|name| npz.read::<f32>(name, &[("point", None)]).unwrap().values);
        let frames: Array<i64> = npz.read("frame", &[("point", Some(x.len()))]).unwrap();
        let best = (0..snr.len()).max_by(|a, b| snr[*a].total_cmp(&snr[*b])).expect("the point is detected");
        let off = (f64::from(x[best]) - place[0]).hypot(f64::from(y[best]) - place[1]);
        assert!(off < 0.2, "{method}: [{}, {}] m, {off} m off", x[best], y[best]);
        let cloud = fs::read_to_string(out.join("point_points/frame_000001.ply")).unwrap();
        let count = frames.values.iter().filter(|frame| **frame == 1).count();
        assert!(cloud.contains(&format!("element vertex {count}\n")), "{cloud}");
        assert_eq!(cloud.lines().skip_while(|line| *line != "end_header").skip(1).count(), count);
    }
}

#[test]
fn hdf5_holds_what_the_archive_holds() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(FRAMES);
    let source = record(&folder.path().join("a"), &radar, IfLayout::Codes, &[("action", "walk")], code);
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "hdf5", "--out", text(&out), "-q"]);
    let file = hdf5_pure::File::open(out.join("a.h5")).unwrap();
    let set = file.dataset("samples").unwrap();
    assert_eq!(set.shape().unwrap(), radar.dims().map(|length| length as u64));
    let bytes = set.read_raw().unwrap();
    let parts: Vec<f32> = bytes.as_chunks().0.iter().map(|&part| f32::from_le_bytes(part)).collect();
    for (place, pair) in parts.chunks(2).enumerate() {
        assert_eq!(pair, [code(place, 0), code(place, 1)], "sample {place}");
    }
    assert_eq!(parts.len(), 2 * radar.dims().iter().product::<usize>());
    let attributes = file.root().attrs().unwrap();
    assert!(attributes["labels"].as_str().unwrap().contains("walk"));
    assert_eq!(set.attrs().unwrap()["axes"].as_str(), Some("frame tx rx loop sample"));
}

#[test]
fn a_trace_of_roverd_has_q_before_i() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(2);
    let source = record(&folder.path().join("a"), &radar, IfLayout::Codes, &[], code);
    let out = folder.path().join("out");
    run(&["export", text(&source), "--to", "rover", "--out", text(&out), "-q"]);
    let sensor = out.join("a/radar");
    let meta: serde_json::Value = serde_json::from_str(&fs::read_to_string(sensor.join("meta.json")).unwrap()).unwrap();
    assert_eq!(meta["iq"]["shape"], serde_json::json!([5, 3, 4, 32]));
    let bytes = fs::read(sensor.join("iq")).unwrap();
    let words: Vec<i16> = bytes.as_chunks().0.iter().map(|&word| i16::from_le_bytes(word)).collect();
    let [frames, n_tx, n_rx, loops, samples] = radar.dims();
    assert_eq!(words.len(), 2 * frames * n_tx * n_rx * loops * samples);
    // iq[…, 0::2] = 1j · iiqq[…, 0::4] + iiqq[…, 2::4], iq[…, 1::2] = 1j · iiqq[…, 1::4] + iiqq[…, 3::4]
    for (row, words) in words.chunks(2 * samples).enumerate() {
        let (rest, rx) = (row / n_rx, row % n_rx);
        let (rest, tx) = (rest / n_tx, rest % n_tx);
        let (frame, index) = (rest / loops, rest % loops);
        for sample in 0..samples {
            let place = (((frame * n_tx + tx) * n_rx + rx) * loops + index) * samples + sample;
            let at = 4 * (sample / 2) + sample % 2;
            assert_eq!([words[at + 2], words[at]], [0, 1].map(|part| code(place, part) as i16), "row {row}, sample {sample}");
        }
    }
    assert_eq!(fs::read(sensor.join("valid")).unwrap(), [1, 1]);
    assert_eq!(fs::read(sensor.join("ts")).unwrap().len(), 16);
    assert!(out.join("a/config.yaml").is_file());
}

/// A chirp that was lost is one in every layout that has a place for it.
#[test]
fn what_was_lost_is_said_where_there_is_a_place_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let radar = radar(2);
    let source = record(&folder.path().join("a"), &radar, IfLayout::Codes, &[], code);
    let [frames, n_tx, n_rx, loops, _] = radar.dims();
    let mut chirps = vec![true; frames * n_tx * n_rx * loops];
    let lost = ((n_tx + 2) * n_rx + 1) * loops + 3;
    chirps[lost] = false;
    write_npy(source.join("valid.npy"), &[frames, n_tx, n_rx, loops], Values::Bool(&chirps)).unwrap();
    let settings = source.join("recording.toml");
    let stated = fs::read_to_string(&settings).unwrap().replace("[files]", "[files]\nvalid = \"valid.npy\"");
    fs::write(&settings, stated).unwrap();
    let export = |target: &str| {
        let out = folder.path().join(target);
        run(&["export", text(&source), "--to", target, "--out", text(&out), "-q"]);
        out
    };
    assert_eq!(fs::read(export("rover").join("a/radar/valid")).unwrap(), [1, 0]);
    let axes = [("frame", Some(frames)), ("tx", Some(n_tx)), ("rx", Some(n_rx)), ("loop", Some(loops))];
    let mut archive = Npz::open(export("npz").join("a.npz")).unwrap();
    assert_eq!(archive.read::<bool>("valid", &axes).unwrap().values, chirps);
    let file = hdf5_pure::File::open(export("hdf5").join("a.h5")).unwrap();
    let bytes: Vec<u8> = chirps.iter().map(|valid| (*valid).into()).collect();
    assert_eq!(file.dataset("valid").unwrap().read_raw().unwrap(), bytes);
    for (target, name) in [("maps", "a_maps.npz"), ("points", "a_points.npz")] {
        let mut archive = Npz::open(export(target).join(name)).unwrap();
        assert_eq!(archive.read::<bool>("valid", &[("frame", Some(frames))]).unwrap().values, [true, false], "{target}");
    }
    let said = run(&["export", text(&source), "--to", "dca1000", "--out", text(&folder.path().join("words"))]);
    assert!(said.contains("not carried: which chirps were lost"), "{said}");
}

#[test]
fn a_data_set_has_shards_labels_splits_and_a_card() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("site");
    for (name, subject, action) in
        [("a", "s1", "walk"), ("b", "s2", "walk, slowly"), ("c", "s3", "sit"), ("d", "s4", "sit"), ("e", "s1", "sit")]
    {
        let labels = [("subject", subject), ("action", action)];
        record(&site.join("recordings").join(name), &radar(1), IfLayout::Codes, &labels, code);
    }
    let export = |out: &str| {
        let out = folder.path().join(out);
        run(&["export", text(&site), "--to", "npz", "--split-by", "subject", "--out", text(&out), "-q"]);
        out
    };
    let (out, again) = (export("out"), export("again"));
    let table = fs::read_to_string(out.join("labels.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "recording,split,frames,duration_s,action,subject");
    assert_eq!(rows.len(), 6);
    assert!(rows[2].starts_with("b,") && rows[2].ends_with(",1,0.033300,\"walk, slowly\",s2"), "{}", rows[2]);
    let split = |row: &str| row.split(',').nth(1).unwrap().to_string();
    assert_eq!(split(rows[1]), split(rows[5]), "a subject is in one split");
    let splits: std::collections::BTreeSet<String> = rows[1..].iter().map(|row| split(row)).collect();
    assert_eq!(splits.into_iter().collect::<Vec<_>>(), ["test", "train", "validation"]);
    let card = fs::read_to_string(out.join("card.md")).unwrap();
    for part in ["5 recordings", "| subject | s1 (2), s2 (1), s3 (1), s4 (1) |", "## Licence", "sample_rate_hz = 4400000.0"] {
        assert!(card.contains(part), "`{part}` is missing in:\n{card}");
    }
    assert_eq!(fs::read(out.join("c/c.npz")).unwrap(), fs::read(again.join("c/c.npz")).unwrap(), "equal runs write equal bytes");
    assert_eq!(table, fs::read_to_string(again.join("labels.csv")).unwrap());
    // Whom a site calls unseen nothing is trained on.
    fs::write(site.join("site.toml"), "unseen = ['s4']\n").unwrap();
    let table = fs::read_to_string(export("unseen").join("labels.csv")).unwrap();
    assert_eq!(table.lines().map(split).filter(|split| split == "test").count(), 1);
    assert_eq!(split(table.lines().nth(4).unwrap()), "test", "{table}");
    let one = site.join("recordings/a");
    refused(
        &["export", text(&one), text(&one), "--to", "npz", "--out", text(&folder.path().join("twice")), "-q"],
        &["two recordings of one name"],
    );
}
