use std::fs;

use super::*;
use crate::data::arrays::Values;
use crate::data::arrays::write_npy;
use crate::data::test_support::{names, shared, small_body, small_motion};
use crate::radar::Sampling;

pub(super) fn small_radar(sampling: Sampling) -> Radar {
    Radar { sampling, samples_per_chirp: 4, loops_per_frame: 3, ..Radar::small(2) }
}

pub(super) fn contents(radar: &Radar, layout: IfLayout) -> RecordingContents<'_> {
    RecordingContents { radar, room: None, person: None, body_file: None, labels: BTreeMap::new(), layout, truth: None }
}

/// Every sample another whole number.
pub(super) fn frame_of(radar: &Radar, index: usize) -> IfFrame {
    let [_, tx, rx, loops, samples] = radar.dims();
    let count = tx * rx * loops * samples;
    let value = |position: usize| (1000 * index + position) as f32 - 7.0;
    let im = (radar.sampling == Sampling::Complex).then(|| (0..count).map(|position| -value(position)).collect());
    IfFrame::new([tx, rx, loops, samples], (0..count).map(value).collect(), im)
}

pub(super) fn written(contents: &RecordingContents) -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("recording");
    write_recording(&folder, contents, &mut |index| Ok(frame_of(contents.radar, index))).unwrap();
    (parent, folder)
}

fn skinned() -> Person {
    let placement = Placement { start_s: 0.0, origin_m: [0.1, 3.0, -1.0], ..Default::default() };
    Person::Skinned { model: small_body(), motion: small_motion(4), placement }
}

/// The message of opening, without the folder.
pub(super) fn refused(folder: &Path) -> String {
    let message = Recording::open(folder).unwrap_err().to_string();
    message.replace(&format!("{}/", folder.display()), "")
}

/// Opening after `from` became `to` in `recording.toml`.
fn refused_with(folder: &Path, from: &str, to: &str) -> String {
    let path = folder.join(SETTINGS_FILE);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} in {text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let message = refused(folder);
    fs::write(&path, text).unwrap();
    message
}

#[test]
fn everything_around_the_samples_comes_back() {
    let radar = small_radar(Sampling::Complex);
    let room = Room { left_m: Some(1.9), floor_m: Some(1.0), ..Default::default() };
    let (person, truth) = (skinned(), serde_json::json!({ "effects": [] }));
    let labels = BTreeMap::from([("action".to_string(), "walk".to_string())]);
    let contents = RecordingContents {
        room: Some(&room),
        person: Some(&person),
        labels: labels.clone(),
        truth: Some(&truth),
        ..contents(&radar, IfLayout::Codes)
    };
    let (parent, folder) = written(&contents);
    assert_eq!(names(parent.path()), ["recording"]);
    assert_eq!(names(&folder), ["body.npz", "if.npy", "motion.npz", "recording.toml", "truth.json"]);
    let recording = Recording::open(&folder).unwrap();
    assert_eq!((&recording.radar, &recording.room, &recording.labels), (&radar, &Some(room), &labels));
    assert_eq!(recording.person(), Some(&person));
    assert!(recording.notes.is_empty(), "{:?}", recording.notes);
    // The settings' own name opens the folder as well, and what is in the truth does not matter.
    fs::write(folder.join("truth.json"), "no JSON").unwrap();
    assert_eq!(Recording::open(folder.join(SETTINGS_FILE)).unwrap().folder, folder);
}

#[test]
fn a_body_that_lies_elsewhere_is_referred_to() {
    let radar = small_radar(Sampling::Complex);
    let parent = tempfile::tempdir().unwrap();
    crate::data::write_body(parent.path().join("body.npz"), &small_body()).unwrap();
    let person = skinned();
    let contents = RecordingContents {
        person: Some(&person),
        body_file: Some(Path::new("../body.npz")),
        ..contents(&radar, IfLayout::Complex)
    };
    let folder = parent.path().join("recording");
    let recording = write_recording(&folder, &contents, &mut |index| Ok(frame_of(&radar, index))).unwrap();
    assert_eq!(names(&folder), ["if.npy", "motion.npz", "recording.toml"]);
    assert_eq!(recording.person(), Some(&person));
    let contents = RecordingContents { body_file: Some(Path::new("../none.npz")), ..contents };
    let error = write_recording(parent.path().join("b"), &contents, &mut |index| Ok(frame_of(&radar, index))).unwrap_err();
    assert!(error.to_string().starts_with("../none.npz: cannot be read: "), "{error}");
    assert_eq!(names(parent.path()), ["body.npz", "recording"]);
}

#[test]
fn meshes_come_back_and_bad_ones_are_named() {
    let radar = small_radar(Sampling::Complex);
    let pose = |shift: f64| vec![[0.0, 2.0, shift], [0.5, 2.0, 0.0], [0.0, 2.0, 0.5]];
    let person = Person::Meshes { vertices: vec![pose(0.0), pose(0.25)], faces: vec![[0, 1, 2]], pose_times_s: vec![0.0, 0.5] };
    let contents = RecordingContents { person: Some(&person), ..contents(&radar, IfLayout::Codes) };
    let (_parent, folder) = written(&contents);
    assert_eq!(Recording::open(&folder).unwrap().person(), Some(&person));

    write_npy(folder.join("pose_times.npy"), &[2], Values::F64(&[0.5, 0.5])).unwrap();
    assert_eq!(refused(&folder), "pose_times.npy: `pose_times` is 0.5 s at pose 1 after 0.5 s, expected times that ascend");
    write_npy(folder.join("pose_times.npy"), &[3], Values::F64(&[0.0, 0.5, 1.0])).unwrap();
    assert_eq!(refused(&folder), "pose_times.npy: `pose_times` is float64 [3], expected real numbers [pose = 2]");
    write_npy(folder.join("pose_times.npy"), &[2], Values::F64(&[0.0, 0.5])).unwrap();
    write_npy(folder.join("faces.npy"), &[1, 3], Values::I32(&[0, 1, 3])).unwrap();
    assert_eq!(refused(&folder), "faces.npy: `faces` is vertex 3 in face 0, expected vertices 0 to 2");
    assert_eq!(
        refused_with(&folder, "faces = \"faces.npy\"\n", ""),
        "recording.toml: `files.faces` is missing, expected vertices, faces and pose_times together"
    );
    assert_eq!(
        refused_with(&folder, "[files]\n", "[files]\nbody = \"body.npz\"\n"),
        "recording.toml: `files` is both a body and meshes, expected body and motion, or vertices, faces and pose_times"
    );
}

#[test]
fn an_axis_that_does_not_fit_the_radar_is_named() {
    let radar = small_radar(Sampling::Complex);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Codes));
    assert_eq!(
        refused_with(&folder, "loops_per_frame = 3", "loops_per_frame = 5"),
        "if.npy: `if` is int16 [2, 1, 2, 3, 4, 2], expected int16 [frame = 2, tx = 1, rx = 2, loop = 5, sample = 4, iq = 2]"
    );
    fs::write(
        folder.join(SETTINGS_FILE),
        fs::read_to_string(folder.join(SETTINGS_FILE)).unwrap().replace("loops_per_frame = 3", "loops_per_frame = 5"),
    )
    .unwrap();
    assert_eq!(Recording::open(&folder).unwrap_err().hint().unwrap(), "loop is 3 instead of 5");
}

#[test]
fn settings_that_cannot_be_are_refused_in_their_file() {
    let radar = small_radar(Sampling::Complex);
    let (room, person) = (Room { left_m: Some(1.9), ..Default::default() }, skinned());
    let contents = RecordingContents { room: Some(&room), person: Some(&person), ..contents(&radar, IfLayout::Codes) };
    let (_parent, folder) = written(&contents);
    let with = |from: &str, to: &str| refused_with(&folder, from, to);
    assert_eq!(with("format = 1", "format = 2\nnew_key = 3"), "recording.toml: `format` is 2, expected 1");
    assert_eq!(
        with("loops_per_frame", "loop_per_frame"),
        "recording.toml: unknown key `radar.loop_per_frame`, the nearest known one is `loops_per_frame`"
    );
    assert_eq!(
        with("left_m = 1.9", "left_m = -1.9"),
        "recording.toml: `room.left_m` is -1.9, expected a distance above zero in metres"
    );
    assert_eq!(with("frames = 2", "frames = 0"), "recording.toml: `radar.frames` is 0, expected a positive number");
    assert_eq!(
        with("frames = 2", "frames = \"two\""),
        "recording.toml: line 13, column 10: invalid type: string \"two\", expected usize"
    );
    assert_eq!(
        with("[1.0, 0.0, 0.0]", "[-1.0, 0.0, 0.0]"),
        "recording.toml: `motion.radar_from_motion` is a mirror image, expected a rotation"
    );
    assert!(with("[1.0, 0.0, 0.0]", "[2.0, 0.0, 0.0]").ends_with("expected a rotation"));
    assert_eq!(with("\nstart_s = 0.0", "\nstart_s = nan"), "recording.toml: `motion.start_s` is NaN, expected a finite number");
    assert!(with("motion = \"motion.npz\"", "motion = \"other.npz\"").starts_with("other.npz: cannot be read: "));
    assert!(refused(&folder.join("none")).contains("recording.toml: cannot be read: "));
}

#[test]
fn what_cannot_be_used_is_noted() {
    let radar = small_radar(Sampling::Complex);
    let mut person = skinned();
    if let Person::Skinned { placement, .. } = &mut person {
        placement.start_s = 0.05;
    }
    let contents = RecordingContents { person: Some(&person), ..contents(&radar, IfLayout::Codes) };
    let (_parent, folder) = written(&contents);
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(recording.notes, ["frame 0 lies outside the motion, which lasts from 0.050 s to 0.350 s"]);
    let path = folder.join(SETTINGS_FILE);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("motion = \"motion.npz\"\n", "") + "\n[labels]\naction = \"walk\"\ntrial = 3\n").unwrap();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(recording.notes, ["a body without a motion: nobody is placed"]);
    assert!(recording.person().is_none());
    assert_eq!(recording.labels["trial"], "3");
}

#[test]
fn a_recording_that_fails_half_way_leaves_nothing() {
    let radar = small_radar(Sampling::Complex);
    let person = skinned();
    let contents = RecordingContents { person: Some(&person), ..contents(&radar, IfLayout::Codes) };
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("recording");
    let full = || Error::write("if.npy", std::io::ErrorKind::StorageFull.into());
    let mut failing = |index| if index == 0 { Ok(frame_of(&radar, 0)) } else { Err(full()) };
    assert!(matches!(write_recording(&folder, &contents, &mut failing), Err(Error::Write { .. })));
    assert!(names(parent.path()).is_empty());

    let mut spoiled = |index| {
        let mut frame = frame_of(&radar, index);
        frame.re[5] = f32::INFINITY;
        Ok(frame)
    };
    let message = write_recording(&folder, &contents, &mut spoiled).unwrap_err().to_string();
    assert!(
        message.ends_with("`if` is NaN or infinite at frame 0, tx 0, rx 0, loop 1, sample 1, expected finite samples"),
        "{message}"
    );
    assert!(names(parent.path()).is_empty());

    let panicked = std::panic::catch_unwind(|| write_recording(&folder, &contents, &mut |_| panic!("a bug")));
    assert!(panicked.is_err() && names(parent.path()).is_empty());
}

#[test]
fn a_recording_does_not_overwrite_another() {
    let radar = small_radar(Sampling::Complex);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Codes));
    let error =
        write_recording(&folder, &contents(&radar, IfLayout::Codes), &mut |index| Ok(frame_of(&radar, index))).unwrap_err();
    assert!(error.to_string().ends_with("exists already and is not an empty folder"), "{error}");
    let error = write_recording(folder.join("x"), &contents(&radar, IfLayout::Real), &mut |_| unreachable!()).unwrap_err();
    assert_eq!(error.to_string(), "`radar.sampling` is complex, expected real for samples stored as real");
}

#[test]
fn the_shared_recordings_open_with_their_stated_sizes() {
    for name in ["p1", "p2", "p3", "p4", "p5", "p6", "p7", "p8"] {
        let Some(folder) = shared(&format!("recordings/planted/{name}")) else { return };
        let recording = Recording::open(folder).unwrap();
        assert_eq!((recording.layout(), recording.radar.dims()), (IfLayout::Codes, [24, 1, 4, 64, 128]));
        assert!(recording.notes.is_empty(), "{:?}", recording.notes);
        let Some(Person::Skinned { model, motion, .. }) = recording.person() else { panic!("{name} has a person") };
        assert_eq!((model.template.len(), motion.poses.len(), motion.rate_hz), (6890, 181, 60.0));
        assert_eq!(recording.room.as_ref().unwrap().boundaries().len(), 6);
        let last = recording.frame(23).unwrap();
        assert_eq!(last.dims, [1, 4, 64, 128]);
        assert!(last.re.iter().chain(last.im.as_ref().unwrap()).any(|&code| code != 0.0));
    }
    let real = [
        ("two_people_77ghz", IfLayout::Codes, [1, 2, 4, 128, 128]),
        ("room_60ghz", IfLayout::Codes, [1, 3, 4, 85, 512]),
        ("breathing_60ghz", IfLayout::RealCodes, [256, 1, 3, 8, 64]),
    ];
    for (name, layout, dims) in real {
        let Some(folder) = shared(&format!("recordings/real/{name}")) else { return };
        let recording = Recording::open(folder).unwrap();
        assert_eq!((recording.layout(), recording.radar.dims()), (layout, dims));
        assert!(recording.person().is_none() && recording.room.is_none() && recording.notes.is_empty());
        let frame = recording.frame(recording.frames() - 1).unwrap();
        assert_eq!(frame.im.is_none(), layout == IfLayout::RealCodes);
        // Twelve-bit codes, offset binary.
        assert!(layout != IfLayout::RealCodes || frame.re.iter().all(|code| (0.0..4096.0).contains(code)));
    }
}
