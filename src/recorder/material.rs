//! What a surface sends back: Fresnel reflection and the loss by roughness.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A half space with a slightly rough face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Relative permittivity ε' − jε'' as [ε', ε''].
    pub permittivity: [f64; 2],
    /// Root mean square height of what is too fine for the mesh, metres.
    pub roughness_m: f64,
}

impl Material {
    /// Dry skin at 77 GHz (Gabriel et al. 1996, the law in `docs/paper.md`), as smooth as skin is.
    pub const SKIN: Self = Self { permittivity: [6.57, 8.92], roughness_m: 1.0e-4 };
    /// Painted plasterboard.
    pub const PLASTERBOARD: Self = Self { permittivity: [2.8, 0.05], roughness_m: 6.0e-4 };

    /// Co-polarised reflection at 45° to the plane of incidence, (r_s − r_p)/2, with r_s = −r_p at normal incidence;
    /// −1 for a perfect conductor at every angle. Conjugated, as the IF phase *grows* with delay.
    pub fn reflection(&self, cos_incidence: f64) -> Complex64 {
        let permittivity = Complex64::new(self.permittivity[0], -self.permittivity[1]);
        let cosine = cos_incidence.clamp(0.0, 1.0);
        let root = (permittivity - (1.0 - cosine * cosine)).sqrt();
        let s = (cosine - root) / (cosine + root);
        let p = (permittivity * cosine - root) / (permittivity * cosine + root);
        ((s - p) * 0.5).conj()
    }

    /// Part of the field that stays coherent when heights are Gaussian: exp(−(k σ Σcosθ)²/2).
    pub fn coherence(&self, wavenumber: f64, cosine_sum: f64) -> f64 {
        (-0.5 * (wavenumber * self.roughness_m * cosine_sum).powi(2)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skin_reflects_a_third_of_the_power_at_normal_incidence() {
        let power = Material::SKIN.reflection(1.0).norm_sqr();
        // |(1 − n)/(1 + n)|² with n = 2.97 − 1.50j
        assert!((power - 0.340).abs() < 1e-3, "{power}");
    }

    #[test]
    fn normal_incidence_is_the_quotient_of_the_indices() {
        let glass = Material { permittivity: [4.0, 0.0], roughness_m: 0.0 };
        assert!((glass.reflection(1.0) - Complex64::new(-1.0 / 3.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_perfect_conductor_reflects_everything_at_every_angle() {
        let metal = Material { permittivity: [1.0, 1e12], roughness_m: 0.0 };
        for cosine in [1.0, 0.7, 0.2] {
            assert!((metal.reflection(cosine) + 1.0).norm() < 1e-4);
        }
    }

    #[test]
    fn roughness_of_an_eighth_wavelength_costs_most_of_the_mirror_image() {
        let rough = Material { roughness_m: 3.8e-3 / 8.0, ..Material::PLASTERBOARD };
        let kept = rough.coherence(std::f64::consts::TAU / 3.8e-3, 2.0);
        assert!((kept - (-0.5 * (std::f64::consts::FRAC_PI_2).powi(2)).exp()).abs() < 1e-12);
    }
}
