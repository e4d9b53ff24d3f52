//! Sixteen numbers at a time, in plain loops that the compiler turns into SIMD.

use crate::if_signal::cis::{COS, SIN};

/// Chirps handled together.
pub const LANES: usize = 16;

pub type Lanes = [f32; LANES];

pub const ZERO: Lanes = [0.0; LANES];

#[inline(always)]
pub fn map(x: Lanes, of: impl Fn(f32) -> f32) -> Lanes {
    std::array::from_fn(|lane| of(x[lane]))
}

#[inline(always)]
pub fn zip(a: Lanes, b: Lanes, of: impl Fn(f32, f32) -> f32) -> Lanes {
    std::array::from_fn(|lane| of(a[lane], b[lane]))
}

/// a·b + c, fused where the machine can: elsewhere `mul_add` would be a slow call.
#[inline(always)]
pub fn multiply_add(a: f32, b: f32, c: f32) -> f32 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
pub fn fma(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
    std::array::from_fn(|lane| multiply_add(a[lane], b[lane], c[lane]))
}

/// Nearest whole number, for |x| < 2²².
#[inline(always)]
pub fn round(x: f32) -> f32 {
    (x + 12_582_912.0) - 12_582_912.0
}

/// cos and sin of 2π turns, to 10⁻⁷.
#[inline(always)]
pub fn cis(turns: Lanes) -> (Lanes, Lanes) {
    let mut cos = [0.0; LANES];
    let mut sin = [0.0; LANES];
    for lane in 0..LANES {
        let whole = turns[lane] - round(turns[lane]);
        // Beyond a quarter turn: the sine mirrors, the cosine changes its sign.
        let far = whole.abs() > 0.25;
        let h = if far { 0.5f32.copysign(whole) - whole } else { whole };
        let u = h * h;
        let even = COS[..4].iter().rev().fold(COS[4] as f32, |sum, &c| multiply_add(sum, u, c as f32));
        let odd = SIN[..4].iter().rev().fold(SIN[4] as f32, |sum, &c| multiply_add(sum, u, c as f32));
        cos[lane] = if far { -even } else { even };
        sin[lane] = h * odd;
    }
    (cos, sin)
}

/// Sixteen values from `at` on, or `width` of them and the last one repeated.
#[inline(always)]
pub fn load(values: &[f32], at: usize, width: usize) -> Lanes {
    if width >= LANES {
        return values[at..at + LANES].try_into().expect("sixteen values");
    }
    std::array::from_fn(|lane| values[at + lane.min(width - 1)])
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
