//! Local frames on the surface: tangent, bitangent, normal.

use burn::tensor::Tensor;

use super::dot;

/// Right-handed and orthonormal: tangent × bitangent = normal. Each `[point, knot, xyz]`, unit vectors.
#[derive(Clone, Debug)]
pub struct Frame {
    pub tangent: Tensor<3>,
    pub bitangent: Tensor<3>,
    pub normal: Tensor<3>,
}

/// Squared length below which a direction is not trusted.
const TINY: f64 = 1e-12;

impl Frame {
    /// The frame whose tangent follows `reference` (Gram-Schmidt). With an edge of the posed mesh as reference the
    /// frame turns with the body, smoothly, as no rule that sees only the normal can: no field of tangents on the
    /// sphere is smooth everywhere.
    ///
    /// # Shapes
    /// - `normal`: `[point, knot, xyz]`, unit
    /// - `reference`: the same, any length but not along the normal (then the tangent is zero: no NaN, no aperture)
    ///
    /// # Gradient
    /// Flows to both.
    pub fn along(normal: Tensor<3>, reference: Tensor<3>) -> Self {
        let across = dot(normal.clone(), reference.clone()).unsqueeze_dim::<3>(2);
        let tangent = reference - normal.clone() * across;
        let length = (dot(tangent.clone(), tangent.clone()) + TINY).sqrt().unsqueeze_dim::<3>(2);
        let tangent = tangent / length;
        Self { bitangent: cross(normal.clone(), tangent.clone()), tangent, normal }
    }

    /// A frame from the normal alone (Duff et al. 2017, "Building an Orthonormal Basis, Revisited"): exact for every
    /// normal, and smooth except across n_z = 0, where it jumps. For surfaces that stand still.
    ///
    /// # Gradient
    /// Flows to `normal`; finite everywhere.
    pub fn from_normal(normal: Tensor<3>) -> Self {
        let axis = |axis: usize| normal.clone().narrow(2, axis, 1);
        let (x, y, z) = (axis(0), axis(1), axis(2));
        // The sign of z, with +1 at zero; sign() is zero there.
        let sign = (z.clone().detach().sign() * 2.0 + 1.0).sign();
        let a: Tensor<3> = -1.0 / (sign.clone() + z);
        let b = x.clone() * y.clone() * a.clone();
        let tangent = Tensor::cat(
            vec![sign.clone() * x.clone().powi_scalar(2) * a.clone() + 1.0, sign.clone() * b.clone(), -sign.clone() * x],
            2,
        );
        let bitangent = Tensor::cat(vec![b, sign + y.clone().powi_scalar(2) * a, -y], 2);
        Self { tangent, bitangent, normal }
    }

    /// Coordinates of directions along tangent, bitangent and normal, each `[point, knot]`.
    pub fn coordinates(&self, direction: Tensor<3>) -> [Tensor<2>; 3] {
        [&self.tangent, &self.bitangent, &self.normal].map(|axis| dot(axis.clone(), direction.clone()))
    }
}

/// a × b over the last axis.
fn cross(a: Tensor<3>, b: Tensor<3>) -> Tensor<3> {
    let axis = |tensor: &Tensor<3>, axis: usize| tensor.clone().narrow(2, axis, 1);
    let component = |i: usize, j: usize| axis(&a, i) * axis(&b, j) - axis(&a, j) * axis(&b, i);
    Tensor::cat(vec![component(1, 2), component(2, 0), component(0, 1)], 2)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_backends, check_finite, check_gradient, directions, input, tensor, values};
    use burn::tensor::Device;

    fn assert_orthonormal(frame: &Frame) {
        let axes = [&frame.tangent, &frame.bitangent, &frame.normal];
        let (mut found, mut wanted) = (Vec::new(), Vec::new());
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate() {
                found.extend(values(&dot((*a).clone(), (*b).clone())));
                wanted.resize(found.len(), if i == j { 1.0 } else { 0.0 });
            }
        }
        assert_close("products of the axes", &found, &wanted, 1e-9);
        let handed = values(&cross(frame.tangent.clone(), frame.bitangent.clone()));
        assert_close("tangent × bitangent", &handed, &values(&frame.normal), 1e-9);
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed_for_every_normal() {
        let mut normals = directions(1, 50);
        normals.extend([0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
        let normal = tensor(&normals, [54, 1, 3], &Device::flex());
        assert_orthonormal(&Frame::from_normal(normal.clone()));
        assert_orthonormal(&Frame::along(normal, tensor(&directions(2, 54), [54, 1, 3], &Device::flex())));
    }

    #[test]
    fn a_frame_along_an_edge_turns_with_the_body() {
        // A quarter turn about z of normal and edge turns the tangent by the same.
        let device = Device::flex();
        let (normals, edges) = (directions(3, 9), directions(4, 9));
        let turn = |v: &[f64]| v.chunks(3).flat_map(|v| [-v[1], v[0], v[2]]).collect::<Vec<_>>();
        let frame = |n: &[f64], e: &[f64]| Frame::along(tensor(n, [3, 3, 3], &device), tensor(e, [3, 3, 3], &device));
        let (before, after) = (frame(&normals, &edges), frame(&turn(&normals), &turn(&edges)));
        assert_close("tangent", &values(&after.tangent), &turn(&values(&before.tangent)), 1e-12);
    }

    fn flat(frame: Frame) -> Tensor<1> {
        let count = frame.normal.dims().iter().product::<usize>();
        Tensor::cat([frame.tangent, frame.bitangent].map(|axis| axis.reshape([count])).to_vec(), 0)
    }

    pub(crate) fn gradients_agree_with_central_differences() {
        let inputs = [input("normal", directions(5, 4)), input("reference", directions(6, 4))];
        let along = |x: &[Tensor<1>]| flat(Frame::along(x[0].clone().reshape([2, 2, 3]), x[1].clone().reshape([2, 2, 3])));
        check_gradient(&inputs, 1e-6, 1e-7, along);
        check_backends(&inputs, 1e-5, along);
        check_gradient(&inputs[..1], 1e-6, 1e-7, |x| flat(Frame::from_normal(x[0].clone().reshape([2, 2, 3]))));
    }

    #[test]
    fn poles_and_a_reference_along_the_normal_are_finite() {
        let poles = [0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        check_finite(&[input("normal", poles)], |x| flat(Frame::from_normal(x[0].clone().reshape([4, 1, 3]))));
        check_finite(&[input("normal", poles), input("reference", poles)], |x| {
            flat(Frame::along(x[0].clone().reshape([4, 1, 3]), x[1].clone().reshape([4, 1, 3])))
        });
    }
}
