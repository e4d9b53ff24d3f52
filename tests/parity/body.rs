//! Skinning.

use burn::tensor::{DType, Device, Tensor, TensorData};
use hybridsim::body::skinning::SkinnedBody;
use hybridsim::body::tensors::BodyTensors;
use hybridsim::person::BodyModel;

use crate::golden::{Golden, close};

/// The golden body; blend shapes are stored `[vertex, xyz, direction]`, as in SMPL's files.
fn model(golden: &Golden) -> BodyModel {
    let directions = |name: &str| -> Vec<Vec<[f64; 3]>> {
        let (shape, values) = golden.array(name);
        let count = shape[2];
        let at = |vertex: usize, axis: usize, direction: usize| values[(vertex * 3 + axis) * count + direction];
        let one = |direction| (0..shape[0]).map(|v| std::array::from_fn(|axis| at(v, axis, direction))).collect();
        (0..count).map(one).collect()
    };
    let sparse = |name: &str| -> Vec<Vec<(usize, f64)>> {
        let (shape, values) = golden.array(name);
        values.chunks_exact(shape[1]).map(|row| row.iter().copied().enumerate().collect()).collect()
    };
    BodyModel {
        template: golden.points("in_template"),
        shape_directions: directions("in_shape_directions"),
        pose_directions: directions("in_pose_directions"),
        joint_regressor: sparse("in_joint_regressor"),
        skinning: sparse("in_weights"),
        parents: golden.values("in_parents").into_iter().map(|parent| (parent >= 0.0).then_some(parent as usize)).collect(),
        faces: Vec::new(),
    }
}

#[test]
fn skinning_is_that_of_numpy_on_the_host_and_as_tensors() {
    let golden = Golden("skinning");
    let model = model(&golden);
    let betas = golden.values("in_betas");
    let (poses, shifts) = (golden.points("in_pose"), golden.points("in_translation"));
    let joints = model.parents.len();
    let each: Vec<&[[f64; 3]]> = poses.chunks_exact(joints).collect();
    let shifts_m: Vec<nalgebra::Vector3<f64>> = shifts.iter().map(|&shift| shift.into()).collect();
    let posed = SkinnedBody::new(&model, &betas).pose(&each, &nalgebra::Matrix3::identity(), &shifts_m);
    let count = each.len();
    let (wanted, vertices) = (golden.values("posed"), model.template.len());
    for pose in 0..count {
        let found: Vec<f64> = (0..vertices).flat_map(|vertex| posed.vertices_m[vertex * count + pose]).collect();
        close("host", &found, &wanted[pose * vertices * 3..(pose + 1) * vertices * 3], 1e-13);
    }

    let device = Device::flex();
    let tensors = BodyTensors::new(&model, (&device, DType::F64));
    let betas = Tensor::<1>::from_data(TensorData::new(betas, [2]), (&device, DType::F64));
    for (pose, joints_of_pose) in each.iter().enumerate() {
        let angles: Vec<f64> = joints_of_pose.iter().flatten().copied().collect();
        let angles = Tensor::<2>::from_data(TensorData::new(angles, [joints, 3]), (&device, DType::F64));
        let shift = Tensor::<1>::from_data(TensorData::new(shifts[pose].to_vec(), [3]), (&device, DType::F64));
        let found: Vec<f64> = tensors.vertices(angles, betas.clone(), shift).into_data().iter::<f64>().collect();
        close("tensors", &found, &wanted[pose * vertices * 3..(pose + 1) * vertices * 3], 1e-13);
    }
}
