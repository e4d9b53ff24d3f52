//! Gradients against central differences, and values and gradients on all backends.
//!
//! A function under test takes flat tensors (`Tensor<1>`, one per input, f64) that it reshapes itself, and returns
//! anything flattened. Not one sum of its outputs is differentiated but a weighted one, so that errors of opposite
//! sign in two outputs cannot cancel.

use std::cell::Cell;

use burn::tensor::{DType, Device, Tensor};

use super::{Input, assert_close, cpu_devices, numbers, other_devices, tensor, values};

fn weights(count: usize) -> Vec<f64> {
    numbers(77, count, 0.5, 1.5).into_iter().enumerate().map(|(i, w)| if i % 2 == 0 { w } else { -w }).collect()
}

fn evaluate(inputs: &[Vec<f64>], device: &Device, function: &dyn Fn(&[Tensor<1>]) -> Tensor<1>) -> Vec<f64> {
    let tensors: Vec<_> = inputs.iter().map(|input| tensor(input, [input.len()], device)).collect();
    values(&function(&tensors))
}

/// d(Σ weight · output)/d(input element) in f64, by (f(x + step) − f(x − step)) / 2 step.
pub fn central_difference(
    inputs: &[Input],
    step: f64,
    device: &Device,
    function: &dyn Fn(&[Tensor<1>]) -> Tensor<1>,
) -> Vec<Vec<f64>> {
    let mut at: Vec<Vec<f64>> = inputs.iter().map(|input| input.values.clone()).collect();
    let mut gradients = Vec::new();
    for which in 0..inputs.len() {
        let mut gradient = Vec::new();
        for element in 0..at[which].len() {
            let centre = at[which][element];
            let mut probe = |offset: f64| {
                at[which][element] = centre + offset;
                let output = evaluate(&at, device, function);
                at[which][element] = centre;
                output
            };
            let (above, below) = (probe(step), probe(-step));
            let weights = weights(above.len());
            gradient.push(above.iter().zip(&below).zip(&weights).map(|((a, b), w)| w * (a - b)).sum::<f64>() / (2.0 * step));
        }
        gradients.push(gradient);
    }
    gradients
}

/// The same by Burn's backward pass. An input that the function does not reach has gradient zero.
pub fn backward(inputs: &[Input], device: &Device, function: &dyn Fn(&[Tensor<1>]) -> Tensor<1>) -> Vec<Vec<f64>> {
    let device = device.clone().autodiff();
    let tensors: Vec<_> =
        inputs.iter().map(|input| tensor(&input.values, [input.values.len()], &device).require_grad()).collect();
    let output = function(&tensors);
    let weights = tensor(&weights(output.dims()[0]), output.dims(), &device);
    let gradients = (output * weights).sum().backward();
    tensors
        .iter()
        .map(|tensor| tensor.grad(&gradients).map_or(vec![0.0; tensor.dims()[0]], |gradient| values(&gradient)))
        .collect()
}

thread_local! {
    /// Derivatives that this test has held against central differences, and those of them that are not zero.
    static COMPARED: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

/// Counts derivatives that a test has held against central differences (or a closed form) by itself; `disagreements` does so for its own.
pub fn compared(wanted: &[f64]) {
    let (all, moving) = COMPARED.get();
    COMPARED.set((all + wanted.len(), moving + wanted.iter().filter(|value| **value != 0.0).count()));
}

/// Runs a gradient test, which must hold derivatives against central differences that are not all zero.
///
/// # Panics
/// As the test does; also if it compared nothing, or nothing that moves.
pub fn with_evidence(test: fn()) {
    COMPARED.set((0, 0));
    test();
    let (all, moving) = COMPARED.get();
    assert!(moving > 0, "of {all} derivatives that were compared, none is other than zero: this test shows nothing");
}

/// Where the backward pass and central differences disagree by more than `tolerance` of the input's largest derivative:
/// one line each.
pub fn disagreements(
    inputs: &[Input],
    step: f64,
    tolerance: f64,
    device: &Device,
    function: &dyn Fn(&[Tensor<1>]) -> Tensor<1>,
) -> Vec<String> {
    let found = backward(inputs, device, function);
    let wanted = central_difference(inputs, step, device, function);
    wanted.iter().for_each(|wanted| compared(wanted));
    let mut rows = Vec::new();
    for ((input, found), wanted) in inputs.iter().zip(&found).zip(&wanted) {
        let largest = wanted.iter().fold(0.0_f64, |largest, w| largest.max(w.abs()));
        for (element, (&found, &wanted)) in found.iter().zip(wanted).enumerate() {
            let allowed = tolerance * largest.max(1e-6);
            let difference = (found - wanted).abs();
            if difference > allowed || difference.is_nan() {
                rows.push(format!(
                    "{}[{element}]: found {found:e}, wanted {wanted:e}, difference {difference:e}, tolerance {allowed:e}",
                    input.name
                ));
            }
        }
    }
    rows
}

/// Gradient of every input element against central differences in f64, on flex (and on ndarray, where the build has it).
///
/// # Panics
/// With all rows that disagree.
pub fn check_gradient(inputs: &[Input], step: f64, tolerance: f64, function: impl Fn(&[Tensor<1>]) -> Tensor<1>) {
    for (name, device) in cpu_devices() {
        let rows = disagreements(inputs, step, tolerance, &device, &function);
        assert!(rows.is_empty(), "gradients on {name} differ from central differences:\n{}", rows.join("\n"));
    }
}

/// Values and gradients without NaN or infinity: for points where the formula is singular. Checked in f32 too, where
/// less can be represented.
///
/// # Panics
/// With the name of what is not finite.
pub fn check_finite(inputs: &[Input], function: impl Fn(&[Tensor<1>]) -> Tensor<1>) {
    for (name, device) in cpu_devices() {
        for dtype in [DType::F64, DType::F32] {
            let device = device.clone().autodiff();
            let tensors: Vec<_> = inputs
                .iter()
                .map(|input| tensor(&input.values, [input.values.len()], &device).cast(dtype).detach().require_grad())
                .collect();
            let output = function(&tensors);
            let found = values(&output.clone().inner());
            assert!(found.iter().all(|v| v.is_finite()), "values on {name} in {dtype:?}: {found:?}");
            let gradients = output.sum().backward();
            for (input, tensor) in inputs.iter().zip(&tensors) {
                if let Some(gradient) = tensor.grad(&gradients) {
                    let found = values(&gradient);
                    assert!(found.iter().all(|v| v.is_finite()), "gradient to {} on {name} in {dtype:?}: {found:?}", input.name);
                }
            }
        }
    }
}

/// The same f32 values and gradients on flex and on every other backend of the build, to `tolerance` of the largest.
pub fn check_backends(inputs: &[Input], tolerance: f64, function: impl Fn(&[Tensor<1>]) -> Tensor<1>) {
    let run = |device: Device| -> (Vec<f64>, Vec<Vec<f64>>) {
        let device = device.autodiff();
        let tensors: Vec<Tensor<1>> = inputs
            .iter()
            .map(|input| tensor(&input.values, [input.values.len()], &device).cast(DType::F32).detach().require_grad())
            .collect();
        let output = function(&tensors);
        let found = values(&output.clone().inner());
        // Weighted: the plain sum of squares of unit vectors has no gradient but rounding.
        let weights = numbers(7, found.len(), 0.5, 1.5);
        let weights: Tensor<1> = tensor(&weights, [weights.len()], &device).cast(DType::F32);
        let gradients = (output.powi_scalar(2) * weights).sum().backward();
        (found, tensors.iter().map(|t| t.grad(&gradients).map(|g| values(&g)).unwrap_or_default()).collect())
    };
    let others = other_devices();
    let wanted = run(Device::flex());
    for (name, device) in others {
        let found = run(device);
        assert_close(&format!("values on {name}"), &found.0, &wanted.0, tolerance);
        for (input, (a, b)) in inputs.iter().zip(found.1.iter().zip(&wanted.1)) {
            assert_close(&format!("{} on {name}", input.name), a, b, tolerance);
        }
    }
}

mod tests {
    #[allow(unused_imports)]
    use super::*;
    #[allow(unused_imports)]
    use crate::support::input;

    #[test]
    fn a_polynomial_has_the_gradient_of_its_formula() {
        let inputs = [input("x", [0.5, -1.0, 2.0])];
        let cube = |x: &[Tensor<1>]| x[0].clone().powi_scalar(3);
        let wanted: Vec<f64> = weights(3).iter().zip([0.5, -1.0, 2.0_f64]).map(|(w, x)| w * 3.0 * x * x).collect();
        assert_close("difference", &central_difference(&inputs, 1e-4, &Device::flex(), &cube)[0], &wanted, 1e-7);
        assert_close("backward", &backward(&inputs, &Device::flex(), &cube)[0], &wanted, 1e-14);
        check_gradient(&inputs, 1e-4, 1e-7, cube);
    }

    #[test]
    fn a_wrong_gradient_is_found_in_its_element() {
        // Detached, the second factor contributes to the value but not to the gradient.
        let wrong = |x: &[Tensor<1>]| x[0].clone() * x[0].clone().detach();
        let inputs = [input("x", [0.0, 3.0])];
        let rows = disagreements(&inputs, 1e-4, 1e-6, &Device::flex(), &wrong);
        assert_eq!(rows.len(), 1, "{rows:?}");
        assert!(rows[0].starts_with("x[1]"));
    }

    #[test]
    fn errors_of_opposite_sign_do_not_cancel() {
        let wrong = |x: &[Tensor<1>]| Tensor::cat(vec![x[0].clone().detach() - x[0].clone(), x[0].clone().detach()], 0);
        let rows = disagreements(&[input("x", [1.0])], 1e-4, 1e-6, &Device::flex(), &wrong);
        assert!(!rows.is_empty());
    }

    #[test]
    #[should_panic(expected = "gradient to x")]
    fn an_infinite_gradient_is_found() {
        check_finite(&[input("x", [0.0])], |x| x[0].clone().sqrt());
    }

    #[test]
    fn a_gradient_test_that_shows_nothing_fails() {
        with_evidence(|| check_gradient(&[input("x", [2.0])], 1e-4, 1e-6, |x| x[0].clone().powi_scalar(2)));
        let silent: [fn(); 2] = [|| (), || check_gradient(&[input("x", [2.0])], 1e-4, 1e-6, |x| x[0].clone().detach() * 0.0)];
        for test in silent {
            assert!(std::panic::catch_unwind(|| with_evidence(test)).is_err());
        }
    }
}
