//! Linear blend skinning in float64, written for the recorder alone.

use super::vector::{Vector, add, add_scaled, multiply, rotate, subtract};
use crate::person::BodyModel;

type Rotation = [[f64; 3]; 3];

/// A body of one shape, ready to be posed.
#[derive(Clone, Debug)]
pub struct Skinning {
    model: BodyModel,
    /// `[vertex, xyz]`, the rest pose with the shape blended in.
    shaped: Vec<Vector>,
    /// `[joint, xyz]`, rest positions.
    joints: Vec<Vector>,
}

impl Skinning {
    /// `betas` beyond the body's shape directions are ignored.
    pub fn new(model: &BodyModel, betas: &[f64]) -> Self {
        let mut shaped = model.template.clone();
        for (direction, &beta) in model.shape_directions.iter().zip(betas) {
            for (vertex, step) in shaped.iter_mut().zip(direction) {
                *vertex = add_scaled(*vertex, *step, beta);
            }
        }
        let joints = model
            .joint_regressor
            .iter()
            .map(|row| row.iter().fold([0.0; 3], |sum, &(vertex, weight)| add_scaled(sum, shaped[vertex], weight)))
            .collect();
        Self { model: model.clone(), shaped, joints }
    }

    /// The rest pose with its shape, `[vertex, xyz]`, metres.
    pub fn rest(&self) -> &[Vector] {
        &self.shaped
    }

    /// `[vertex, xyz]` for axis-angle rotations `[joint]`, radians; joints without one stay at rest.
    pub fn pose(&self, axis_angles: &[Vector], translation: Vector) -> Vec<Vector> {
        let joints = self.joints.len();
        let local: Vec<Rotation> =
            (0..joints).map(|joint| rodrigues(axis_angles.get(joint).copied().unwrap_or([0.0; 3]))).collect();
        let blended = self.pose_blended(&local);
        // World rotation of each joint and what it adds to a rotated rest position.
        let mut rotations: Vec<Rotation> = Vec::with_capacity(joints);
        let mut positions: Vec<Vector> = Vec::with_capacity(joints);
        for ((parent, local), &rest) in self.model.parents.iter().zip(&local).zip(&self.joints) {
            let (rotation, position) = match *parent {
                None => (*local, rest),
                Some(parent) => {
                    let bone = subtract(rest, self.joints[parent]);
                    (multiply(&rotations[parent], local), add(positions[parent], rotate(&rotations[parent], bone)))
                }
            };
            rotations.push(rotation);
            positions.push(position);
        }
        let offsets: Vec<Vector> =
            (0..joints).map(|joint| subtract(positions[joint], rotate(&rotations[joint], self.joints[joint]))).collect();
        blended
            .iter()
            .zip(&self.model.skinning)
            .map(|(&vertex, weights)| {
                weights.iter().fold(translation, |sum, &(joint, weight)| {
                    add_scaled(sum, add(rotate(&rotations[joint], vertex), offsets[joint]), weight)
                })
            })
            .collect()
    }

    /// The rest pose plus the pose blend shapes: linear in the entries of R − 1 of every joint but the root.
    fn pose_blended(&self, local: &[Rotation]) -> Vec<Vector> {
        let mut vertices = self.shaped.clone();
        for (index, direction) in self.model.pose_directions.iter().enumerate() {
            let (joint, entry) = (1 + index / 9, index % 9);
            let identity = if entry % 4 == 0 { 1.0 } else { 0.0 };
            let Some(rotation) = local.get(joint) else { break };
            let coefficient = rotation[entry / 3][entry % 3] - identity;
            if coefficient != 0.0 {
                for (vertex, step) in vertices.iter_mut().zip(direction) {
                    *vertex = add_scaled(*vertex, *step, coefficient);
                }
            }
        }
        vertices
    }
}

/// Rotation matrix of an axis-angle vector; exact at zero.
pub fn rodrigues(axis_angle: Vector) -> Rotation {
    let [x, y, z] = axis_angle;
    let angle_squared = x * x + y * y + z * z;
    let angle = angle_squared.sqrt();
    // sin(a)/a and (1 − cos a)/a², by their series where the quotients lose digits.
    let (sine, cosine) = if angle < 1e-4 {
        (1.0 - angle_squared / 6.0, 0.5 - angle_squared / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / angle_squared)
    };
    [
        [1.0 - cosine * (y * y + z * z), cosine * x * y - sine * z, cosine * x * z + sine * y],
        [cosine * x * y + sine * z, 1.0 - cosine * (x * x + z * z), cosine * y * z - sine * x],
        [cosine * x * z - sine * y, cosine * y * z + sine * x, 1.0 - cosine * (x * x + y * y)],
    ]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Two bones along x, one vertex on each and one that both share.
    fn arm() -> BodyModel {
        BodyModel {
            template: vec![[0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.0, 0.0]],
            shape_directions: vec![vec![[0.0; 3], [0.0; 3], [0.5, 0.0, 0.0]]],
            pose_directions: vec![],
            joint_regressor: vec![vec![(0, 2.0), (1, -1.0)], vec![(1, 1.0)]],
            skinning: vec![vec![(0, 1.0)], vec![(0, 0.5), (1, 0.5)], vec![(1, 1.0)]],
            parents: vec![None, Some(0)],
            faces: vec![[0, 1, 2]],
        }
    }

    fn assert_close(found: &[Vector], wanted: &[Vector]) {
        for (a, b) in found.iter().flatten().zip(wanted.iter().flatten()) {
            assert!((a - b).abs() < 1e-12, "{found:?} against {wanted:?}");
        }
    }

    #[test]
    fn a_bent_elbow_moves_the_forearm_around_it() {
        let posed = Skinning::new(&arm(), &[]).pose(&[[0.0; 3], [0.0, 0.0, FRAC_PI_2]], [0.0, 0.0, 1.0]);
        assert_close(&posed, &[[0.5, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.5, 1.0]]);
    }

    #[test]
    fn a_turned_root_carries_the_whole_chain() {
        let posed = Skinning::new(&arm(), &[1.0]).pose(&[[0.0, 0.0, FRAC_PI_2], [0.0, 0.0, FRAC_PI_2]], [0.0; 3]);
        assert_close(&posed, &[[0.0, 0.5, 0.0], [0.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]);
    }

    #[test]
    fn pose_blend_shapes_follow_the_entries_of_the_rotation() {
        let mut model = arm();
        // Entry (0, 1) of the elbow's rotation, which is −1 for a quarter turn about z, lifts the shared vertex.
        model.pose_directions = vec![vec![[0.0; 3]; 3]; 9];
        model.pose_directions[1][1] = [0.0, 0.0, 0.25];
        let posed = Skinning::new(&model, &[]).pose(&[[0.0; 3], [0.0, 0.0, FRAC_PI_2]], [0.0; 3]);
        assert!((posed[1][2] + 0.25).abs() < 1e-12);
    }

    #[test]
    fn rodrigues_is_a_rotation_at_every_angle() {
        for angle in [0.0, 1e-9, 1e-5, 1e-3, 1.0, 3.1] {
            let matrix = rodrigues([0.6 * angle, -0.8 * angle, 0.0]);
            for row in 0..3 {
                for column in 0..3 {
                    let product: f64 = (0..3).map(|k| matrix[row][k] * matrix[column][k]).sum();
                    assert!((product - if row == column { 1.0 } else { 0.0 }).abs() < 1e-12, "angle {angle}");
                }
            }
        }
    }
}
