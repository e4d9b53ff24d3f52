//! Every target but the capture card's: what its files hold and say.

use std::fs;
use std::path::{Path, PathBuf};

use hybridsim::data::arrays::{Array, Npz, Values, write_npy};
use hybridsim::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use hybridsim::radar::Radar;
use num_complex::Complex32;

use super::{FRAMES, code, radar, record, refused, run, text};

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
