use std::collections::BTreeMap;

use nalgebra::Rotation3;

use super::neutral::LIMBS;
use super::*;
use crate::person::procedural;
use crate::support::shared;

fn person() -> BodyModel {
    procedural::person(&procedural::PersonConfig { edge_m: 0.032, ..Default::default() }).unwrap()
}

/// Places of the joints, `[pose][joint]`.
fn joints(model: &BodyModel, motion: &Motion) -> Vec<Vec<Point>> {
    let rest: Vec<Point> = model.rest_joints(&motion.betas).into_iter().map(Point::from).collect();
    let every = motion.poses.iter().zip(&motion.translations);
    every
        .map(|(pose, translation)| {
            let (mut turns, mut places): (Vec<Rotation3<f64>>, Vec<Point>) = (Vec::new(), Vec::new());
            for (joint, rotation) in pose.iter().enumerate() {
                let local = Rotation3::new(Point::from(*rotation));
                let (turn, place) = match model.parents[joint] {
                    Some(parent) => (turns[parent] * local, places[parent] + turns[parent] * (rest[joint] - rest[parent])),
                    None => (local, rest[0] + Point::from(*translation)),
                };
                turns.push(turn);
                places.push(place);
            }
            places
        })
        .collect()
}

fn twin(path: &Path) -> Motion {
    let (motion, _) = crate::data::read_motion(path, 24, 0).unwrap();
    motion
}

/// Joints of a body in SMPL layout.
fn smpl(path: &Path) -> BodyModel {
    let model = crate::data::read_body(path).unwrap();
    BodyModel { shape_directions: Vec::new(), ..model }
}

/// Bones whose direction a motion decides.
const BONES: [(usize, usize); 9] = [(1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21), (1, 2)];

/// Largest angle in degrees, over all poses, between the directions from one joint to another.
fn largest_angle(found: &[Vec<Point>], wanted: &[Vec<Point>], (from, to): (usize, usize)) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let angle = |(a, b): (&Vec<Point>, &Vec<Point>)| (a[to] - a[from]).angle(&(b[to] - b[from])).to_degrees();
    let angles: Vec<f64> = found.iter().zip(wanted).map(angle).collect();
    assert!(angles.iter().all(|angle| angle.is_finite()));
    angles.into_iter().fold(0.0, f64::max)
}

#[test]
fn every_limb_points_where_the_file_says_on_any_body() {
    let model = person();
    for name in ["cmu/01_01", "cmu/02_01", "cmu/02_10", "procedural/arm_swing_s1", "procedural/walk_back_forth_armswing_s1"] {
        let Some(path) = shared(&format!("motions/{name}.bvh")) else { return };
        let bvh = Bvh::read(&path).unwrap();
        let config = BvhConfig::default();
        let assigned = joints::assign(&bvh, &config).unwrap().joints;
        let found = joints(&model, &retarget(&bvh, &model, &config).unwrap().0);
        let place = |frame: usize| -> Vec<Point> {
            let pose = bvh.pose(frame);
            assigned.iter().map(|found| found.map_or(Point::zeros(), |found| pose.places[found])).collect()
        };
        let wanted: Vec<Vec<Point>> = (0..bvh.frames.len()).map(place).collect();
        for bone in LIMBS {
            let angle = largest_angle(&found, &wanted, bone);
            assert!(angle < 0.01, "{name}: {} is off by {angle} degrees", JOINT_NAMES[bone.1]);
        }
    }
}

#[test]
fn retargeting_agrees_with_twins_that_others_made() {
    // Measured: limbs 0.3 degrees, feet 0.2 (same skeleton) and 4.1 degrees (CMU: the twin keeps the sole level, we keep
    // its angle to the shank). Heads of CMU are left out: their twins follow the upper of two neck joints, we the line
    // through both. Paths: 1 cm for CMU; for the procedural walk 1 % of its length, the ratio of the legs of this body to
    // those of the one it was made for.
    for (name, limb, foot, apart_m, path_m) in [
        ("cmu/02_01", 0.01, 4.2, 0.013, 0.011),
        ("cmu/02_02", 0.01, 4.2, 0.013, 0.011),
        ("procedural/arm_swing_s1", 0.3, 0.2, 0.004, 0.001),
        ("procedural/walk_back_forth_armswing_s1", 0.3, 0.2, 0.004, 0.017),
    ] {
        let cmu = name.starts_with("cmu");
        let npz = if cmu { format!("motions/{name}_smpl24.npz") } else { format!("motions/{name}.npz") };
        let (Some(body), Some(bvh), Some(npz)) =
            (shared("bodies/male_lite.npz"), shared(&format!("motions/{name}.bvh")), shared(&npz))
        else {
            return;
        };
        let model = smpl(&body);
        let motion = read_bvh_motion(&bvh, &model, &BvhConfig::default()).unwrap().0;
        let twin = twin(&npz);
        let step = motion.rate_hz / twin.rate_hz;
        assert_eq!(step, if cmu { 2.0 } else { 1.0 });
        let found: Vec<Vec<Point>> = joints(&model, &motion).into_iter().step_by(step as usize).collect();
        let wanted = joints(&model, &twin);
        for bone in BONES {
            let angle = largest_angle(&found, &wanted, bone);
            assert!(angle < limb, "{name}: {} is off by {angle} degrees", JOINT_NAMES[bone.1]);
        }
        for bone in [(7, 10), (8, 11)] {
            let angle = largest_angle(&found, &wanted, bone);
            assert!(angle < foot, "{name}: {} is off by {angle} degrees", JOINT_NAMES[bone.1]);
        }
        for joint in (0..24).filter(|&joint| !(cmu && joint == 15)) {
            let apart = |(a, b): (&Vec<Point>, &Vec<Point>)| ((a[joint] - a[0]) - (b[joint] - b[0])).norm();
            let most = found.iter().zip(&wanted).map(apart).fold(0.0, f64::max);
            assert!(most < apart_m, "{name}: {} is {most} m apart", JOINT_NAMES[joint]);
        }
        // The paths agree up to where in the pelvis the joint is taken to be, which turns with the pelvis.
        let turned = |pose: usize| Rotation3::new(Point::from(twin.poses[pose][0])).inverse();
        let offsets: Vec<Point> = (0..found.len()).map(|pose| turned(pose) * (found[pose][0] - wanted[pose][0])).collect();
        let mean = offsets.iter().sum::<Point>() / offsets.len() as f64;
        let spread = offsets.iter().map(|offset| (offset - mean).norm()).fold(0.0, f64::max);
        assert!(spread < path_m, "{name}: the paths differ by {spread} m");
    }
}

/// A small skeleton that raises its left arm and walks, in its own axes, unit and names.
fn skeleton(z_up: bool, unit: f64, names: [&str; 4]) -> String {
    let vector = |[x, y, z]: [f64; 3]| {
        let [x, y, z] = if z_up { [x, -z, y] } else { [x, y, z] }.map(|value| value / unit);
        format!("{x} {y} {z}")
    };
    let [hips, up_leg, leg, fore_arm] = names;
    let mut text = format!("HIERARCHY\nROOT {hips}\n{{\nOFFSET 0 0 0\n");
    text += "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n";
    let mut chain = |joints: &[(String, [f64; 3])]| {
        for (name, offset) in joints {
            text += &format!("JOINT {name}\n{{\nOFFSET {}\nCHANNELS 3 Zrotation Yrotation Xrotation\n", vector(*offset));
        }
        text += &"}\n".repeat(joints.len());
    };
    for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
        chain(&[
            (format!("{side}{up_leg}"), [0.1 * sign, 0.0, 0.0]),
            (format!("{side}{leg}"), [0.0, -0.45, 0.0]),
            (format!("{side}Foot"), [0.0, -0.42, 0.0]),
        ]);
        chain(&[
            (format!("{side}Arm"), [0.2 * sign, 0.5, 0.0]),
            (format!("{side}{fore_arm}"), [0.3 * sign, 0.0, 0.0]),
            (format!("{side}Hand"), [0.25 * sign, 0.0, 0.0]),
        ]);
    }
    chain(&[("Neck".into(), [0.0, 0.55, 0.0])]);
    // The left arm is the fourth joint after the root: 90 degrees about the axis that points ahead lift it overhead.
    let lifted = if z_up { "0 -90 0" } else { "90 0 0" };
    let rest = |count: usize| "0 0 0 ".repeat(count);
    text += "}\nMOTION\nFrames: 2\nFrame Time: 0.02\n";
    text += &format!("{} 0 0 0 {}\n", vector([0.0, 0.9, 0.0]), rest(13));
    text + &format!("{} 0 0 0 {}{lifted} {}\n", vector([0.0, 0.9, 0.5]), rest(3), rest(9))
}

const NAMES: [&str; 4] = ["Hips", "UpLeg", "Leg", "ForeArm"];

#[test]
fn axes_units_and_namespaces_make_no_difference() {
    let model = person();
    let read = |text: &str, config: &BvhConfig| retarget(&Bvh::parse(text).unwrap(), &model, config).unwrap().0;
    let plain = read(&skeleton(false, 1.0, NAMES), &BvhConfig::default());
    assert_eq!(plain.rate_hz, 50.0);
    let placed = joints(&model, &plain);
    assert!((placed[1][20] - placed[1][16]).normalize().y > 0.999, "the left arm is up: {:?}", placed[1][20] - placed[1][16]);
    assert!((placed[1][21] - placed[1][17]).normalize().x < -0.999, "the right arm is still");

    let close = |other: &Motion| {
        for (a, b) in placed.iter().flatten().zip(joints(&model, other).iter().flatten()) {
            assert!((a - b).norm() < 1e-9, "{a} and {b}");
        }
    };
    close(&read(&skeleton(true, 1.0, NAMES), &BvhConfig::default()));
    for (unit, _) in UNITS_M {
        close(&read(&skeleton(false, unit, NAMES), &BvhConfig::default()));
        let kept = read(&skeleton(true, unit, NAMES), &BvhConfig { fit_legs: false, ..Default::default() });
        let step = Point::from(kept.translations[1]) - Point::from(kept.translations[0]);
        assert!((step - Point::new(0.0, 0.0, 0.5)).norm() < 1e-9, "{step}");
    }
    close(&read(&skeleton(false, 0.01, NAMES).replace("JOINT ", "JOINT mixamorig:"), &BvhConfig::default()));
}

#[test]
fn other_names_come_through_a_map() {
    let model = person();
    let foreign = Bvh::parse(&skeleton(false, 1.0, ["Becken", "Schenkel", "Leg", "Elle"])).unwrap();
    let message = |error: Error| (error.to_string(), error.hint().unwrap_or_default());
    let (found, hint) = message(retarget(&foreign, &model, &BvhConfig::default()).unwrap_err());
    assert_eq!(found, ": `pelvis, left_hip, right_hip, left_elbow, right_elbow` is missing, expected a joint for each of them");
    assert!(hint.contains("joint_map") && hint.contains("LeftSchenkel"), "{hint}");

    let pairs = [
        ("pelvis", "Becken"),
        ("left_hip", "LeftSchenkel"),
        ("right_hip", "RightSchenkel"),
        ("left_elbow", "LeftElle"),
        ("right_elbow", "RightElle"),
    ];
    let map = |pairs: &[(&str, &str)]| -> BvhConfig {
        let joint_map: BTreeMap<String, String> = pairs.iter().map(|(to, from)| (to.to_string(), from.to_string())).collect();
        BvhConfig { joint_map, ..Default::default() }
    };
    let plain = retarget(&Bvh::parse(&skeleton(false, 1.0, NAMES)).unwrap(), &model, &BvhConfig::default()).unwrap().0;
    assert_eq!(retarget(&foreign, &model, &map(&pairs)).unwrap().0, plain);

    let (found, hint) = message(retarget(&foreign, &model, &map(&[("left_elbow", "LeftEle")])).unwrap_err());
    assert_eq!(found, ": `joint_map.left_elbow` is `LeftEle`, expected the name of a joint in this file");
    assert!(hint.starts_with("the nearest name is `LeftElle`"), "{hint}");
    let (found, _) = message(retarget(&foreign, &model, &map(&[("elbow", "LeftElle")])).unwrap_err());
    assert!(found.starts_with("`joint_map.elbow` is LeftElle, expected a joint of the body on the left: pelvis,"), "{found}");
}

#[test]
fn settings_that_cannot_work_are_refused() {
    let model = person();
    let bvh = Bvh::parse(&skeleton(false, 1.0, NAMES)).unwrap();
    let refused = |config: BvhConfig| retarget(&bvh, &model, &config).unwrap_err().to_string();
    let plain = BvhConfig::default;
    assert_eq!(
        refused(BvhConfig { scale_m: Some(0.0), ..plain() }),
        "`scale_m` is 0, expected metres per unit of the file, above zero"
    );
    assert_eq!(
        refused(BvhConfig { frame_rate_hz: Some(f64::NAN), ..plain() }),
        "`frame_rate_hz` is NaN, expected frames per second above zero"
    );
    assert_eq!(
        refused(BvhConfig { skip_frames: 2, ..plain() }),
        "`skip_frames` is 2, expected fewer than the 2 frames of the file"
    );
    let odd = Bvh::parse(&skeleton(false, 0.2, NAMES)).unwrap();
    assert_eq!(
        retarget(&odd, &model, &plain()).unwrap_err().to_string(),
        ": `length of the legs` is 4.3500 units, expected a person's in metres, centimetres, millimetres, inches or CMU units"
    );
    let scaled = retarget(&odd, &model, &BvhConfig { scale_m: Some(0.2), ..plain() }).unwrap().0;
    assert!((scaled.translations[1][2] - scaled.translations[0][2] - 0.5).abs() < 1e-9);
    let flat = Bvh::parse(
        &skeleton(false, 1.0, NAMES).replace("OFFSET 0.1 0 0", "OFFSET 0 0 0").replace("OFFSET -0.1 0 0", "OFFSET 0 0 0"),
    )
    .unwrap();
    assert!(
        retarget(&flat, &model, &plain()).unwrap_err().to_string().contains("expected hips side by side and a neck above them")
    );
}

#[test]
fn a_person_turned_aside_at_rest_still_faces_ahead_of_the_body() {
    // The same skeleton built facing +x: the pose is the body's rest pose, turned.
    let model = person();
    let turned = skeleton(false, 1.0, NAMES);
    let turned = turned.replace("OFFSET 0.1 0 0", "OFFSET 0 0 -0.1").replace("OFFSET -0.1 0 0", "OFFSET 0 0 0.1");
    let turned = turned.replace("OFFSET 0.2 0.5 0", "OFFSET 0 0.5 -0.2").replace("OFFSET -0.2 0.5 0", "OFFSET 0 0.5 0.2");
    let turned = turned.replace("OFFSET 0.3 0 0", "OFFSET 0 0 -0.3").replace("OFFSET -0.3 0 0", "OFFSET 0 0 0.3");
    let turned = turned.replace("OFFSET 0.25 0 0", "OFFSET 0 0 -0.25").replace("OFFSET -0.25 0 0", "OFFSET 0 0 0.25");
    let motion = retarget(&Bvh::parse(&turned).unwrap(), &model, &BvhConfig::default()).unwrap().0;
    let facing = Rotation3::new(Point::from(motion.poses[0][0])) * Point::z();
    assert!((facing - Point::x()).norm() < 1e-9, "{facing}");
    // The legs of this skeleton are straight, the body's spread a little; nothing else turns.
    for joint in [3, 6, 9, 12, 16, 17, 18, 19] {
        assert!(Point::from(motion.poses[0][joint]).norm() < 0.02, "{}: {:?}", JOINT_NAMES[joint], motion.poses[0][joint]);
    }
}
