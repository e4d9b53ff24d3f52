//! The places that scatter: what they are made of, and how much they return towards a receiver.
//!
//! ```text
//! features -> decoders -> Material -> microfacet (with fresnel): direct amplitude    (paper, section 3.2)
//!                      -> Patch    -> patches (with spherical harmonics): indirect   (paper, section 3.3)
//! visibility: who is seen; room_patches: where the room's scatterers are
//! ```
//! Amplitudes are evaluated at a few instants of a frame (axis `knot`), because directions change little within it; all
//! directions are unit vectors that point *away from the scatterer*.

pub mod decoders;
pub mod fresnel;
pub mod material;
pub mod microfacet;
pub mod patches;
pub mod room_patches;
pub mod spherical_harmonics;
pub mod tangent;
pub mod visibility;

use burn::tensor::Tensor;

/// Scalar product over the last axis.
///
/// # Shapes
/// - `a`, `b`: `[point, knot, xyz]`, either may have one point or knot for all
/// - result: `[point, knot]`
pub fn dot(a: Tensor<3>, b: Tensor<3>) -> Tensor<2> {
    let product = a * b;
    let [point, knot, _] = product.dims();
    product.sum_dim(2).reshape([point, knot])
}

/// Tensors of one learned number per point, as a column that broadcasts over knots: `[point]` to `[point, 1]`.
fn column(per_point: Tensor<1>) -> Tensor<2> {
    let [point] = per_point.dims();
    per_point.reshape([point, 1])
}

#[cfg(test)]
mod chain_tests;
