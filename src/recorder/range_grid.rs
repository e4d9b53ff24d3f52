//! Sums of tones of any frequency through a fine grid of frequencies: each tone is spread over eight neighbouring
//! cells with a smooth kernel, the grid is transformed once, and the kernel's spectrum is divided out.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner32};
use num_complex::{Complex32, Complex64};

/// Width of the kernel in cells.
const TAPS: usize = 8;
/// Rows of the kernel's table; between two rows it is linear, to 1e-6.
const ROWS: usize = 512;
/// exp(β (√(1 − z²) − 1)), the kernel of FINUFFT, with β for an oversampling of two.
const BETA: f64 = 2.30 * TAPS as f64;
/// Powers of the fast time that modulate a tone: 1, s, s².
pub const ORDERS: usize = 3;

/// Weights of one tone: real and imaginary part for each order.
pub type ToneWeights = [f32; 2 * ORDERS];

/// Plan for a number of samples.
#[derive(Clone)]
pub struct RangeGrid {
    samples: usize,
    size: usize,
    /// `[row][tap]`.
    table: Vec<[f32; TAPS]>,
    /// `[sample]`, one over the kernel's spectrum.
    correction: Vec<f64>,
    fft: Arc<dyn Fft<f32>>,
}

impl RangeGrid {
    /// Plans the transform for chirps of so many samples.
    pub fn new(samples: usize) -> Self {
        let size = (2 * samples).max(2 * TAPS);
        let half = TAPS as f64 / 2.0;
        let kernel = |x: f64| {
            let z = x / half;
            if z.abs() < 1.0 { (BETA * ((1.0 - z * z).sqrt() - 1.0)).exp() } else { 0.0 }
        };
        let table = (0..=ROWS)
            .map(|row| std::array::from_fn(|tap| kernel(tap as f64 - (half - 1.0) - row as f64 / ROWS as f64) as f32))
            .collect();
        let correction = (0..samples)
            .map(|sample| {
                let n = sample as f64 - (samples / 2) as f64;
                const STEPS: usize = 4000;
                let width = TAPS as f64 / STEPS as f64;
                let spectrum: f64 = (0..STEPS)
                    .map(|step| {
                        let x = (step as f64 + 0.5) * width - half;
                        kernel(x) * (std::f64::consts::TAU * x * n / size as f64).cos() * width
                    })
                    .sum();
                1.0 / spectrum
            })
            .collect();
        Self { samples, size, table, correction, fft: FftPlanner32::new().plan_fft_inverse(size) }
    }

    /// Cells of the grid; a tone of `turns_per_sample` sits at cell `turns_per_sample · size`, modulo size.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Numbers that one grid needs, for all orders.
    pub fn storage(&self) -> usize {
        2 * ORDERS * (self.size + TAPS)
    }

    /// Spreads tones; `cell` in 0..size, `between` in 0..1 is the rest of the position.
    pub fn add(&self, storage: &mut [f32], cell: &[u32], between: &[f32], weights: &[ToneWeights]) {
        let stride = self.size + TAPS;
        for ((&cell, &between), weights) in cell.iter().zip(between).zip(weights) {
            let row = between * ROWS as f32;
            let index = (row as usize).min(ROWS - 1);
            let (low, high, blend) = (&self.table[index], &self.table[index + 1], row - index as f32);
            let taps: [f32; TAPS] = std::array::from_fn(|tap| low[tap] + blend * (high[tap] - low[tap]));
            for (order, &weight) in weights.iter().enumerate() {
                let start = order * stride + cell as usize;
                for (value, tap) in storage[start..start + TAPS].iter_mut().zip(taps) {
                    *value += weight * tap;
                }
            }
        }
    }

    /// Σ over orders of s^order times its sum of tones; `[sample]`, s = (n − N/2)/N.
    pub fn samples(&self, storage: &[f32]) -> Vec<Complex64> {
        let stride = self.size + TAPS;
        let mut signal = vec![Complex64::ZERO; self.samples];
        let mut spectrum = vec![Complex32::ZERO; self.size];
        let middle = self.samples / 2;
        for order in 0..ORDERS {
            spectrum.fill(Complex32::ZERO);
            let (re, im) = (&storage[2 * order * stride..], &storage[(2 * order + 1) * stride..]);
            for index in 0..stride {
                // The first tap of cell c is at c − 3.
                let cell = (index + self.size - (TAPS / 2 - 1)) % self.size;
                spectrum[cell] += Complex32::new(re[index], im[index]);
            }
            self.fft.process(&mut spectrum);
            for (sample, value) in signal.iter_mut().enumerate() {
                let tone = spectrum[(sample + self.size - middle) % self.size];
                let s = (sample as f64 - middle as f64) / self.samples as f64;
                let tone = Complex64::new(f64::from(tone.re), f64::from(tone.im));
                *value += tone * (self.correction[sample] * s.powi(order as i32));
            }
        }
        signal
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn tones_of_any_frequency_come_out_to_minus_hundred_decibels() {
        for samples in [32, 85, 256] {
            let grid = RangeGrid::new(samples);
            let mut storage = vec![0.0; grid.storage()];
            let mut wanted = vec![Complex64::ZERO; samples];
            for index in 0..50 {
                let frequency = (index as f64 * 0.618_034).fract();
                let weights: ToneWeights = std::array::from_fn(|k| ((index * 7 + k * 3) % 11) as f32 - 5.0);
                let position = frequency * grid.size() as f64;
                grid.add(&mut storage, &[position as u32], &[position.fract() as f32], &[weights]);
                for (sample, value) in wanted.iter_mut().enumerate() {
                    let n = sample as f64 - (samples / 2) as f64;
                    let s = n / samples as f64;
                    let factor: Complex64 = (0..ORDERS)
                        .map(|order| {
                            Complex64::new(f64::from(weights[2 * order]), f64::from(weights[2 * order + 1]))
                                * s.powi(order as i32)
                        })
                        .sum();
                    *value += factor * Complex64::cis(TAU * frequency * n);
                }
            }
            let found = grid.samples(&storage);
            let error: f64 = found.iter().zip(&wanted).map(|(a, b)| (a - b).norm_sqr()).sum();
            let energy: f64 = wanted.iter().map(|b| b.norm_sqr()).sum();
            let db = 10.0 * (error / energy).log10();
            assert!(db < -100.0, "{samples} samples: {db:.1} dB");
        }
    }
}
