//! exp(j 2π turns) for tensors of millions of elements.

use std::f64::consts::TAU;

use burn::tensor::{DType, Tensor};

use crate::complex::{Complex, wrap};

/// sin(2πh)/h in powers of h², |h| ≤ ¼, to 3·10⁻⁸.
pub const SIN: [f64; 5] = [6.28318528, -41.34168067, 81.60248074, -76.58128456, 39.76072208];
/// cos(2πh) in powers of h², |h| ≤ ¼, to 5·10⁻⁸.
pub const COS: [f64; 5] = [0.99999995, -19.73917132, 64.93458165, -85.24010036, 56.24054044];

/// exp(j 2π turns), with the gradient of the exact function.
///
/// A CPU backend takes its sines one by one, 158 million a second; a polynomial of half the angle and one doubling
/// are multiplications and additions, several times faster. The polynomial runs without a tape: the result is
/// z (1 + j2πδ) with δ = turns − turns, whose value is zero and whose gradient is one. f64 takes the backend's sine.
pub fn cis(turns: Tensor<2>) -> Complex<2> {
    if turns.dtype() == DType::F64 {
        return Complex::unit(turns);
    }
    let still = turns.clone().detach();
    let half = wrap(still.clone()) * 0.5;
    let squared = half.clone() * half.clone();
    let sin = half * polynomial(&squared, &SIN);
    let cos = polynomial(&squared, &COS);
    let (re, im) = (1.0 - sin.clone() * sin.clone() * 2.0, sin * cos * 2.0);
    if !turns.is_require_grad() && !turns.device().is_autodiff() {
        return Complex::new(re, im);
    }
    let delta = (turns - still) * TAU;
    Complex::new(re.clone() - im.clone() * delta.clone(), im + re * delta)
}

fn polynomial(x: &Tensor<2>, coefficients: &[f64]) -> Tensor<2> {
    let (last, rest) = coefficients.split_last().expect("a polynomial has coefficients");
    let (next, rest) = rest.split_last().expect("of degree one at least");
    let start = x.clone() * *last + *next;
    rest.iter().rev().fold(start, |sum, &coefficient| sum * x.clone() + coefficient)
}
