//! Effects on points, paths and noise.

use burn::tensor::{DType, Device, Tensor};

use super::test_support::{flat, operator, radar, values, values_of};
use super::*;
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::{SumForm, direct_signal, noise},
    paths::{Amplitude, Dechirp, Points},
    room::Room,
    support::{assert_close, check_gradient, input, numbers, tensor, values as host},
};

const PLACES: [[f64; 3]; 3] = [[0.3, 2.0, 0.2], [-0.4, 2.1, 0.5], [0.1, 1.8, -0.6]];
const NORMALS: [[f64; 3]; 3] = [[0.0, -1.0, 0.0], [0.6, -0.8, 0.0], [0.0, -0.6, 0.8]];
const JOINTS: [&str; 3] = ["spine2", "left_wrist", "spine1"];
const TIMES: [f64; 3] = [0.20, 0.21, 0.22];

fn components(from: u64, device: &Device, size: f64) -> Displacement {
    let part = |axis: u64| tensor::<2>(&numbers(from + axis, 9, -size, size), [3, 3], device);
    Displacement { x: part(0), y: part(1), z: part(2) }
}

fn points<'a>(velocity: &'a Displacement) -> BodyPoints<'a> {
    BodyPoints {
        reference_m: &PLACES,
        normal: &NORMALS,
        joints: &JOINTS,
        velocity: Some(velocity),
        times_s: &TIMES,
        tx: 1,
        extent_m: [[-0.5, 1.7, -0.7], [0.5, 2.2, 1.1]],
        centre_m: [0.0, 1.95, 0.2],
        radar_m: [0.0; 3],
    }
}

/// `[3 · 9]`: x, y, z.
fn displaced(values: &Values) -> Tensor<1> {
    let device = values.device.clone();
    let velocity = components(20, &device, 2.0);
    let displace = operator(values.id).on_displacement().unwrap();
    let Displacement { x, y, z } = displace(components(10, &device, 0.02), values, &points(&velocity));
    Tensor::cat(vec![x.reshape([9]), y.reshape([9]), z.reshape([9])], 0)
}

fn weighed(values: &Values) -> Tensor<1> {
    let device = values.device.clone();
    let velocity = components(20, &device, 2.0);
    let Operator::Amplitude(weigh) = operator(values.id) else { panic!("{}", values.id) };
    weigh(tensor(&[1.0, 2.0, 3.0], [3, 1], &device), values, &points(&velocity)).reshape([3])
}

fn of(id: &str) -> EffectSetting {
    EffectSetting::neutral(id)
}

/// Effects on points away from neutral, with the parameters that learn.
fn point_cases() -> Vec<EffectSetting> {
    vec![
        of("clock_offset").with("offset_s", [2e-3]),
        of("clock_drift").with("relative", [1e-3]),
        of("tdm_phase").with("slot_s", [1e-5]),
        of("pose_offset").with("offset_m", [0.02, -0.01, 0.03]).with("yaw_deg", [4.0]),
        of("breathing").with("rate_hz", [0.3]).with("amplitude_m", [0.003]).with("phase_rad", [0.7]),
        of("heartbeat").with("rate_hz", [1.3]).with("amplitude_m", [2e-4]).with("phase_rad", [0.2]),
        of("clothing_delay").with("extra_m", [0.001]),
        of("part_reflectivity").with("db", [3.0]).choosing("left_wrist"),
        of("soft_occlusion").with("width", [0.4]),
        of("antenna_pattern").with("exponent", [2.5]),
    ]
}

fn on_points(values: &Values) -> Tensor<1> {
    match operator(values.id).on_displacement() {
        Some(_) => displaced(values),
        None => weighed(values),
    }
}

pub(crate) fn effects_on_points_are_neutral_and_differentiable() {
    let cases: Vec<String> = point_cases().into_iter().map(|case| case.id).collect();
    let is_on_points = |of: Operator| of.on_displacement().is_some() || matches!(of, Operator::Amplitude(_));
    let wanted: Vec<&str> = library().iter().filter(|info| is_on_points(info.operator)).map(|info| info.id).collect();
    assert!(wanted.iter().all(|id| cases.iter().any(|case| case == id)) && wanted.len() == cases.len(), "{wanted:?}");
    for case in point_cases() {
        let neutral = host(&on_points(&values(&of(&case.id))));
        let device = Device::flex();
        let before = match operator(&case.id).on_displacement() {
            Some(_) => {
                let Displacement { x, y, z } = components(10, &device, 0.02);
                [host(&x), host(&y), host(&z)].concat()
            }
            None => vec![1.0, 2.0, 3.0],
        };
        assert_eq!(neutral, before, "{}", case.id);
        assert_ne!(host(&on_points(&values(&case))), before, "{}", case.id);
        for (name, start) in &case.parameters {
            let size = start.iter().fold(0.0f64, |size, value| size.max(value.abs()));
            eprintln!("{} {name}", case.id);
            check_gradient(&[input("value", start.iter().map(|v| v / size).collect::<Vec<_>>())], 1e-5, 1e-6, |inputs| {
                on_points(&values_of(&case, &[(name, inputs[0].clone() * size)], &inputs[0]))
            });
        }
    }
}

#[test]
fn points_move_as_their_effects_say() {
    let device = Device::flex();
    let (start, velocity) = (components(10, &device, 0.02), components(20, &device, 2.0));
    let moved = |setting: EffectSetting| host(&displaced(&values(&setting)));
    let before = [host(&start.x), host(&start.y), host(&start.z)].concat();
    let speed = [host(&velocity.x), host(&velocity.y), host(&velocity.z)].concat();
    let later = |seconds: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..27).map(|i| before[i] + speed[i] * seconds(i % 3)).collect() };
    assert_close("offset", &moved(of("clock_offset").with("offset_s", [2e-3])), &later(&|_| 2e-3), 1e-12);
    assert_close("drift", &moved(of("clock_drift").with("relative", [1e-3])), &later(&|m| 1e-3 * TIMES[m]), 1e-12);
    assert_close("slot", &moved(of("tdm_phase").with("slot_s", [1e-5])), &later(&|_| 1e-5), 1e-12);
    // A quarter turn about the middle takes what is right to the front.
    let turned = moved(of("pose_offset").with("yaw_deg", [30.0]));
    let (x, y) = (PLACES[0][0] + before[0], PLACES[0][1] - 1.95 + before[9]);
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    assert!((turned[0] + PLACES[0][0] - (x * cosine - y * sine)).abs() < 1e-12);
    assert!((turned[9] + PLACES[0][1] - 1.95 - (x * sine + y * cosine)).abs() < 1e-12);
    // Breathing: the torso's points along their normals, the wrist not at all.
    let breath = moved(of("breathing").with("rate_hz", [0.25]).with("amplitude_m", [0.004]));
    let swing = 0.004 * (std::f64::consts::TAU * 0.25 * 0.21).sin();
    assert!((breath[9 + 1] - before[9 + 1] + swing).abs() < 1e-12, "point 0 faces the radar");
    assert!((breath[9 + 4] - before[9 + 4]).abs() < 1e-15, "the wrist");
    let coat = moved(of("clothing_delay").with("extra_m", [0.002]).choosing("left_wrist"));
    let change = |axis: usize| coat[9 * axis + 3] - before[9 * axis + 3];
    let length = (0..3).map(|axis| change(axis).powi(2)).sum::<f64>().sqrt();
    assert!((length - 0.002).abs() < 1e-12 && change(1) > 0.0);
    assert_eq!(coat[0], before[0], "the torso is bare then");
}

#[test]
fn points_are_weighed_as_their_effects_say() {
    let weigh = |setting: EffectSetting| host(&weighed(&values(&setting)));
    let part = weigh(of("part_reflectivity").with("db", [6.0]).choosing("left_wrist"));
    assert_close("part", &part, &[1.0, 2.0 * 10f64.powf(0.3), 3.0], 1e-12);
    let off = |place: [f64; 3]| place[1] / place.iter().map(|x| x * x).sum::<f64>().sqrt();
    let wanted: Vec<f64> = (0..3).map(|i| (i + 1) as f64 * off(PLACES[i]).powf(2.5)).collect();
    assert_close("pattern", &weigh(of("antenna_pattern").with("exponent", [2.5])), &wanted, 1e-12);
    let soft = weigh(of("soft_occlusion").with("width", [0.3]));
    assert!(soft[0] > 0.99 && soft.iter().zip([1.0, 2.0, 3.0]).all(|(soft, hard)| *soft <= hard));
}

/// One transmitter's signal of the three points.
fn direct(radar: &crate::radar::Radar, device: &Device) -> Complex<3> {
    with_points(device, |points| direct_signal(points, radar, 1, Dechirp::Exact, SumForm::Exact))
}

fn with_points<T>(device: &Device, of: impl Fn(Points) -> T) -> T {
    let displacement = components(10, device, 0.01);
    let amplitude = Amplitude::real(tensor(&[1.0, 2.0, 3.0], [3, 1], device));
    of(Points { reference_m: &PLACES, displacement: &displacement, amplitude: &amplitude })
}

fn room() -> Room {
    Room { right_m: Some(1.2), floor_m: Some(0.9), ..Room::default() }
}

/// What an effect on paths adds to the three points' signal, or makes of it.
fn on_paths(values: &Values) -> Tensor<1> {
    let (radar, device) = (radar(), values.device.clone());
    let (dechirp, form) = (Dechirp::Exact, SumForm::Exact);
    let chirps = Chirps { radar: &radar, tx: 1, dechirp, form };
    let room = room();
    flat(match operator(values.id) {
        Operator::Paths(signal) => with_points(&device, |points| {
            signal(&DirectReturns { points, direct: &direct(&radar, &device), room: Some(&room), chirps }, values).unwrap()
        }),
        Operator::Direct(signal) => with_points(&device, |points| signal(points, values, &chirps)),
        Operator::Reflector(signal) => signal(values, &TIMES, &chirps),
        Operator::Carried(signal) => {
            let displacement = components(10, &device, 0.01).map(|part| part.narrow(0, 0, 1));
            signal(values, PLACES[0], &displacement, &chirps)
        }
        other => panic!("{}: {other:?}", values.id),
    })
}

pub(crate) fn effects_on_paths_are_differentiable() {
    let cases = [
        of("wall_ghost").with("coefficient", [0.4]).with("phase_rad", [0.3]).choosing("right"),
        of("floor_bounce").with("coefficient", [0.3]).with("phase_rad", [-0.6]),
        of("body_multibounce").with("extra_m", [0.4]).with("coefficient", [0.2]).with("phase_rad", [0.3]),
        of("antenna_position").with("offset_m", numbers(4, 12, -1e-3, 1e-3)),
        of("static_reflector").with("position_m", [0.5, 2.2, -0.3]).with("amplitude", [1.5]).with("phase_rad", [0.4]),
        of("moving_reflector")
            .with("position_m", [0.5, 2.2, -0.3])
            .with("rate_hz", [0.9])
            .with("swing_m", [0.02])
            .with("axis", [0.6, 0.8, 0.0])
            .with("motion_rad", [0.5])
            .with("amplitude", [1.5])
            .with("phase_rad", [0.4]),
        of("carried_reflector").with("amplitude", [1.5]).with("phase_rad", [0.4]),
    ];
    let is_on_paths =
        |of: Operator| matches!(of, Operator::Paths(_) | Operator::Direct(_) | Operator::Reflector(_) | Operator::Carried(_));
    assert_eq!(library().iter().filter(|info| is_on_paths(info.operator)).count(), cases.len());
    for case in cases {
        for (name, start) in &case.parameters {
            let size = start.iter().fold(0.0f64, |size, value| size.max(value.abs()));
            eprintln!("{} {name}", case.id);
            check_gradient(&[input("value", start.iter().map(|v| v / size).collect::<Vec<_>>())], 1e-6, 1e-5, |inputs| {
                on_paths(&values_of(&case, &[(name, inputs[0].clone() * size)], &inputs[0]))
            });
        }
    }
}

#[test]
fn a_wall_ghost_is_the_path_by_way_of_the_mirrored_body() {
    let (radar, device) = (radar(), Device::flex());
    let found = host(&on_paths(&values(&of("wall_ghost").with("coefficient", [0.5]).choosing("right"))));
    // The same by mirroring the points instead of the antennas: out directly and back from the image, and reversed. One
    // still point is enough.
    let place = PLACES[0];
    let image = [2.4 - place[0], place[1], place[2]];
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let displacement = Displacement::still(1, &device, DType::F64);
    let amplitude = Amplitude::real(tensor(&[1.0], [1, 1], &device));
    let point = Points { reference_m: &[place], displacement: &displacement, amplitude: &amplitude };
    let values = values(&of("wall_ghost").with("coefficient", [0.5]).choosing("right"));
    let one = wall_ghost::signal(point, &values, &room(), &radar, 1, Dechirp::Paper, SumForm::Exact).unwrap();
    let (re, im) = (host(&one.re), host(&one.im));
    let (tx, samples) = (radar.tx_position_m(1), radar.samples_per_chirp);
    for rx in 0..2 {
        let antenna = radar.rx_position_m(rx);
        let legs = [[distance(tx, place), distance(image, antenna)], [distance(tx, image), distance(place, antenna)]];
        for n in 0..samples {
            let (mut wanted_re, mut wanted_im) = (0.0, 0.0);
            for [out, back] in legs {
                let delay = (out + back) / crate::radar::SPEED_OF_LIGHT;
                let hz = radar.carrier_hz() + radar.slope_hz_per_s * n as f64 / radar.sample_rate_hz;
                let (sin, cos) = (std::f64::consts::TAU * (hz * delay).fract()).sin_cos();
                wanted_re += 0.5 * cos / (out * back);
                wanted_im += 0.5 * sin / (out * back);
            }
            let at = rx * samples + n;
            assert!((re[at] - wanted_re).abs() < 1e-6 && (im[at] - wanted_im).abs() < 1e-6, "rx {rx} sample {n}");
        }
    }
    assert!(found.iter().all(|value| value.is_finite()));
    // No such wall, no ghost.
    let none = with_points(&device, |p| {
        wall_ghost::signal(p, &values, &Room::default(), &radar, 1, Dechirp::Exact, SumForm::Exact).is_none()
    });
    assert!(none);
}

#[test]
fn the_floor_returns_once_by_each_way_and_twice_by_both() {
    let (radar, device) = (radar(), Device::flex());
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let place = PLACES[1];
    let image = [place[0], place[1], -1.8 - place[2]];
    let displacement = Displacement::still(1, &device, DType::F64);
    let amplitude = Amplitude::real(tensor(&[1.0], [1, 1], &device));
    let point = Points { reference_m: &[place], displacement: &displacement, amplitude: &amplitude };
    let values = values(&of("floor_bounce").with("coefficient", [-0.4]));
    let found = floor_bounce::signal(point, &values, &room(), &radar, 0, Dechirp::Paper, SumForm::Exact).unwrap();
    let (re, im) = (host(&found.re), host(&found.im));
    let (tx, rx) = (radar.tx_position_m(0), radar.rx_position_m(1));
    let ways = [(place, image, -0.4), (image, place, -0.4), (image, image, 0.16)];
    for n in 0..radar.samples_per_chirp {
        let hz = radar.carrier_hz() + radar.slope_hz_per_s * n as f64 / radar.sample_rate_hz;
        let (mut wanted_re, mut wanted_im) = (0.0, 0.0);
        for (out, back, weight) in ways {
            let (out, back) = (distance(tx, out), distance(back, rx));
            let turns = (hz * (out + back) / crate::radar::SPEED_OF_LIGHT).fract();
            let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
            wanted_re += weight * cos / (out * back);
            wanted_im += weight * sin / (out * back);
        }
        let at = radar.samples_per_chirp + n;
        assert!((re[at] - wanted_re).abs() < 1e-6 && (im[at] - wanted_im).abs() < 1e-6, "sample {n}");
    }
}

#[test]
fn echoes_within_the_body_come_from_behind_it() {
    let (radar, device) = (radar(), Device::flex());
    let signal_of = |range: f64| {
        let displacement = Displacement::still(1, &device, DType::F64);
        let amplitude = Amplitude::real(tensor(&[range * range], [1, 1], &device));
        let single = crate::radar::Radar { position_m: [0.0; 3], tx_m: vec![[0.0; 3]], rx_m: vec![[0.0; 3]], ..radar.clone() };
        let place = [[0.0, range, 0.0]];
        let point = Points { reference_m: &place, displacement: &displacement, amplitude: &amplitude };
        direct_signal(point, &single, 0, Dechirp::Paper, SumForm::Exact)
    };
    let values = values(&of("body_multibounce").with("extra_m", [0.35]).with("coefficient", [0.25]));
    let found = host(&flat(body_multibounce::echo(signal_of(2.0), &values, &radar)));
    assert_close("echo", &found, &host(&flat(signal_of(2.35).scale_by(0.25))), 1e-6);
}

#[test]
fn moved_antennas_see_what_a_radar_built_so_would_see() {
    let (built, device) = (radar(), Device::flex());
    let offsets = numbers(4, 12, -3e-4, 3e-4);
    let mut moved = built.clone();
    for (antenna, place) in moved.tx_m.iter_mut().chain(&mut moved.rx_m).enumerate() {
        (0..3).for_each(|axis| place[axis] += offsets[3 * antenna + axis]);
    }
    let found = host(&on_paths(&values(&of("antenna_position").with("offset_m", offsets))));
    let wanted = host(&flat(direct(&moved, &device)));
    let before = host(&flat(direct(&built, &device)));
    let error = |from: &[f64]| from.iter().zip(&wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    assert!(error(&found) < 1e-4 * error(&before), "{:.1e} of the change is left", error(&found) / error(&before));
    assert_close("unmoved", &host(&on_paths(&values(&of("antenna_position")))), &before, 1e-12);
}

#[test]
fn reflectors_are_points_of_the_scene() {
    let (radar, device) = (radar(), Device::flex());
    let setting = of("moving_reflector").with("position_m", PLACES[0]).with("amplitude", [2.0]);
    let setting = setting.with("rate_hz", [0.9]).with("swing_m", [0.02]).with("motion_rad", [0.5]);
    let found = host(&on_paths(&values(&setting)));
    let along: Vec<f64> = TIMES.iter().map(|t| 0.02 * (std::f64::consts::TAU * 0.9 * t + 0.5).sin()).collect();
    let none = || tensor::<2>(&[0.0; 3], [1, 3], &device);
    let displacement = Displacement { x: none(), y: tensor(&along, [1, 3], &device), z: none() };
    let amplitude = Amplitude::real(tensor(&[2.0], [1, 1], &device));
    let point = Points { reference_m: &PLACES[..1], displacement: &displacement, amplitude: &amplitude };
    let wanted = host(&flat(direct_signal(point, &radar, 1, Dechirp::Exact, SumForm::Exact)));
    assert_close("moving", &found, &wanted, 1e-9);
    let silent = host(&on_paths(&values(&of("static_reflector").with("position_m", PLACES[0]))));
    assert!(silent.iter().all(|value| *value == 0.0), "without amplitude");
}

#[test]
fn lost_frames_show_the_scene_later_from_there_on() {
    let values = values(&of("frame_drop").with("at", [3.0]).with("count", [2.0]));
    assert_eq!([0, 2, 3, 4].map(|frame| frame_drop::shift(&values, frame)), [0, 0, 2, 2]);
    assert_eq!(frame_drop::shift(&super::test_support::values(&of("frame_drop")), 3), 0);
}

fn shaped(values: &Values, dims: [usize; 4]) -> Complex<4> {
    let Operator::Noise(shape) = operator(values.id) else { panic!("{}", values.id) };
    shape(noise::normals(1, dims, &values.device, DType::F64), values, &radar(), 7)
}

pub(crate) fn noise_is_neutral_differentiable_and_has_the_spectrum_or_tails_or_coherence_asked_for() {
    let dims = [1, 2, 3, 16];
    let cases: [(EffectSetting, &[&str]); 3] = [
        (of("coloured_noise").with("knee_hz", [5e5]).with("power", [1.3]), &["knee_hz", "power"]),
        (of("impulsive_noise").with("probability", [0.2]).with("excess", [8.0]), &["excess"]),
        (of("correlated_noise").with("coefficient", [0.4]), &["coefficient"]),
    ];
    for (case, learning) in cases {
        let white = host(&flat(noise::normals(1, dims, &Device::flex(), DType::F64)));
        assert_eq!(host(&flat(shaped(&values(&of(&case.id)), dims))), white, "{}", case.id);
        for name in learning {
            let size = case.parameters[*name][0];
            check_gradient(&[input("value", [1.0])], 1e-5, 1e-6, |inputs| {
                flat(shaped(&values_of(&case, &[(name, inputs[0].clone() * size)], &inputs[0]), dims))
            });
        }
    }
    let many = [2, 2, 500, 16];
    let power = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
    // Zero frequency holds the most: 1 + (f_k / half a bin)^p, half a bin being 125 kHz.
    let coloured = shaped(&values(&of("coloured_noise").with("knee_hz", [5e5]).with("power", [1.0])), many);
    let mean = host(&coloured.re.mean_dim(3));
    assert!((power(&mean) * 16.0 / (1.0 + 4.0) - 1.0).abs() < 0.1, "{}", power(&mean) * 16.0);
    let common = shaped(&values(&of("correlated_noise").with("coefficient", [0.5])), many);
    let [a, b] = [0, 1].map(|rx| host(&common.re.clone().narrow(1, rx, 1)));
    let covariance = a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
    assert!((covariance - 0.25).abs() < 0.03, "{covariance}");
    let rare = host(&shaped(&values(&of("impulsive_noise").with("probability", [0.05]).with("excess", [9.0])), many).re);
    assert!((power(&rare) / (0.95 + 0.05 * 100.0) - 1.0).abs() < 0.2, "{}", power(&rare));
}
