//! Small errors of a motion: where a recorded person really stood, when, turned how, and of which shape.
//!
//! The host applies a correction in f64 ([`PoseCorrection::apply`]); [`super::PosedFrame`] moves the body around it on a device,
//! with gradients ([`PoseTensors`]).

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use super::kinematics::{Matrix, Vector, rotation};
use crate::person::{Motion, Person, Placement};

/// What a motion and its placement lack. All zero: nothing.
///
/// A vertex of the person at radar time T moves to
/// `H (x(T − clock) − pivot) + pivot + shift + shifts(T)`, with H a turn by `heading_rad` about the vertical. `x` is posed
/// with `exp(turns(T))` before each joint's rotation (in the axes of the joint's parent) and `betas` added to the shape's.
/// Corrections in time are linear between knots, and constant beyond the first and the last.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PoseCorrection {
    /// The motion happens later by this, seconds.
    pub clock_s: f64,
    /// Turn of the whole motion about the vertical through `pivot_m`, counter-clockwise seen from above, radians.
    pub heading_rad: f64,
    /// Radar frame, metres.
    pub pivot_m: [f64; 3],
    /// Of the whole motion, radar frame, metres.
    pub shift_m: [f64; 3],
    /// `[shape]`, added to the motion's.
    pub betas: Vec<f64>,
    /// `[knot]`, ascending, seconds after the motion's first pose.
    pub knots_s: Vec<f64>,
    /// `[knot][joint, xyz]`, axis-angle, radians; empty for none.
    pub turns_rad: Vec<Vec<[f64; 3]>>,
    /// `[knot, xyz]`, radar frame, metres; empty for none.
    pub shifts_m: Vec<[f64; 3]>,
}

impl PoseCorrection {
    /// The person as corrected. Meshes have neither joints nor shape: of those parts nothing is done.
    ///
    /// # Panics
    /// When a turn has not as many joints as the motion, or a knot no turn.
    pub fn apply(&self, person: &Person) -> Person {
        let turn = rotation([0.0, 0.0, self.heading_rad]);
        let pivot = Vector::from(self.pivot_m);
        let origin = |origin: Vector| turn * (origin - pivot) + pivot + Vector::from(self.shift_m);
        match person {
            Person::Skinned { model, motion, placement } => {
                let world = Matrix::from_fn(|row, column| placement.radar_from_motion[row][column]);
                let radar_from_motion = turn * world;
                let placement = Placement {
                    start_s: placement.start_s + self.clock_s,
                    radar_from_motion: std::array::from_fn(|row| std::array::from_fn(|column| radar_from_motion[(row, column)])),
                    origin_m: origin(Vector::from(placement.origin_m)).into(),
                };
                Person::Skinned { model: model.clone(), motion: self.moved(motion, &radar_from_motion), placement }
            }
            Person::Meshes { vertices, faces, pose_times_s } => {
                let first_s = pose_times_s.first().copied().unwrap_or(0.0);
                let at = |(mesh, time_s): (&Vec<[f64; 3]>, &f64)| -> Vec<[f64; 3]> {
                    let shift = self.shift_at(time_s - first_s);
                    mesh.iter().map(|&vertex| (origin(Vector::from(vertex)) + shift).into()).collect()
                };
                Person::Meshes {
                    vertices: vertices.iter().zip(pose_times_s).map(at).collect(),
                    faces: faces.clone(),
                    pose_times_s: pose_times_s.iter().map(|time| time + self.clock_s).collect(),
                }
            }
        }
    }

    fn moved(&self, motion: &Motion, radar_from_motion: &Matrix) -> Motion {
        let time = |pose: usize| pose as f64 / motion.rate_hz;
        let turned = |(pose, joints): (usize, &Vec<[f64; 3]>)| -> Vec<[f64; 3]> {
            if self.turns_rad.is_empty() {
                return joints.clone();
            }
            let turns = self.turns_at(time(pose), joints.len());
            joints.iter().zip(turns).map(|(&joint, turn)| after(turn, joint)).collect()
        };
        let shifted = |(pose, &place): (usize, &[f64; 3])| -> [f64; 3] {
            (Vector::from(place) + radar_from_motion.transpose() * self.shift_at(time(pose))).into()
        };
        let count = motion.betas.len().max(self.betas.len());
        let beta = |all: &[f64], shape: usize| all.get(shape).copied().unwrap_or(0.0);
        Motion {
            poses: motion.poses.iter().enumerate().map(turned).collect(),
            translations: motion.translations.iter().enumerate().map(shifted).collect(),
            betas: (0..count).map(|shape| beta(&motion.betas, shape) + beta(&self.betas, shape)).collect(),
            rate_hz: motion.rate_hz,
        }
    }

    /// The one or two knots around a time (seconds after the first pose) and their weights.
    pub(super) fn knots_around(&self, time_s: f64) -> [(usize, f64); 2] {
        let after = self.knots_s.partition_point(|&knot| knot <= time_s);
        if after == 0 || after == self.knots_s.len() {
            let only = after.saturating_sub(1).min(self.knots_s.len().saturating_sub(1));
            return [(only, 1.0), (only, 0.0)];
        }
        let (before, next) = (self.knots_s[after - 1], self.knots_s[after]);
        let share = (time_s - before) / (next - before);
        [(after - 1, 1.0 - share), (after, share)]
    }

    /// Axis-angle of every joint at a time, radians.
    pub(super) fn turns_at(&self, time_s: f64, joints: usize) -> Vec<[f64; 3]> {
        let around = self.knots_around(time_s);
        let turn = |joint: usize| {
            std::array::from_fn(|axis| around.iter().map(|&(knot, weight)| weight * self.turns_rad[knot][joint][axis]).sum())
        };
        if self.turns_rad.is_empty() { vec![[0.0; 3]; joints] } else { (0..joints).map(turn).collect() }
    }

    /// Metres, radar frame.
    pub(super) fn shift_at(&self, time_s: f64) -> Vector {
        if self.shifts_m.is_empty() {
            return Vector::zeros();
        }
        self.knots_around(time_s).iter().map(|&(knot, weight)| Vector::from(self.shifts_m[knot]) * weight).sum()
    }
}

/// Axis-angle of a rotation that follows another one.
fn after(turn: [f64; 3], joint: [f64; 3]) -> [f64; 3] {
    if turn == [0.0; 3] {
        return joint;
    }
    let both = nalgebra::Rotation3::new(Vector::from(turn)) * nalgebra::Rotation3::new(Vector::from(joint));
    nalgebra::UnitQuaternion::from_rotation_matrix(&both).scaled_axis().into()
}

/// The parts of a [`PoseCorrection`] that learn, on a device: the whole value, of which the body's own correction
/// ([`super::PosedBody::correction`]) is taken away where the body is posed. What is `None` stays as the body has it.
#[derive(Clone, Debug, Default)]
pub struct PoseTensors {
    /// `[1]`, seconds. Enters by the time derivative of the pose: right to the second order of its distance from the body's.
    pub clock_s: Option<Tensor<1>>,
    /// `[1]`, radians.
    pub heading_rad: Option<Tensor<1>>,
    /// `[xyz]`, metres.
    pub shift_m: Option<Tensor<1>>,
    /// `[shape]`, as many as the body's correction has, at most as many as the model.
    pub betas: Option<Tensor<1>>,
    /// `[knot, joint, xyz]`, radians.
    pub turns_rad: Option<Tensor<3>>,
    /// `[knot, xyz]`, metres.
    pub shifts_m: Option<Tensor<2>>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::test_bodies::random_body;
    use crate::body::{Interpolation, PosedBody, SurfaceConfig};

    fn person() -> Person {
        let poses = (0..20).map(|pose| vec![[0.1 * pose as f64, 0.3, -0.2]; 5]).collect();
        let motion = Motion {
            poses,
            translations: (0..20).map(|pose| [0.0, 0.9, 0.05 * pose as f64]).collect(),
            betas: vec![0.5],
            rate_hz: 20.0,
        };
        let placement = Placement { start_s: 0.1, origin_m: [0.2, 3.5, -1.0], ..Default::default() };
        Person::Skinned { model: random_body(30, 5, 3), motion, placement }
    }

    fn at(person: &Person, time_s: f64) -> Vec<[f64; 3]> {
        let body = PosedBody::new(person, &SurfaceConfig::vertices(), Interpolation::Cubic).unwrap();
        body.frame(&[time_s]).unwrap().vertices_m
    }

    #[test]
    fn nothing_changes_nothing_and_a_clock_moves_the_motion_in_time() {
        assert_eq!(PoseCorrection::default().apply(&person()), person());
        let late = PoseCorrection { clock_s: 0.05, ..Default::default() }.apply(&person());
        for (a, b) in at(&late, 0.55).iter().zip(at(&person(), 0.5)) {
            assert!((Vector::from(*a) - Vector::from(b)).norm() < 1e-12);
        }
    }

    #[test]
    fn heading_turns_about_the_pivot_and_shifts_are_in_the_radar_frame() {
        let correction = PoseCorrection {
            heading_rad: 0.5,
            pivot_m: [0.2, 3.0, 7.0],
            shift_m: [0.01, 0.02, 0.03],
            knots_s: vec![0.0, 0.4],
            shifts_m: vec![[0.0, 0.0, 0.0], [0.4, 0.0, -0.2]],
            ..Default::default()
        };
        // A pose half way between the knots: 0.2 s after the first, at 0.3 s.
        let turn = rotation([0.0, 0.0, 0.5]);
        let pivot = Vector::from(correction.pivot_m);
        for (a, b) in at(&correction.apply(&person()), 0.3).iter().zip(at(&person(), 0.3)) {
            let wanted = turn * (Vector::from(b) - pivot) + pivot + Vector::new(0.21, 0.02, -0.07);
            assert!((Vector::from(*a) - wanted).norm() < 1e-12);
        }
    }

    #[test]
    fn a_turn_precedes_the_joints_rotation_and_shape_is_added() {
        let knots = PoseCorrection {
            betas: vec![0.1, -0.3],
            knots_s: vec![0.0],
            turns_rad: vec![vec![[0.0, 0.0, 0.2]; 5]],
            ..Default::default()
        };
        let Person::Skinned { motion, .. } = knots.apply(&person()) else { unreachable!() };
        assert_eq!(motion.betas, [0.6, -0.3]);
        let wanted = rotation([0.0, 0.0, 0.2]) * rotation([0.7, 0.3, -0.2]);
        assert!((rotation(motion.poses[7][2]) - wanted).norm() < 1e-12);
    }
}
