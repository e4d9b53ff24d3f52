//! Motions as NumPy's archives: the same walk in every form comes out as the same walk, and what is no motion is refused.

use std::path::Path;

use nalgebra::UnitQuaternion;

use super::tried_tests::{Point, Turn, person, same, walk};
use super::{BvhConfig, read_motion};
use crate::data::UpAxis;
use crate::person::{BodyModel, Motion};

/// One array as NumPy stores it.
struct Stored {
    name: &'static str,
    descr: &'static str,
    fortran: bool,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

fn real(name: &'static str, shape: &[usize], values: &[f64]) -> Stored {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    assert_eq!(shape.iter().product::<usize>(), values.len(), "{name}");
    Stored { name, descr: "<f8", fortran: false, shape: shape.to_vec(), bytes }
}

fn npz(folder: &Path, members: &[Stored]) -> std::path::PathBuf {
    let path = folder.join("motion.npz");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    for member in members {
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        archive.start_file(format!("{}.npy", member.name), options).unwrap();
        let shape: String = member.shape.iter().map(|length| format!("{length}, ")).collect();
        let fortran = if member.fortran { "True" } else { "False" };
        let header = format!("{{'descr': '{}', 'fortran_order': {fortran}, 'shape': ({shape}), }}\n", member.descr);
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(&member.bytes);
        std::io::Write::write_all(&mut archive, &bytes).unwrap();
    }
    archive.finish().unwrap();
    path
}

/// The walk as columns: `[pose, 3 joints]` of these joints of SMPL.
fn columns(motion: &Motion, joints: std::ops::Range<usize>) -> Vec<f64> {
    motion.poses.iter().flat_map(|pose| pose[joints.clone()].iter().flatten().copied().collect::<Vec<_>>()).collect()
}

/// The same motion in another world: turned about the origin.
fn turned(model: &BodyModel, motion: &Motion, world: Turn) -> Motion {
    let pelvis = Point::from(model.rest_joints(&motion.betas)[0]);
    let mut motion = motion.clone();
    motion.poses.iter_mut().for_each(|pose| pose[0] = (world * UnitQuaternion::new(Point::from(pose[0]))).scaled_axis().into());
    let place = |place: &mut [f64; 3]| *place = (world * (pelvis + Point::from(*place)) - pelvis).into();
    motion.translations.iter_mut().for_each(place);
    motion
}

/// Fingers that are bent: what must not become a hand.
fn bent(poses: usize, joints: usize) -> Vec<f64> {
    vec![1.3; poses * 3 * joints]
}

/// Rows side by side, as `[pose, width + width]`.
fn beside(poses: usize, parts: &[Vec<f64>]) -> Vec<f64> {
    let row = |pose: usize| parts.iter().flat_map(move |part| part.chunks(part.len() / poses).nth(pose).unwrap().to_vec());
    (0..poses).flat_map(row).collect()
}

/// The walk with what files say beside it.
struct Written {
    model: BodyModel,
    walk: Motion,
}

impl Written {
    fn new() -> Self {
        let model = person();
        let mut walk = walk(&model);
        walk.betas = vec![0.0; model.shape_directions.len()];
        assert!(walk.poses.iter().all(|pose| pose[22..] == [[0.0; 3]; 2]), "the hands rest");
        Self { model, walk }
    }

    fn poses(&self) -> usize {
        self.walk.poses.len()
    }

    fn betas(&self) -> usize {
        self.walk.betas.len()
    }

    fn all(&self) -> Vec<f64> {
        columns(&self.walk, 0..24)
    }

    fn body(&self) -> Vec<f64> {
        columns(&self.walk, 0..22)
    }

    fn places(&self) -> Vec<f64> {
        self.walk.translations.concat()
    }

    fn pose(&self) -> Stored {
        real("poses", &[self.poses(), 72], &self.all())
    }

    fn trans(&self) -> Stored {
        real("trans", &[self.poses(), 3], &self.places())
    }

    fn shape(&self) -> Stored {
        real("betas", &[self.betas()], &self.walk.betas)
    }

    /// With poses of a form, and the rest as AMASS has it.
    fn with(&self, poses: Stored) -> Vec<Stored> {
        vec![poses, self.trans(), self.shape(), rate()]
    }

    /// Every form comes out as the walk, and its notes say what is wanted.
    fn all_give(&self, forms: Vec<(&str, Vec<Stored>, &str)>) {
        let folder = tempfile::tempdir().unwrap();
        for (form, members, wanted) in forms {
            let (found, notes) = read_motion(&npz(folder.path(), &members), &self.model, &BvhConfig::default()).unwrap();
            assert!(notes.iter().any(|note| note.contains(wanted)), "{form}: {notes:?}");
            same(form, &self.model, &found, &self.walk);
            assert_eq!(found.rate_hz, if form == "ROMP" { 30.0 } else { 60.0 }, "{form}");
        }
    }
}

fn rate() -> Stored {
    real("mocap_framerate", &[], &[60.0])
}

#[test]
fn every_way_to_name_and_order_joints_gives_the_same_walk() {
    let written = Written::new();
    let (walk, poses, all, places) = (&written.walk, written.poses(), written.all(), written.places());
    let (pose, trans, shape) = (|| written.pose(), || written.trans(), || written.shape());
    let matrices: Vec<f64> = all
        .chunks(3)
        .flat_map(|angles| {
            let turn = UnitQuaternion::new(Point::new(angles[0], angles[1], angles[2])).to_rotation_matrix();
            turn.matrix().transpose().as_slice().to_vec()
        })
        .collect();
    written.all_give(vec![
        ("AMASS", written.with(pose()), "up axis: y"),
        ("three axes", written.with(real("poses", &[poses, 24, 3], &all)), "units: metres"),
        ("one person", vec![real("poses", &[1, poses, 72], &all), real("trans", &[1, poses, 3], &places), shape(), rate()], ""),
        ("transl", vec![pose(), real("transl", &[poses, 3], &places), shape(), real("fps", &[1], &[60.0])], "60 Hz (`fps`)"),
        ("matrices", written.with(real("poses", &[poses, 24, 3, 3], &matrices)), "matrices"),
        (
            "smplx",
            vec![
                real("global_orient", &[poses, 1, 3], &columns(walk, 0..1)),
                real("body_pose", &[poses, 23, 3], &columns(walk, 1..24)),
                real("transl", &[poses, 3], &places),
                shape(),
                rate(),
            ],
            "from `body_pose` and `global_orient`",
        ),
        (
            "AMASS in parts",
            vec![
                real("root_orient", &[poses, 3], &columns(walk, 0..1)),
                real("pose_body", &[poses, 63], &columns(walk, 1..22)),
                real("pose_hand", &[poses, 90], &bent(poses, 30)),
                trans(),
                shape(),
                rate(),
            ],
            "by name",
        ),
    ]);
}

#[test]
fn every_body_model_gives_the_same_walk() {
    let written = Written::new();
    let poses = written.poses();
    let with_bent = |columns: usize, bent_joints: usize| {
        written.with(real("poses", &[poses, columns], &beside(poses, &[written.body(), bent(poses, bent_joints)])))
    };
    let romp = vec![
        real("smpl_thetas", &[poses, 72], &written.all()),
        real("cam_trans", &[poses, 3], &written.places()),
        real("smpl_betas", &[written.betas()], &written.walk.betas),
    ];
    let shapes = written.walk.betas.repeat(poses);
    let with_betas = |betas: Stored| vec![written.pose(), written.trans(), betas, rate()];
    written.all_give(vec![
        ("SMPL-H", with_bent(156, 30), "52 of SMPL-H"),
        ("SMPL-X", with_bent(165, 33), "55 of SMPL-X"),
        ("betas [1, B]", with_betas(real("betas", &[1, written.betas()], &written.walk.betas)), ""),
        ("betas [T, B]", with_betas(real("betas", &[poses, written.betas()], &shapes)), "a shape for each"),
        ("ROMP", romp, "30 Hz is assumed"),
    ]);
}

#[test]
fn every_world_unit_and_number_type_gives_the_same_walk() {
    let written = Written::new();
    let poses = written.poses();
    let about_x = |degrees: f64| UnitQuaternion::from_axis_angle(&Point::x_axis(), f64::to_radians(degrees));
    let other = |degrees: f64| {
        let other = turned(&written.model, &written.walk, about_x(degrees));
        let trans = real("trans", &[poses, 3], &other.translations.concat());
        vec![real("poses", &[poses, 72], &columns(&other, 0..24)), trans, written.shape(), rate()]
    };
    let scaled = |values: &[f64], scale: f64| values.iter().map(|value| value * scale).collect::<Vec<_>>();
    let in_units = |scale: f64| {
        let trans = real("trans", &[poses, 3], &scaled(&written.places(), scale));
        vec![written.pose(), trans, written.shape(), rate()]
    };
    let degrees = real("poses", &[poses, 72], &scaled(&written.all(), 1_f64.to_degrees()));
    let all = written.all();
    let fortran: Vec<f64> = (0..72).flat_map(|column| all.chunks(72).map(|pose| pose[column]).collect::<Vec<_>>()).collect();
    let stored = |descr, fortran, values: Vec<f64>, bytes: &dyn Fn(f64) -> Vec<u8>| {
        let bytes = values.into_iter().flat_map(bytes).collect();
        written.with(Stored { name: "poses", descr, fortran, shape: vec![poses, 72], bytes })
    };
    let half = |value: f64| half::f16::from_f64(value).to_le_bytes().to_vec();
    written.all_give(vec![
        ("z up", other(90.0), "up axis: z"),
        ("a camera's", other(180.0), "up axis: -y"),
        ("centimetres", in_units(100.0), "units: centimetres"),
        ("millimetres", in_units(1e3), "units: millimetres"),
        ("degrees", written.with(degrees), "angles: degrees"),
        ("float16", stored("<f2", false, written.all(), &half), ""),
        ("big endian", stored(">f8", false, written.all(), &|value| value.to_be_bytes().to_vec()), ""),
        ("Fortran order", stored("<f8", true, fortran, &|value| value.to_le_bytes().to_vec()), ""),
    ]);
}

#[test]
fn settings_have_the_last_word() {
    let model = person();
    let walk = walk(&model);
    let poses = walk.poses.len();
    let folder = tempfile::tempdir().unwrap();
    let path = npz(
        folder.path(),
        &[real("poses", &[poses, 72], &columns(&walk, 0..24)), real("trans", &[poses, 3], &walk.translations.concat())],
    );
    let config =
        BvhConfig { up: Some(UpAxis::Z), frame_rate_hz: Some(50.0), scale_m: Some(2.0), skip_frames: 10, ..BvhConfig::default() };
    let (found, _) = read_motion(&path, &model, &config).unwrap();
    assert_eq!((found.rate_hz, found.poses.len()), (50.0, poses - 10));
    let mut wanted = walk.clone();
    wanted.poses.drain(..10);
    wanted.translations.drain(..10);
    wanted.translations.iter_mut().flatten().for_each(|value| *value *= 2.0);
    wanted.betas = found.betas.clone();
    let about_x = UnitQuaternion::from_axis_angle(&Point::x_axis(), -std::f64::consts::FRAC_PI_2);
    same("by settings", &model, &found, &turned(&model, &wanted, about_x));
    let refused = |config: BvhConfig| read_motion(&path, &model, &config).unwrap_err().to_string();
    assert!(refused(BvhConfig { skip_frames: poses, ..BvhConfig::default() }).starts_with("`skip_frames` is"));
    assert!(refused(BvhConfig { frame_rate_hz: Some(0.0), ..BvhConfig::default() }).starts_with("`frame_rate_hz` is 0"));
    assert!(refused(BvhConfig { scale_m: Some(-1.0), ..BvhConfig::default() }).starts_with("`scale_m` is -1"));
}

#[test]
fn what_no_reading_can_mend_is_refused_by_name() {
    let model = person();
    let walk = walk(&model);
    let poses = walk.poses.len();
    let folder = tempfile::tempdir().unwrap();
    let trans = || real("trans", &[poses, 3], &walk.translations.concat());
    let refused = |members: &[Stored]| {
        let error = read_motion(&npz(folder.path(), members), &model, &BvhConfig::default()).unwrap_err();
        let message = error.to_string().split_once(": ").unwrap().1.to_string();
        (message, error.hint().unwrap_or_default())
    };
    let (message, hint) = refused(&[real("poses", &[poses, 69], &columns(&walk, 1..24)), trans()]);
    assert_eq!(message, "`poses` is 69 columns, the 23 joints of SMPL without the root, expected a root orientation beside them");
    assert!(hint.contains("global_orient"), "{hint}");
    let (message, hint) = refused(&[trans()]);
    assert_eq!(message, "`poses` is missing, expected real numbers [pose, 3 per joint]");
    assert!(hint.contains("smpl_thetas") && hint.ends_with("the file holds: trans"), "{hint}");
    let (_, hint) = refused(&[real("poses", &[2, 24, 4], &[0.5; 192]), trans()]);
    assert!(hint.contains("quaternions"), "{hint}");
    let (_, hint) = refused(&[real("poses", &[2, 3, 72], &[0.5; 432]), trans()]);
    assert!(hint.contains("several persons"), "{hint}");
    let (message, _) = refused(&[real("poses", &[1, 24, 3, 3], &[0.5; 216]), real("trans", &[1, 3], &[0.0; 3])]);
    assert!(message.contains("no rotation at pose 0"), "{message}");
    let far: Vec<f64> = (0..3 * poses).map(|index| (index * index) as f64 * 1e6).collect();
    let (message, hint) = refused(&[real("poses", &[poses, 72], &columns(&walk, 0..24)), real("trans", &[poses, 3], &far)]);
    assert!(message.contains("expected metres, at most 12.4 m/s") && hint.contains("scale_m"), "{message}");
}

#[test]
fn whoever_has_no_place_stands_on_the_floor() {
    let model = person();
    let walk = walk(&model);
    let poses = walk.poses.len();
    let folder = tempfile::tempdir().unwrap();
    let members = [
        real("pose", &[poses, 72], &columns(&walk, 0..24)),
        real("betas", &[poses, 10], &vec![0.0; 10 * poses]),
        real("orig_cam", &[poses, 4], &vec![1.0; 4 * poses]),
    ];
    let (found, notes) = read_motion(&npz(folder.path(), &members), &model, &BvhConfig::default()).unwrap();
    assert!(notes.iter().any(|note| note.contains("`orig_cam` is a place in a picture")), "{notes:?}");
    assert!(notes.iter().any(|note| note.contains("stays in one place")), "{notes:?}");
    let height = found.translations[0][1] + model.rest_joints(&found.betas)[0][1];
    assert!((0.8..1.1).contains(&height) && found.translations.iter().all(|place| *place == found.translations[0]), "{height}");
}
