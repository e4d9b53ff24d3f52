//! Motion files as people have them: the same walk in every form comes out as the same walk.

use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};

use super::bvh::Bvh;
use super::written::{self, JOINTS, Style};
use super::{BvhConfig, read_bvh_motion, read_motion, retarget};
use crate::data::UpAxis;
use crate::person::actions::{self, Action, StyleConfig};
use crate::person::{BodyModel, JOINT_NAMES, Motion, procedural};
use crate::support::shared;

type Point = Vector3<f64>;
type Turn = UnitQuaternion<f64>;

fn person() -> BodyModel {
    procedural::person(&procedural::PersonConfig { edge_m: 0.032, ..Default::default() }).unwrap()
}

fn walk(model: &BodyModel) -> Motion {
    actions::motion(Action::WalkBackForthArmswing, &StyleConfig::default(), model, &[], 3.0, 60.0).unwrap()
}

/// `[pose][joint]`: how every joint is turned in space.
fn turns(model: &BodyModel, motion: &Motion) -> Vec<Vec<Turn>> {
    let pose = |pose: &Vec<[f64; 3]>| {
        let mut turns: Vec<Turn> = Vec::new();
        for (parent, turn) in model.parents.iter().zip(pose).take(JOINTS) {
            let own = UnitQuaternion::new(Point::from(*turn));
            turns.push(parent.map_or(own, |parent| turns[parent] * own));
        }
        turns
    };
    motion.poses.iter().map(pose).collect()
}

/// The largest angle in degrees between the directions of a bone, and between the whole turns of its joint, with its name.
fn apart(model: &BodyModel, found: &Motion, wanted: &Motion) -> (f64, f64, String) {
    assert_eq!(found.poses.len(), wanted.poses.len());
    let rest: Vec<Point> = model.rest_joints(&wanted.betas).into_iter().map(Point::from).collect();
    let (found, wanted) = (turns(model, found), turns(model, wanted));
    let mut worst = (0.0, 0.0, String::new());
    for joint in 1..JOINTS {
        let parent = model.parents[joint].unwrap();
        let bone = rest[joint] - rest[parent];
        let angle = |(a, b): (&Vec<Turn>, &Vec<Turn>)| (a[parent] * bone).angle(&(b[parent] * bone)).to_degrees();
        let direction = found.iter().zip(&wanted).map(angle).fold(0.0, f64::max);
        let angle = |(a, b): (&Vec<Turn>, &Vec<Turn>)| a[joint].angle_to(&b[joint]).to_degrees();
        let turn = found.iter().zip(&wanted).map(angle).fold(0.0, f64::max);
        if direction > 0.1 || turn > 0.1 {
            println!("{:>16}: bone {direction:.3}, turn {turn:.3}", JOINT_NAMES[joint]);
        }
        if direction > worst.0 {
            worst.0 = direction;
            worst.2 = JOINT_NAMES[joint].into();
        }
        worst.1 = f64::max(worst.1, turn);
    }
    worst
}

#[test]
fn the_axes_of_bones_make_no_difference() {
    let model = person();
    let walk = walk(&model);
    let about_x = |degrees: f64| UnitQuaternion::from_axis_angle(&Point::x_axis(), f64::to_radians(degrees));
    let xsens = |joint: usize| {
        let [left, right] = ["Left", "Right"].map(|side| move |part: &str| format!("{side}{part}"));
        match joint {
            0 => "Hips".into(),
            3 => "Chest".into(),
            6 => "Chest2".into(),
            9 => "Chest3".into(),
            12 => "Neck".into(),
            15 => "Head".into(),
            _ => {
                let parts = ["Hip", "Knee", "Ankle", "Toe", "Collar", "Shoulder", "Elbow", "Wrist"];
                let place = [1, 4, 7, 10, 13, 16, 18, 20].iter().position(|first| joint == *first || joint == first + 1);
                let name = parts[place.unwrap()];
                let right_side = [2, 5, 8, 11, 14, 17, 19, 21].contains(&joint);
                if right_side { right(name) } else { left(name) }
            }
        }
    };
    let mut plantar = vec![Turn::identity(); JOINTS];
    // Feet that point straight down with all rotations zero.
    for joint in [7, 8, 10, 11] {
        plantar[joint] = about_x(-72.0);
    }
    let bones = written::along_bones(&model, &[]);
    // Largest difference in degrees of bones, and of whole turns. Of a walk without T-pose: what its average is not as at
    // rest (arms that hang pull the collars down) is not known.
    let kinds: Vec<(&str, Style, f64, f64, &str)> = vec![
        ("as SMPL", Style::default(), 1e-4, 1e-4, "as SMPL has them"),
        ("rest z up, world y up", Style { axes: vec![about_x(-90.0); JOINTS], ..Style::default() }, 1e-4, 1e-4, "up axis: y"),
        (
            "z up",
            Style { world: about_x(90.0), axes: vec![about_x(-90.0); JOINTS], ..Style::default() },
            1e-4,
            1e-4,
            "up axis: z",
        ),
        ("camera", Style { world: about_x(180.0), ..Style::default() }, 1e-4, 1e-4, "up axis: -y"),
        ("Xsens", Style { name: &xsens, positions: true, unit_m: 0.0254, ..Style::default() }, 1e-4, 1e-4, "units: inches"),
        ("feet down", Style { axes: plantar, ..Style::default() }, 2.5, 2.5, "left_ankle, right_ankle"),
        ("along bones", Style { axes: bones.clone(), ..Style::default() }, 8.0, 11.0, "nobody stands in it"),
        ("along bones, z up", Style { axes: bones, world: about_x(90.0), ..Style::default() }, 8.0, 11.0, "nobody stands in it"),
    ];
    for (kind, style, bone, turn, wanted) in kinds {
        let text = written::bvh(&model, &walk, &style);
        let (found, notes) = retarget(&Bvh::parse(&text).unwrap(), &model, &BvhConfig::default()).unwrap();
        println!("{kind}: {notes:#?}");
        assert!(notes.iter().any(|note| note.contains(wanted)), "{kind}: {notes:?}");
        let apart = apart(&model, &found, &walk);
        println!("{kind}: {apart:?}");
        assert!(apart.0 < bone && apart.1 < turn, "{kind}: {apart:?}");
        // The bones that a motion is made of point exactly where the file's do.
        for (joint, end) in super::neutral::LIMBS {
            let rest: Vec<Point> = model.rest_joints(&[]).into_iter().map(Point::from).collect();
            let (found, wanted) = (turns(&model, &found), turns(&model, &walk));
            let bone = rest[end] - rest[joint];
            let angle = |(a, b): (&Vec<Turn>, &Vec<Turn>)| (a[joint] * bone).angle(&(b[joint] * bone)).to_degrees();
            let most = found.iter().zip(&wanted).map(angle).fold(0.0, f64::max);
            assert!(most < 0.01, "{kind}: {} is off by {most} degrees", JOINT_NAMES[joint]);
        }
    }
}

/// The file's own numbers near no turn and near half a turn make no numbers that are none.
#[test]
fn no_turn_and_half_a_turn_are_exact() {
    let model = person();
    let mut walk = walk(&model);
    walk.poses.truncate(61);
    walk.translations.truncate(61);
    for (joint, axis) in
        [(7, [1e-8, -1e-8, 5e-9]), (18, [0.0, 0.0, std::f64::consts::PI]), (19, [std::f64::consts::PI, 0.0, 0.0])]
    {
        walk.poses.iter_mut().for_each(|pose| pose[joint] = axis);
        let text = written::bvh(&model, &walk, &Style::default());
        let (found, _) = retarget(&Bvh::parse(&text).unwrap(), &model, &BvhConfig::default()).unwrap();
        let apart = apart(&model, &found, &walk);
        assert!(apart.0 < 1e-4 && apart.1 < 1e-4, "{}: {apart:?}", JOINT_NAMES[joint]);
    }
}

#[test]
fn what_is_assumed_is_said() {
    let model = person();
    let mut walk = walk(&model);
    walk.poses.truncate(40);
    walk.translations.truncate(40);
    let read = |style: &Style, config: &BvhConfig| {
        retarget(&Bvh::parse(&written::bvh(&model, &walk, style)).unwrap(), &model, config).unwrap()
    };
    let said = |notes: &[String], what: &str| notes.iter().any(|note| note.contains(what));
    for (time, likely) in [("0.033", "30 Hz"), ("0.0083", "120 Hz"), ("0.04", ""), ("0.0166667", ""), ("0.03", "30 Hz")] {
        let (_, notes) = read(&Style { frame_time: time.into(), ..Style::default() }, &BvhConfig::default());
        assert_eq!(said(&notes, "is likely"), !likely.is_empty(), "{time}: {notes:?}");
        assert!(said(&notes, likely), "{time}: {notes:?}");
    }
    // A body whose legs are a tenth longer walks a tenth faster.
    let scaled = |share: f64| {
        let mut model = model.clone();
        model.template.iter_mut().flatten().for_each(|value| *value *= share);
        model
    };
    let text = written::bvh(&model, &walk, &Style::default());
    let (tall, notes) = retarget(&Bvh::parse(&text).unwrap(), &scaled(1.1), &BvhConfig::default()).unwrap();
    assert!(said(&notes, "fit_legs makes the path 1.100 times as long"), "{notes:?}");
    let kept = BvhConfig { fit_legs: false, ..BvhConfig::default() };
    let (short, notes) = retarget(&Bvh::parse(&text).unwrap(), &scaled(1.1), &kept).unwrap();
    assert!(!said(&notes, "fit_legs makes"), "{notes:?}");
    let step = |motion: &Motion| (Point::from(motion.translations[39]) - Point::from(motion.translations[0])).norm();
    assert!((step(&tall) / step(&short) - 1.1).abs() < 0.02, "{} and {}", step(&tall), step(&short));
}

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

fn half_bytes(value: f64) -> [u8; 2] {
    half::f16::from_f64(value).to_le_bytes()
}

#[test]
fn every_way_to_write_npz_gives_the_same_walk() {
    let model = person();
    let mut walk = walk(&model);
    walk.betas = vec![0.0; model.shape_directions.len()];
    let (poses, betas) = (walk.poses.len(), walk.betas.len());
    assert!(walk.poses.iter().all(|pose| pose[22..] == [[0.0; 3]; 2]), "the hands rest");
    let about_x = |degrees: f64| UnitQuaternion::from_axis_angle(&Point::x_axis(), f64::to_radians(degrees));
    let all = || columns(&walk, 0..24);
    let pose = || real("poses", &[poses, 72], &all());
    let places = walk.translations.concat();
    let trans = || real("trans", &[poses, 3], &places);
    let shape = || real("betas", &[betas], &walk.betas);
    let rate = || real("mocap_framerate", &[], &[60.0]);
    let other = |degrees: f64| {
        let other = turned(&model, &walk, about_x(degrees));
        vec![
            real("poses", &[poses, 72], &columns(&other, 0..24)),
            real("trans", &[poses, 3], &other.translations.concat()),
            shape(),
            rate(),
        ]
    };
    let scaled = |values: &[f64], scale: f64| values.iter().map(|value| value * scale).collect::<Vec<_>>();
    let matrices: Vec<f64> = all()
        .chunks(3)
        .flat_map(|angles| {
            let turn = UnitQuaternion::new(Point::new(angles[0], angles[1], angles[2])).to_rotation_matrix();
            turn.matrix().transpose().as_slice().to_vec()
        })
        .collect();
    let fortran: Vec<f64> = (0..72).flat_map(|column| all().chunks(72).map(|pose| pose[column]).collect::<Vec<_>>()).collect();
    let stored = |descr, fortran, values: Vec<f64>, bytes: &dyn Fn(f64) -> Vec<u8>| Stored {
        name: "poses",
        descr,
        fortran,
        shape: vec![poses, 72],
        bytes: values.into_iter().flat_map(bytes).collect(),
    };
    let body = || columns(&walk, 0..22);
    let forms: Vec<(&str, Vec<Stored>, &str)> = vec![
        ("AMASS", vec![pose(), trans(), shape(), rate()], "up axis: y"),
        ("three axes", vec![real("poses", &[poses, 24, 3], &all()), trans(), shape(), rate()], "units: metres"),
        ("one person", vec![real("poses", &[1, poses, 72], &all()), real("trans", &[1, poses, 3], &places), shape(), rate()], ""),
        ("transl", vec![pose(), real("transl", &[poses, 3], &places), shape(), real("fps", &[1], &[60.0])], "60 Hz (`fps`)"),
        ("matrices", vec![real("poses", &[poses, 24, 3, 3], &matrices), trans(), shape(), rate()], "matrices"),
        (
            "smplx",
            vec![
                real("global_orient", &[poses, 1, 3], &columns(&walk, 0..1)),
                real("body_pose", &[poses, 23, 3], &columns(&walk, 1..24)),
                real("transl", &[poses, 3], &places),
                shape(),
                rate(),
            ],
            "from `body_pose` and `global_orient`",
        ),
        (
            "AMASS in parts",
            vec![
                real("root_orient", &[poses, 3], &columns(&walk, 0..1)),
                real("pose_body", &[poses, 63], &columns(&walk, 1..22)),
                real("pose_hand", &[poses, 90], &bent(poses, 30)),
                trans(),
                shape(),
                rate(),
            ],
            "by name",
        ),
        (
            "SMPL-H",
            vec![real("poses", &[poses, 156], &beside(poses, &[body(), bent(poses, 30)])), trans(), shape(), rate()],
            "52 of SMPL-H",
        ),
        (
            "SMPL-X",
            vec![real("poses", &[poses, 165], &beside(poses, &[body(), bent(poses, 33)])), trans(), shape(), rate()],
            "55 of SMPL-X",
        ),
        ("z up", other(90.0), "up axis: z"),
        ("a camera's", other(180.0), "up axis: -y"),
        ("centimetres", vec![pose(), real("trans", &[poses, 3], &scaled(&places, 100.0)), shape(), rate()], "units: centimetres"),
        ("millimetres", vec![pose(), real("trans", &[poses, 3], &scaled(&places, 1e3)), shape(), rate()], "units: millimetres"),
        (
            "degrees",
            vec![real("poses", &[poses, 72], &scaled(&all(), 1_f64.to_degrees())), trans(), shape(), rate()],
            "angles: degrees",
        ),
        ("betas [1, B]", vec![pose(), trans(), real("betas", &[1, betas], &walk.betas), rate()], ""),
        (
            "betas [T, B]",
            vec![pose(), trans(), real("betas", &[poses, betas], &walk.betas.repeat(poses)), rate()],
            "a shape for each",
        ),
        ("float16", vec![stored("<f2", false, all(), &|value| half_bytes(value).to_vec()), trans(), shape(), rate()], ""),
        ("big endian", vec![stored(">f8", false, all(), &|value| value.to_be_bytes().to_vec()), trans(), shape(), rate()], ""),
        (
            "Fortran order",
            vec![stored("<f8", true, fortran, &|value| value.to_le_bytes().to_vec()), trans(), shape(), rate()],
            "",
        ),
        (
            "ROMP",
            vec![
                real("smpl_thetas", &[poses, 72], &all()),
                real("cam_trans", &[poses, 3], &places),
                real("smpl_betas", &[betas], &walk.betas),
            ],
            "30 Hz is assumed",
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (form, members, wanted) in forms {
        let (found, notes) = read_motion(&npz(folder.path(), &members), &model, &BvhConfig::default()).unwrap();
        assert!(notes.iter().any(|note| note.contains(wanted)), "{form}: {notes:?}");
        same(form, &model, &found, &walk);
        assert_eq!(found.rate_hz, if form == "ROMP" { 30.0 } else { 60.0 }, "{form}");
    }
}

/// Equal turns and places, up to the precision of float16.
fn same(form: &str, model: &BodyModel, found: &Motion, wanted: &Motion) {
    let (_, angle, joint) = apart(model, found, wanted);
    assert!(angle < 0.2, "{form}: {joint} is {angle} degrees off");
    assert_eq!(found.betas, wanted.betas, "{form}");
    for (found, wanted) in found.translations.iter().zip(&wanted.translations) {
        assert!((Point::from(*found) - Point::from(*wanted)).norm() < 1e-6, "{form}: {found:?}, expected {wanted:?}");
    }
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

/// Every file of `../shared/fixtures/tried`, as its README says.
#[test]
fn every_tried_file_comes_out_right() {
    let Some(folder) = shared("fixtures/tried") else { return };
    let model = person();
    let read = |name: &str| read_motion(&folder.join(name), &model, &BvhConfig::default());
    let noted = |name: &str, notes: &[String], wanted: &[&str]| {
        for wanted in wanted {
            assert!(notes.iter().any(|note| note.contains(wanted)), "{name}: no `{wanted}` in {notes:#?}");
        }
    };
    let first = |motion: &Motion, poses: usize| {
        let mut motion = motion.clone();
        motion.poses.truncate(poses);
        motion.translations.truncate(poses);
        motion
    };

    // The same walk, as the reference has it.
    let (reference, _) = read("bvh/00-reference-t-pose.bvh").unwrap();
    let cases: [(&str, &[&str]); 5] = [
        ("10-biped-names", &["as 3ds Max Biped has them", "units: centimetres"]),
        ("11-mixamorig1-prefix", &["Mixamo"]),
        ("12-mixamorig-underscore", &["Mixamo"]),
        ("140-rest-zup-world-yup", &["up axis: y (from the feet to the head, where z was expected)"]),
        ("147-frame-time-0.033", &["30 Hz is likely"]),
    ];
    for (name, wanted) in cases {
        let (found, notes) = read(&format!("bvh/{name}.bvh")).unwrap();
        noted(name, &notes, wanted);
        let apart = apart(&model, &found, &reference);
        assert!(apart.0 < 1.0 && apart.1 < 1.0, "{name}: {apart:?}");
    }
    // Half the walk with one joint turned by next to nothing or by half a turn.
    for (name, joints) in [("14-ankle-turned-1e-6-deg", [7, 8].as_slice()), ("14-arm-turned-180-deg", &[16, 18, 20])] {
        let (found, _) = read(&format!("bvh/{name}.bvh")).unwrap();
        let (found, reference) = (turns(&model, &found), turns(&model, &first(&reference, found.poses.len())));
        for joint in (0..JOINTS).filter(|joint| !joints.contains(joint) && !joints.contains(&model.parents[*joint].unwrap_or(0)))
        {
            let angle = |(a, b): (&Vec<Turn>, &Vec<Turn>)| a[joint].angle_to(&b[joint]).to_degrees();
            let most = found.iter().zip(&reference).map(angle).fold(0.0, f64::max);
            assert!(most < 1.0, "{name}: {} is off by {most}", JOINT_NAMES[joint]);
        }
    }
    // Walks of their own, whose joints swing about a T-pose: limbs point as in the file, and without a T-pose in the file
    // all are on average at rest.
    for name in ["05-xsens-names-allpos-zup", "06-lafan-local-x", "07-lafan-local-x-names-smpl"] {
        let path = folder.join(format!("bvh/{name}.bvh"));
        let (bvh, config) = (Bvh::read(&path).unwrap(), BvhConfig::default());
        let (found, notes) = read_bvh_motion(&path, &model, &config).unwrap();
        println!("{name}: {notes:#?}");
        let assigned = super::joints::assign(&bvh, &config).unwrap().joints;
        let up = if name.starts_with("05") { UpAxis::Z } else { UpAxis::Y };
        let rest: Vec<Point> = model.rest_joints(&[]).into_iter().map(Point::from).collect();
        let found = turns(&model, &found);
        for (joint, end) in super::neutral::LIMBS {
            for (frame, turns) in found.iter().enumerate() {
                let places = bvh.pose(frame).places;
                let file = up.to_y() * (places[assigned[end].unwrap()] - places[assigned[joint].unwrap()]);
                let angle = (turns[joint] * (rest[end] - rest[joint])).angle(&file).to_degrees();
                assert!(angle < 1.0, "{name}: {} is off by {angle} degrees in frame {frame}", JOINT_NAMES[joint]);
            }
        }
        // 05 has a T-pose, from which nothing is averaged.
        for joint in (1..JOINTS).filter(|_| !name.starts_with("05")) {
            let parent = model.parents[joint].unwrap();
            let local = |turns: &Vec<Turn>| (turns[parent].inverse() * turns[joint]).scaled_axis();
            let mean = found.iter().map(local).sum::<Point>() / found.len() as f64;
            // Limbs also turn by what the two skeletons differ; only their twist is at rest.
            let limb = super::neutral::LIMBS.iter().find(|(start, _)| *start == joint);
            let twist = limb.map(|&(start, end)| mean.dot(&(rest[end] - rest[start]).normalize()).abs());
            let degrees = twist.unwrap_or(mean.norm()).to_degrees();
            println!("{:>16}: {degrees:.2} degrees from rest on average", JOINT_NAMES[joint]);
            assert!(degrees < 3.0, "{name}: {} is on average {degrees} degrees from rest", JOINT_NAMES[joint]);
        }
    }

    // Captured and made by others, with rest poses in which somebody stands.
    for name in ["cmu/01_01", "cmu/02_01", "cmu/02_10", "procedural/arm_swing_s1", "procedural/walk_back_forth_armswing_s1"] {
        let (_, notes) = read(&format!("../../motions/{name}.bvh")).unwrap();
        noted(name, &notes, &["up axis: y (from the feet to the head)", "frame rate"]);
        assert!(!notes.iter().any(|note| note.contains("rest pose")), "{name}: {notes:#?}");
    }

    let (walk, _) = read("motions/31-betas-1x10.npz").unwrap();
    let cases: [(&str, &[&str]); 13] = [
        ("20-smplh-hands", &["52 of SMPL-H"]),
        ("21-smplx-jaw", &["55 of SMPL-X"]),
        ("22-zup-without-up", &["up axis: z"]),
        ("23-poses-3d", &[]),
        ("24-transl-key", &[]),
        ("25-romp-keys", &["30 Hz is assumed"]),
        ("26-root_orient-pose_body", &["by name"]),
        ("28-float16", &[]),
        ("31-betas-1x10", &["up axis: y", "units: metres", "angles: radians", "frame rate: 60 Hz"]),
        ("32-betas-Tx10", &["a shape for each of 121 poses"]),
        ("35-trans-cm", &["units: centimetres"]),
        ("36-camera-y-down", &["up axis: -y"]),
        ("39-degrees", &["angles: degrees"]),
    ];
    for (name, wanted) in cases {
        let (found, notes) = read(&format!("motions/{name}.npz")).unwrap();
        noted(name, &notes, wanted);
        same(name, &model, &found, &walk);
    }
    let error = read("motions/40-69-columns-no-root.npz").unwrap_err().to_string();
    assert!(error.contains("the 23 joints of SMPL without the root"), "{error}");
}
