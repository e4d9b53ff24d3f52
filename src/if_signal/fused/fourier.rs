//! Fourier transforms of the range grid, sixteen chirps and all moments at once.

use std::f64::consts::TAU;

use super::lanes::{Lanes, multiply_add, zip};

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
    #[inline(always)]
    pub fn transform<const FUSED: bool>(&self, grid: &mut [Lanes], width: usize) {
        let row = 2 * width;
        // Halves first, and theirs before: small ones stay in the cache from their first to their last pass.
        for end in (2..=self.length).step_by(2) {
            let mut size = 2;
            while size <= self.length && end % size == 0 {
                let (low, high) = grid[(end - size) * row..end * row].split_at_mut(size / 2 * row);
                self.butterflies(low, high, width, |a, b, root| {
                    let b = multiply::<FUSED>(b, root);
                    (add(a, b), subtract(a, b))
                });
                size *= 2;
            }
        }
    }

    /// The adjoint: x\[g\] = Σ_k Y\[k\] exp(−j2πgk/C), in place; Y in natural order, x at its places.
    #[inline(always)]
    pub fn adjoint<const FUSED: bool>(&self, grid: &mut [Lanes], width: usize) {
        let row = 2 * width;
        for start in (0..self.length).step_by(2) {
            let mut size = self.length;
            while start % size != 0 {
                size /= 2;
            }
            while size >= 2 {
                let (low, high) = grid[start * row..(start + size) * row].split_at_mut(size / 2 * row);
                self.butterflies(low, high, width, |a, b, (c, s)| (add(a, b), multiply::<FUSED>(subtract(a, b), (c, -s))));
                size /= 2;
            }
        }
    }

    /// Replaces every pair of complex lanes of two halves; the root belongs to the row.
    #[inline(always)]
    fn butterflies(
        &self,
        low: &mut [Lanes],
        high: &mut [Lanes],
        width: usize,
        of: impl Fn(Pair, Pair, (f32, f32)) -> (Pair, Pair),
    ) {
        let row = 2 * width;
        let stride = self.roots.len() * row / low.len();
        for ((a, b), &root) in low.chunks_exact_mut(row).zip(high.chunks_exact_mut(row)).zip(self.roots.iter().step_by(stride)) {
            for (a, b) in a.chunks_exact_mut(2).zip(b.chunks_exact_mut(2)) {
                let ((ar, ai), (br, bi)) = of((a[0], a[1]), (b[0], b[1]), root);
                (a[0], a[1], b[0], b[1]) = (ar, ai, br, bi);
            }
        }
    }
}

/// Real and imaginary part.
type Pair = (Lanes, Lanes);

#[inline(always)]
fn add(a: Pair, b: Pair) -> Pair {
    (zip(a.0, b.0, |a, b| a + b), zip(a.1, b.1, |a, b| a + b))
}

#[inline(always)]
fn subtract(a: Pair, b: Pair) -> Pair {
    (zip(a.0, b.0, |a, b| a - b), zip(a.1, b.1, |a, b| a - b))
}

#[inline(always)]
fn multiply<const FUSED: bool>(a: Pair, (c, s): (f32, f32)) -> Pair {
    (zip(a.0, a.1, |re, im| multiply_add::<FUSED>(c, re, -s * im)), zip(a.0, a.1, |re, im| multiply_add::<FUSED>(c, im, s * re)))
}

#[cfg(test)]
mod tests {
    use super::super::lanes::LANES;
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
            if forward {
                fourier.transform::<false>(&mut grid, width)
            } else {
                fourier.adjoint::<false>(&mut grid, width)
            }
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
