//! Linear blend skinning with pose blend shapes, on the host in f64: many poses of one body in one pass.

use rayon::prelude::*;

use super::kinematics::{JointTransform, Matrix, Vector, joint_transforms, pose_feature, rest_joints, rotation, shaped};
use crate::person::BodyModel;

/// A body of one shape, ready to be posed.
#[derive(Clone, Debug)]
pub struct SkinnedBody {
    shaped: Vec<Vector>,
    rest_joints: Vec<Vector>,
    parents: Vec<Option<usize>>,
    /// `[vertex, xyz, direction]`: what one vertex needs lies together, for all poses at once.
    pose_directions: Vec<f64>,
    skinning: Vec<Vec<(usize, f64)>>,
}

/// Several poses of one body.
#[derive(Clone, Debug)]
pub struct Poses {
    pub count: usize,
    /// `[vertex, pose]`, metres.
    pub vertices_m: Vec<[f64; 3]>,
    /// `[joint, pose]`: from the rest pose to the world.
    pub rotations: Vec<Matrix>,
    /// `[joint, pose]`, metres: what each joint adds to turned points of the rest pose, without the shift.
    pub translations_m: Vec<Vector>,
    /// `[vertex, pose]`, metres: change of the rest pose by the pose blend shapes, where there are any.
    pub blends_m: Option<Vec<[f64; 3]>>,
}

impl SkinnedBody {
    /// `betas` beyond the body's are ignored, missing ones count as zero.
    pub fn new(model: &BodyModel, betas: &[f64]) -> Self {
        let shaped = shaped(model, betas);
        let rest_joints = rest_joints(model, &shaped);
        let directions = model.pose_directions.len();
        let mut pose_directions = vec![0.0; model.template.len() * 3 * directions];
        for (direction, changes) in model.pose_directions.iter().enumerate() {
            for (vertex, change) in changes.iter().enumerate() {
                for (axis, &value) in change.iter().enumerate() {
                    pose_directions[(vertex * 3 + axis) * directions + direction] = value;
                }
            }
        }
        Self { shaped, rest_joints, parents: model.parents.clone(), pose_directions, skinning: model.skinning.clone() }
    }

    /// The rest pose of this shape, `[vertex]`, metres.
    pub fn rest_m(&self) -> Vec<[f64; 3]> {
        self.shaped.iter().map(|&vertex| vertex.into()).collect()
    }

    /// `[joint]`: the joint that each hangs on; the root has none.
    pub fn parents(&self) -> &[Option<usize>] {
        &self.parents
    }

    /// Joints of the rest pose of this shape, `[joint]`, metres.
    pub fn rest_joints_m(&self) -> &[Vector] {
        &self.rest_joints
    }

    /// Poses the body: `world_from_body · LBS(pose) + shift`.
    ///
    /// `poses`: `[pose][joint]` axis-angle, radians. `shifts_m`: `[pose]`, metres, in the world.
    pub fn pose(&self, poses: &[&[[f64; 3]]], world_from_body: &Matrix, shifts_m: &[Vector]) -> Poses {
        let count = poses.len();
        let rotations: Vec<Vec<Matrix>> = poses.iter().map(|pose| pose.iter().map(|&joint| rotation(joint)).collect()).collect();
        let features: Vec<Vec<f64>> = rotations.iter().map(|rotations| pose_feature(rotations)).collect();
        let transforms: Vec<Vec<JointTransform>> = rotations
            .iter()
            .map(|rotations| {
                let mut transforms = joint_transforms(&self.parents, &self.rest_joints, rotations);
                for transform in &mut transforms {
                    transform.rotation = world_from_body * transform.rotation;
                    transform.translation = world_from_body * transform.translation;
                }
                transforms
            })
            .collect();

        let mut vertices_m = vec![[0.0; 3]; self.shaped.len() * count];
        let mut blends_m = vec![[0.0; 3]; self.shaped.len() * count];
        let posed = vertices_m.par_chunks_mut(count.max(1)).zip(blends_m.par_chunks_mut(count.max(1)));
        posed.with_min_len(64).enumerate().for_each(|(vertex, (posed, blends))| {
            for (pose, (target, blended)) in posed.iter_mut().zip(blends).enumerate() {
                let blend = self.pose_blend(vertex, &features[pose]);
                *blended = blend.into();
                let rest = self.shaped[vertex] + blend;
                let skinned: Vector =
                    self.skinning[vertex].iter().map(|&(joint, weight)| transforms[pose][joint].apply(rest) * weight).sum();
                *target = (skinned + shifts_m[pose]).into();
            }
        });
        let joints = self.parents.len();
        let all = || (0..joints).flat_map(|joint| transforms.iter().map(move |pose| pose[joint]));
        Poses {
            count,
            vertices_m,
            rotations: all().map(|transform| transform.rotation).collect(),
            translations_m: all().map(|transform| transform.translation).collect(),
            blends_m: (!self.pose_directions.is_empty()).then_some(blends_m),
        }
    }

    /// Change of a vertex by the pose blend shapes, metres.
    fn pose_blend(&self, vertex: usize, feature: &[f64]) -> Vector {
        if self.pose_directions.is_empty() {
            return Vector::zeros();
        }
        let axis = |axis: usize| {
            let start = (vertex * 3 + axis) * feature.len();
            dot(&self.pose_directions[start..start + feature.len()], feature)
        };
        Vector::new(axis(0), axis(1), axis(2))
    }

    /// The joint with the largest weight at a vertex.
    pub fn joint(&self, vertex: usize) -> usize {
        let weights = self.skinning[vertex].iter();
        weights.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |&(joint, _)| joint)
    }

    /// Blended rotation at a vertex, from the joints' (`[joint, pose]` of [`Poses`]).
    pub fn blended_rotation(&self, vertex: usize, pose: usize, poses: &Poses) -> Matrix {
        self.skinning[vertex].iter().map(|&(joint, weight)| poses.rotations[joint * poses.count + pose] * weight).sum()
    }
}

/// Eight partial sums, so that the compiler may use SIMD.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_blocks, b_blocks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a_blocks.zip(b_blocks) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::body::test_bodies::{arm, random_body, shared_body};

    fn place(body: &SkinnedBody, pose: &[[f64; 3]]) -> Vec<[f64; 3]> {
        body.pose(&[pose], &Matrix::identity(), &[Vector::zeros()]).vertices_m
    }

    fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).flat_map(|(a, b)| (0..3).map(move |axis| (a[axis] - b[axis]).abs())).fold(0.0, f64::max)
    }

    #[test]
    fn the_zero_pose_is_the_rest_pose() {
        let model = random_body(40, 5, 1);
        let body = SkinnedBody::new(&model, &[0.5, -1.0]);
        assert!(farthest(&place(&body, &[[0.0; 3]; 5]), &body.rest_m()) < 1e-14);
    }

    #[test]
    fn a_right_angle_at_one_joint_turns_what_hangs_on_it() {
        let body = SkinnedBody::new(&arm(), &[]);
        let mut pose = [[0.0; 3]; 3];
        pose[1] = [0.0, 0.0, FRAC_PI_2];
        let posed = place(&body, &pose);
        // The arm lies along x with joints at 0, 1, 2; the vertex at 3 hangs on the last joint.
        assert!(farthest(&posed[3..4], &[[1.0, 2.0, 0.0]]) < 1e-14, "{posed:?}");
        // The vertex on the bending joint is shared by two bones and stays.
        assert!(farthest(&posed[1..2], &[[1.0, 0.0, 0.0]]) < 1e-14, "{posed:?}");
        assert!(farthest(&posed[0..1], &[[0.0, 0.0, 0.0]]) < 1e-14, "{posed:?}");
    }

    #[test]
    fn the_root_turns_everything_about_its_joint_and_the_world_comes_last() {
        let body = SkinnedBody::new(&arm(), &[]);
        let mut pose = [[0.0; 3]; 3];
        pose[0] = [0.0, 0.0, FRAC_PI_2];
        let world = rotation([FRAC_PI_2, 0.0, 0.0]);
        let posed = body.pose(&[&pose], &world, &[Vector::new(0.0, 3.0, 0.0)]).vertices_m;
        // x → y by the pose, y → z by the world.
        assert!(farthest(&posed[3..4], &[[0.0, 3.0, 3.0]]) < 1e-14, "{posed:?}");
    }

    /// SMPL written again with plain loops and 4 × 4 matrices, sharing nothing with the code above.
    fn plain_smpl(model: &BodyModel, betas: &[f64], pose: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let vertices = model.template.len();
        let mut rest = model.template.clone();
        for (shape, beta) in betas.iter().enumerate() {
            for (point, change) in rest.iter_mut().flatten().zip(model.shape_directions[shape].iter().flatten()) {
                *point += beta * change;
            }
        }
        let joints: Vec<[f64; 3]> = model
            .joint_regressor
            .iter()
            .map(|row| std::array::from_fn(|axis| row.iter().map(|&(vertex, weight)| weight * rest[vertex][axis]).sum()))
            .collect();
        let turn: Vec<nalgebra::Matrix4<f64>> =
            pose.iter().map(|&joint| nalgebra::Rotation3::new(Vector::from(joint)).to_homogeneous()).collect();
        let mut world = Vec::new();
        for joint in 0..joints.len() {
            let parent = model.parents[joint];
            let offset =
                std::array::from_fn(|axis| joints[joint][axis] - parent.map_or(0.0, |parent: usize| joints[parent][axis]));
            let local = nalgebra::Matrix4::new_translation(&Vector::from(offset)) * turn[joint];
            world.push(parent.map_or(local, |parent: usize| world[parent] * local));
        }
        let mut posed = vec![[0.0; 3]; vertices];
        for vertex in 0..vertices {
            let mut point = rest[vertex];
            for (direction, changes) in model.pose_directions.iter().enumerate() {
                let (joint, entry) = (1 + direction / 9, direction % 9);
                let value = turn[joint][(entry / 3, entry % 3)] - if entry % 4 == 0 { 1.0 } else { 0.0 };
                for axis in 0..3 {
                    point[axis] += value * changes[vertex][axis];
                }
            }
            for &(joint, weight) in &model.skinning[vertex] {
                let relative = Vector::from(point) - Vector::from(joints[joint]);
                let moved = world[joint] * relative.push(1.0);
                for axis in 0..3 {
                    posed[vertex][axis] += weight * moved[axis];
                }
            }
        }
        posed
    }

    #[test]
    fn many_poses_at_once_equal_a_plain_implementation() {
        let model = random_body(60, 7, 3);
        let body = SkinnedBody::new(&model, &[0.7, -0.3]);
        let poses: Vec<Vec<[f64; 3]>> = (0..3)
            .map(|pose| (0..7).map(|joint| [0.3 * pose as f64, (joint as f64).sin(), -0.2 * joint as f64]).collect())
            .collect();
        let all = body.pose(&poses.iter().map(Vec::as_slice).collect::<Vec<_>>(), &Matrix::identity(), &[Vector::zeros(); 3]);
        for (pose, angles) in poses.iter().enumerate() {
            let mine: Vec<[f64; 3]> = all.vertices_m.iter().skip(pose).step_by(3).copied().collect();
            let error = farthest(&mine, &plain_smpl(&model, &[0.7, -0.3], angles));
            assert!(error < 1e-13, "pose {pose}: {error} m");
        }
    }

    #[test]
    fn a_shared_body_poses_as_numpy_does() {
        let Some(model) = shared_body("neutral_lite") else { return };
        let betas: Vec<f64> = (0..10).map(|shape| 0.3 * (shape as f64 - 4.0)).collect();
        let pose: Vec<[f64; 3]> =
            (0..24).map(|joint| std::array::from_fn(|axis| 0.4 * ((3 * joint + axis) as f64).sin())).collect();
        let body = SkinnedBody::new(&model, &betas);
        // Printed by scripts/golden_pose.py.
        let golden = super::super::golden::NEUTRAL_LITE;
        let (rest, posed) = (body.rest_m(), place(&body, &pose));
        for (vertex, rest_golden, posed_golden) in golden {
            assert!(farthest(&rest[vertex..=vertex], &[rest_golden]) < 1e-9, "rest {vertex}: {:?}", rest[vertex]);
            assert!(farthest(&posed[vertex..=vertex], &[posed_golden]) < 1e-9, "posed {vertex}: {:?}", posed[vertex]);
        }
        let error = farthest(&posed, &plain_smpl(&model, &betas, &pose));
        assert!(error < 1e-12, "{error} m");
    }
}
