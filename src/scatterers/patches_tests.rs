use super::*;
use crate::scatterers::spherical_harmonics::CONSTANT;
use crate::support::{
    assert_close, check_backends, check_finite, check_gradient, cpu_devices, directions, input, numbers, tensor, values,
};
use burn::tensor::Device;
use std::f64::consts::PI;

/// 2π / 3.8 mm.
const WAVENUMBER: f64 = 1653.5;

fn patch(rotation: f64, scale: [f64; 2], device: &Device) -> Patch {
    Patch {
        offset_m: tensor(&[0.0; 3], [1, 3], device),
        rotation_rad: tensor(&[rotation], [1], device),
        scale_m: tensor(&scale, [1, 2], device),
        reflectance: tensor(&[0.5], [1], device),
        lobes: tensor(&[1.0 / CONSTANT], [1, 1], device),
    }
}

/// ∫ Gaussian(x) exp(j κ·x) d²x by sums over ±6 standard deviations: independent of the closed form.
fn integrated(rotation: f64, scale: [f64; 2], kappa: [f64; 2]) -> f64 {
    let steps = 240;
    let at = |step: usize| 6.0 * (2.0 * (step as f64 + 0.5) / steps as f64 - 1.0);
    let (sine, cosine) = rotation.sin_cos();
    let (mut real, mut mass) = (0.0, 0.0);
    for i in 0..steps {
        for j in 0..steps {
            let (u, v) = (at(i), at(j));
            let weight = (-0.5 * (u * u + v * v)).exp();
            // Own axes to tangent and bitangent.
            let (a, b) = (u * scale[0], v * scale[1]);
            let (x, y) = (a * cosine - b * sine, a * sine + b * cosine);
            real += weight * (kappa[0] * x + kappa[1] * y).cos();
            mass += weight;
        }
    }
    real / mass
}

#[test]
fn the_aperture_is_the_integrated_gaussian() {
    let cases = [
        (0.0, [5e-4, 5e-4], [1000.0, 0.0]),
        (0.0, [1e-3, 3e-4], [1000.0, 700.0]),
        (0.7, [1e-3, 3e-4], [1000.0, 700.0]),
        (-1.9, [2e-4, 1.5e-3], [-600.0, 900.0]),
        (2.4, [1e-3, 1e-3], [0.0, 0.0]),
    ];
    for (_, device) in cpu_devices() {
        for (rotation, scale, kappa) in cases {
            let tangential = kappa.map(|k| tensor(&[k], [1, 1], &device));
            let found = values(&aperture(&patch(rotation, scale, &device), tangential));
            assert_close("aperture", &found, &[integrated(rotation, scale, kappa)], 1e-6);
        }
    }
}

/// Amplitude of one patch with normal z and tangent x, the same direction in and out, at angles to the normal.
fn monostatic(patch: &Patch, polar: f64, azimuth: f64) -> f64 {
    let device = Device::flex();
    let axis = |v: [f64; 3]| tensor(&v, [1, 1, 3], &device);
    let frame = Frame::along(axis([0.0, 0.0, 1.0]), axis([1.0, 0.0, 0.0]));
    let direction = axis([polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()]);
    values(&amplitude(patch, &frame, direction.clone(), direction, WAVENUMBER))[0]
}

#[test]
fn scale_narrows_the_return() {
    let device = Device::flex();
    let small = patch(0.0, [2e-4, 2e-4], &device);
    let large = patch(0.0, [2e-3, 2e-3], &device);
    for patch in [&small, &large] {
        assert_close("normal", &[monostatic(patch, 0.0, 0.0)], &[0.5], 1e-9);
    }
    let at = |patch: &Patch| monostatic(patch, 0.3, 0.0) / 0.5;
    let law = |scale: f64| (-0.5 * (scale * 2.0 * WAVENUMBER * 0.3_f64.sin()).powi(2)).exp();
    assert_close("small", &[at(&small)], &[law(2e-4)], 1e-9);
    assert_close("large", &[at(&large)], &[law(2e-3)], 1e-9);
    assert!(at(&small) > 0.97 && at(&large) < 0.2);
}

#[test]
fn rotation_turns_the_return_in_the_plane() {
    let device = Device::flex();
    // Long along its first axis: a narrow return in that direction, a wide one across it.
    let turned = patch(0.6, [1.5e-3, 2e-4], &device);
    let still = patch(0.0, [1.5e-3, 2e-4], &device);
    for azimuth in [0.0, 0.4, 1.0, 2.0] {
        let (a, b) = (monostatic(&turned, 0.4, azimuth + 0.6), monostatic(&still, 0.4, azimuth));
        assert_close("turned", &[a], &[b], 1e-9);
    }
    let (along, across) = (monostatic(&turned, 0.4, 0.6), monostatic(&turned, 0.4, 0.6 + PI / 2.0));
    assert!(along < 0.3 * across, "{along} along, {across} across");
    assert_close("half a turn", &[monostatic(&turned, 0.4, 0.6 + PI)], &[along], 1e-9);
}

#[test]
fn the_return_is_strongest_in_the_specular_direction() {
    let device = Device::flex();
    let patch = patch(0.3, [2e-3, 2e-3], &device);
    let axis = |v: [f64; 3]| tensor(&v, [1, 1, 3], &device);
    let frame = Frame::along(axis([0.0, 0.0, 1.0]), axis([1.0, 0.0, 0.0]));
    let towards = |polar: f64| {
        let incident = axis([-0.5_f64.sin(), 0.0, 0.5_f64.cos()]);
        values(&amplitude(&patch, &frame, incident, axis([polar.sin(), 0.0, polar.cos()]), WAVENUMBER))[0]
    };
    assert_close("specular", &[towards(0.5)], &[0.5], 1e-9);
    for polar in [-0.5, 0.0, 0.3, 0.7, 1.2_f64] {
        let kappa = WAVENUMBER * (polar.sin() - 0.5_f64.sin());
        let wanted = 0.5 * (-0.5 * (2e-3 * kappa).powi(2)).exp();
        assert!((towards(polar) - wanted).abs() < 1e-9 && wanted < 0.45, "at {polar}: {} is not {wanted}", towards(polar));
    }
}

#[test]
fn several_receivers_share_a_call() {
    let device = Device::flex();
    let config = PatchConfig::default();
    let count = config.raw_initial().len();
    let patch = config.real(tensor(&numbers(1, 3 * count, -1.0, 1.0), [3, count], &device));
    let axes = |seed| tensor(&directions(seed, 3), [3, 1, 3], &device);
    let frame = Frame::along(axes(1), axes(2));
    let (first, second) = (axes(4), axes(5));
    let together = amplitude(&patch, &frame, axes(3), Tensor::cat(vec![first.clone(), second.clone()], 1), WAVENUMBER);
    let apart =
        Tensor::cat(vec![first, second].into_iter().map(|o| amplitude(&patch, &frame, axes(3), o, WAVENUMBER)).collect(), 1);
    assert_close("amplitude", &values(&together), &values(&apart), 1e-14);
}

#[test]
fn picking_and_joining_keep_the_points_order() {
    let device = Device::flex();
    let config = PatchConfig { degree: 1, ..Default::default() };
    let decode = |seed| config.real(tensor(&numbers(seed, 22, -1.0, 1.0), [2, 11], &device));
    let picked = Patch::cat(vec![decode(1), decode(2)]).pick(&RowIndex::new(&[3, 0], 4, &device));
    assert_eq!(values(&picked.offset_m)[..3], values(&decode(2).offset_m)[3..]);
    assert_eq!(values(&picked.lobes)[4..], values(&decode(1).lobes)[..4]);
    assert_eq!(values(&picked.rotation_rad)[0], values(&decode(2).rotation_rad)[1]);
}

/// From flat raw outputs, normal, reference, incident, outgoing; degree 3, two points, two knots.
fn from_flat(x: &[Tensor<1>]) -> Tensor<1> {
    let config = PatchConfig { degree: 3, ..Default::default() };
    let patch = config.real(x[0].clone().reshape([2, 23]));
    let direction = |i: usize| x[i].clone().reshape([2, 2, 3]);
    let frame = Frame::along(direction(1), direction(2));
    let found = amplitude(&patch, &frame, direction(3), direction(4), WAVENUMBER).reshape([4]);
    Tensor::cat(vec![found, patch.offset_m.reshape([6]) * 10.0], 0)
}

fn inputs() -> Vec<crate::support::Input> {
    vec![
        input("raw", numbers(1, 46, -1.0, 1.0)),
        input("normal", directions(2, 4)),
        input("reference", directions(3, 4)),
        input("incident", directions(4, 4)),
        input("outgoing", directions(5, 4)),
    ]
}

pub(crate) fn gradients_to_every_input_agree_with_central_differences() {
    check_gradient(&inputs(), 1e-6, 1e-6, from_flat);
}

#[test]
fn backends_agree() {
    check_backends(&inputs(), 1e-4, from_flat);
}

#[test]
fn extreme_outputs_and_edgewise_references_are_finite() {
    let mut raw: Vec<f64> = vec![1e4; 23];
    raw.extend([-1e4; 23]);
    // Far-off lobes only scale the value; a thousand is extreme enough for them.
    raw.iter_mut().enumerate().filter(|(i, _)| i % 23 >= 7).for_each(|(_, v)| *v = v.clamp(-1e3, 1e3));
    let normal = directions(2, 4);
    check_finite(
        &[
            input("raw", raw),
            input("normal", normal.clone()),
            input("reference", normal.clone()),
            input("incident", normal.clone()),
            input("outgoing", normal.iter().map(|v| -v).collect::<Vec<_>>()),
        ],
        from_flat,
    );
}

#[test]
fn unusable_settings_are_refused() {
    assert!(PatchConfig::default().check("patch").is_ok());
    let error = PatchConfig { degree: 4, ..Default::default() }.check("patch").unwrap_err();
    assert_eq!(error.to_string(), "`patch.degree` is 4, expected 0 to 3");
    assert!(PatchConfig { scale_m: Range::new(0.0, 1.0, 0.5), ..Default::default() }.check("patch").is_err());
    assert!(PatchConfig { offset_m: f64::NAN, ..Default::default() }.check("patch").is_err());
}
