use super::*;
use crate::support::{assert_close, check_backends, check_finite, check_gradient, directions, input, numbers, tensor, values};
use burn::tensor::Device;
use std::f64::consts::PI;

const RESPONSES: [Response; 3] = [Response::Paper, Response::Projected, Response::Field];

/// From flat inputs: roughness, metallic, refraction, extinction, polarisation, normal, incident, outgoing.
fn from_flat(x: &[Tensor<1>], response: Response) -> Tensor<1> {
    let [point] = x[0].dims();
    let material = Material {
        roughness: x[0].clone(),
        metallic: x[1].clone(),
        refraction: x[2].clone(),
        extinction: x[3].clone(),
        polarisation: x[4].clone(),
    };
    let direction = |i: usize| {
        let knot = x[i].dims()[0] / (3 * point);
        x[i].clone().reshape([point, knot, 3])
    };
    let found = amplitude(&material, direction(5), direction(6), direction(7), response);
    let count = found.dims().iter().product::<usize>();
    found.reshape([count])
}

/// Amplitude of one point at z-up normals with directions given by (polar angle, azimuth).
fn single(alpha: f64, index: (f64, f64), incident: (f64, f64), outgoing: (f64, f64), response: Response) -> f64 {
    let device = Device::flex();
    let unit = |(polar, azimuth): (f64, f64)| [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()];
    let flat: Vec<Tensor<1>> =
        [&[alpha][..], &[0.0], &[index.0], &[index.1], &[0.5], &[0.0, 0.0, 1.0], &unit(incident), &unit(outgoing)]
            .iter()
            .map(|values| tensor(values, [values.len()], &device))
            .collect();
    values(&from_flat(&flat, response))[0]
}

#[test]
fn normal_incidence_is_the_closed_form() {
    // D = 1/(π α²), G₂ = 1: f_r = F / (4 π α²).
    for alpha in [0.05, 0.4, 1.0] {
        let wanted = (4.0 + 2.25) / (16.0 + 2.25) / (4.0 * PI * alpha * alpha);
        let at = |response| single(alpha, (3.0, 1.5), (0.0, 0.0), (0.0, 0.0), response);
        // The rounding-off at grazing costs 5e-5 each way at normal incidence.
        assert_close("f_r", &[at(Response::Paper), at(Response::Projected)], &[wanted, wanted], 3e-4);
        assert_close("√f_r", &[at(Response::Field)], &[wanted.sqrt()], 3e-4);
    }
}

#[test]
fn away_from_grazing_it_is_the_formula_term_by_term() {
    let (alpha, polar_i, polar_o, azimuth) = (0.3_f64, 0.5_f64, 0.9_f64, 1.1_f64);
    let (ci, co) = (polar_i.cos(), polar_o.cos());
    let i_dot_o = polar_i.sin() * polar_o.sin() * azimuth.cos() + ci * co;
    let half = ((1.0 + i_dot_o) / 2.0).sqrt();
    let n_dot_h = (ci + co) / (2.0 * half);
    let a2 = alpha * alpha;
    let d = a2 / (PI * ((n_dot_h * n_dot_h) * (a2 - 1.0) + 1.0).powi(2));
    let lambda = |c: f64| ((1.0 + a2 * (1.0 - c * c) / (c * c)).sqrt() - 1.0) / 2.0;
    let g = 1.0 / (1.0 + lambda(ci) + lambda(co));
    let index = num_complex::Complex64::new(3.0, 1.5);
    let root = (index * index - (1.0 - half * half)).sqrt();
    let s = ((half - root) / (half + root)).norm_sqr();
    let p = ((index * index * half - root) / (index * index * half + root)).norm_sqr();
    let wanted = d * g * 0.5 * (s + p) / (4.0 * ci * co);
    let at = |response| single(alpha, (3.0, 1.5), (polar_i, 0.0), (polar_o, azimuth), response);
    assert_close("paper", &[at(Response::Paper)], &[wanted], 5e-4);
    assert_close("projected", &[at(Response::Projected)], &[wanted * 0.5 * (ci + co)], 5e-4);
    assert_close("field", &[at(Response::Field)], &[(wanted * ci * co).sqrt()], 5e-4);
}

#[test]
fn the_distribution_of_facets_projects_to_one() {
    // ∫ D(h) cos θ dω = 1 for every roughness.
    for alpha in [0.1_f64, 0.4, 1.0] {
        let steps = 20_000;
        let (sines, cosines): (Vec<f64>, Vec<f64>) =
            (0..steps).map(|k| ((k as f64 + 0.5) / steps as f64 * PI / 2.0).sin_cos()).unzip();
        let device = Device::flex();
        let column = |v: Vec<f64>| tensor(&v, [steps, 1], &device);
        let half = Half {
            cosine_squared: column(cosines.iter().map(|c| c * c).collect()),
            sine_squared: column(sines.iter().map(|s| s * s).collect()),
            deviation_cosine_squared: column(vec![1.0; steps]),
        };
        let d = values(&distribution(&half, tensor(&[alpha * alpha], [1, 1], &device)));
        let integral: f64 = (0..steps).map(|k| d[k] * cosines[k] * sines[k]).sum::<f64>() * 2.0 * PI * (PI / 2.0) / steps as f64;
        assert_close("∫ D cos", &[integral], &[1.0], 1e-5);
    }
}

#[test]
fn no_more_power_is_scattered_than_arrives() {
    // ∫ f_r cos θ_o dω_o ≤ 1 for facets that reflect everything (metallic = 1): the white furnace.
    for alpha in [0.2, 0.5, 1.0] {
        for polar in [0.0, 0.7, 1.3] {
            let (rows, columns) = (90, 90);
            let mut sum = 0.0;
            for row in 0..rows {
                let out = (row as f64 + 0.5) / rows as f64 * PI / 2.0;
                let device = Device::flex();
                let outgoing: Vec<f64> = (0..columns)
                    .flat_map(|k| {
                        let azimuth = (k as f64 + 0.5) / columns as f64 * 2.0 * PI;
                        [out.sin() * azimuth.cos(), out.sin() * azimuth.sin(), out.cos()]
                    })
                    .collect();
                let flat: Vec<Tensor<1>> = [
                    &[alpha][..],
                    &[1.0],
                    &[3.0],
                    &[1.5],
                    &[0.5],
                    &[0.0, 0.0, 1.0],
                    &[f64::sin(polar), 0.0, f64::cos(polar)],
                    &outgoing,
                ]
                .iter()
                .map(|values| tensor(values, [values.len()], &device))
                .collect();
                let ring: f64 = values(&from_flat(&flat, Response::Paper)).iter().sum();
                sum += ring * out.cos() * out.sin();
            }
            let power = sum * (PI / 2.0 / rows as f64) * (2.0 * PI / columns as f64);
            assert!(power < 1.001, "α = {alpha}, θ = {polar}: {power}");
            if alpha == 1.0 && polar == 0.0 {
                // Here D = 1/π and G₂ / (4 cos cos) = ½ / (1 + cos θ_o): ∫ μ / (1 + μ) dμ.
                assert_close("power", &[power], &[1.0 - 2.0_f64.ln()], 1e-3);
            }
        }
    }
}

#[test]
fn swapping_transmitter_and_receiver_changes_nothing() {
    let device = Device::flex();
    let flat = |values: &[f64]| tensor(values, [values.len()], &device);
    let mut x: Vec<Tensor<1>> = [(0.1, 0.9), (0.0, 1.0), (1.1, 5.0), (0.0, 3.0), (0.0, 1.0)]
        .iter()
        .enumerate()
        .map(|(seed, &(low, high))| flat(&numbers(seed as u64, 20, low, high)))
        .collect();
    x.extend([directions(7, 20), directions(8, 20), directions(9, 20)].map(|d| flat(&d)));
    for response in RESPONSES {
        let forth = values(&from_flat(&x, response));
        let mut swapped = x.clone();
        swapped.swap(6, 7);
        assert_close("amplitude", &values(&from_flat(&swapped, response)), &forth, 1e-13);
    }
}

#[test]
fn what_faces_away_returns_nothing_and_the_projected_form_stays_bounded() {
    let behind = single(0.4, (3.0, 1.5), (2.2, 0.0), (2.2, 0.0), Response::Projected);
    let front = single(0.4, (3.0, 1.5), (0.9, 0.0), (0.9, 0.0), Response::Projected);
    assert!(behind < 1e-6 * front, "{behind} behind, {front} in front");
    for alpha in [0.05, 0.4, 1.0] {
        for step in 0..=100 {
            let polar = PI * f64::from(step) / 100.0;
            let found = single(alpha, (3.0, 1.5), (polar, 0.0), (polar, 0.0), Response::Projected);
            let (sine, cosine) = polar.sin_cos();
            let facets = alpha * alpha / (PI * (alpha * alpha * cosine * cosine + sine * sine).powi(2));
            assert!(found <= facets / (4.0 * alpha) * 1.001, "α = {alpha}, θ = {polar}: {found}");
        }
    }
}

#[test]
fn a_rougher_surface_returns_less_at_the_normal_and_more_beside_it() {
    let at = |alpha: f64, polar: f64| single(alpha, (3.0, 1.5), (polar, 0.0), (polar, 0.0), Response::Projected);
    assert!(at(0.1, 0.0) > at(0.4, 0.0));
    assert!(at(0.1, 0.8) < at(0.4, 0.8));
}

fn smooth_inputs() -> Vec<crate::support::Input> {
    // Directions within 70° of the normals, so that the smallest gradients are not lost among the largest.
    let near = |seed: u64, about: &[f64]| -> Vec<f64> {
        let offsets = directions(seed, 4);
        about
            .chunks(3)
            .zip(offsets.chunks(3))
            .flat_map(|(n, o)| {
                let sum: Vec<f64> = n.iter().zip(o).map(|(n, o)| n + 0.8 * o).collect();
                let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
                sum.into_iter().map(move |v| v / length).collect::<Vec<_>>()
            })
            .collect()
    };
    let normals = directions(11, 4);
    vec![
        input("roughness", numbers(1, 4, 0.3, 0.9)),
        input("metallic", numbers(2, 4, 0.1, 0.9)),
        input("refraction", numbers(3, 4, 1.2, 5.0)),
        input("extinction", numbers(4, 4, 0.1, 3.0)),
        input("polarisation", numbers(5, 4, 0.1, 0.9)),
        input("incident", near(12, &normals)),
        input("outgoing", near(13, &normals)),
        input("normal", normals),
    ]
}

fn reordered(x: &[Tensor<1>], response: Response) -> Tensor<1> {
    let order = [0, 1, 2, 3, 4, 7, 5, 6].map(|i| x[i].clone());
    from_flat(&order, response)
}

pub(crate) fn gradients_to_every_input_agree_with_central_differences() {
    for response in RESPONSES {
        check_gradient(&smooth_inputs(), 1e-6, 1e-6, |x| reordered(x, response));
    }
}

#[test]
fn backends_agree() {
    for response in RESPONSES {
        check_backends(&smooth_inputs(), 1e-4, |x| reordered(x, response));
    }
}

#[test]
fn values_and_gradients_are_finite_where_the_formula_is_singular() {
    let up = [0.0, 0.0, 1.0];
    let (side, down) = ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    // Normal, grazing both, grazing one, from behind, forward scattering (no half vector), grazing opposite; twice,
    // first rough, then a mirror of nothing (α = 0, no interface).
    let incident = [up, side, side, down, up, side].concat();
    let outgoing = [up, side, up, down, down, [-1.0, 0.0, 0.0]].concat();
    for response in RESPONSES {
        for (alpha, refraction, extinction) in [(0.4, 3.0, 1.5), (0.0, 1.0, 0.0), (0.0, 3.0, 0.0), (1.0, 1.05, 6.0)] {
            let inputs = [
                input("roughness", [alpha; 6]),
                input("metallic", [0.0; 6]),
                input("refraction", [refraction; 6]),
                input("extinction", [extinction; 6]),
                input("polarisation", [1.0; 6]),
                input("normal", [up; 6].concat()),
                input("incident", incident.clone()),
                input("outgoing", outgoing.clone()),
            ];
            check_finite(&inputs, |x| from_flat(x, response));
        }
    }
}
