//! What a capture lost: packets, chirps, its end.

use std::fs;

use hybridsim::data::{Recording, Valid};
use hybridsim::diagnosis::cube::Loaded;
use hybridsim::import::capture::{self, Stated};
use hybridsim::integrity;

use super::{CFG, CHIRP, FRAMES, LOOPS, RX, captured, hybridsim, names, recording, text};

/// 16-bit words in a packet of the capture card.
const PACKET: usize = 728;

#[test]
fn packets_of_zeros_are_lost_and_known() {
    // Two packets, in the frames 3 and 9.
    let (folder, bin) = captured(CFG, |words| {
        for start in [3 * LOOPS * CHIRP + 100, 9 * LOOPS * CHIRP + 4 * CHIRP + 40] {
            words[start..start + PACKET].fill(0);
        }
    });
    let output = hybridsim(&["import", bin.to_str().unwrap(), "--out", "out"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("2 of 16 frames are not whole and are used for nothing"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("what was lost is left out"), "{}", text(&output.stdout));
    let recording = Recording::open(folder.path().join("out")).unwrap();
    let broken: Vec<usize> = (0..FRAMES).filter(|frame| !recording.is_whole(*frame)).collect();
    assert_eq!((broken, recording.whole_stretch().unwrap()), (vec![3, 9], 10..16));
    // What is left is whole, and `check` says how much that is.
    let findings = integrity::inspect(&recording, FRAMES).unwrap();
    assert_eq!(integrity::damage(&findings), None, "{findings:?}");
    let check = hybridsim(&["check", "out"], folder.path());
    assert!(text(&check.stdout).contains("all 14 frames can be read"), "{}", text(&check.stdout));
    // The diagnosis looks at the longest stretch, at its own times.
    let loaded = Loaded::read(&recording, usize::MAX).unwrap();
    assert_eq!((loaded.radar.frames, (loaded.starts_s[0] * 10.0).round()), (6, 10.0));
    assert_eq!(loaded.cube.samples[7].re, f64::from(recording.frame(10).unwrap().re[7]));
}

#[test]
fn a_mask_is_read_as_bool_or_bytes_and_refused_in_another_shape() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["if.npy", "recording.toml"] {
        fs::copy(recording().join(name), folder.path().join(name)).unwrap();
    }
    let file = folder.path().join("recording.toml");
    let plain: String = fs::read_to_string(&file).unwrap();
    let without_person: Vec<&str> = plain
        .lines()
        .filter(|line| !["body =", "motion =", "vertices =", "faces =", "pose_times ="].iter().any(|key| line.starts_with(key)))
        .collect();
    let plain = without_person.join("\n").replace("[files]", "[files]\nvalid = \"valid.npy\"");
    fs::write(&file, &plain).unwrap();
    let write = |kind: &str, shape: &str, values: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        let padded = format!("{header:<117}\n");
        let bytes = [b"\x93NUMPY\x01\x00\x76\x00".as_slice(), padded.as_bytes(), values].concat();
        fs::write(folder.path().join("valid.npy"), bytes).unwrap();
        Recording::open(folder.path())
    };
    let mut values = vec![1; FRAMES * RX * LOOPS];
    values[2 * RX * LOOPS + 5] = 0;
    for kind in ["|b1", "|u1"] {
        let recording = write(kind, "(16, 1, 4, 16)", &values).unwrap();
        assert_eq!(recording.whole_frames().count(), FRAMES - 1);
        assert!(!recording.is_whole(2) && recording.notes.iter().any(|note| note.contains("1 of 1024 chirps were lost")));
    }
    let error = write("|b1", "(16, 4, 16)", &values).unwrap_err();
    assert!(
        error.to_string().contains("valid") && error.to_string().contains("[frame = 16, tx = 1, rx = 4, loop = 16]"),
        "{error}"
    );
    values.fill(0);
    let error = write("|b1", "(16, 1, 4, 16)", &values).unwrap().whole_stretch().unwrap_err();
    assert!(error.to_string().contains("lost chirps in every frame"), "{error}");
    assert_eq!(Valid::without(&Recording::open(recording()).unwrap().radar, [[2, 0, 0, 5]]).lost(), 1);
}

/// A capture that ends anywhere: whole frames are kept, and less is refused.
#[test]
fn a_capture_that_is_cut_off_gives_its_whole_frames_or_an_error() {
    let (folder, bin) = captured(CFG, |_| {});
    let whole = fs::read(&bin).unwrap();
    let frame = 2 * LOOPS * CHIRP;
    for (bytes, wanted) in [
        (0, Err("an empty file")),
        (1, Err("at least 32768 bytes, one frame")),
        (frame - 2, Err("at least 32768 bytes, one frame")),
        (frame + 1, Ok(1)),
        (2 * frame, Ok(2)),
        (3 * frame - 2, Ok(2)),
        (whole.len(), Ok(FRAMES)),
    ] {
        fs::write(&bin, &whole[..bytes]).unwrap();
        match (capture::open(std::slice::from_ref(&bin), &Stated::default()), wanted) {
            (Ok(capture), Ok(frames)) => assert_eq!(capture.radar.frames, frames, "{bytes} bytes"),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{bytes} bytes: {error}"),
            (found, _) => panic!("{bytes} bytes: {:?}", found.err()),
        }
    }
    drop(folder);
}

/// A packet of zeros in every frame, and in the only one; the only one without the packet.
#[test]
fn nothing_whole_is_nothing_imported() {
    let refused = |frames: usize, change: &dyn Fn(&mut Vec<i16>)| {
        let (folder, bin) = captured(CFG, |words| {
            words.truncate(frames * LOOPS * CHIRP);
            change(words);
        });
        let error = capture::open(std::slice::from_ref(&bin), &Stated::default())
            .and_then(|capture| capture::import(capture, &folder.path().join("out"), Default::default(), &mut |_, _| ()))
            .unwrap_err();
        assert_eq!(names(folder.path()), ["adc_data.bin", "radar.cfg"]);
        assert!(error.hint().is_some(), "{error}");
        error.to_string()
    };
    for frames in [FRAMES, 1] {
        let error = refused(frames, &|words| {
            (0..frames).for_each(|frame| words[frame * LOOPS * CHIRP + 3 * CHIRP + 300 * frame..][..PACKET].fill(0));
        });
        let spot = "the first from frame 0, loop 3, tx 0, rx 0, sample 0 on, expected one frame at least that is whole";
        assert!(error.contains("adc_data.bin: `samples` is lost chirps in every frame: exact zeros in"), "{error}");
        assert!(error.contains(spot), "{error}");
    }
    let error = refused(1, &|words| drop(words.drain(3 * CHIRP..3 * CHIRP + PACKET)));
    let bytes = 2 * (LOOPS * CHIRP - PACKET);
    assert!(error.contains(&format!("`samples` is {bytes} bytes, expected at least 32768 bytes, one frame of")), "{error}");
}
