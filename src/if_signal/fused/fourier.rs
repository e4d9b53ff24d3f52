//! Fourier transforms of the range grid, sixteen chirps and all moments at once.

use std::f64::consts::TAU;

use super::lanes::{LANES, Lanes, multiply_add};

/// A radix-2 transform of a power-of-two length without the reordering pass: whoever fills or reads the grid does so
/// at [`Fourier::place`].
pub struct Fourier {
    length: usize,
    /// exp(+j2πi/length), i below half the length.
    roots: Vec<(f32, f32)>,
}

impl Fourier {
    pub fn new(length: usize) -> Self {
        assert!(length.is_power_of_two(), "fourier: length {length} is no power of two");
        let roots = (0..length / 2)
            .map(|i| {
                let (sin, cos) = (TAU * i as f64 / length as f64).sin_cos();
                (cos as f32, sin as f32)
            })
            .collect();
        Self { length, roots }
    }

    /// Where a cell lies in memory: its index with the bits reversed.
    pub fn place(&self, cell: usize) -> usize {
        match self.length.trailing_zeros() {
            0 => 0,
            bits => cell.reverse_bits() >> (usize::BITS - bits),
        }
    }

    /// Y\[k\] = Σ_g x\[g\] exp(+j2πgk/C), in place; x at its places, Y in natural order. A row is `width` complex lanes.
    pub fn from_cells(&self, grid: &mut [Lanes], width: usize) {
        let row = 2 * width;
        let mut half = 1;
        while half < self.length {
            let stride = self.length / (2 * half);
            for group in grid.chunks_exact_mut(2 * half * row) {
                let (low, high) = group.split_at_mut(half * row);
                for (i, (a, b)) in low.chunks_exact_mut(row).zip(high.chunks_exact_mut(row)).enumerate() {
                    let (c, s) = self.roots[i * stride];
                    for (a, b) in a.chunks_exact_mut(2).zip(b.chunks_exact_mut(2)) {
                        for lane in 0..LANES {
                            let (br, bi) = (b[0][lane], b[1][lane]);
                            let re = multiply_add(c, br, -s * bi);
                            let im = multiply_add(c, bi, s * br);
                            let (ar, ai) = (a[0][lane], a[1][lane]);
                            (a[0][lane], a[1][lane]) = (ar + re, ai + im);
                            (b[0][lane], b[1][lane]) = (ar - re, ai - im);
                        }
                    }
                }
            }
            half *= 2;
        }
    }

    /// The adjoint: x\[g\] = Σ_k Y\[k\] exp(−j2πgk/C), in place; Y in natural order, x at its places.
    pub fn to_cells(&self, grid: &mut [Lanes], width: usize) {
        let row = 2 * width;
        let mut half = self.length / 2;
        while half > 0 {
            let stride = self.length / (2 * half);
            for group in grid.chunks_exact_mut(2 * half * row) {
                let (low, high) = group.split_at_mut(half * row);
                for (i, (a, b)) in low.chunks_exact_mut(row).zip(high.chunks_exact_mut(row)).enumerate() {
                    let (c, s) = self.roots[i * stride];
                    for (a, b) in a.chunks_exact_mut(2).zip(b.chunks_exact_mut(2)) {
                        for lane in 0..LANES {
                            let (dr, di) = (a[0][lane] - b[0][lane], a[1][lane] - b[1][lane]);
                            a[0][lane] += b[0][lane];
                            a[1][lane] += b[1][lane];
                            b[0][lane] = multiply_add(c, dr, s * di);
                            b[1][lane] = multiply_add(c, di, -s * dr);
                        }
                    }
                }
            }
            half /= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_transforms_agree_with_their_definition() {
        let (length, width) = (16, 2);
        let fourier = Fourier::new(length);
        let value = |i: usize| [((i * 7 % 5) as f32 - 2.0), ((i * 3 % 4) as f32 - 1.5)];
        for (sign, forward) in [(1.0, true), (-1.0, false)] {
            let mut grid = vec![[0.0f32; LANES]; length * width * 2];
            for i in 0..length {
                let place = if forward { fourier.place(i) } else { i };
                for part in 0..2 {
                    grid[(place * width + 1) * 2 + part][3] = value(i)[part];
                }
            }
            if forward { fourier.from_cells(&mut grid, width) } else { fourier.to_cells(&mut grid, width) }
            for k in 0..length {
                let (mut re, mut im) = (0.0, 0.0);
                for i in 0..length {
                    let (sin, cos) = (sign * TAU * (i * k) as f64 / length as f64).sin_cos();
                    let [r, m] = value(i).map(f64::from);
                    re += r * cos - m * sin;
                    im += r * sin + m * cos;
                }
                let place = if forward { k } else { fourier.place(k) };
                let found = [0, 1].map(|part| f64::from(grid[(place * width + 1) * 2 + part][3]));
                assert!((found[0] - re).abs() < 1e-4 && (found[1] - im).abs() < 1e-4, "bin {k}: {found:?}, wanted {re} {im}");
            }
        }
    }
}
