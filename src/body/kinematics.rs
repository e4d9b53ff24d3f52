//! From shape and pose to the rigid motion of every joint (SMPL's kinematic chain), on the host in f64.
//!
//! [`super::tensors`] holds the same chain as tensor operations with gradients; a test compares them.

use nalgebra::{Matrix3, Vector3};

use crate::person::BodyModel;

/// x, y, z.
pub type Vector = Vector3<f64>;
/// A rotation, or another linear map of vectors.
pub type Matrix = Matrix3<f64>;

/// What a joint does to a point of the rest pose: `rotation · x + translation` (G in SMPL's notation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTransform {
    pub rotation: Matrix,
    /// Metres.
    pub translation: Vector,
}

impl JointTransform {
    /// The point after the joint's motion: rotated, then moved.
    pub fn apply(&self, point: Vector) -> Vector {
        self.rotation * point + self.translation
    }
}

/// Rotation about an axis by its length in radians (Rodrigues); exact at zero.
pub fn rotation(axis_angle: [f64; 3]) -> Matrix {
    let axis = Vector::from(axis_angle);
    let angle = axis.norm();
    let cross = axis.cross_matrix();
    let half = sinc(0.5 * angle);
    Matrix::identity() + cross * sinc(angle) + cross * cross * (0.5 * half * half)
}

/// sin x / x.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

/// Rest pose of a body shape, `[vertex]`, metres: template + Σ β S. Missing parameters count as zero, surplus ones are ignored.
pub fn shaped(model: &BodyModel, betas: &[f64]) -> Vec<Vector> {
    let mut vertices: Vec<Vector> = model.template.iter().map(|&vertex| Vector::from(vertex)).collect();
    for (direction, &beta) in model.shape_directions.iter().zip(betas) {
        if beta != 0.0 {
            for (vertex, &change) in vertices.iter_mut().zip(direction) {
                *vertex += Vector::from(change) * beta;
            }
        }
    }
    vertices
}

/// Where the joints of a rest pose are, `[joint]`, metres.
pub fn rest_joints(model: &BodyModel, shaped: &[Vector]) -> Vec<Vector> {
    let joint = |weights: &Vec<(usize, f64)>| weights.iter().map(|&(vertex, weight)| shaped[vertex] * weight).sum();
    model.joint_regressor.iter().map(joint).collect()
}

/// The transform of each joint, `[joint]`, from its rotation relative to its parent.
///
/// The chain carries a joint's frame: R of the world and where the joint went; the transform then takes the
/// joint's rest position out, so that it applies to points of the rest pose.
pub fn joint_transforms(parents: &[Option<usize>], rest_joints: &[Vector], rotations: &[Matrix]) -> Vec<JointTransform> {
    let mut world: Vec<JointTransform> = Vec::with_capacity(parents.len());
    for (joint, &parent) in parents.iter().enumerate() {
        world.push(match parent {
            None => JointTransform { rotation: rotations[joint], translation: rest_joints[joint] },
            Some(parent) => JointTransform {
                rotation: world[parent].rotation * rotations[joint],
                translation: world[parent].apply(rest_joints[joint] - rest_joints[parent]),
            },
        });
    }
    for (transform, &rest) in world.iter_mut().zip(rest_joints) {
        transform.translation -= transform.rotation * rest;
    }
    world
}

/// What the pose blend shapes are driven by: the entries of R − 1 of every joint but the root, row by row.
pub fn pose_feature(rotations: &[Matrix]) -> Vec<f64> {
    let rows = |rotation: &Matrix| {
        let change = rotation - Matrix::identity();
        (0..9).map(|entry| change[(entry / 3, entry % 3)]).collect::<Vec<_>>()
    };
    rotations.iter().skip(1).flat_map(rows).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_rotation_is_orthogonal_and_turns_counter_clockwise() {
        let quarter = rotation([0.0, 0.0, FRAC_PI_2]);
        assert!((quarter * Vector::x() - Vector::y()).norm() < 1e-15);
        for axis in [[0.3, -1.2, 0.7], [1e-9, 0.0, 2e-9], [3.0, 0.1, 0.0], [0.0; 3]] {
            let turned = rotation(axis);
            assert!((turned * turned.transpose() - Matrix::identity()).norm() < 1e-14, "{axis:?}");
            assert!((turned - nalgebra::Rotation3::new(Vector::from(axis)).into_inner()).norm() < 1e-14, "{axis:?}");
        }
    }

    #[test]
    fn a_bent_elbow_moves_the_hand_and_leaves_the_shoulder() {
        let parents = [None, Some(0), Some(1)];
        let rest = [Vector::zeros(), Vector::x(), Vector::x() * 2.0];
        let rotations = [Matrix::identity(), rotation([0.0, 0.0, FRAC_PI_2]), Matrix::identity()];
        let transforms = joint_transforms(&parents, &rest, &rotations);
        assert!((transforms[0].apply(rest[0]) - rest[0]).norm() < 1e-15);
        assert!((transforms[1].apply(rest[1]) - rest[1]).norm() < 1e-15, "a joint does not move by its own rotation");
        assert!((transforms[2].apply(rest[2]) - Vector::new(1.0, 1.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn the_pose_feature_is_zero_at_rest_and_skips_the_root() {
        let turned = rotation([0.0, 0.0, FRAC_PI_2]);
        assert!(pose_feature(&[turned, Matrix::identity()]).iter().all(|&entry| entry == 0.0));
        let feature = pose_feature(&[Matrix::identity(), turned]);
        assert_eq!(feature.len(), 9);
        // Row by row: the second entry is row 0, column 1.
        assert!((feature[1] + 1.0).abs() < 1e-15 && (feature[3] - 1.0).abs() < 1e-15);
    }
}
