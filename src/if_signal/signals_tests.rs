use std::f64::consts::TAU;
use std::ops::Range;

use burn::tensor::{DType, Device, TensorData};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::if_signal::tests::fused_devices;
use crate::paths::{Amplitude, Displacement};
use crate::radar::SPEED_OF_LIGHT;

fn radar(samples: usize, receivers: usize) -> Radar {
    Radar {
        start_frequency_hz: 77e9,
        slope_hz_per_s: 60.012e12,
        sample_rate_hz: 4.4e6,
        sampling: Default::default(),
        samples_per_chirp: samples,
        loops_per_frame: 8,
        adc_start_s: 6e-6,
        chirp_period_s: 216e-6,
        frame_period_s: 0.1,
        frames: 1,
        position_m: [0.0, 0.0, 0.2],
        tx_m: vec![[0.0; 3], [0.004, 0.0, 0.0]],
        rx_m: (0..receivers).map(|rx| [0.01 + 0.002 * rx as f64, 0.0, 0.0]).collect(),
        full_scale_codes: None,
    }
}

/// Points that move evenly, and their inputs on the host: x, y, z `[point * chirps]`, re, im.
struct Scene {
    reference_m: Vec<[f64; 3]>,
    velocity_mps: Vec<[f64; 3]>,
    chirps: usize,
    inputs: [Vec<f64>; 5],
    amplitude_chirps: usize,
}

impl Scene {
    fn new(points: usize, chirps: usize, amplitude_chirps: usize, radar: &Radar) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut within = |low: f64, high: f64| random.random_range(low..=high);
        let reference_m: Vec<[f64; 3]> = (0..points).map(|_| [within(-1.0, 1.0), within(0.8, 1.8), within(-0.5, 0.5)]).collect();
        let velocity_mps: Vec<[f64; 3]> = (0..points).map(|_| [0; 3].map(|_| within(-2.0, 2.0))).collect();
        let time_s = |chirp: usize| (chirp as f64 - 0.5 * (chirps as f64 - 1.0)) * radar.loop_period_s();
        // Rounded to f32, so that all precisions get the same.
        let axis = |axis: usize| -> Vec<f64> {
            (0..points * chirps).map(|i| f64::from((velocity_mps[i / chirps][axis] * time_s(i % chirps)) as f32)).collect()
        };
        let axes = [axis(0), axis(1), axis(2)];
        let mut strength = || (0..points * amplitude_chirps).map(|_| f64::from(within(-1.0, 1.0) as f32)).collect();
        let [x, y, z] = axes;
        let inputs = [x, y, z, strength(), strength()];
        Self { reference_m, velocity_mps, chirps, inputs, amplitude_chirps }
    }

    fn tensors(&self, device: &Device, dtype: DType) -> [Tensor<2>; 5] {
        let points = self.reference_m.len();
        [0, 1, 2, 3, 4].map(|input| {
            let columns = if input < 3 { self.chirps } else { self.amplitude_chirps };
            let data = TensorData::new(self.inputs[input].clone(), [points, columns]).convert_dtype(dtype);
            let tensor = Tensor::from_data(data, (device, dtype));
            if device.is_autodiff() { tensor.require_grad() } else { tensor }
        })
    }

    /// `to`: the receivers of the radar, or a wall's.
    fn signal(&self, [x, y, z, re, im]: [Tensor<2>; 5], complex: bool, how: &How) -> Complex<3> {
        let displacement = Displacement { x, y, z };
        let amplitude = Amplitude { re, im: complex.then_some(im) };
        let points = Points { reference_m: &self.reference_m, displacement: &displacement, amplitude: &amplitude };
        match how.proxy_m {
            None => direct_signal(points, &how.radar, how.tx, how.dechirp, how.form),
            Some(proxy_m) => {
                let to_walls = ToWalls { points, walls: &[(0, 0..self.reference_m.len())] };
                indirect_signal(&[to_walls], &[proxy_m], &how.radar, how.tx, how.dechirp, how.form).expect("a wall")
            }
        }
    }
}

#[derive(Clone)]
struct How {
    radar: Radar,
    tx: usize,
    proxy_m: Option<[f64; 3]>,
    dechirp: Dechirp,
    form: SumForm,
}

const PROXY_M: [f64; 3] = [2.0, 1.5, 0.4];

fn values(signal: &Complex<3>) -> Vec<f64> {
    let host = |tensor: &Tensor<3>| tensor.clone().into_data().convert::<f64>().try_into_vec::<f64>().unwrap();
    [host(&signal.re), host(&signal.im)].concat()
}

fn relative_error(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let difference: f64 = found.iter().zip(wanted).map(|(f, w)| (f - w).powi(2)).sum();
    (difference / wanted.iter().map(|w| w * w).sum::<f64>()).sqrt()
}

fn length(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// The mixer's phase with the delay of every sample's time, in f64 on the host: `[rx][chirp][sample]`.
fn truth(scene: &Scene, how: &How) -> Vec<f64> {
    let radar = &how.radar;
    let (mut re, mut im) = (vec![], vec![]);
    let middle_s = 0.5 * radar.samples_per_chirp as f64 / radar.sample_rate_hz;
    for rx in 0..radar.rx_m.len() {
        for chirp in 0..scene.chirps {
            for sample in 0..radar.samples_per_chirp {
                let t = sample as f64 / radar.sample_rate_hz;
                let (mut sum_re, mut sum_im) = (0.0, 0.0);
                for (point, &reference) in scene.reference_m.iter().enumerate() {
                    let since_middle_s = if how.dechirp == Dechirp::Exact && scene.chirps > 1 { t - middle_s } else { 0.0 };
                    let at = point * scene.chirps + chirp;
                    let x: [f64; 3] = std::array::from_fn(|axis| {
                        reference[axis] + scene.inputs[axis][at] + scene.velocity_mps[point][axis] * since_middle_s
                    });
                    let (tx_m, rx_m) = (radar.tx_position_m(how.tx), radar.rx_position_m(rx));
                    let mut legs = vec![length(tx_m, x)];
                    match how.proxy_m {
                        None => legs.push(length(x, rx_m)),
                        Some(proxy) => legs.extend([length(x, proxy), length(proxy, rx_m)]),
                    }
                    let delay = legs.iter().sum::<f64>() / SPEED_OF_LIGHT;
                    let mut turns = radar.carrier_hz() * delay + radar.slope_hz_per_s * t * delay;
                    if how.dechirp == Dechirp::Exact {
                        turns -= 0.5 * radar.slope_hz_per_s * delay * delay;
                    }
                    let (sin, cos) = (TAU * turns.fract()).sin_cos();
                    let spreading = 1.0 / legs.iter().product::<f64>();
                    let index = if scene.amplitude_chirps == 1 { point } else { at };
                    let (a, b) = (scene.inputs[3][index] * spreading, scene.inputs[4][index] * spreading);
                    sum_re += a * cos - b * sin;
                    sum_im += a * sin + b * cos;
                }
                re.push(sum_re);
                im.push(sum_im);
            }
        }
    }
    [re, im].concat()
}

fn cases() -> Vec<(Scene, How)> {
    let mut cases = vec![];
    for (points, chirps, amplitude_chirps, samples, receivers) in
        [(40, 20, 1, 64, 3), (30, 37, 37, 51, 1), (300, 1, 1, 64, 2), (20, 2, 1, 32, 2), (25, 3, 3, 32, 1), (70, 130, 1, 48, 4)]
    {
        for proxy_m in [None, Some(PROXY_M)] {
            for dechirp in [Dechirp::Exact, Dechirp::Paper] {
                let radar = radar(samples, receivers);
                let scene = Scene::new(points, chirps, amplitude_chirps, &radar);
                cases.push((scene, How { radar, tx: 1, proxy_m, dechirp, form: SumForm::Fused }));
            }
        }
    }
    cases
}

/// The paper's signal is what it says; the exact one misses the curvature of a moving point's phase within a chirp.
#[test]
fn signals_agree_with_the_mixers_phase_in_f64() {
    for (scene, how) in cases() {
        let wanted = truth(&scene, &how);
        let tensor = [DType::F64, DType::F32].map(|dtype| (SumForm::Tensor, dtype, Device::flex()));
        let fused = fused_devices().into_iter().map(|(_, device)| (SumForm::Fused, DType::F32, device));
        for (form, dtype, device) in tensor.into_iter().chain(fused) {
            let how = How { form, ..how.clone() };
            let error = relative_error(&values(&scene.signal(scene.tensors(&device, dtype), true, &how)), &wanted);
            let tolerance = match (how.dechirp, dtype) {
                (Dechirp::Exact, _) => 2e-4,
                // What the softening of the legs changes.
                (Dechirp::Paper, DType::F64) => 5e-7,
                (Dechirp::Paper, _) => 2e-5,
            };
            println!(
                "{} chirps, wall {}, {:?}, {form:?}, {dtype:?}, {device:?}: {error:.1e}",
                scene.chirps,
                how.proxy_m.is_some(),
                how.dechirp
            );
            assert!(
                error < tolerance,
                "{} chirps, wall {}, {:?}, {form:?}, {dtype:?}, {device:?}: {error:.1e}",
                scene.chirps,
                how.proxy_m.is_some(),
                how.dechirp
            );
        }
    }
}

/// Gradients of a weighted sum of the samples to x, y, z, re and im.
fn gradients(scene: &Scene, complex: bool, how: &How, dtype: DType, device: &Device) -> Vec<Vec<f64>> {
    let tensors = scene.tensors(&device.clone().autodiff(), dtype);
    let signal = scene.signal(tensors.clone(), complex, how);
    let (dims, device) = (signal.dims(), signal.device());
    let weights = |part: usize| -> Tensor<3> {
        let values: Vec<f64> = (0..dims.iter().product()).map(|i| weight(i, part)).collect();
        Tensor::from_data(TensorData::new(values, dims).convert_dtype(dtype), (&device, dtype))
    };
    let gradients = (signal.re * weights(0) + signal.im * weights(1)).sum().backward();
    let used = if complex { 5 } else { 4 };
    let host = |tensor: &Tensor<2>| tensor.grad(&gradients).unwrap().into_data().convert::<f64>().try_into_vec::<f64>().unwrap();
    tensors[..used].iter().map(host).collect()
}

fn weight(index: usize, part: usize) -> f64 {
    ((index * 37 + part * 11) % 17) as f64 / 8.0 - 1.0
}

#[test]
fn fused_gradients_agree_with_the_tensor_form_in_f64() {
    let mut failures = vec![];
    for (scene, how) in cases() {
        for complex in [false, true] {
            let tensor = How { form: SumForm::Tensor, ..how.clone() };
            let wanted = gradients(&scene, complex, &tensor, DType::F64, &Device::flex());
            let fused = fused_devices().into_iter().map(|(_, device)| (&how, device));
            for (how, device) in fused.chain([(&tensor, Device::flex())]) {
                let found = gradients(&scene, complex, how, DType::F32, &device);
                for (input, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
                    let error = relative_error(found, wanted);
                    if error.is_nan() || error > 5e-5 {
                        let wall = how.proxy_m.is_some();
                        failures.push(format!(
                            "{} chirps, wall {wall}, {:?} {:?} on {device:?}, input {input}: {error:.1e}",
                            scene.chirps, how.dechirp, how.form
                        ));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

pub(crate) fn gradients_agree_with_central_differences_of_a_micrometre() {
    for proxy_m in [None, Some(PROXY_M)] {
        let radar = radar(24, 2);
        let scene = Scene::new(3, 4, 1, &radar);
        let how = How { radar, tx: 0, proxy_m, dechirp: Dechirp::Exact, form: SumForm::Tensor };
        let found = gradients(&scene, true, &how, DType::F64, &Device::flex());
        for input in 0..5 {
            let wanted: Vec<f64> = (0..scene.inputs[input].len())
                .map(|i| {
                    let at = |by: f64| {
                        let mut inputs = scene.inputs.clone();
                        inputs[input][i] += by;
                        let moved = Scene {
                            inputs,
                            reference_m: scene.reference_m.clone(),
                            velocity_mps: scene.velocity_mps.clone(),
                            ..scene
                        };
                        let values = values(&moved.signal(moved.tensors(&Device::flex(), DType::F64), true, &how));
                        let half = values.len() / 2;
                        values.iter().enumerate().map(|(k, value)| value * weight(k % half, k / half)).sum::<f64>()
                    };
                    (at(1e-6) - at(-1e-6)) / 2e-6
                })
                .collect();
            crate::support::compared(&wanted);
            let error = relative_error(&found[input], &wanted);
            assert!(error < 1e-5, "wall {}, input {input}: {error:.1e}", proxy_m.is_some());
        }
    }
}

/// Three walls, of which the second sees nobody, in one call, against each of them in f64: values, and gradients to the displacement.
#[test]
fn the_points_of_several_walls_are_summed_apart() {
    let radar = radar(48, 2);
    let scene = Scene::new(70, 20, 1, &radar);
    let walls_m = [PROXY_M, [-2.0, 1.0, 0.1], [0.5, 6.0, -0.3]];
    let rows = [(0, 0..25), (1, 25..25), (2, 25..70)];
    let answer = |device: Device, dtype: DType, form: SumForm, walls: &[(usize, Range<usize>)]| {
        let [x, y, z, re, _] = scene.tensors(&device.autodiff(), dtype);
        let displacement = Displacement { x: x.clone(), y, z };
        let amplitude = Amplitude::real(re.clone());
        let part = |rows: Range<usize>| (displacement.rows(rows.clone()), amplitude.rows(rows));
        let of = |walls: &[(usize, Range<usize>)]| {
            let all = walls[0].1.start..walls[walls.len() - 1].1.end;
            let (displacement, amplitude) = part(all.clone());
            let reference_m = &scene.reference_m[all.clone()];
            let points = Points { reference_m, displacement: &displacement, amplitude: &amplitude };
            let walls: Vec<_> = walls.iter().map(|(wall, rows)| (*wall, rows.start - all.start..rows.end - all.start)).collect();
            indirect_signal(&[ToWalls { points, walls: &walls }], &walls_m, &radar, 1, Dechirp::Exact, form).unwrap()
        };
        let signal = match form {
            SumForm::Fused => of(walls),
            _ => walls.iter().map(|wall| of(std::slice::from_ref(wall))).reduce(Complex::add).unwrap(),
        };
        let gradients = signal.clone().power().sum().backward();
        let host = |tensor: Tensor<2>| tensor.into_data().convert::<f64>().try_into_vec::<f64>().unwrap();
        (values(&signal), host(x.grad(&gradients).unwrap()), host(re.grad(&gradients).unwrap()))
    };
    let wanted = answer(Device::flex(), DType::F64, SumForm::Tensor, &rows);
    for (name, device) in fused_devices() {
        let found = answer(device, DType::F32, SumForm::Fused, &rows);
        for (what, found, wanted) in
            [("values", &found.0, &wanted.0), ("x", &found.1, &wanted.1), ("amplitude", &found.2, &wanted.2)]
        {
            let error = relative_error(found, wanted);
            assert!(error < 5e-5, "{name}, {what}: {error:.1e}");
        }
    }
}

#[test]
fn swapping_transmitter_and_receiver_changes_nothing() {
    let mut there = radar(64, 1);
    there.tx_m = vec![[0.3, 0.0, 0.1]];
    let mut back = there.clone();
    std::mem::swap(&mut back.tx_m, &mut back.rx_m);
    let scene = Scene::new(50, 6, 1, &there);
    for form in [SumForm::Tensor, SumForm::Fused] {
        let how = |radar: &Radar| How { radar: radar.clone(), tx: 0, proxy_m: None, dechirp: Dechirp::Exact, form };
        let of = |radar: &Radar| values(&scene.signal(scene.tensors(&Device::flex(), DType::F32), false, &how(radar)));
        assert!(relative_error(&of(&there), &of(&back)) < 1e-5, "{form:?}");
    }
}

#[test]
fn points_at_rest_answer_every_chirp_alike() {
    let radar = radar(64, 2);
    let (moving, still) = (Scene::new(30, 5, 1, &radar), Scene::new(40, 1, 1, &radar));
    let how = How { radar, tx: 0, proxy_m: None, dechirp: Dechirp::Exact, form: SumForm::Auto };
    let of = |scene: &Scene| scene.signal(scene.tensors(&Device::flex(), DType::F32), false, &how);
    let room = of(&still);
    assert_eq!(room.dims(), [2, 1, 64]);
    let both = of(&moving).add(room);
    assert_eq!(both.dims(), [2, 5, 64]);
}

#[test]
fn nobody_in_view_is_silence() {
    let radar = radar(32, 3);
    let scene = Scene::new(0, 4, 1, &radar);
    for proxy_m in [None, Some(PROXY_M)] {
        for form in [SumForm::Auto, SumForm::Tensor, SumForm::Exact] {
            let how = How { radar: radar.clone(), tx: 0, proxy_m, dechirp: Dechirp::Exact, form };
            let signal = scene.signal(scene.tensors(&Device::flex(), DType::F32), false, &how);
            assert_eq!(values(&signal), vec![0.0; 2 * 3 * 4 * 32], "{form:?}");
        }
    }
}

#[test]
fn a_point_on_an_antenna_is_finite_in_value_and_gradient() {
    let radar = radar(32, 2);
    let mut scene = Scene::new(3, 4, 1, &radar);
    scene.reference_m = vec![radar.tx_position_m(0), radar.rx_position_m(0), PROXY_M];
    scene.inputs[..3].iter_mut().for_each(|axis| axis.fill(0.0));
    for proxy_m in [None, Some(PROXY_M)] {
        let fused = fused_devices().into_iter().map(|(_, device)| (SumForm::Fused, device));
        for (form, device) in fused.chain([(SumForm::Tensor, Device::flex())]) {
            let how = How { radar: radar.clone(), tx: 0, proxy_m, dechirp: Dechirp::Exact, form };
            let signal = scene.signal(scene.tensors(&device, DType::F32), true, &how);
            assert!(values(&signal).iter().all(|value| value.is_finite()), "{form:?}");
            for (input, gradient) in gradients(&scene, true, &how, DType::F32, &device).into_iter().enumerate() {
                assert!(gradient.iter().all(|value| value.is_finite()), "{form:?}, {device:?}, input {input}: {gradient:?}");
            }
        }
    }
}

#[test]
fn displacements_need_no_tape_when_only_amplitudes_learn() {
    let radar = radar(32, 2);
    let scene = Scene::new(20, 6, 1, &radar);
    for form in [SumForm::Tensor, SumForm::Fused] {
        let how = How { radar: radar.clone(), tx: 0, proxy_m: None, dechirp: Dechirp::Exact, form };
        let [x, y, z, _, im] = scene.tensors(&Device::flex(), DType::F32);
        let [_, _, _, re, _] = scene.tensors(&Device::flex().autodiff(), DType::F32);
        let signal = scene.signal([x, y, z, re.clone(), im], false, &how);
        let gradients = signal.power().sum().backward();
        assert!(re.grad(&gradients).is_some(), "{form:?}");
    }
}
