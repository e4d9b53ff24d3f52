//! The phase of a whole flat facet, in closed form: no scatterer needs to sit closer than the mesh's own facets.

use burn::tensor::{Tensor, TensorData};

use super::Displacement;
use crate::complex::Complex;

/// Two edges of every facet, from its first corner to its second and to its third, metres; components `[point, chirp]`.
#[derive(Clone, Debug)]
pub struct FacetEdges {
    pub second: Displacement,
    pub third: Displacement,
}

/// Mean of exp(j κ·(x − centre)) over each facet: 1 at κ = 0, and it falls as the facet turns away from the
/// specular direction. Times the facet's area it is the surface integral over one flat facet (physical optics).
///
/// The mean over a triangle of exp of a linear phase is twice the second divided difference of exp at the phases of
/// its three corners (Hermite-Genocchi). Sorted phases put the largest gap below the fraction bar; where even that
/// gap is small, a power series takes over. Edges and κ are those of every chirp: a facet that turns by a
/// hundredth of a radian within a frame shifts the phase at its corners by half a radian.
///
/// # Shapes
/// - `edges`: components `[point, chirp]`, metres
/// - `wavevector`: components `[point, chirp]`, rad/m (see [`wavevector`])
/// - result: `[point, chirp]`
///
/// # Gradient
/// Flows to edges and wavevector; smooth everywhere, κ = 0, equal corners and degenerate facets included.
/// Error: below 1e-6 in f32 for phases of a few turns, 1e-11 in f64.
pub fn facet_integral(edges: &FacetEdges, wavevector: &Displacement) -> Complex<2> {
    let (second, third) = (dot(&edges.second, wavevector), dot(&edges.third, wavevector));
    // Phases of the corners relative to the centre; they sum to zero.
    let first = (second.clone() + third.clone()) / -3.0;
    triangle_mean(first.clone(), second + first.clone(), third + first)
}

fn dot(a: &Displacement, b: &Displacement) -> Tensor<2> {
    a.x.clone() * b.x.clone() + a.y.clone() * b.y.clone() + a.z.clone() * b.z.clone()
}

/// Gradient of the carrier's phase with respect to a scatterer's position, κ = k Σ (x − antenna)/|x − antenna|, rad/m:
/// the phase grows with the way to either antenna.
///
/// # Shapes
/// - `reference_m`: `[point, xyz]`, host; `displacement`: components `[point, chirp]`, metres
/// - result: components `[point, chirp]`
///
/// # Gradient
/// Flows to the displacement. Smooth except where a point meets an antenna.
pub fn wavevector(
    reference_m: &[[f64; 3]],
    displacement: &Displacement,
    antennas_m: [[f64; 3]; 2],
    wavelength_m: f64,
) -> Displacement {
    let wavenumber = std::f64::consts::TAU / wavelength_m;
    let device = displacement.x.device();
    let options = (&device, displacement.x.dtype());
    let from = |antenna_m: [f64; 3]| {
        let component = |axis: usize, change: &Tensor<2>| {
            let offset: Vec<f64> = reference_m.iter().map(|point| point[axis] - antenna_m[axis]).collect();
            change.clone() + Tensor::<2>::from_data(TensorData::new(offset, [reference_m.len(), 1]), options)
        };
        let away =
            Displacement { x: component(0, &displacement.x), y: component(1, &displacement.y), z: component(2, &displacement.z) };
        // The small number keeps value and gradient finite in an antenna itself.
        let scale = (dot(&away, &away) + 1e-12).sqrt().recip() * wavenumber;
        away.map(|part| part * scale.clone())
    };
    let [to, back] = antennas_m.map(from);
    Displacement { x: to.x + back.x, y: to.y + back.y, z: to.z + back.z }
}

/// Below this spread of phases (radians) the series is used; what it leaves out there is 5e-12.
const SERIES_BELOW: f64 = 0.5;

/// Mean of exp(j phase) over a triangle whose corners have these phases, which sum to zero.
fn triangle_mean(first: Tensor<2>, second: Tensor<2>, third: Tensor<2>) -> Complex<2> {
    let low = first.clone().min_pair(second.clone()).min_pair(third.clone());
    let high = first.clone().max_pair(second.clone()).max_pair(third.clone());
    // The rest of the sum rather than a median: with ties its gradient is right whichever corner the pair chose.
    let middle = first + second + third - low.clone() - high.clone();
    let spread = high.clone() - low.clone();
    let is_small = spread.clone().lower_scalar(SERIES_BELOW);
    let is_large = is_small.clone().bool_not();

    // Large phases are blanked, so that their powers, which nobody uses, cannot overflow.
    let [a, b, c] = [&low, &middle, &high].map(|phase| phase.clone().mask_fill(is_large.clone(), 0.0));
    let series = small_triangle_mean(a, b, c);

    // exp[m, b] = exp(j (m + b)/2) sinc((b − m)/2), and m + b = −a because the three sum to zero.
    let upper = sinc((high.clone() - middle.clone()) * 0.5);
    let lower = sinc((middle - low.clone()) * 0.5);
    let (low, high) = (low * 0.5, high * 0.5);
    let re = low.clone().cos() * upper.clone() - high.clone().cos() * lower.clone();
    let im = high.sin() * lower - low.sin() * upper;
    let scale = spread.mask_fill(is_small.clone(), 1.0).recip() * 2.0;
    // Divided by j times the spread.
    let (re, im) = (im * scale.clone(), -re * scale);
    Complex::new(re.mask_where(is_small.clone(), series.re), im.mask_where(is_small, series.im))
}

/// The same for small phases: Σ_n 2 jⁿ h_n / (n + 2)!, with h_n the complete symmetric polynomials of the phases.
fn small_triangle_mean(a: Tensor<2>, b: Tensor<2>, c: Tensor<2>) -> Complex<2> {
    let pairs = a.clone() * b.clone() + (a.clone() + b.clone()) * c.clone();
    let triple = a * b * c;
    // h_n = −pairs · h_{n−2} + triple · h_{n−3}, because the sum of the phases is zero; h_0 = 1, h_1 = 0.
    let h2 = -pairs.clone();
    let h3 = triple.clone();
    let next = |two_before: &Tensor<2>, three_before: &Tensor<2>| {
        triple.clone() * three_before.clone() - pairs.clone() * two_before.clone()
    };
    let h4 = -pairs.clone() * h2.clone();
    let h5 = next(&h3, &h2);
    let h6 = next(&h4, &h3);
    let h7 = next(&h5, &h4);
    let h8 = next(&h6, &h5);
    let h9 = next(&h7, &h6);
    Complex::new(
        h2 / -12.0 + h4 / 360.0 - h6 / 20_160.0 + h8 / 1_814_400.0 + 1.0,
        h3 / -60.0 + h5 / 2_520.0 - h7 / 181_440.0 + h9 / 19_958_400.0,
    )
}

/// sin x / x, with its series near zero, so that value and gradient are finite there.
fn sinc(x: Tensor<2>) -> Tensor<2> {
    let is_small = x.clone().abs().lower_scalar(0.1);
    let is_large = is_small.clone().bool_not();
    let square = x.clone().mask_fill(is_large, 0.0).square();
    let series =
        ((((square.clone() / 72.0 - 1.0) * square.clone() / 42.0 + 1.0) * square.clone() / 20.0 - 1.0) * square / 6.0) + 1.0;
    let away = x.mask_fill(is_small.clone(), 1.0);
    (away.clone().sin() / away).mask_where(is_small, series)
}

#[cfg(test)]
pub(crate) mod tests {
    use burn::tensor::{DType, Device};

    use super::*;

    type Triangle = [[f64; 3]; 2];

    fn column(values: &[f64], device: &Device, dtype: DType) -> Tensor<2> {
        Tensor::from_data(TensorData::new(values.to_vec(), [values.len(), 1]), (device, dtype))
    }

    fn vectors(rows: &[[f64; 3]], device: &Device, dtype: DType) -> Displacement {
        let axis = |axis: usize| column(&rows.iter().map(|row| row[axis]).collect::<Vec<_>>(), device, dtype);
        Displacement { x: axis(0), y: axis(1), z: axis(2) }
    }

    fn values(tensor: Tensor<2>) -> Vec<f64> {
        tensor.into_data().convert::<f64>().try_to_vec().unwrap()
    }

    fn integral(triangles: &[Triangle], kappa: &[[f64; 3]], dtype: DType) -> (Vec<f64>, Vec<f64>) {
        let device = Device::flex();
        let edges = FacetEdges {
            second: vectors(&triangles.iter().map(|t| t[0]).collect::<Vec<_>>(), &device, dtype),
            third: vectors(&triangles.iter().map(|t| t[1]).collect::<Vec<_>>(), &device, dtype),
        };
        let Complex { re, im } = facet_integral(&edges, &vectors(kappa, &device, dtype));
        (values(re), values(im))
    }

    /// Midpoint rule on n² small triangles.
    fn quadrature(triangle: Triangle, kappa: [f64; 3], n: usize) -> (f64, f64) {
        let phase = |edge: [f64; 3]| (0..3).map(|axis| edge[axis] * kappa[axis]).sum::<f64>();
        let (second, third) = (phase(triangle[0]), phase(triangle[1]));
        let (mut re, mut im) = (0.0, 0.0);
        let mut add = |i: f64, j: f64| {
            let turn = second * (i / n as f64 - 1.0 / 3.0) + third * (j / n as f64 - 1.0 / 3.0);
            re += turn.cos();
            im += turn.sin();
        };
        for i in 0..n {
            for j in 0..n - i {
                add(i as f64 + 1.0 / 3.0, j as f64 + 1.0 / 3.0);
                if i + j + 1 < n {
                    add(i as f64 + 2.0 / 3.0, j as f64 + 2.0 / 3.0);
                }
            }
        }
        let count = (n * n) as f64;
        (re / count, im / count)
    }

    const TRIANGLE: Triangle = [[16e-3, 1e-3, 0.0], [5e-3, 12e-3, 2e-3]];

    fn directions() -> Vec<[f64; 3]> {
        let mut all = vec![[0.0, 0.0, 3300.0], [3300.0, 0.0, 0.0], [0.0, 900.0, 0.0], [-20.0, 13.0, 1.0], [30.0, -20.0, 900.0]];
        // Across the switch from series to fraction, and one pair of equal corners.
        all.extend((1..12).map(|step| [3.0 * step as f64, 0.0, 0.0]));
        all.push([-200.0, 3200.0, 0.0]);
        all
    }

    #[test]
    fn the_closed_form_equals_dense_quadrature() {
        let kappa = directions();
        let (re, im) = integral(&vec![TRIANGLE; kappa.len()], &kappa, DType::F64);
        for (row, &direction) in kappa.iter().enumerate() {
            let dense = quadrature(TRIANGLE, direction, 1000);
            let error = (re[row] - dense.0).hypot(im[row] - dense.1);
            // The midpoint rule itself is off by (phase / n)² / 36.
            assert!(error < 1e-4, "{direction:?}: {} {} against {dense:?}", re[row], im[row]);
            if direction.iter().map(|k| k.abs()).sum::<f64>() < 60.0 {
                assert!(error < 2e-8, "{direction:?}: {error}");
            }
        }
    }

    #[test]
    fn single_precision_loses_six_digits_at_most() {
        let kappa = directions();
        let triangles = vec![TRIANGLE; kappa.len()];
        let (exact, single) = (integral(&triangles, &kappa, DType::F64), integral(&triangles, &kappa, DType::F32));
        for (row, direction) in kappa.iter().enumerate() {
            let error = (exact.0[row] - single.0[row]).hypot(exact.1[row] - single.1[row]);
            assert!(error < 2e-6, "{direction:?}: {error}");
        }
    }

    #[test]
    fn series_and_fraction_meet() {
        let around: Vec<[f64; 3]> = [0.499_999_999, 0.500_000_001].map(|spread| [spread / 16e-3, 0.0, 0.0]).to_vec();
        let flat = vec![[[16e-3, 0.0, 0.0], [4e-3, 12e-3, 0.0]]; 2];
        let (re, im) = integral(&flat, &around, DType::F64);
        assert!((re[0] - re[1]).abs() < 1e-9 && (im[0] - im[1]).abs() < 1e-9, "{re:?} {im:?}");
    }

    #[test]
    fn no_wave_or_no_facet_means_one() {
        let nothing = [[0.0; 3]; 2];
        let (re, im) = integral(&[TRIANGLE, nothing], &[[0.0; 3], [3300.0, 100.0, 5.0]], DType::F32);
        assert_eq!((re, im), (vec![1.0; 2], vec![0.0; 2]));
    }

    pub(crate) fn gradients_equal_central_differences_also_where_corners_coincide() {
        let kappa =
            [[30.0, -20.0, 900.0], [900.0, 200.0, -10.0], [0.0; 3], [5.0, 3.0, 1.0], [0.0, 0.0, 3300.0], [0.0, 900.0, 0.0]];
        let equal_corners = [[16e-3, 0.0, 0.0], [4e-3, 12e-3, 0.0]];
        let triangles = [TRIANGLE, TRIANGLE, TRIANGLE, TRIANGLE, equal_corners, equal_corners];
        let device = Device::flex().autodiff();
        let rows = |edge: usize| triangles.iter().map(|t| t[edge]).collect::<Vec<_>>();
        let tracked = |v: Displacement| v.map(|part| part.require_grad());
        let edges = FacetEdges {
            second: tracked(vectors(&rows(0), &device, DType::F64)),
            third: tracked(vectors(&rows(1), &device, DType::F64)),
        };
        let wave = tracked(vectors(&kappa, &device, DType::F64));
        // A loss that weighs both parts.
        let Complex { re, im } = facet_integral(&edges, &wave);
        let gradients = (re * 0.7 + im * 1.3).sum().backward();
        let loss = |triangle: Triangle, kappa: [f64; 3]| {
            let (re, im) = integral(&[triangle], &[kappa], DType::F64);
            0.7 * re[0] + 1.3 * im[0]
        };
        for axis in 0..3 {
            let part = |v: &Displacement| values([&v.x, &v.y, &v.z][axis].grad(&gradients).unwrap());
            let (second, third, wave) = (part(&edges.second), part(&edges.third), part(&wave));
            for row in 0..kappa.len() {
                let central = |step: f64, change: &dyn Fn(&mut Triangle, &mut [f64; 3], f64)| {
                    let at = |step: f64| {
                        let (mut triangle, mut direction) = (triangles[row], kappa[row]);
                        change(&mut triangle, &mut direction, step);
                        loss(triangle, direction)
                    };
                    (at(step) - at(-step)) / (2.0 * step)
                };
                let checks = [
                    ("second", second[row], central(1e-6, &|t, _, h| t[0][axis] += h), 1e-3),
                    ("third", third[row], central(1e-6, &|t, _, h| t[1][axis] += h), 1e-3),
                    ("wave", wave[row], central(1e-2, &|_, k, h| k[axis] += h), 1e-8),
                ];
                for (name, found, wanted, tolerance) in checks {
                    crate::support::compared(&[wanted]);
                    assert!(
                        (found - wanted).abs() <= tolerance + 1e-5 * wanted.abs(),
                        "{name} {row} {axis}: {found}, wanted {wanted}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_wavevector_is_the_gradient_of_the_carrier_phase() {
        let antennas = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]];
        let point = [0.4, 3.0, -0.2];
        let device = Device::flex();
        let zero = vectors(&[[0.0; 3]], &device, DType::F64);
        let wave = wavevector(&[point], &zero, antennas, 3.9e-3);
        let phase = |point: [f64; 3]| {
            let way = |antenna: [f64; 3]| (0..3).map(|axis| (point[axis] - antenna[axis]).powi(2)).sum::<f64>().sqrt();
            std::f64::consts::TAU / 3.9e-3 * (way(antennas[0]) + way(antennas[1]))
        };
        for (axis, part) in [wave.x, wave.y, wave.z].into_iter().enumerate() {
            let mut around = [point; 2];
            around[0][axis] += 1e-5;
            around[1][axis] -= 1e-5;
            let wanted = (phase(around[0]) - phase(around[1])) / 2e-5;
            assert!((values(part)[0] - wanted).abs() < 1e-3, "{axis}");
        }
        let inside = wavevector(&[antennas[0]], &zero, antennas, 3.9e-3);
        assert!(values(inside.x)[0].is_finite(), "a point in an antenna");
    }
}
