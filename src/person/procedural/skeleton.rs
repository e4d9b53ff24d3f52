//! The 24 joints of the generated person and the bones between them.

use nalgebra::{Vector3, vector};

use super::PersonConfig;

/// SMPL's kinematic tree.
pub const PARENTS: [Option<usize>; 24] = [
    None,
    Some(0),
    Some(0),
    Some(0),
    Some(1),
    Some(2),
    Some(3),
    Some(4),
    Some(5),
    Some(6),
    Some(7),
    Some(8),
    Some(9),
    Some(9),
    Some(9),
    Some(12),
    Some(13),
    Some(14),
    Some(16),
    Some(17),
    Some(18),
    Some(19),
    Some(20),
    Some(21),
];

/// A segment that moves with a joint, and how thick the flesh around it is.
pub struct Bone {
    pub joint: usize,
    pub from: Vector3<f64>,
    pub to: Vector3<f64>,
    /// At both ends.
    pub radius_m: [f64; 2],
}

impl Bone {
    /// Position along the segment (0 to 1) that is nearest to `point`.
    pub fn nearest(&self, point: &Vector3<f64>) -> f64 {
        let along = self.to - self.from;
        ((point - self.from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
    }

    pub fn at(&self, fraction: f64) -> Vector3<f64> {
        self.from + (self.to - self.from) * fraction
    }

    /// Distance from the segment in units of the flesh's thickness.
    pub fn relative_distance(&self, point: &Vector3<f64>) -> f64 {
        let fraction = self.nearest(point);
        let radius = self.radius_m[0] + (self.radius_m[1] - self.radius_m[0]) * fraction;
        (point - self.at(fraction)).norm() / radius
    }
}

/// Rest pose: a T-pose with the feet slightly apart, the pelvis at the origin, the sole at −`floor_m`; metres.
pub struct Skeleton {
    pub joints: [Vector3<f64>; 24],
    pub bones: Vec<Bone>,
    /// Height of the pelvis above the sole.
    pub floor_m: f64,
    pub head_top: Vector3<f64>,
    /// Left and right.
    pub fingertips: [Vector3<f64>; 2],
    pub toes: [Vector3<f64>; 2],
    pub heels: [Vector3<f64>; 2],
}

/// Hip, knee, ankle, ball of the foot, collar, shoulder, elbow, wrist, hand, fingertip, toes and heel of a side, in fractions of the
/// stature.
fn side_of_body(config: &PersonConfig, floor: f64, trunk: f64, side: f64) -> [Vector3<f64>; 12] {
    let (hip, shoulder) = (0.052 * config.hip_width, 0.102 * config.shoulder_width);
    let spread = 0.020;
    let knee_x = hip + 0.5 * spread;
    let (ankle_x, ankle_y) = (hip + spread, 0.042 - floor);
    let knee_y = -0.010 + 0.50 * (ankle_y + 0.010);
    let arm_y = 0.272 * trunk;
    [
        vector![side * hip, -0.010, 0.0],
        vector![side * knee_x, knee_y, 0.006],
        vector![side * ankle_x, ankle_y, -0.012],
        vector![side * (ankle_x + 0.004), 0.017 - floor, 0.070],
        vector![side * 0.016, 0.262 * trunk, -0.006],
        vector![side * shoulder, arm_y, -0.008],
        vector![side * (shoulder + 0.165), arm_y, -0.008],
        vector![side * (shoulder + 0.310), arm_y, -0.008],
        vector![side * (shoulder + 0.355), arm_y, -0.008],
        vector![side * (shoulder + 0.418), arm_y, -0.008],
        vector![side * (ankle_x + 0.006), 0.014 - floor, 0.106],
        vector![side * ankle_x, 0.020 - floor, -0.030],
    ]
}

impl Skeleton {
    pub fn new(config: &PersonConfig) -> Self {
        // In fractions of the stature. Longer legs leave less of it to the trunk.
        let floor = 0.535 * config.leg_length;
        let trunk = (1.0 - floor) / 0.465;
        let sided = |side: f64| side_of_body(config, floor, trunk, side);
        let (left, right) = (sided(1.0), sided(-1.0));
        let middle = |height: f64, z: f64| vector![0.0, height * trunk, z];
        let joints = [
            Vector3::zeros(),
            left[0],
            right[0],
            middle(0.055, -0.012),
            left[1],
            right[1],
            middle(0.130, -0.016),
            left[2],
            right[2],
            middle(0.200, -0.018),
            left[3],
            right[3],
            middle(0.305, -0.008),
            left[4],
            right[4],
            middle(0.358, 0.006),
            left[5],
            right[5],
            left[6],
            right[6],
            left[7],
            right[7],
            left[8],
            right[8],
        ]
        .map(|joint| joint * config.height_m);
        let metres = |points: [Vector3<f64>; 2]| points.map(|point| point * config.height_m);

        let mut skeleton = Self {
            joints,
            bones: Vec::new(),
            floor_m: floor * config.height_m,
            head_top: middle(0.465, 0.006) * config.height_m,
            fingertips: metres([left[9], right[9]]),
            toes: metres([left[10], right[10]]),
            heels: metres([left[11], right[11]]),
        };
        skeleton.bones = skeleton.segments(config);
        skeleton
    }

    /// The bones in an order that depends on nothing, so that two skeletons can be compared bone by bone.
    fn segments(&self, config: &PersonConfig) -> Vec<Bone> {
        let thickness = |joint: usize| match joint {
            0 => 0.068,
            3 | 6 | 9 => 0.080,
            1 | 2 => 0.050,
            4 | 5 => 0.032,
            7 | 8 | 10 | 11 => 0.024,
            12 => 0.036,
            15 => 0.048,
            13 | 14 => 0.044,
            16 | 17 => 0.034,
            _ => 0.022,
        };
        let bone = |joint: usize, to: Vector3<f64>, far: usize| Bone {
            joint,
            from: self.joints[joint],
            to,
            radius_m: [joint, far].map(|joint| thickness(joint) * config.height_m),
        };
        let mut bones: Vec<Bone> =
            (1..24).filter_map(|child| PARENTS[child].map(|parent| bone(parent, self.joints[child], child))).collect();
        bones.push(bone(15, self.head_top, 15));
        for side in 0..2 {
            bones.push(bone(7 + side, self.heels[side], 7));
            bones.push(bone(10 + side, self.toes[side], 10));
            bones.push(bone(22 + side, self.fingertips[side], 22));
        }
        bones
    }
}
