//! Sums of a cell's deviations with a cosine and a sine.

use num_complex::Complex64;

/// Of a cell's deviations D: Σ D, Σ D cos ωt, Σ D sin ωt, and the sums of the cosines and sines themselves.
#[derive(Clone, Copy, Default)]
pub struct Sums {
    count: f64,
    all: Complex64,
    data: [Complex64; 2],
    basis: [f64; 2],
    /// cos², cos · sin, sin².
    squares: [f64; 3],
}

impl Sums {
    pub fn add(&mut self, value: Complex64, turn: Complex64) {
        self.count += 1.0;
        self.all += value;
        self.data[0] += value * turn.re;
        self.data[1] += value * turn.im;
        self.basis[0] += turn.re;
        self.basis[1] += turn.im;
        self.squares[0] += turn.re * turn.re;
        self.squares[1] += turn.re * turn.im;
        self.squares[2] += turn.im * turn.im;
    }

    /// With a constant of its own taken out.
    pub fn centred(self) -> Self {
        if self.count == 0.0 {
            return self;
        }
        let [c, s] = self.basis.map(|sum| sum / self.count);
        let squares =
            [self.squares[0] - c * self.basis[0], self.squares[1] - c * self.basis[1], self.squares[2] - s * self.basis[1]];
        Self { data: [self.data[0] - c * self.all, self.data[1] - s * self.all], squares, ..self }
    }

    /// Whether cosine and sine are distinguishable: one where they are orthogonal.
    pub fn determinant(&self) -> f64 {
        let [cc, cs, ss] = self.squares;
        if self.count > 0.0 { 4.0 * (cc * ss - cs * cs) / (self.count * self.count) } else { 0.0 }
    }

    /// Σ D u and Σ u² for u = cos(ωt + phase).
    pub fn along(&self, phase: f64) -> (Complex64, f64) {
        let (sin, cos) = phase.sin_cos();
        let [cc, cs, ss] = self.squares;
        (self.data[0] * cos - self.data[1] * sin, cos * cos * cc - 2.0 * cos * sin * cs + sin * sin * ss)
    }

    /// What a cosine and a sine with a factor of their own each would gain.
    pub fn both(&self) -> f64 {
        let ([cc, cs, ss], [c, s]) = (self.squares, self.data);
        (ss * c.norm_sqr() + cc * s.norm_sqr() - 2.0 * cs * (c.conj() * s).re) / (cc * ss - cs * cs)
    }
}
