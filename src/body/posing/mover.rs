//! What moves the vertices of a frame: joints and blend shapes, then heading and shifts.

use burn::tensor::Tensor;

use super::chain::Chain;
use super::{DeviceBody, On, times};
use crate::body::correction::PoseTensors;
use crate::body::frame::Rotations;
use crate::body::kinematics::{Matrix, Vector, rotation};
use crate::body::skinning::Poses;
use crate::body::tensors::{BodyTensors, turns};
use crate::body::{BodyFrame, PosedBody, Source};

/// What moves the vertices of one frame.
pub(super) struct Mover<'a> {
    pub body: &'a PosedBody,
    pub frame: &'a BodyFrame,
    pub on: &'a On,
    pub device: &'a DeviceBody,
    pub pose: &'a PoseTensors,
}

impl Mover<'_> {
    /// Change of the vertices by motion, joints and shape, `[vertex, pose, xyz]`, and their rotations.
    pub fn before_heading(&self) -> (Tensor<3>, Tensor<2>) {
        let (poses, vertices) = (self.frame.basis.poses.len(), self.frame.vertices_m.len());
        match (&self.frame.rotations, &self.body.source, &self.device.model) {
            (Rotations::Joints(_), Source::Skinned { .. }, Some(model)) => self.skinned(model),
            (Rotations::Vertices(rotations), _, _) => {
                let flat = self.frame.change_m.iter().flatten().copied().collect();
                let rotation = self.on.matrices(rotations.iter().copied()).reshape([vertices, poses * 9]);
                (self.on.tensor(flat, [vertices, poses, 3]), rotation)
            }
            _ => panic!("posing: this frame belongs to another body"),
        }
    }

    fn skinned(&self, model: &BodyTensors) -> (Tensor<3>, Tensor<2>) {
        let (Rotations::Joints(posed), Source::Skinned { body, shifts_m, .. }) = (&self.frame.rotations, &self.body.source)
        else {
            unreachable!("the caller has matched both")
        };
        let on = self.on;
        let window = self.frame.basis.poses.clone();
        let (poses, vertices, joints) = (window.len(), self.frame.vertices_m.len(), body.parents().len());
        let weights = &self.frame.middle.weights;
        // The joints' motions minus their mean over the frame's middle, in f64.
        let mut difference = Vec::with_capacity(joints * poses * 12);
        let mut means = Vec::with_capacity(joints * 9);
        for joint in 0..joints {
            let (turns, places) = (&posed.rotations[joint * poses..][..poses], &posed.translations_m[joint * poses..][..poses]);
            let mean_turn: Matrix = turns.iter().zip(weights).map(|(turn, &weight)| turn * weight).sum();
            let mean_place: Vector = places.iter().zip(weights).map(|(place, &weight)| place * weight).sum();
            for (turn, place) in turns.iter().zip(places) {
                difference.extend(row_major(&(turn - mean_turn)));
                difference.extend((place - mean_place).iter());
            }
            means.extend(row_major(&mean_turn));
        }
        let mut motion: Tensor<2> = on.tensor(difference, [joints, poses * 12]);
        let shape = self.shape_change(model);
        let local = self.local_change();
        if local.is_some() || shape.is_some() {
            let rest = shape.as_ref().map(|shape| model.regressor.clone().matmul(shape.clone()));
            motion = motion + self.chain_change(local.clone(), rest);
        }
        let moved: Tensor<4> = model.skinning().matmul(motion).reshape([vertices, poses, 12, 1]);
        let mean: Tensor<3> = model.skinning().matmul(on.tensor(means, [joints, 9])).reshape([vertices, 1, 9]);
        let rotation = moved.clone().narrow(2, 0, 9);
        let blended: Tensor<3> = rotation.clone().reshape([vertices, poses, 9]) + mean;
        let about = |turn: Tensor<4>, x: Tensor<4>| -> Tensor<3> { (turn * x).sum_dim(3).squeeze_dim(3) };
        let reference: Tensor<4> = on.tensor(body.rest_m().into_iter().flatten().collect(), [vertices, 1, 1, 3]);
        let mut change = about(rotation.reshape([vertices, poses, 3, 3]), reference) + moved.narrow(2, 9, 3).squeeze_dim::<3>(3);
        if let Some(blend) = self.blend(model, local, shape, posed.blends_m.as_deref()) {
            let turned = about(blended.clone().reshape([vertices, poses, 3, 3]), blend.unsqueeze_dim(2));
            let before = self.blend_in_the_middle(posed);
            change = change + turned - on.tensor(before, [vertices, 1, 3]);
        }
        let shifts = &shifts_m[window];
        let mean_shift: Vector = shifts.iter().zip(weights).map(|(shift, &weight)| shift * weight).sum();
        let shifts = shifts.iter().flat_map(|shift| (shift - mean_shift).data.0[0]).collect();
        (change + on.tensor(shifts, [1, poses, 3]), blended.reshape([vertices, poses * 9]))
    }

    /// `[vertex, xyz]`, metres.
    fn shape_change(&self, model: &BodyTensors) -> Option<Tensor<2>> {
        let (betas, directions) = (self.pose.betas.clone()?, model.shape_directions.as_ref()?);
        let count = betas.dims()[0].min(directions.dims()[0]);
        let known = (0..count).map(|shape| self.body.correction.betas.get(shape).copied().unwrap_or(0.0)).collect();
        let change = betas.narrow(0, 0, count) - self.on.tensor(known, [count]);
        let moved = change.unsqueeze::<2>().matmul(directions.clone().narrow(0, 0, count));
        Some(moved.reshape([self.frame.vertices_m.len(), 3]))
    }

    /// Time of every pose of the window, seconds after the motion's first pose.
    fn times_s(&self) -> Vec<f64> {
        let all = &self.body.pose_times_s;
        self.frame.basis.poses.clone().map(|pose| all[pose] - all[0]).collect()
    }

    /// A quantity of the knots at the poses of the window, `[knot, feature]` to `[pose, feature]`.
    fn at_poses(&self, knots: Tensor<2>) -> Tensor<2> {
        let around: Vec<_> = self.times_s().iter().map(|&time| self.body.correction.knots_around(time)).collect();
        let first = around.iter().flatten().map(|&(knot, _)| knot).min().unwrap_or(0);
        let last = around.iter().flatten().map(|&(knot, _)| knot).max().unwrap_or(0);
        let width = last + 1 - first;
        let mut weights = vec![0.0; around.len() * width];
        for (pose, around) in around.iter().enumerate() {
            around.iter().for_each(|&(knot, weight)| weights[pose * width + knot - first] += weight);
        }
        self.on.tensor(weights, [around.len(), width]).matmul(knots.narrow(0, first, width))
    }

    /// Change of the joints' rotations relative to their parents, `[pose, joint, row, column]`.
    fn local_change(&self) -> Option<Tensor<4>> {
        let knots = self.pose.turns_rad.clone()?;
        let Source::Skinned { poses, .. } = &self.body.source else { return None };
        let [count, joints, _] = knots.dims();
        let window = &poses[self.frame.basis.poses.clone()];
        let angles = self.at_poses(knots.reshape([count, joints * 3])).reshape([window.len() * joints, 3]);
        let known: Vec<[f64; 3]> =
            self.times_s().into_iter().flat_map(|time| self.body.correction.turns_at(time, joints)).collect();
        let before = known.iter().map(|&turn| rotation(turn) - Matrix::identity());
        // The joint's rotation without any correction.
        let joint = window.iter().flatten().zip(&known).map(|(&joint, &turn)| rotation(turn).transpose() * rotation(joint));
        let change = turns(angles) - self.on.matrices(before);
        Some(change.matmul(self.on.matrices(joint)).reshape([window.len(), joints, 3, 3]))
    }

    fn chain_change(&self, local: Option<Tensor<4>>, rest_m: Option<Tensor<2>>) -> Tensor<2> {
        let (Rotations::Joints(posed), Source::Skinned { body, poses, world_from_body, .. }) =
            (&self.frame.rotations, &self.body.source)
        else {
            unreachable!("only a skinned body has joints")
        };
        let window = &poses[self.frame.basis.poses.clone()];
        let joints = body.parents().len();
        let rotations: Vec<Vec<Matrix>> = window.iter().map(|pose| pose.iter().map(|&joint| rotation(joint)).collect()).collect();
        let chain = Chain {
            parents: body.parents(),
            rest_m: body.rest_joints_m(),
            world_from_body,
            local: &rotations,
            world: &posed.rotations,
        };
        let still = || self.on.tensor(vec![0.0; window.len() * joints * 9], [window.len(), joints, 3, 3]);
        chain.change(local.unwrap_or_else(still), rest_m, self.on)
    }

    /// What shape and pose blend shapes add to the rest pose, `[vertex, pose, xyz]`, metres.
    fn blend(
        &self,
        model: &BodyTensors,
        local: Option<Tensor<4>>,
        shape: Option<Tensor<2>>,
        known: Option<&[[f64; 3]]>,
    ) -> Option<Tensor<3>> {
        let (poses, vertices) = (self.frame.basis.poses.len(), self.frame.vertices_m.len());
        let known =
            known.map(|known| -> Tensor<3> { self.on.tensor(known.iter().flatten().copied().collect(), [vertices, poses, 3]) });
        let by_pose = local.zip(model.pose_directions.as_ref()).map(|(local, directions)| {
            let [_, joints, _, _] = local.dims();
            let feature = local.narrow(1, 1, joints - 1).reshape([poses, 9 * (joints - 1)]);
            feature.matmul(directions.clone()).reshape([poses, vertices, 3]).swap_dims(0, 1)
        });
        let by_shape = shape.map(|shape| shape.unsqueeze_dim::<3>(1).expand([vertices, poses, 3]));
        [known, by_pose, by_shape].into_iter().flatten().reduce(|sum, part| sum + part)
    }

    /// What the known blend shapes add to the vertices in the middle of the frame, `[vertex, xyz]`, flat, metres.
    fn blend_in_the_middle(&self, posed: &Poses) -> Vec<f64> {
        let Source::Skinned { body, .. } = &self.body.source else { return Vec::new() };
        let vertices = self.frame.vertices_m.len();
        let Some(blends) = &posed.blends_m else { return vec![0.0; vertices * 3] };
        let at = |vertex: usize| -> Vector {
            let poses = self.frame.middle.weights.iter().enumerate();
            poses
                .map(|(pose, &weight)| {
                    let blend = Vector::from(blends[vertex * posed.count + pose]);
                    body.blended_rotation(vertex, pose, posed) * blend * weight
                })
                .sum()
        };
        (0..vertices).flat_map(|vertex| at(vertex).data.0[0]).collect()
    }

    /// Heading, shift and the knots' shifts; also the transpose of the heading's rotation minus one.
    pub fn placed(&self, own_m: Tensor<3>) -> (Tensor<3>, Option<Tensor<2>>) {
        let (correction, on) = (&self.body.correction, self.on);
        let [vertices, poses, _] = own_m.dims();
        let known: Vec<Vector> = self.times_s().into_iter().map(|time| correction.shift_at(time)).collect();
        let flat_known = || known.iter().flat_map(|shift| shift.data.0[0]).collect::<Vec<f64>>();
        let mut change = own_m.clone();
        let heading = self.pose.heading_rad.clone().map(|heading| {
            let angle = (heading - correction.heading_rad).reshape([1, 1]);
            let (sine, half) = (angle.clone().sin(), (angle * 0.5).sin());
            let less = half.square() * -2.0;
            let zero = sine.zeros_like();
            let rows = [less.clone(), sine.clone(), zero.clone(), -sine, less, zero.clone(), zero.clone(), zero.clone(), zero];
            Tensor::cat(rows.to_vec(), 1).reshape([3, 3])
        });
        if let Some(heading) = &heading {
            let pivot = Vector::from(correction.pivot_m) + Vector::from(correction.shift_m);
            let arms = self.frame.vertices_m.iter().flat_map(|&vertex| (Vector::from(vertex) - pivot).data.0[0]).collect();
            let arm = own_m + on.tensor(arms, [vertices, 1, 3]) - on.tensor(flat_known(), [1, poses, 3]);
            change = change + times(arm, heading.clone());
        }
        if let Some(shift) = self.pose.shift_m.clone() {
            change = change + (shift - on.tensor(correction.shift_m.to_vec(), [3])).reshape([1, 1, 3]);
        }
        if let Some(knots) = self.pose.shifts_m.clone() {
            let shifts = self.at_poses(knots) - on.tensor(flat_known(), [poses, 3]);
            change = change + shifts.unsqueeze_dim::<3>(0);
        }
        (change, heading)
    }
}

fn row_major(matrix: &Matrix) -> impl Iterator<Item = f64> {
    (0..9).map(move |entry| matrix[(entry / 3, entry % 3)])
}
