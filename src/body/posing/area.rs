//! Normals and areas of a mesh as tensor operations, from the edges of its facets.

use burn::tensor::{IndexingUpdateOp, Int, Tensor};

/// The three corners of every facet, `[facet]` each.
pub type Corners = [Tensor<1, Int>; 3];

/// Squared length below which a direction is none: of a vector of areas (m⁴), far below any mesh's.
const NONE: f64 = 1e-24;

/// Of every facet its normal, twice as long as its area, `[facet, xyz]`, m²; from two edges `[facet, xyz]`.
///
/// # Gradient
/// Flows to both; bilinear.
pub fn doubled_areas(second: Tensor<2>, third: Tensor<2>) -> Tensor<2> {
    let axis = |edge: &Tensor<2>, axis: usize| edge.clone().narrow(1, axis, 1);
    let part = |i: usize, j: usize| axis(&second, i) * axis(&third, j) - axis(&second, j) * axis(&third, i);
    Tensor::cat(vec![part(1, 2), part(2, 0), part(0, 1)], 1)
}

/// Sum of the values of the facets around each vertex, `[facet, feature]` to `[vertex, feature]`.
pub fn around(values: Tensor<2>, corners: &Corners, vertices: usize) -> Tensor<2> {
    let [_, feature] = values.dims();
    let zero = Tensor::zeros([vertices, feature], (&values.device(), values.dtype()));
    corners.iter().fold(zero, |sum, corner| sum.select_assign(0, corner.clone(), values.clone(), IndexingUpdateOp::Add))
}

/// Lengths of vectors, `[row, xyz]` to `[row, 1]`; a vector of zero has length and gradient zero.
pub fn lengths(vectors: Tensor<2>) -> Tensor<2> {
    let square = vectors.square().sum_dim(1);
    let is_none = square.clone().lower_scalar(NONE);
    square.mask_fill(is_none.clone(), 1.0).sqrt().mask_fill(is_none, 0.0)
}

/// The same directions with length one; `fallback` (constant, no gradient) where there is none.
pub fn unit(vectors: Tensor<2>, fallback: [f64; 3]) -> Tensor<2> {
    let square = vectors.clone().square().sum_dim(1);
    let is_none = square.clone().lower_scalar(NONE);
    let length = square.mask_fill(is_none.clone(), 1.0).sqrt();
    let axis = |axis: usize| (vectors.clone().narrow(1, axis, 1) / length.clone()).mask_fill(is_none.clone(), fallback[axis]);
    Tensor::cat(vec![axis(0), axis(1), axis(2)], 1)
}
