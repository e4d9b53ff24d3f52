//! Motion files as people have them: the same walk in every form comes out as the same walk.

use nalgebra::{UnitQuaternion, Vector3};

use super::bvh::Bvh;
use super::written::{self, JOINTS, Style};
use super::{BvhConfig, retarget};
use crate::person::actions::{self, Action, StyleConfig};
use crate::person::{BodyModel, JOINT_NAMES, Motion, procedural};

pub(super) type Point = Vector3<f64>;
pub(super) type Turn = UnitQuaternion<f64>;

pub(super) fn person() -> BodyModel {
    procedural::person(&procedural::PersonConfig { edge_m: 0.032, ..Default::default() }).unwrap()
}

pub(super) fn walk(model: &BodyModel) -> Motion {
    actions::motion(Action::WalkBackForthArmswing, &StyleConfig::default(), model, &[], 3.0, 60.0).unwrap()
}

/// `[pose][joint]`: how every joint is turned in space.
pub(super) fn turns(model: &BodyModel, motion: &Motion) -> Vec<Vec<Turn>> {
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
pub(super) fn apart(model: &BodyModel, found: &Motion, wanted: &Motion) -> (f64, f64, String) {
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

/// A joint's name as Xsens writes it.
fn xsens(joint: usize) -> String {
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
}

#[test]
fn the_axes_of_bones_make_no_difference() {
    let model = person();
    let walk = walk(&model);
    let about_x = |degrees: f64| UnitQuaternion::from_axis_angle(&Point::x_axis(), f64::to_radians(degrees));
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

/// Equal turns and places, up to the precision of float16.
pub(super) fn same(form: &str, model: &BodyModel, found: &Motion, wanted: &Motion) {
    let (_, angle, joint) = apart(model, found, wanted);
    assert!(angle < 0.2, "{form}: {joint} is {angle} degrees off");
    assert_eq!(found.betas, wanted.betas, "{form}");
    for (found, wanted) in found.translations.iter().zip(&wanted.translations) {
        assert!((Point::from(*found) - Point::from(*wanted)).norm() < 1e-6, "{form}: {found:?}, expected {wanted:?}");
    }
}
