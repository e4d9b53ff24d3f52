//! Fresnel reflection at a surface with complex refractive index η + jk (supplement, "Details of the Microfacet BRDF").

use burn::tensor::Tensor;

/// Reflected power, 0 … 1, for each polarisation; each `[point, knot]`.
pub struct Reflectance {
    /// |r_s|², electric field perpendicular to the plane of incidence.
    pub s: Tensor<2>,
    /// |r_p|², electric field in the plane of incidence.
    pub p: Tensor<2>,
}

/// Below every squared quantity that is divided by or rooted: far below what f32 resolves next to 1.
const TINY: f64 = 1e-12;

/// Power reflectances, from air.
///
/// With a + jb = √(ñ² − sin²θ):
/// |r_s|² = ((c − a)² + b²) / ((c + a)² + b²) and
/// |r_p|² = |r_s|² ((ca − s²)² + c²b²) / ((ca + s²)² + c²b²), where c, s are cosine and sine.
/// These forms subtract nothing that nearly cancels, and unlike |r| they are smooth at Brewster's angle. The same
/// formula serves dielectrics (k = 0) and conductors.
///
/// # Shapes
/// - `cosine_squared`: `[point, knot]`, cos² of the angle of incidence, 0 … 1
/// - `refraction` (η ≥ 1), `extinction` (k ≥ 0): `[point, 1]` or `[point, knot]`
///
/// # Gradient
/// Flows to all inputs; finite also at grazing and at η = 1, k = 0.
pub fn reflectance(cosine_squared: Tensor<2>, refraction: Tensor<2>, extinction: Tensor<2>) -> Reflectance {
    let sine_squared: Tensor<2> = 1.0 - cosine_squared.clone();
    let cosine = (cosine_squared.clone() + TINY).sqrt();
    // a² − b² and 2ab, the parts of ñ² − sin²θ.
    let difference = refraction.clone().powi_scalar(2) - extinction.clone().powi_scalar(2) - sine_squared.clone();
    let product = refraction * extinction * 2.0;
    let modulus = (difference.clone().powi_scalar(2) + product.clone().powi_scalar(2) + TINY).sqrt();
    let a = ((modulus + difference) * 0.5 + TINY).sqrt();
    let b_squared = (product / (a.clone() * 2.0)).powi_scalar(2);

    let below = (cosine.clone() - a.clone()).powi_scalar(2) + b_squared.clone();
    let above = (cosine.clone() + a.clone()).powi_scalar(2) + b_squared.clone();
    let s = below / (above + TINY);

    let projected = cosine * a;
    let absorbed = cosine_squared * b_squared;
    let below = (projected.clone() - sine_squared.clone()).powi_scalar(2) + absorbed.clone();
    let above = (projected + sine_squared).powi_scalar(2) + absorbed;
    let p = s.clone() * below / (above + TINY);
    Reflectance { s, p }
}

impl Reflectance {
    /// What a receiver sees of both: w |r_s|² + (1 − w) |r_p|² with the polarisation-mixing weight w, `[point, 1]`.
    pub fn mixed(self, weight: Tensor<2>) -> Tensor<2> {
        self.p.clone() + weight * (self.s - self.p)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::support::{assert_close, check_backends, check_finite, check_gradient, input, numbers, tensor, values};
    use burn::tensor::Device;

    /// (s, p) at each cosine.
    fn at(cosines: &[f64], refraction: f64, extinction: f64) -> (Vec<f64>, Vec<f64>) {
        let device = Device::flex();
        let squares: Vec<f64> = cosines.iter().map(|c| c * c).collect();
        let same = |value: f64| tensor(&[value], [1, 1], &device);
        let found = reflectance(tensor(&squares, [cosines.len(), 1], &device), same(refraction), same(extinction));
        (values(&found.s), values(&found.p))
    }

    const COSINES: [f64; 6] = [0.02, 0.2, 0.4, 0.6, 0.8, 0.99];

    #[test]
    fn normal_incidence_is_the_closed_form() {
        for (n, k) in [(1.5, 0.0), (3.0, 1.5), (2.2, 0.1), (1.05, 6.0)] {
            let wanted = [((n - 1.0_f64).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)];
            let (s, p) = at(&[1.0], n, k);
            assert_close("s", &s, &wanted, 1e-9);
            assert_close("p", &p, &wanted, 1e-9);
        }
    }

    #[test]
    fn nothing_of_p_is_reflected_at_brewsters_angle_without_absorption() {
        for n in [1.3_f64, 2.0, 3.0] {
            let cosine = 1.0 / (1.0 + n * n).sqrt();
            let (s, p) = at(&[cosine], n, 0.0);
            assert!(p[0] < 1e-12, "{p:?}");
            let wanted = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
            assert_close("s", &s, &[wanted], 1e-9);
            assert!(at(&[cosine], n, 0.5).1[0] > 1e-4, "absorption lifts the zero");
        }
    }

    #[test]
    fn everything_is_reflected_at_grazing() {
        for (n, k) in [(1.5, 0.0), (3.0, 1.5), (2.2, 0.1)] {
            let (s, p) = at(&[1e-4], n, k);
            assert!(s[0] > 0.999 && p[0] > 0.99, "{s:?} {p:?}");
        }
    }

    #[test]
    fn no_more_than_the_incident_power_is_reflected() {
        for n in [1.0, 1.05, 1.5, 3.0, 8.0] {
            for k in [0.0, 1e-3, 0.5, 1.5, 6.0] {
                let (s, p) = at(&COSINES, n, k);
                assert!(s.iter().chain(&p).all(|r| (0.0..=1.0).contains(r)), "{n} {k}: {s:?} {p:?}");
                assert!(s.iter().zip(&p).all(|(s, p)| *s >= p - 1e-12), "s is never below p");
            }
        }
    }

    #[test]
    fn without_absorption_it_is_the_dielectric_law() {
        for n in [1.3_f64, 2.0, 4.0] {
            let (s, p) = at(&COSINES, n, 0.0);
            let law = |cosine: f64| {
                let inside = (1.0 - (1.0 - cosine * cosine) / (n * n)).sqrt();
                let s = (cosine - n * inside) / (cosine + n * inside);
                let p = (n * cosine - inside) / (n * cosine + inside);
                (s * s, p * p)
            };
            let (wanted_s, wanted_p): (Vec<f64>, Vec<f64>) = COSINES.iter().map(|&c| law(c)).unzip();
            assert_close("s", &s, &wanted_s, 1e-9);
            assert_close("p", &p, &wanted_p, 1e-9);
        }
    }

    #[test]
    fn with_absorption_it_is_the_law_in_complex_numbers() {
        use num_complex::Complex64;
        for (n, k) in [(3.0, 1.5), (1.1, 4.0), (2.0, 0.01)] {
            let index = Complex64::new(n, k);
            let law = |cosine: f64| {
                let root = (index * index - (1.0 - cosine * cosine)).sqrt();
                let s = (cosine - root) / (cosine + root);
                let p = (index * index * cosine - root) / (index * index * cosine + root);
                (s.norm_sqr(), p.norm_sqr())
            };
            let (wanted_s, wanted_p): (Vec<f64>, Vec<f64>) = COSINES.iter().map(|&c| law(c)).unzip();
            let (s, p) = at(&COSINES, n, k);
            assert_close("s", &s, &wanted_s, 1e-9);
            assert_close("p", &p, &wanted_p, 1e-9);
        }
    }

    fn mixed(x: &[Tensor<1>]) -> Tensor<1> {
        let [point] = x[0].dims();
        let column = |i: usize| x[i].clone().reshape([point, 1]);
        reflectance(column(0), column(1), column(2)).mixed(column(3)).reshape([point])
    }

    pub(crate) fn gradients_agree_with_central_differences() {
        let inputs = [
            input("cosine squared", numbers(1, 8, 0.02, 0.98)),
            input("refraction", numbers(2, 8, 1.1, 6.0)),
            input("extinction", numbers(3, 8, 0.05, 4.0)),
            input("weight", numbers(4, 8, 0.1, 0.9)),
        ];
        check_gradient(&inputs, 1e-6, 1e-6, mixed);
        check_backends(&inputs, 1e-4, mixed);
    }

    #[test]
    fn values_and_gradients_are_finite_where_the_formula_is_singular() {
        // Grazing, normal, Brewster, no interface at all, a perfect conductor's limit.
        check_finite(
            &[
                input("cosine squared", [0.0, 1.0, 0.2, 0.0, 1.0, 0.0, 0.5]),
                input("refraction", [2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0]),
                input("extinction", [0.0, 0.0, 0.0, 0.0, 0.0, 1e4, 0.0]),
                input("weight", [0.5; 7]),
            ],
            mixed,
        );
    }
}
