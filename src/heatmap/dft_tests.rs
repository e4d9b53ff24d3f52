use burn::tensor::{DType, Device, Tensor, TensorData};
use num_complex::{Complex32, Complex64};
use rand::{RngExt, SeedableRng};

use super::*;
use crate::heatmap::{Analysis, Window, synthetic};
use crate::radar::Radar;

fn noise(count: usize, seed: u64) -> Vec<Complex32> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| Complex32::new(random.random::<f32>() - 0.5, random.random::<f32>() - 0.5)).collect()
}

fn tensor<const D: usize>(signal: &[Complex32], dims: [usize; D], device: &Device, dtype: DType) -> Complex<D> {
    let part = |values: Vec<f32>| Tensor::from_data(TensorData::new(values, dims), (device, dtype));
    Complex::new(part(signal.iter().map(|v| v.re).collect()), part(signal.iter().map(|v| v.im).collect()))
}

fn values<const D: usize>(map: Complex<D>) -> Vec<Complex64> {
    let part = |tensor: Tensor<D>| tensor.into_data().iter::<f64>().collect::<Vec<_>>();
    part(map.re).into_iter().zip(part(map.im)).map(|(re, im)| Complex64::new(re, im)).collect()
}

/// Error relative to the strongest cell.
fn error(found: &[Complex64], wanted: &[Complex64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let peak = wanted.iter().map(|v| v.norm()).fold(0.0, f64::max);
    found.iter().zip(wanted).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / peak
}

#[test]
#[allow(deprecated)] // ndarray is the second opinion on a CPU, for as long as it exists
fn the_graph_agrees_with_the_fft_for_lengths_that_are_no_powers_of_two() {
    let devices = [
        Device::flex(),
        #[cfg(feature = "ndarray")]
        Device::ndarray(),
    ];
    for (loops, samples) in [(85, 128), (128, 85), (100, 64), (1, 7), (48, 100)] {
        for sampling in [Sampling::Complex, Sampling::Real] {
            for window in [Window::Hann, Window::Rectangular] {
                let config = HeatmapConfig { range_window: window, doppler_window: Window::Hamming, ..Default::default() };
                let radar = Radar { sampling, loops_per_frame: loops, samples_per_chirp: samples, ..synthetic::radar() };
                let dims = [2, 3, loops, samples];
                let signal = noise(dims.iter().product(), 1);
                let wanted = Analysis::new(&radar, &config).range_doppler_complex(&signal).into_values();
                for device in &devices {
                    for (dtype, tolerance) in [(DType::F32, 1e-6), (DType::F64, 1e-13)] {
                        let transform = RangeDoppler::new(loops, samples, sampling, &config, (device, dtype));
                        let map = transform.map(tensor(&signal, dims, device, dtype));
                        assert_eq!(map.dims(), [2, 3, loops, range_bins(samples, sampling)]);
                        let error = error(&values(map), &wanted);
                        assert!(error < tolerance, "{loops} × {samples} {sampling:?} {window:?} {dtype:?}: {error:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_point_at_three_metres_that_recedes_peaks_in_its_cell() {
    let radar = synthetic::radar();
    let velocity = 4.0 * radar.velocity_resolution_mps();
    let signal = synthetic::point(&radar, |time| [0.0, 3.0 + velocity * time, 0.0]);
    let device = Device::flex();
    let [_, transmitters, receivers, loops, samples] = radar.dims();
    let transform = RangeDoppler::new(loops, samples, radar.sampling, &HeatmapConfig::default(), &device);
    let dims = [transmitters, receivers, loops, samples];
    let map = transform.map(tensor(&signal, dims, &device, DType::F32));
    let power = map.power().reshape([8, loops * samples]).mean_dim(0);
    let peak = power.argmax(1).into_scalar::<i64>() as usize;
    assert_eq!([peak / samples, peak % samples], [loops / 2 + 4, (3.0 / radar.range_resolution_m()).round() as usize]);
}

#[test]
#[should_panic(expected = "expected […, loop, sample] = [4, 8]")]
fn a_signal_of_another_shape_is_refused() {
    let device = Device::flex();
    let transform = RangeDoppler::new(4, 8, Sampling::Complex, &HeatmapConfig::default(), &device);
    transform.map(Complex::<3>::zeros([1, 8, 4], &device));
}

#[test]
fn decibels_of_nothing_are_the_floor_and_their_gradient_is_zero() {
    let device = Device::flex().autodiff();
    let signal = Complex::<2>::new(
        Tensor::from_data([[0.0, 1.0]], &device).require_grad(),
        Tensor::from_data([[0.0, 0.0]], &device).require_grad(),
    );
    let db = power_db(signal.clone().power(), 1e-3);
    let found: Vec<f64> = db.clone().into_data().iter::<f64>().collect();
    assert!((found[0] + 60.0).abs() < 1e-4 && found[1].abs() < 1e-4, "{found:?}");
    let gradients = db.sum().backward();
    let gradient: Vec<f64> = signal.re.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
    assert_eq!(gradient[0], 0.0);
    // d/da 20 log₁₀ a at a = 1
    assert!((gradient[1] - 20.0 / std::f64::consts::LN_10).abs() < 1e-4);
    // without any floor at all, values stay finite
    assert!(power_db(Tensor::<1>::zeros([1], &device), 0.0).into_scalar::<f64>().is_finite());
}

pub(crate) fn gradients_of_the_decibel_map_agree_with_central_differences() {
    let (loops, samples) = (3, 5);
    let device = Device::flex().autodiff();
    let transform = RangeDoppler::new(loops, samples, Sampling::Complex, &HeatmapConfig::default(), (&device, DType::F64));
    let weights = Tensor::<2>::from_data(TensorData::new(weights(loops * samples), [loops, samples]), (&device, DType::F64));
    let score = |signal: Complex<2>| {
        let signal = remove_loop_mean(signal);
        (power_db(transform.map(signal).power(), 1e-2) * weights.clone()).sum()
    };
    let start = noise(loops * samples, 3);
    let signal = tensor(&start, [loops, samples], &device, DType::F64);
    let tracked = Complex::new(signal.re.require_grad(), signal.im.require_grad());
    let gradients = score(tracked.clone()).backward();
    let found: Vec<f64> = tracked.re.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
    let step = 1e-5;
    for index in 0..start.len() {
        let moved = |by: f64| {
            let mut re: Vec<f64> = start.iter().map(|v| v.re.into()).collect();
            re[index] += by;
            let im: Vec<f64> = start.iter().map(|v| v.im.into()).collect();
            let part = |values| Tensor::from_data(TensorData::new(values, [loops, samples]), (&device, DType::F64));
            score(Complex::new(part(re), part(im))).into_scalar::<f64>()
        };
        let wanted = (moved(step) - moved(-step)) / (2.0 * step);
        crate::support::compared(&[wanted]);
        assert!((found[index] - wanted).abs() < 1e-5 * (1.0 + wanted.abs()), "{index}: found {}, wanted {wanted}", found[index]);
    }
}

fn weights(count: usize) -> Vec<f64> {
    noise(count, 4).into_iter().map(|value| value.re.into()).collect()
}

#[test]
fn doppler_over_time_sums_the_power_over_range_and_averages_the_antennas() {
    let device = Device::flex();
    let map = Complex::new(Tensor::<5>::ones([2, 1, 3, 4, 5], &device) * 2.0, Tensor::zeros([2, 1, 3, 4, 5], &device));
    let found = time_doppler(map);
    assert_eq!(found.dims(), [2, 4]);
    assert!(found.into_data().iter::<f64>().all(|value| (value - 20.0).abs() < 1e-6));
}

#[cfg(feature = "wgpu")]
#[test]
fn wgpu_agrees_with_the_fft_in_values_and_with_flex_in_gradients() {
    let (loops, samples) = (85, 100);
    let radar = Radar { loops_per_frame: loops, samples_per_chirp: samples, ..synthetic::radar() };
    let config = HeatmapConfig::default();
    let signal = noise(2 * loops * samples, 5);
    let wanted = Analysis::new(&radar, &config).range_doppler_complex(&signal).into_values();
    let gradient = |device: Device| {
        let transform = RangeDoppler::new(loops, samples, Sampling::Complex, &config, &device);
        let signal = tensor(&signal, [2, loops, samples], &device, DType::F32);
        let signal = Complex::new(signal.re.require_grad(), signal.im);
        let map = transform.map(signal.clone());
        let gradients = power_db(map.clone().power(), 1e-3).sum().backward();
        let gradient: Vec<f64> = signal.re.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
        (values(map), gradient.into_iter().map(Complex64::from).collect::<Vec<_>>())
    };
    let (map, found) = gradient(Device::wgpu(burn::tensor::DeviceKind::Cpu).autodiff());
    assert!(error(&map, &wanted) < 1e-6, "{:e}", error(&map, &wanted));
    let (_, wanted) = gradient(Device::flex().autodiff());
    assert!(error(&found, &wanted) < 1e-4, "{:e}", error(&found, &wanted));
}
