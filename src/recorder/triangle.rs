//! The closed-form integral of a phase over a triangle.

use num_complex::Complex64;

/// Mean of exp(jφ) over a triangle on which φ is linear and takes the values `phases` (radians) at the corners.
///
/// With h_m the complete homogeneous polynomials of the corner phases, the mean of φ^m over the triangle is
/// 2 m!/(m+2)! · h_m, hence Σ 2 j^m h_m/(m+2)!. Unlike the quotient form (Gordon 1975) the series has no singular
/// direction: it holds for flat, tilted and degenerate phases alike. About e^|φ| · 1e-16 of accuracy is lost,
/// so phases up to 20 radians around their mean are good to 1e-7.
pub fn mean_phasor(phases: [f64; 3]) -> Complex64 {
    let mean = (phases[0] + phases[1] + phases[2]) / 3.0;
    let [a, b, c] = phases.map(|phase| phase - mean);
    // The first symmetric polynomial is zero now: h_m = −e2 h_{m−2} + e3 h_{m−3}.
    let (e2, e3) = (a * b + b * c + c * a, a * b * c);
    let largest = a.abs().max(b.abs()).max(c.abs());
    let terms = (8.0 + 2.9 * largest) as usize + 6;
    let [mut before_last, mut last, mut now] = [0.0, 0.0, 1.0];
    let [mut re, mut im] = [1.0, 0.0];
    let mut factor = 1.0;
    for order in 1..terms {
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

    #[test]
    fn small_triangles_of_a_flat_facet_add_up_to_the_whole() {
        let [a, b, c] = [0.3, 9.0, -4.0];
        let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
        let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(mean_phasor);
        let difference = (parts.iter().sum::<Complex64>() / 4.0 - mean_phasor([a, b, c])).norm();
        assert!(difference < 1e-12, "{difference:e}");
    }
}
