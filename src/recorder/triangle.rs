//! The closed-form integral of a phase over a triangle.

use num_complex::Complex64;

/// Phases that differ by less are summed as a series: there the quotient's numerator cancels.
const SMALL: f64 = 1.0;
/// Of the series: at |φ| ≤ 2/3, the most around the mean of phases that are [`SMALL`], the first one left out is below 1e-17.
const TERMS: usize = 14;

/// Mean of exp(jφ) over a triangle on which φ is linear and takes the values `phases` (radians) at the corners, to about 1e-15 for
/// phases however far apart.
///
/// By Hermite and Genocchi the mean is −2 f[a, b, c], a divided difference of f(φ) = exp(jφ). With a ≤ b ≤ c it is
/// (f[b, c] − f[a, b]) / (c − a), where f[x, y] = j exp(j (x + y)/2) sinc((y − x)/2): the only divisor is the largest difference, so no
/// direction is singular (Gordon 1975 divides by all three).
pub fn mean_phasor(phases: [f64; 3]) -> Complex64 {
    // By hand: the library's sort takes as long as half of the rest, of what a recorder does most.
    let [mut a, mut b, mut c] = phases;
    if a > b {
        std::mem::swap(&mut a, &mut b);
    }
    if b > c {
        std::mem::swap(&mut b, &mut c);
    }
    if a > b {
        std::mem::swap(&mut a, &mut b);
    }
    if c - a < SMALL {
        return series([a, b, c]);
    }
    // Around b: j exp(±jh) sinc(h) of either half.
    let side = |half: f64| {
        let (sin, cos) = half.sin_cos();
        let sinc = if half > 1e-9 { sin / half } else { 1.0 };
        [sin * sinc, cos * sinc]
    };
    let ([above_sin, above_cos], [below_sin, below_cos]) = (side(0.5 * (c - b)), side(0.5 * (b - a)));
    // −2j ((above_cos + j above_sin) − (below_cos − j below_sin)) / (c − a)
    let around = Complex64::new(above_sin + below_sin, below_cos - above_cos) * (2.0 / (c - a));
    Complex64::cis(b) * around
}

/// With h_m the complete homogeneous polynomials of the corner phases, the mean of φ^m over the triangle is 2 m!/(m+2)! · h_m, hence
/// Σ 2 j^m h_m/(m+2)!.
fn series(phases: [f64; 3]) -> Complex64 {
    let mean = (phases[0] + phases[1] + phases[2]) / 3.0;
    let [a, b, c] = phases.map(|phase| phase - mean);
    // The first symmetric polynomial is zero now: h_m = −e2 h_{m−2} + e3 h_{m−3}.
    let (e2, e3) = (a * b + b * c + c * a, a * b * c);
    let [mut before_last, mut last, mut now] = [0.0, 0.0, 1.0];
    let [mut re, mut im] = [1.0, 0.0];
    let mut factor = 1.0;
    for order in 1..TERMS {
        (before_last, last, now) = (last, now, -e2 * last + e3 * before_last);
        factor /= (order + 2) as f64;
        let term = now * factor;
        match order % 4 {
            0 => re += term,
            1 => im += term,
            2 => re -= term,
            _ => im -= term,
        }
    }
    Complex64::from_polar(1.0, mean) * Complex64::new(re, im)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint sum over n² equal triangles.
    fn brute_force(phases: [f64; 3], n: usize) -> Complex64 {
        let mut sum = Complex64::ZERO;
        for row in 0..n {
            for column in 0..(2 * (n - row) - 1) {
                let third = if column % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
                let v = (row as f64 + third) / n as f64;
                let u = ((column / 2) as f64 + third) / n as f64;
                sum += Complex64::cis(phases[0] * (1.0 - u - v) + phases[1] * u + phases[2] * v);
            }
        }
        sum / (n * n) as f64
    }

    #[test]
    fn the_closed_form_agrees_with_a_dense_sum() {
        for phases in [[0.0; 3], [1.0, 1.0, 1.0], [0.1, -0.3, 0.2], [5.0, 5.0, -7.0], [12.0, -3.0, 4.0], [0.0, 0.0, 15.0]] {
            let difference = (mean_phasor(phases) - brute_force(phases, 1000)).norm();
            assert!(difference < 1e-5, "{phases:?}: {difference:e}");
        }
    }

    /// A facet that a pose stretches is many wavelengths long: with phases this far apart a series in powers of them overflows.
    #[test]
    fn phases_far_apart_are_as_good_as_near_ones() {
        for phases in [[0.0, 60.0, -45.0], [200.0, 200.0, 0.0], [-150.0, 100.0, 100.0], [3e3, 3e3 + 80.0, 3e3 - 7.0]] {
            let difference = (mean_phasor(phases) - brute_force(phases, 3000)).norm();
            assert!(difference < 1e-4, "{phases:?}: {difference:e}");
        }
        assert!(mean_phasor([0.0, 1e6, 3e6]).norm() < 1e-11);
    }

    /// On both sides of where one form ends and the other begins, in any order of the corners.
    #[test]
    fn the_two_forms_agree_where_they_meet() {
        for shape in [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.3, 1.0]] {
            let [below, above] =
                [0.999_999_999, 1.000_000_001].map(|scale| mean_phasor(shape.map(|phase| 40.0 + SMALL * scale * phase)));
            assert!((below - above).norm() < 1e-8, "{shape:?}: {below} {above}");
            let [a, b, c] = shape.map(|phase| 40.0 + 1.5 * phase);
            let sorted = mean_phasor([a, b, c]);
            for order in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
                assert!((mean_phasor(order) - sorted).norm() < 1e-14);
            }
            assert!((series([a, b, c]) - sorted).norm() < 1e-9, "{shape:?}");
        }
    }

    #[test]
    fn small_triangles_of_a_flat_facet_add_up_to_the_whole() {
        let [a, b, c] = [0.3, 9.0, -4.0];
        let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
        let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(mean_phasor);
        let difference = (parts.iter().sum::<Complex64>() / 4.0 - mean_phasor([a, b, c])).norm();
        assert!(difference < 1e-12, "{difference:e}");
    }
}
