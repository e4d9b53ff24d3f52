use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::radar::{Radar, SPEED_OF_LIGHT};

fn radar() -> Radar {
    Radar {
        start_frequency_hz: 77e9,
        slope_hz_per_s: 60.012e12,
        sample_rate_hz: 4.4e6,
        sampling: Default::default(),
        samples_per_chirp: 64,
        loops_per_frame: 8,
        adc_start_s: 6e-6,
        chirp_period_s: 72e-6,
        frame_period_s: 0.1,
        frames: 1,
        position_m: [0.0, 0.0, 0.2],
        tx_m: vec![[0.0; 3], [0.004, 0.0, 0.0]],
        rx_m: vec![[0.01, 0.0, 0.0], [0.012, 0.0, 0.0]],
        full_scale_codes: None,
    }
}

/// Reference positions in a room, and displacements of up to `reach_m` along each axis, `[axis][point * chirps + chirp]`.
fn scene(points: usize, chirps: usize, reach_m: f64) -> (Vec<[f64; 3]>, [Vec<f64>; 3]) {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut within = |low: f64, high: f64| random.random_range(low..=high);
    let reference = (0..points).map(|_| [within(-2.0, 2.0), within(1.0, 5.0), within(-1.0, 1.0)]).collect();
    // What f32 tensors hold.
    let mut axis = || (0..points * chirps).map(|_| f64::from(within(-reach_m, reach_m) as f32)).collect();
    (reference, [axis(), axis(), axis()])
}

fn tensor(values: &[f64], dims: [usize; 2], device: &Device, dtype: DType) -> Tensor<2> {
    let tensor = Tensor::from_data(TensorData::new(values.to_vec(), dims).convert_dtype(dtype), (device, dtype));
    if device.is_autodiff() { tensor.require_grad() } else { tensor }
}

fn displacement(axes: &[Vec<f64>; 3], dims: [usize; 2], device: &Device, dtype: DType) -> Displacement {
    let [x, y, z] = [0, 1, 2].map(|axis| tensor(&axes[axis], dims, device, dtype));
    Displacement { x, y, z }
}

fn host(tensor: Tensor<2>) -> Vec<f64> {
    tensor.into_data().convert::<f64>().try_into_vec::<f64>().unwrap()
}

fn moved(reference: [f64; 3], axes: &[Vec<f64>; 3], at: usize) -> [f64; 3] {
    std::array::from_fn(|axis| reference[axis] + axes[axis][at])
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| if value.abs() > most || value.is_nan() { value.abs() } else { most })
}

#[test]
fn a_leg_in_f64_is_the_distance() {
    let (reference, axes) = scene(20, 3, 0.1);
    let antenna = [0.3, 0.1, 0.2];
    let leg = leg(&reference, &displacement(&axes, [20, 3], &Device::flex(), DType::F64), antenna);
    let found = host(leg.length_m());
    let error = largest((0..60).map(|i| found[i] - distance(moved(reference[i / 3], &axes, i), antenna)));
    assert!(error < 1e-8, "{error:.1e} m");
}

/// The number that the precision scheme is for: f32 alone is off by 4·10⁻³ rad.
#[test]
fn the_phase_in_f32_is_right_to_fifty_microradians() {
    let (points, chirps, radar) = (4000, 4, radar());
    // Three centimetres along each axis: half a frame's way of a hand.
    let (reference, axes) = scene(points, chirps, 0.03);
    let displacement = displacement(&axes, [points, chirps], &Device::flex(), DType::F32);
    let (tx, rx) = (radar.tx_position_m(0), radar.rx_position_m(1));
    let motion = Motion::new(&reference, &displacement);
    let amplitude = Amplitude::real(Tensor::ones([points, 1], &Device::flex()));
    let phasors = phasors(&[&motion.leg(tx), &motion.leg(rx)], &amplitude, &radar, Dechirp::Paper);
    let middle_hz = radar.carrier_hz() + 0.5 * radar.bandwidth_hz();
    let (mut worst, mut squares): (f64, f64) = (0.0, 0.0);
    for (i, turns) in host(phasors.phase_turns).into_iter().enumerate() {
        let x = moved(reference[i / chirps], &axes, i);
        let wanted = middle_hz * (distance(x, tx) + distance(x, rx)) / SPEED_OF_LIGHT;
        let off = turns - wanted;
        let radians = TAU * (off - off.round());
        worst = worst.max(radians.abs());
        squares += radians * radians;
    }
    let typical = (squares / (points * chirps) as f64).sqrt();
    println!("phase error: at most {worst:.1e} rad, typically {typical:.1e} rad");
    assert!(worst < 5e-5 && typical < 8e-6, "at most {worst:.1e}, typically {typical:.1e} rad");
}

#[test]
fn sweep_and_amplitude_follow_delay_rate_and_lengths() {
    let (radar, chirps) = (radar(), 8);
    let velocity = [0.5, -1.5, 0.3];
    let reference = [0.4, 2.5, 0.1];
    let time_s = |chirp: usize| (chirp as f64 - 3.5) * radar.loop_period_s();
    let axes = velocity.map(|v| (0..chirps).map(|chirp| v * time_s(chirp)).collect::<Vec<f64>>());
    let displacement = displacement(&axes, [1, chirps], &Device::flex(), DType::F64);
    let (tx, rx) = (radar.tx_position_m(0), radar.rx_position_m(0));
    let motion = Motion::new(std::slice::from_ref(&reference), &displacement);
    let amplitude = Amplitude::real(Tensor::full([1, 1], 3.0, (&Device::flex(), DType::F64)));
    let phasors = phasors(&[&motion.leg(tx), &motion.leg(rx)], &amplitude, &radar, Dechirp::Exact);
    let at = |time_s: f64| -> [f64; 3] { std::array::from_fn(|axis| reference[axis] + velocity[axis] * time_s) };
    let path = |time_s: f64| distance(at(time_s), tx) + distance(at(time_s), rx);
    let (sweep, strength) = (host(phasors.sweep_turns), host(phasors.amplitude));
    let middle_hz = radar.carrier_hz() + 0.5 * radar.bandwidth_hz();
    let window_s = 64.0 / radar.sample_rate_hz;
    for chirp in 0..chirps {
        let t = time_s(chirp);
        let rate = (path(t + 1e-6) - path(t - 1e-6)) / 2e-6 / SPEED_OF_LIGHT;
        let wanted = radar.bandwidth_hz() * path(t) / SPEED_OF_LIGHT + middle_hz * rate * window_s;
        assert!((sweep[chirp] - wanted).abs() < 1e-6, "chirp {chirp}: {} turns, wanted {wanted}", sweep[chirp]);
        let wanted = 3.0 / (distance(at(t), tx) * distance(at(t), rx));
        assert!((strength[chirp] / wanted - 1.0).abs() < 1e-7, "chirp {chirp}: {}, wanted {wanted}", strength[chirp]);
    }
}

/// Weighted sum of everything that phasors are made of.
fn loss(phasors: Phasors) -> Tensor<1> {
    let weighted = |tensor: Tensor<2>, offset: usize| {
        let dims = tensor.dims();
        let weights: Vec<f64> = (0..dims[0] * dims[1]).map(|i| ((i * 7 + offset) % 5) as f64 - 1.7).collect();
        let (device, dtype) = (tensor.device(), tensor.dtype());
        (tensor * Tensor::from_data(TensorData::new(weights, dims).convert_dtype(dtype), (&device, dtype))).sum()
    };
    weighted(phasors.amplitude, 0)
        + weighted(phasors.amplitude_im.expect("a complex amplitude"), 1)
        + weighted(phasors.phase_turns, 2) * 0.01
        + weighted(phasors.sweep_turns, 3)
}

pub(crate) fn gradients_of_phasors_agree_with_central_differences() {
    let (points, chirps) = (3, 4);
    let (reference, axes) = scene(points, chirps, 0.05);
    let strengths: Vec<f64> = (0..2 * points).map(|i| 0.3 + 0.1 * i as f64).collect();
    let radar = radar();
    for dechirp in [Dechirp::Exact, Dechirp::Paper] {
        let build = |inputs: &[Vec<f64>], device: &Device| -> (Vec<Tensor<2>>, Tensor<1>) {
            let axes = [inputs[0].clone(), inputs[1].clone(), inputs[2].clone()];
            let displacement = displacement(&axes, [points, chirps], device, DType::F64);
            let [re, im] = [3, 4].map(|i| tensor(&inputs[i], [points, 1], device, DType::F64));
            let amplitude = Amplitude { re: re.clone(), im: Some(im.clone()) };
            let motion = Motion::new(&reference, &displacement);
            let legs = [motion.leg(radar.tx_position_m(1)), motion.leg(radar.rx_position_m(0))];
            let value = loss(phasors(&[&legs[0], &legs[1]], &amplitude, &radar, dechirp));
            (vec![displacement.x.clone(), displacement.y.clone(), displacement.z.clone(), re, im], value)
        };
        let inputs: Vec<Vec<f64>> =
            axes.iter().cloned().chain([strengths[..points].to_vec(), strengths[points..].to_vec()]).collect();
        let (tensors, value) = build(&inputs, &Device::flex().autodiff());
        let gradients = value.backward();
        for (input, tensor) in tensors.iter().enumerate() {
            let found = host(tensor.grad(&gradients).expect("a gradient"));
            for (i, found) in found.into_iter().enumerate() {
                let at = |by: f64| {
                    let mut inputs = inputs.clone();
                    inputs[input][i] += by;
                    build(&inputs, &Device::flex()).1.into_data().convert::<f64>().try_into_vec::<f64>().unwrap()[0]
                };
                let wanted = (at(1e-6) - at(-1e-6)) / 2e-6;
                crate::support::compared(&[wanted]);
                let close = (found - wanted).abs() < 1e-6 * wanted.abs().max(1.0);
                assert!(close, "{dechirp:?}, input {input}, element {i}: {found}, wanted {wanted}");
            }
        }
    }
}

#[test]
fn a_point_on_an_antenna_is_finite_in_value_and_gradient() {
    let radar = radar();
    for dtype in [DType::F32, DType::F64] {
        let device = Device::flex().autodiff();
        let reference = [radar.tx_position_m(0), radar.rx_position_m(0)];
        let displacement = displacement(&[vec![0.0; 2], vec![0.0; 2], vec![0.0; 2]], [2, 1], &device, dtype);
        let amplitude = tensor(&[1.0, 1.0], [2, 1], &device, dtype);
        let motion = Motion::new(&reference, &displacement);
        let legs = [motion.leg(radar.tx_position_m(0)), motion.leg(radar.rx_position_m(0))];
        let amplitude_of = Amplitude { re: amplitude.clone(), im: Some(amplitude.clone()) };
        let value = loss(phasors(&[&legs[0], &legs[1]], &amplitude_of, &radar, Dechirp::Exact));
        assert!(value.clone().into_data().convert::<f64>().try_into_vec::<f64>().unwrap()[0].is_finite(), "{dtype:?}");
        let gradients = value.backward();
        for input in [&displacement.x, &displacement.y, &displacement.z, &amplitude] {
            let gradient = host(input.grad(&gradients).expect("a gradient"));
            assert!(gradient.iter().all(|g| g.is_finite()), "{dtype:?}: {gradient:?}");
        }
    }
}

#[test]
fn differences_are_exact_for_a_parabola() {
    for chirps in [3, 4, 9] {
        let parabola = |chirp: usize| 0.3 * (chirp * chirp) as f64 - 2.0 * chirp as f64;
        for chirp in 0..chirps {
            let found: f64 = difference(chirp, chirps).iter().map(|&(from, weight)| weight * parabola(from)).sum();
            assert!((found - (0.6 * chirp as f64 - 2.0)).abs() < 1e-12, "chirp {chirp} of {chirps}");
        }
    }
}

#[test]
fn settings_are_written_in_lower_case() {
    assert_eq!(serde_json::to_string(&[Dechirp::Exact, Dechirp::Paper]).unwrap(), r#"["exact","paper"]"#);
}
