//! Real spherical harmonics up to degree 3: how the strength of a patch varies with direction (paper, section 3.3).
//!
//! Orthonormal on the sphere, ordered by degree and then order −l … l, without the Condon-Shortley phase:
//! Y₀₀ = ½√(1/π); Y₁ ∝ y, z, x.

use std::f64::consts::PI;

use burn::tensor::Tensor;

/// Highest degree that is implemented.
pub const MAX_DEGREE: usize = 3;

/// Y₀₀, the same in all directions.
pub const CONSTANT: f64 = 0.282_094_791_773_878_14;

/// How many coefficients a degree needs: 1, 4, 9, 16.
pub const fn coefficients(degree: usize) -> usize {
    (degree + 1) * (degree + 1)
}

/// Σ coefficient · Y(direction).
///
/// # Shapes
/// - `weights`: `[point, coefficient]`, 1, 4, 9 or 16 of them
/// - `direction`: x, y, z of unit vectors, each `[point, knot]`
/// - result: `[point, knot]`; may be negative
///
/// # Gradient
/// Flows to `weights` and `direction` (as polynomials: also off the unit sphere); smooth everywhere.
pub fn directional(weights: Tensor<2>, direction: [Tensor<2>; 3]) -> Tensor<2> {
    let [_, coefficient] = weights.dims();
    let degree = (0..=MAX_DEGREE)
        .find(|&degree| coefficients(degree) == coefficient)
        .unwrap_or_else(|| panic!("spherical harmonics: {coefficient} coefficients, expected 1, 4, 9 or 16"));
    let weight = |index: usize| weights.clone().narrow(1, index, 1);
    let constant = weight(0) * CONSTANT;
    if degree == 0 {
        let [_, knot] = direction[0].dims();
        return constant.repeat_dim(1, knot);
    }
    let [x, y, z] = direction;
    let mut sum = constant;
    let mut index = 1;
    let mut add = |polynomial: Tensor<2>, scale: f64| {
        sum = sum.clone() + polynomial * (weight(index) * scale);
        index += 1;
    };
    let linear = (3.0 / (4.0 * PI)).sqrt();
    add(y.clone(), linear);
    add(z.clone(), linear);
    add(x.clone(), linear);
    if degree >= 2 {
        let (xx, yy, zz) = (x.clone() * x.clone(), y.clone() * y.clone(), z.clone() * z.clone());
        let product = (15.0 / (4.0 * PI)).sqrt();
        let (xy, difference) = (x.clone() * y.clone(), xx.clone() - yy.clone());
        add(xy.clone(), product);
        add(y.clone() * z.clone(), product);
        add(zz.clone() * 3.0 - 1.0, (5.0 / (16.0 * PI)).sqrt());
        add(x.clone() * z.clone(), product);
        add(difference.clone(), 0.5 * product);
        if degree >= 3 {
            let outer = (35.0 / (32.0 * PI)).sqrt();
            let middle = (105.0 / (4.0 * PI)).sqrt();
            let inner = (21.0 / (32.0 * PI)).sqrt();
            let rise: Tensor<2> = zz.clone() * 5.0 - 1.0;
            add(y.clone() * (xx.clone() * 3.0 - yy.clone()), outer);
            add(xy * z.clone(), middle);
            add(y * rise.clone(), inner);
            add(z.clone() * (zz * 5.0 - 3.0), (7.0 / (16.0 * PI)).sqrt());
            add(x.clone() * rise, inner);
            add(difference * z, 0.5 * middle);
            add(x * (xx - yy * 3.0), outer);
        }
    }
    sum
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_backends, check_gradient, cpu_devices, directions, input, numbers, tensor, values};
    use burn::tensor::Device;

    fn split(directions: Tensor<1>, knots: usize) -> [Tensor<2>; 3] {
        let [count] = directions.dims();
        let points = count / 3 / knots;
        std::array::from_fn(|axis| directions.clone().reshape([points, knots, 3]).narrow(2, axis, 1).reshape([points, knots]))
    }

    /// Every basis function (as a point of its own) in the given directions.
    fn basis(degree: usize, directions: &[f64], device: &Device) -> Vec<Vec<f64>> {
        let count = coefficients(degree);
        let identity: Vec<f64> = (0..count * count).map(|i| if i / count == i % count { 1.0 } else { 0.0 }).collect();
        let knots = directions.len() / 3;
        let all = directions.repeat(count);
        let found = directional(tensor(&identity, [count, count], device), split(tensor(&all, [all.len()], device), knots));
        values(&found).chunks(knots).map(<[f64]>::to_vec).collect()
    }

    #[test]
    fn the_basis_is_orthonormal() {
        // Gauss-Legendre in height (8 nodes: exact to degree 15) times 16 even steps in azimuth: exact for degree 3 × 3.
        let nodes: [f64; 4] = [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_2];
        let weights = [0.362_683_783_378_362, 0.313_706_645_877_887_3, 0.222_381_034_453_374_5, 0.101_228_536_290_376_3];
        let (mut quadrature, mut weight) = (Vec::new(), Vec::new());
        for (node, node_weight) in nodes.iter().zip(weights) {
            for height in [*node, -node] {
                for step in 0..16 {
                    let (sine, cosine) = (PI * f64::from(step) / 8.0).sin_cos();
                    let radius = (1.0 - height * height).sqrt();
                    quadrature.extend([radius * cosine, radius * sine, height]);
                    weight.push(node_weight * PI / 8.0);
                }
            }
        }
        for (_, device) in cpu_devices() {
            let basis = basis(3, &quadrature, &device);
            for (i, a) in basis.iter().enumerate() {
                for (j, b) in basis.iter().enumerate() {
                    let product: f64 = a.iter().zip(b).zip(&weight).map(|((a, b), w)| a * b * w).sum();
                    let wanted = if i == j { 1.0 } else { 0.0 };
                    assert!((product - wanted).abs() < 1e-12, "⟨Y{i}, Y{j}⟩ = {product}");
                }
            }
        }
    }

    #[test]
    fn lower_degrees_are_the_first_coefficients_of_higher_ones() {
        let somewhere = directions(2, 5);
        let all = basis(3, &somewhere, &Device::flex());
        for degree in 0..3 {
            assert_eq!(basis(degree, &somewhere, &Device::flex()), all[..coefficients(degree)]);
        }
        assert_close("constant", &all[0], &[CONSTANT; 5], 1e-15);
    }

    pub(crate) fn gradients_agree_with_central_differences() {
        for degree in 0..=3 {
            let count = coefficients(degree);
            let inputs = [input("weights", numbers(1, 2 * count, -1.0, 1.0)), input("direction", directions(2, 6))];
            let sum = |x: &[Tensor<1>]| directional(x[0].clone().reshape([2, count]), split(x[1].clone(), 3)).reshape([6]);
            check_gradient(&inputs, 1e-5, 1e-7, sum);
            check_backends(&inputs, 1e-5, sum);
        }
    }

    #[test]
    #[should_panic(expected = "5 coefficients")]
    fn a_number_of_coefficients_between_degrees_is_refused() {
        let device = Device::flex();
        directional(Tensor::zeros([1, 5], &device), [0; 3].map(|_| Tensor::zeros([1, 1], &device)));
    }
}
