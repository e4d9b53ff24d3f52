//! Sixteen numbers at a time, in plain loops that the compiler turns into SIMD.

use crate::if_signal::cis::{COS, SIN};

/// Chirps handled together.
pub const LANES: usize = 16;

pub type Lanes = [f32; LANES];

pub const ZERO: Lanes = [0.0; LANES];

// Loops over slices of a known length: closures of `array::from_fn` are not always inlined.
#[inline(always)]
pub fn map(mut x: Lanes, of: impl Fn(f32) -> f32) -> Lanes {
    for x in &mut x {
        *x = of(*x);
    }
    x
}

#[inline(always)]
pub fn zip(mut a: Lanes, b: Lanes, of: impl Fn(f32, f32) -> f32) -> Lanes {
    for (a, b) in a.iter_mut().zip(&b) {
        *a = of(*a, *b);
    }
    a
}

/// a·b + c, fused where the processor can ([`super::machine::Work`]).
#[inline(always)]
pub fn multiply_add<const FUSED: bool>(a: f32, b: f32, c: f32) -> f32 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
pub fn fma<const FUSED: bool>(a: Lanes, b: Lanes, mut c: Lanes) -> Lanes {
    for ((a, b), c) in a.iter().zip(&b).zip(&mut c) {
        *c = multiply_add::<FUSED>(*a, *b, *c);
    }
    c
}

/// Nearest whole number, for |x| < 2²².
#[inline(always)]
pub fn round(x: f32) -> f32 {
    (x + 12_582_912.0) - 12_582_912.0
}

/// cos and sin of 2π turns, to 10⁻⁷.
#[inline(always)]
pub fn cis<const FUSED: bool>(turns: Lanes) -> (Lanes, Lanes) {
    let mut cos = [0.0; LANES];
    let mut sin = [0.0; LANES];
    for ((turns, cos), sin) in turns.iter().zip(&mut cos).zip(&mut sin) {
        let whole = turns - round(*turns);
        // Beyond a quarter turn: the sine mirrors, the cosine changes its sign.
        let far = whole.abs() > 0.25;
        let h = if far { 0.5f32.copysign(whole) - whole } else { whole };
        let u = h * h;
        let even = horner::<FUSED>(u, COS.map(|c| c as f32));
        let odd = horner::<FUSED>(u, SIN.map(|c| c as f32));
        *cos = if far { -even } else { even };
        *sin = h * odd;
    }
    (cos, sin)
}

#[inline(always)]
fn horner<const FUSED: bool>(u: f32, [a, b, c, d, e]: [f32; 5]) -> f32 {
    let sum = multiply_add::<FUSED>(multiply_add::<FUSED>(e, u, d), u, c);
    multiply_add::<FUSED>(multiply_add::<FUSED>(sum, u, b), u, a)
}

/// Sixteen values from `at` on, or `width` of them and the last one repeated.
#[inline(always)]
pub fn load(values: &[f32], at: usize, width: usize) -> Lanes {
    if width >= LANES {
        return values[at..at + LANES].try_into().expect("sixteen values");
    }
    let mut lanes = [values[at + width - 1]; LANES];
    lanes[..width].copy_from_slice(&values[at..at + width]);
    lanes
}

/// The first `width` lanes to `at` on.
#[inline(always)]
pub fn store(values: &mut [f32], at: usize, width: usize, lanes: Lanes) {
    let width = width.min(LANES);
    values[at..at + width].copy_from_slice(&lanes[..width]);
}

/// Adds the first `width` lanes to what is at `at` on.
#[inline(always)]
pub fn accumulate(values: &mut [f32], at: usize, width: usize, lanes: Lanes) {
    let width = width.min(LANES);
    for (value, lane) in values[at..at + width].iter_mut().zip(lanes) {
        *value += lane;
    }
}
