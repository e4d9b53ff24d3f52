//! BVH files as programs write them, made from a motion that is known: for tests.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use crate::person::{BodyModel, JOINT_NAMES, Motion};

type Point = Vector3<f64>;
type Turn = UnitQuaternion<f64>;

/// Joints that a file has; SMPL's hands are not among them.
pub const JOINTS: usize = 22;

/// The choices of a program that writes BVH.
pub struct Style<'a> {
    /// What each of the body's first 22 joints is called.
    pub name: &'a dyn Fn(usize) -> String,
    /// The axes of each joint, in the body's rest pose (`JOINTS` of them).
    pub axes: Vec<Turn>,
    /// From y up to the axes of the file's world.
    pub world: Turn,
    pub unit_m: f64,
    pub frame_time: String,
    /// Position channels in every joint, not in the root alone.
    pub positions: bool,
}

impl Default for Style<'_> {
    fn default() -> Self {
        Self {
            name: &|joint| JOINT_NAMES[joint].into(),
            axes: vec![Turn::identity(); JOINTS],
            world: Turn::identity(),
            unit_m: 0.01,
            frame_time: "0.0166667".into(),
            positions: false,
        }
    }
}

/// Axes whose x is every bone's direction, as in LaFAN1: nobody stands when all of them are parallel.
pub fn along_bones(model: &BodyModel, betas: &[f64]) -> Vec<Turn> {
    let rest: Vec<Point> = model.rest_joints(betas).into_iter().map(Point::from).collect();
    let axes = |joint: usize| {
        // The trunk's bones are built upright; the pelvis and the chest have left and right children.
        let bone = match joint {
            0 | 3 | 6 | 9 => Point::y(),
            _ => match (joint + 1..JOINTS).find(|&child| model.parents[child] == Some(joint)) {
                Some(child) => rest[child] - rest[joint],
                None => rest[joint] - rest[model.parents[joint].expect("the root has children")],
            },
        };
        let x = bone.normalize();
        let aside = if x.x.abs() < 0.7 { Point::x() } else { Point::z() };
        let y = aside.cross(&x).normalize();
        let matrix = Rotation3::from_basis_unchecked(&[x, y, x.cross(&y)]);
        UnitQuaternion::from_rotation_matrix(&matrix)
    };
    (0..JOINTS).map(axes).collect()
}

/// The text of a file that holds this motion.
pub fn bvh(model: &BodyModel, motion: &Motion, style: &Style) -> String {
    let rest: Vec<Point> = model.rest_joints(&motion.betas).into_iter().map(Point::from).collect();
    let mut order = Vec::new();
    let mut text = "HIERARCHY\n".to_string();
    joint(0, model, &rest, style, &mut order, &mut text);
    text += &format!("MOTION\nFrames: {}\nFrame Time: {}\n", motion.poses.len(), style.frame_time);
    for (pose, translation) in motion.poses.iter().zip(&motion.translations) {
        let mut turns: Vec<Turn> = Vec::new();
        for (parent, turn) in model.parents.iter().zip(pose).take(JOINTS) {
            let own = UnitQuaternion::new(Point::from(*turn));
            turns.push(parent.map_or(own, |parent| turns[parent] * own));
        }
        let axes = |joint: usize| style.world * turns[joint] * style.axes[joint];
        let mut numbers = Vec::new();
        for &joint in &order {
            let (local, place) = match model.parents[joint] {
                Some(parent) => (axes(parent).inverse() * axes(joint), offset(joint, model, &rest, style)),
                None => (axes(joint), style.world * (rest[0] + Point::from(*translation)) / style.unit_m),
            };
            if joint == 0 || style.positions {
                numbers.extend(place.iter().copied());
            }
            let (x, y, z) = local.euler_angles();
            numbers.extend([z, y, x].map(f64::to_degrees));
        }
        let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.6}")).collect();
        text += &(numbers.join(" ") + "\n");
    }
    text
}

fn offset(joint: usize, model: &BodyModel, rest: &[Point], style: &Style) -> Point {
    match model.parents[joint] {
        Some(parent) => style.axes[parent].inverse() * (rest[joint] - rest[parent]) / style.unit_m,
        None => Point::zeros(),
    }
}

fn joint(joint: usize, model: &BodyModel, rest: &[Point], style: &Style, order: &mut Vec<usize>, text: &mut String) {
    order.push(joint);
    let place = offset(joint, model, rest, style);
    let kind = if joint == 0 { "ROOT" } else { "JOINT" };
    let channels = if joint == 0 || style.positions { "6 Xposition Yposition Zposition" } else { "3" };
    *text += &format!("{kind} {}\n{{\nOFFSET {:.6} {:.6} {:.6}\n", (style.name)(joint), place.x, place.y, place.z);
    *text += &format!("CHANNELS {channels} Zrotation Yrotation Xrotation\n");
    for child in (joint + 1..JOINTS).filter(|&child| model.parents[child] == Some(joint)) {
        self::joint(child, model, rest, style, order, text);
    }
    *text += "}\n";
}
