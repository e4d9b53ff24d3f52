use std::f64::consts::TAU;

use burn::tensor::{Device, TensorData};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// Random returns on the host, `[point][chirp]` each.
#[derive(Clone)]
struct Returns {
    re: Vec<f64>,
    im: Vec<f64>,
    phase: Vec<f64>,
    sweep: Vec<f64>,
    dims: [usize; 2],
}

/// `speed`: change of the sweep from chirp to chirp, in turns at most.
fn returns(points: usize, chirps: usize, samples: usize, speed: f64) -> Returns {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut all = Returns { re: vec![], im: vec![], phase: vec![], sweep: vec![], dims: [points, chirps] };
    for _ in 0..points {
        let range: f64 = random.random_range(-0.1..0.9);
        let (rate, start): (f64, f64) = (random.random_range(-speed..=speed), random.random_range(-0.5..0.5));
        for chirp in 0..chirps {
            let moved = rate * chirp as f64;
            all.re.push(random.random_range(0.2..1.0));
            all.im.push(random.random_range(-1.0..1.0));
            all.phase.push(start + 20.0 * moved);
            all.sweep.push(range * samples as f64 + moved);
        }
    }
    // What f32 tensors hold, so that all forms get the same numbers.
    for values in [&mut all.re, &mut all.im, &mut all.phase, &mut all.sweep] {
        values.iter_mut().for_each(|value| *value = f64::from(*value as f32));
    }
    all
}

impl Returns {
    fn phasors(&self, device: &Device, dtype: DType, complex: bool) -> Phasors {
        let tensor = |values: &[f64]| {
            let tensor = Tensor::from_data(TensorData::new(values.to_vec(), self.dims).convert_dtype(dtype), (device, dtype));
            if device.is_autodiff() { tensor.require_grad() } else { tensor }
        };
        Phasors {
            amplitude: tensor(&self.re),
            amplitude_im: complex.then(|| tensor(&self.im)),
            phase_turns: tensor(&self.phase),
            sweep_turns: tensor(&self.sweep),
        }
    }

    /// The definition in f64 on the host: real parts, then imaginary parts, `[chirp][sample]`.
    fn sum(&self, samples: usize, complex: bool) -> Vec<f64> {
        let [points, chirps] = self.dims;
        let mut out = vec![0.0; 2 * chirps * samples];
        let (re, im) = out.split_at_mut(chirps * samples);
        for i in 0..points * chirps {
            let b = if complex { self.im[i] } else { 0.0 };
            for n in 0..samples {
                let s = (n as f64 - 0.5 * samples as f64) / samples as f64;
                let (sin, cos) = (TAU * (self.phase[i] + self.sweep[i] * s)).sin_cos();
                re[i % chirps * samples + n] += self.re[i] * cos - b * sin;
                im[i % chirps * samples + n] += self.re[i] * sin + b * cos;
            }
        }
        out
    }
}

fn values(signal: &Complex<2>) -> Vec<f64> {
    let host = |tensor: &Tensor<2>| tensor.clone().into_data().convert::<f64>().try_into_vec::<f64>().unwrap();
    [host(&signal.re), host(&signal.im)].concat()
}

fn relative_error(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let square = |of: &mut dyn Iterator<Item = f64>| of.map(|x| x * x).sum::<f64>();
    (square(&mut found.iter().zip(wanted).map(|(f, w)| f - w)) / square(&mut wanted.iter().copied())).sqrt()
}

/// Where the fused kernels run, in f32.
pub(crate) fn fused_devices() -> Vec<(&'static str, Device)> {
    vec![
        ("flex", Device::flex()),
        #[cfg(feature = "wgpu")]
        ("wgpu", Device::wgpu(burn::tensor::DeviceKind::Cpu)),
    ]
}

type Form = fn(&Phasors, usize) -> Complex<2>;
const FORMS: [(&str, Form); 4] = [("exact", exact::sum), ("spread", spread::sum), ("split", split::sum), ("fused", fused::sum)];

/// Points, chirps, samples, speed: powers of two, odd lengths, one chirp, one sample, and more cells than lanes share.
const CASES: [(usize, usize, usize, f64); 8] = [
    (200, 32, 64, 0.02),
    (50, 37, 85, 0.02),
    (3000, 1, 256, 0.0),
    (40, 16, 255, 0.1),
    (20, 5, 7, 0.05),
    (30, 3, 1, 0.0),
    (60, 40, 96, 3.0),
    (5000, 20, 48, 0.3),
];

#[test]
fn every_form_agrees_with_the_definition_in_f64() {
    let mut failures = vec![];
    for (points, chirps, samples, speed) in CASES {
        let returns = returns(points, chirps, samples, speed);
        for complex in [false, true] {
            let wanted = returns.sum(samples, complex);
            let mut check = |name: String, signal: Complex<2>, tolerance: f64| {
                assert_eq!(signal.dims(), [chirps, samples]);
                let error = relative_error(&values(&signal), &wanted);
                println!("{points} points, {chirps} chirps, {samples} samples, {name}: {error:.1e}");
                if error.is_nan() || error > tolerance {
                    failures.push(format!("{points} x {chirps} x {samples}, {name}: {error:.1e} above {tolerance:.0e}"));
                }
            };
            for (name, form) in FORMS {
                check(format!("{name} f32"), form(&returns.phasors(&Device::flex(), DType::F32, complex), samples), 3e-5);
                if name == "fused" {
                    for (device_name, device) in &fused_devices()[1..] {
                        let name = format!("fused on {device_name}");
                        check(name, form(&returns.phasors(device, DType::F32, complex), samples), 3e-5);
                    }
                } else {
                    check(format!("{name} f64"), form(&returns.phasors(&Device::flex(), DType::F64, complex), samples), 1e-11);
                }
            }
            #[cfg(feature = "ndarray")]
            {
                #[allow(deprecated)]
                let ndarray = Device::ndarray();
                check("spread on ndarray".into(), spread::sum(&returns.phasors(&ndarray, DType::F32, complex), samples), 3e-5);
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A loss with a different weight for every sample, and its gradients to re, im, phase and sweep.
fn gradients(phasors: &Phasors, samples: usize, form: Form) -> Vec<Vec<f64>> {
    let signal = form(phasors, samples);
    let (device, dtype) = (signal.device(), signal.re.dtype());
    let loss = (signal.re * weights(phasors.dims()[1], samples, 0, &device, dtype)
        + signal.im * weights(phasors.dims()[1], samples, 1, &device, dtype))
    .sum();
    let gradients = loss.backward();
    [Some(&phasors.amplitude), phasors.amplitude_im.as_ref(), Some(&phasors.phase_turns), Some(&phasors.sweep_turns)]
        .into_iter()
        .flatten()
        .map(|input| input.grad(&gradients).expect("a gradient").into_data().convert::<f64>().try_into_vec::<f64>().unwrap())
        .collect()
}

fn weight(index: usize, part: usize) -> f64 {
    ((index * 37 + part * 11) % 17) as f64 / 8.0 - 1.0
}

fn weights(chirps: usize, samples: usize, part: usize, device: &Device, dtype: DType) -> Tensor<2> {
    let values: Vec<f64> = (0..chirps * samples).map(|i| weight(i, part)).collect();
    Tensor::from_data(TensorData::new(values, [chirps, samples]).convert_dtype(dtype), (device, dtype))
}

pub(crate) fn gradients_agree_with_central_differences_in_f64() {
    let (points, chirps, samples) = (6, 3, 21);
    let returns = returns(points, chirps, samples, 0.05);
    let loss = |returns: &Returns| -> f64 {
        let (re, im) = (returns.sum(samples, true), chirps * samples);
        re.iter().enumerate().map(|(i, value)| value * weight(i % im, i / im)).sum()
    };
    let step = 1e-6;
    let wanted: Vec<Vec<f64>> = (0..4)
        .map(|input| {
            (0..points * chirps)
                .map(|i| {
                    let moved = |by: f64| {
                        let mut moved = returns.clone();
                        [&mut moved.re, &mut moved.im, &mut moved.phase, &mut moved.sweep][input][i] += by;
                        loss(&moved)
                    };
                    (moved(step) - moved(-step)) / (2.0 * step)
                })
                .collect()
        })
        .collect();
    wanted.iter().for_each(|wanted| crate::support::compared(wanted));
    for (name, form) in &FORMS[..3] {
        let found = gradients(&returns.phasors(&Device::flex().autodiff(), DType::F64, true), samples, *form);
        for (input, (found, wanted)) in ["re", "im", "phase", "sweep"].iter().zip(found.iter().zip(&wanted)) {
            let error = relative_error(found, wanted);
            assert!(error < 1e-7, "{name}, gradient to {input}: {error:.1e}");
        }
    }
}

#[test]
fn f32_gradients_of_every_form_agree_with_the_exact_ones_in_f64() {
    let mut failures = vec![];
    for (points, chirps, samples, speed) in [(200, 32, 64, 0.02), (50, 37, 85, 0.02), (60, 40, 96, 3.0), (900, 1, 255, 0.0)] {
        let returns = returns(points, chirps, samples, speed);
        for complex in [false, true] {
            let inputs = |device: &Device, dtype| returns.phasors(&device.clone().autodiff(), dtype, complex);
            let wanted = gradients(&inputs(&Device::flex(), DType::F64), samples, exact::sum);
            let mut check = |name: &str, found: Vec<Vec<f64>>| {
                assert_eq!(found.len(), wanted.len());
                for (index, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
                    let error = relative_error(found, wanted);
                    println!("{points} x {chirps} x {samples}, {name}, input {index} of {}: {error:.1e}", wanted.len());
                    // The moments' derivative loses one order: the sweep's gradient is the least accurate.
                    if error.is_nan() || error > 1e-4 {
                        failures.push(format!("{points} x {chirps} x {samples}, {name}, input {index}: {error:.1e}"));
                    }
                }
            };
            for (name, form) in FORMS {
                check(name, gradients(&inputs(&Device::flex(), DType::F32), samples, form));
            }
            for (name, device) in &fused_devices()[1..] {
                check(&format!("fused on {name}"), gradients(&inputs(device, DType::F32), samples, fused::sum));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn no_points_give_silence_in_every_form() {
    let returns = returns(0, 3, 16, 0.0);
    for form in [SumForm::Auto, SumForm::Tensor, SumForm::Fused, SumForm::Exact] {
        let signal = coherent_sum(&returns.phasors(&Device::flex(), DType::F32, false), 16, form);
        assert_eq!(values(&signal), vec![0.0; 2 * 3 * 16], "{form:?}");
    }
}

#[test]
fn auto_and_fused_fall_back_where_the_kernel_cannot_run() {
    let returns = returns(20, 4, 32, 0.02);
    #[allow(deprecated)]
    let others = [
        (Device::flex(), DType::F64),
        #[cfg(feature = "ndarray")]
        (Device::ndarray(), DType::F32),
    ];
    for (device, dtype) in others {
        for form in [SumForm::Auto, SumForm::Fused] {
            let signal = coherent_sum(&returns.phasors(&device, dtype, true), 32, form);
            assert_eq!(signal.re.dtype(), dtype);
            assert!(relative_error(&values(&signal), &returns.sum(32, true)) < 3e-5, "{device:?} {form:?}");
        }
    }
}

#[test]
fn a_delay_that_is_no_number_reaches_the_samples_of_its_chirp() {
    let mut returns = returns(20, 20, 32, 0.02);
    returns.sweep[3 * 20 + 5] = f64::NAN;
    for (name, device) in fused_devices() {
        let found = values(&fused::sum(&returns.phasors(&device, DType::F32, false), 32));
        for chirp in 0..20 {
            assert_eq!(found[chirp * 32].is_nan(), chirp == 5, "{name}, chirp {chirp}");
        }
    }
}

#[test]
fn the_forms_are_settings_in_lower_case() {
    for (text, form) in
        [("auto", SumForm::Auto), ("tensor", SumForm::Tensor), ("fused", SumForm::Fused), ("exact", SumForm::Exact)]
    {
        assert_eq!(serde_json::from_str::<SumForm>(&format!("\"{text}\"")).unwrap(), form);
    }
}

#[cfg(feature = "wgpu")]
#[test]
fn the_tensor_form_on_wgpu_agrees_with_flex_in_values_and_gradients() {
    use burn::tensor::DeviceKind;
    let returns = returns(60, 6, 32, 0.05);
    let sum: Form = |phasors, samples| coherent_sum(phasors, samples, SumForm::Tensor);
    let device = Device::wgpu(DeviceKind::Cpu);
    let error = relative_error(&values(&sum(&returns.phasors(&device, DType::F32, true), 32)), &returns.sum(32, true));
    assert!(error < 1e-4, "values: {error:.1e}");
    let of = |device: Device| gradients(&returns.phasors(&device.autodiff(), DType::F32, true), 32, sum);
    for (index, (found, wanted)) in of(device).iter().zip(&of(Device::flex())).enumerate() {
        let error = relative_error(found, wanted);
        assert!(error < 1e-4, "gradient to input {index}: {error:.1e}");
    }
}
