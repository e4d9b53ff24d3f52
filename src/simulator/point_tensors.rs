//! Places and values of points as tensors, and the directions from points to places.

use burn::tensor::{DType, Device, Tensor, TensorData};

use crate::features::RowIndex;

pub(super) fn way(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| to[axis] - from[axis])
}

/// Unit vectors along ways from points, `[point, 1, xyz]`.
pub(super) fn towards(ways: impl ExactSizeIterator<Item = [f64; 3]>, device: &Device) -> Tensor<3> {
    vectors(
        ways.map(|way| {
            let length = way.iter().map(|value| value * value).sum::<f64>().sqrt().max(1e-9);
            way.map(|value| value / length)
        }),
        device,
    )
}

/// The same from points that have moved on the device, `[point, xyz]`, metres.
///
/// # Gradient
/// Flows to `moved_m`.
pub(super) fn directions(ways: impl ExactSizeIterator<Item = [f64; 3]>, moved_m: Tensor<2>, device: &Device) -> Tensor<3> {
    let way = vectors(ways, device) - moved_m.unsqueeze_dim(1);
    // The small number keeps value and gradient finite in the place itself.
    let length = (way.clone().square().sum_dim(2) + 1e-18).sqrt();
    way / length
}

/// `[point, 1, xyz]`.
pub(super) fn vectors(values: impl ExactSizeIterator<Item = [f64; 3]>, device: &Device) -> Tensor<3> {
    let count = values.len();
    let flat: Vec<f32> = values.flatten().map(|value| value as f32).collect();
    Tensor::from_data(TensorData::new(flat, [count, 1, 3]), (&device.clone().without_autodiff(), DType::F32))
}

/// `[point, 1]`.
pub(super) fn column(values: impl ExactSizeIterator<Item = f64>, device: &Device) -> Tensor<2> {
    let count = values.len();
    let values: Vec<f32> = values.map(|value| value as f32).collect();
    Tensor::from_data(TensorData::new(values, [count, 1]), (&device.clone().without_autodiff(), DType::F32))
}

/// Rows of a table of `rows` points.
pub(super) fn rows(index: &[usize], rows: usize, device: &Device) -> RowIndex {
    RowIndex::new(index, rows, &device.clone().without_autodiff())
}
