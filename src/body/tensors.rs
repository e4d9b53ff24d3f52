//! The body as tensor operations: shape, pose and translation to vertices, with gradients to all three.
//!
//! The host's f64 chain ([`super::kinematics`], [`super::skinning`]) is the reference. In f32, absolute positions are
//! good to 1e-7 m only; what a frame needs is posed in differences ([`super::PosedFrame`]), which keep 1e-8 m.

use burn::tensor::{Tensor, TensorCreationOptions, TensorData};

use crate::person::BodyModel;

/// What every joint does to points of the rest pose.
#[derive(Clone, Debug)]
pub struct JointMotion {
    /// `[joint, row, column]`.
    pub rotation: Tensor<3>,
    /// `[joint, xyz]`, metres.
    pub translation: Tensor<2>,
}

/// Linear blend skinning: Σ_joint w (R x + t).
///
/// # Shapes
/// - `rest`: `[vertex, xyz]`, metres; `weights`: `[vertex, joint]`
/// - result: `[vertex, xyz]`, metres
///
/// # Gradient
/// Flows to `rest` (so also to canonical offsets), to the motion and to the weights; linear in each.
pub fn skin(rest: Tensor<2>, motion: &JointMotion, weights: Tensor<2>) -> Tensor<2> {
    let [joints, _, _] = motion.rotation.dims();
    let translation = weights.clone().matmul(motion.translation.clone());
    rotate(rest, motion.rotation.clone().reshape([joints, 9]), weights) + translation
}

/// Σ_joint w R x, with the rotations as `[joint, row · column]`.
fn rotate(x: Tensor<2>, rotation: Tensor<2>, weights: Tensor<2>) -> Tensor<2> {
    let [vertices, _] = x.dims();
    let blended: Tensor<3> = weights.matmul(rotation).reshape([vertices, 3, 3]);
    (blended * x.unsqueeze_dim(1)).sum_dim(2).squeeze_dim(2)
}

/// Rotation matrices of axis-angle vectors (Rodrigues).
///
/// # Shapes
/// - `axis_angle`: `[joint, xyz]`, radians
/// - result: `[joint, row, column]`
///
/// # Gradient
/// Flows to the angles; smooth, at zero too.
pub fn rotations(axis_angle: Tensor<2>) -> Tensor<3> {
    let identity = Tensor::<2>::eye(3, &axis_angle.device()).cast(axis_angle.dtype()).unsqueeze::<3>();
    turns(axis_angle) + identity
}

/// The same minus the identity, without cancellation: a small turn keeps all its digits.
pub fn turns(axis_angle: Tensor<2>) -> Tensor<3> {
    let [joints, _] = axis_angle.dims();
    let square = axis_angle.clone().square().sum_dim(1);
    // Both factors are smooth functions of the squared angle; near zero their series avoid 0/0.
    let is_small = square.clone().lower_scalar(1e-2);
    let near = square.clone().mask_fill(is_small.clone().bool_not(), 0.0);
    let angle = square.clone().mask_fill(is_small.clone(), 1.0).sqrt();
    let series = |terms: [f64; 5]| {
        let [first, rest @ ..] = terms;
        rest.into_iter().fold(near.zeros_like() + first, |sum, term| sum * near.clone() + term)
    };
    let sine = (angle.clone().sin() / angle.clone())
        .mask_where(is_small.clone(), series([1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0]));
    let cosine = ((angle.clone().cos() - 1.0) / -angle.square())
        .mask_where(is_small, series([1.0 / 3_628_800.0, -1.0 / 40_320.0, 1.0 / 720.0, -1.0 / 24.0, 0.5]));
    let [x, y, z] = [0, 1, 2].map(|axis| axis_angle.clone().narrow(1, axis, 1));
    let zero = x.zeros_like();
    let cross: Tensor<3> = Tensor::cat(vec![zero.clone(), -z.clone(), y.clone(), z, zero.clone(), -x.clone(), -y, x, zero], 1)
        .reshape([joints, 3, 3]);
    let factor = |factor: Tensor<2>| -> Tensor<3> { factor.unsqueeze_dim(2) };
    cross.clone() * factor(sine) + cross.clone().matmul(cross) * factor(cosine)
}

/// A body model on a device.
#[derive(Clone, Debug)]
pub struct BodyTensors {
    /// `[vertex, xyz]`, metres.
    template: Tensor<2>,
    /// `[shape, vertex · xyz]`.
    pub(super) shape_directions: Option<Tensor<2>>,
    /// `[9 (joint − 1), vertex · xyz]`.
    pub(super) pose_directions: Option<Tensor<2>>,
    /// `[joint, vertex]`.
    pub(super) regressor: Tensor<2>,
    /// `[vertex, joint]`.
    skinning: Tensor<2>,
    parents: Vec<Option<usize>>,
}

impl BodyTensors {
    /// The constants of a body on the device and in the kind of number that `options` say; none of them learns.
    pub fn new(model: &BodyModel, options: impl Into<TensorCreationOptions>) -> Self {
        let options = options.into();
        let (vertices, joints) = (model.template.len(), model.parents.len());
        let blends = |directions: &[Vec<[f64; 3]>]| {
            let flat: Vec<f64> = directions.iter().flatten().flatten().copied().collect();
            (!directions.is_empty())
                .then(|| Tensor::from_data(TensorData::new(flat, [directions.len(), vertices * 3]), options.clone()))
        };
        let dense = |rows: &[Vec<(usize, f64)>], width: usize| {
            let mut flat = vec![0.0; rows.len() * width];
            for (row, weights) in rows.iter().enumerate() {
                for &(column, weight) in weights {
                    flat[row * width + column] += weight;
                }
            }
            Tensor::from_data(TensorData::new(flat, [rows.len(), width]), options.clone())
        };
        let template: Vec<f64> = model.template.iter().flatten().copied().collect();
        Self {
            template: Tensor::from_data(TensorData::new(template, [vertices, 3]), options.clone()),
            shape_directions: blends(&model.shape_directions),
            pose_directions: blends(&model.pose_directions),
            regressor: dense(&model.joint_regressor, vertices),
            skinning: dense(&model.skinning, joints),
            parents: model.parents.clone(),
        }
    }

    /// `[vertex, joint]`.
    pub fn skinning(&self) -> Tensor<2> {
        self.skinning.clone()
    }

    /// Rest pose of a shape, `[vertex, xyz]`, metres; `betas`: `[shape]`, at most as many as the body has.
    pub fn shaped(&self, betas: Tensor<1>) -> Tensor<2> {
        let [vertices, _] = self.template.dims();
        match &self.shape_directions {
            None => self.template.clone(),
            Some(directions) => {
                let count = betas.dims()[0].min(directions.dims()[0]);
                let change = betas.narrow(0, 0, count).unsqueeze::<2>().matmul(directions.clone().narrow(0, 0, count));
                self.template.clone() + change.reshape([vertices, 3])
            }
        }
    }

    /// The joints' motion from the rest pose, of a shape (`[vertex, xyz]`) and rotations (`[joint, row, column]`).
    pub fn motion(&self, shaped: Tensor<2>, rotations: Tensor<3>) -> JointMotion {
        let rest = self.regressor.clone().matmul(shaped);
        let column = |tensor: &Tensor<2>, joint: usize| -> Tensor<2> { tensor.clone().narrow(0, joint, 1).transpose() };
        let mut turns: Vec<Tensor<2>> = Vec::new();
        let mut places: Vec<Tensor<2>> = Vec::new();
        for (joint, parent) in self.parents.iter().enumerate() {
            let turn: Tensor<2> = rotations.clone().narrow(0, joint, 1).squeeze_dim(0);
            let (turn, place) = match *parent {
                None => (turn, column(&rest, joint)),
                Some(parent) => {
                    let bone = column(&rest, joint) - column(&rest, parent);
                    (turns[parent].clone().matmul(turn), turns[parent].clone().matmul(bone) + places[parent].clone())
                }
            };
            turns.push(turn);
            places.push(place);
        }
        let rotation: Tensor<3> = Tensor::stack(turns, 0);
        let places: Tensor<2> = Tensor::cat(places, 1).transpose();
        let rest: Tensor<3> = rest.unsqueeze_dim(1);
        JointMotion { translation: places - (rotation.clone() * rest).sum_dim(2).squeeze_dim::<2>(2), rotation }
    }

    /// Posed vertices.
    ///
    /// # Shapes
    /// - `pose`: `[joint, xyz]` axis-angle, radians; `betas`: `[shape]`; `translation`: `[xyz]`, metres
    /// - result: `[vertex, xyz]`, metres, body frame
    ///
    /// # Gradient
    /// Flows to all three; smooth.
    pub fn vertices(&self, pose: Tensor<2>, betas: Tensor<1>, translation: Tensor<1>) -> Tensor<2> {
        let rotations = rotations(pose);
        let shaped = self.shaped(betas);
        let motion = self.motion(shaped.clone(), rotations.clone());
        skin(shaped + self.pose_blend(rotations), &motion, self.skinning.clone()) + translation.unsqueeze::<2>()
    }

    /// Change of the rest pose by the pose blend shapes, `[vertex, xyz]`, metres.
    fn pose_blend(&self, rotations: Tensor<3>) -> Tensor<2> {
        let ([vertices, _], [joints, _, _]) = (self.template.dims(), rotations.dims());
        match &self.pose_directions {
            None => self.template.zeros_like(),
            Some(directions) => {
                let identity = Tensor::<2>::eye(3, &rotations.device()).cast(rotations.dtype()).unsqueeze::<3>();
                let feature = (rotations.narrow(0, 1, joints - 1) - identity).reshape([1, 9 * (joints - 1)]);
                feature.matmul(directions.clone()).reshape([vertices, 3])
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use burn::tensor::{DType, Device};

    use super::*;
    use crate::body::kinematics::{Matrix, Vector};
    use crate::body::skinning::SkinnedBody;
    use crate::body::test_bodies::random_body;

    const JOINTS: usize = 6;

    fn data<const D: usize>(values: &[f64], dims: [usize; D], device: &Device, dtype: DType) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values.to_vec(), dims), (device, dtype))
    }

    fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
        tensor.into_data().convert::<f64>().try_to_vec().unwrap()
    }

    fn angles() -> Vec<f64> {
        // One joint at rest: the singular point of Rodrigues; one with a tiny angle.
        (0..JOINTS * 3)
            .map(|i| {
                if i / 3 == 2 {
                    0.0
                } else if i / 3 == 3 {
                    1e-3 * i as f64
                } else {
                    (i as f64).sin()
                }
            })
            .collect()
    }

    fn host(model: &BodyModel, angles: &[f64], betas: &[f64], shift: [f64; 3]) -> Vec<f64> {
        let pose: Vec<[f64; 3]> = angles.chunks_exact(3).map(|joint| [joint[0], joint[1], joint[2]]).collect();
        let posed = SkinnedBody::new(model, betas).pose(&[&pose], &Matrix::identity(), &[Vector::from(shift)]);
        posed.vertices_m.into_iter().flatten().collect()
    }

    #[test]
    fn tensors_pose_as_the_host_does() {
        let model = random_body(30, JOINTS, 5);
        let (betas, shift) = ([0.4, -0.8], [0.1, 2.0, -0.3]);
        let wanted = host(&model, &angles(), &betas, shift);
        for (dtype, tolerance) in [(DType::F64, 1e-13), (DType::F32, 2e-6)] {
            let device = Device::flex();
            let vertices = BodyTensors::new(&model, (&device, dtype)).vertices(
                data(&angles(), [JOINTS, 3], &device, dtype),
                data(&betas, [2], &device, dtype),
                data(&shift, [3], &device, dtype),
            );
            for (found, wanted) in values(vertices).iter().zip(&wanted) {
                assert!((found - wanted).abs() < tolerance, "{dtype:?}: {found}, wanted {wanted}");
            }
        }
    }

    pub(crate) fn gradients_reach_pose_shape_and_translation() {
        let model = random_body(12, JOINTS, 6);
        let device = Device::flex().autodiff();
        let (betas, shift) = ([0.4, -0.8], [0.1, 2.0, -0.3]);
        let tracked = [
            data::<1>(&angles(), [JOINTS * 3], &device, DType::F64).require_grad(),
            data::<1>(&betas, [2], &device, DType::F64).require_grad(),
            data::<1>(&shift, [3], &device, DType::F64).require_grad(),
        ];
        let vertices = BodyTensors::new(&model, (&device, DType::F64)).vertices(
            tracked[0].clone().reshape([JOINTS, 3]),
            tracked[1].clone(),
            tracked[2].clone(),
        );
        let weights: Vec<f64> = (0..36).map(|i| (0.7 * i as f64).cos()).collect();
        let gradients = (vertices * data(&weights, [12, 3], &device, DType::F64)).sum().backward();
        let loss = |parameters: &[Vec<f64>; 3]| -> f64 {
            let shift = [parameters[2][0], parameters[2][1], parameters[2][2]];
            host(&model, &parameters[0], &parameters[1], shift).iter().zip(&weights).map(|(value, weight)| value * weight).sum()
        };
        let at = [angles(), betas.to_vec(), shift.to_vec()];
        for (which, tensor) in tracked.iter().enumerate() {
            let found = values(tensor.grad(&gradients).expect("a gradient"));
            for entry in 0..at[which].len() {
                let moved = |step: f64| {
                    let mut parameters = at.clone();
                    parameters[which][entry] += step;
                    loss(&parameters)
                };
                let wanted = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                crate::support::compared(&[wanted]);
                assert!(
                    (found[entry] - wanted).abs() < 1e-7 * (1.0 + wanted.abs()),
                    "{which} {entry}: {}, wanted {wanted}",
                    found[entry]
                );
            }
        }
    }
}
