//! Amplitude of the direct path: a microfacet surface seen bistatically (supplement, "Details of the Microfacet BRDF").
//!
//! f_r = D(h) G₂(i, o) F(i·h) / (4 |n·i| |n·o|), with i towards the transmitter, o towards the receiver and h half way:
//! Trowbridge-Reitz distribution D, *height-correlated* Smith shadowing G₂ (Heitz 2014, eq. 99: reciprocal, and more
//! accurate than the separable form at the same cost), Fresnel reflectance F.
//!
//! # From response to amplitude
//! The paper sets L_p = f_r: `Response::Paper`, the default. Two things speak against it, so the alternatives exist.
//! First, f_r alone grows like 1/cos θ towards grazing, which makes silhouettes the strongest scatterers (with
//! α = 0.4, beyond 86° a point returns more than at normal incidence); a surface element presents less area there, and the
//! Kirchhoff obliquity factor ½ (cos θ_i + cos θ_o) of `Response::Projected` bounds it by D F / (4 α): reciprocal and
//! smooth, and what a sum of area elements wants. Second, f_r is a ratio of powers, so the amplitude of an *incoherent*
//! element is its root, `Response::Field` = √(f_r cos θ_i cos θ_o); elements whose phases are summed explicitly have
//! the interference already, and take `Paper` or `Projected`. Area weights (m²), the gain into ADC codes and 1/distance
//! come outside.

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use super::material::Material;
use super::{column, dot, fresnel};

/// What of f_r is the amplitude; see the module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Response {
    /// L_p = f_r.
    #[default]
    Paper,
    /// f_r times ½ (cos θ_i + cos θ_o).
    Projected,
    /// √(f_r cos θ_i cos θ_o).
    Field,
}

/// What happens where a surface is seen on edge, and from behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Grazing {
    /// Cosines are rounded off below 0.01 (0.6° from grazing): f_r ends at a large finite value, and the response fades out
    /// over a few of it when the surface turns away, instead of jumping.
    #[default]
    Smooth,
    /// The formula to the end: f_r as long as both sides see the front, nothing after. That edge has no gradient.
    Paper,
}

/// Which form of the model is the amplitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Law {
    pub response: Response,
    pub grazing: Grazing,
}

impl From<Response> for Law {
    /// Rounded off at grazing.
    fn from(response: Response) -> Self {
        Self { response, ..Self::default() }
    }
}

/// Where [`Grazing::Smooth`] rounds cosines off.
const ROUNDED_BELOW: f64 = 0.01;

/// Cosines below this are indistinguishable from zero in f32; [`Grazing::Paper`] divides by no smaller one.
const LEAST_COSINE: f64 = 1e-6;

/// Added to squared lengths and to α² (whose smallest useful value is 4e-4).
const TINY: f64 = 1e-10;

/// Scattering amplitude L_p of each point (supplement, eq. for L_p).
///
/// # Shapes
/// - `material`: `[point]` each
/// - `normal`, `incident`, `outgoing`: `[point, knot, xyz]`, unit vectors away from the surface, towards the transmitter
///   and towards the receiver; each may have one knot for all
/// - result: `[point, knot]`, not negative, without unit
///
/// # Gradient
/// Flows to all inputs; finite everywhere, also at grazing, from behind, with opposite directions and for α → 0; smooth
/// unless the law ends at an edge ([`Grazing::Paper`]). Symmetric in `incident` and `outgoing`.
pub fn amplitude(
    material: &Material,
    normal: Tensor<3>,
    incident: Tensor<3>,
    outgoing: Tensor<3>,
    law: impl Into<Law>,
) -> Tensor<2> {
    let Law { response, grazing } = law.into();
    let alpha_squared = column(material.roughness.clone()).powi_scalar(2) + TINY;
    let half = Half::between(&normal, incident.clone(), outgoing.clone());
    let incident = Side::of(dot(normal.clone(), incident), grazing);
    let outgoing = Side::of(dot(normal, outgoing), grazing);

    let reflected = fresnel::reflectance(
        half.deviation_cosine_squared.clone(),
        column(material.refraction.clone()),
        column(material.extinction.clone()),
    )
    .mixed(column(material.polarisation.clone()));
    // At millimetre waves metals are perfect conductors to a part in a thousand.
    let reflected = reflected.clone() + column(material.metallic.clone()) * (1.0 - reflected);

    let facets = distribution(&half, alpha_squared.clone());
    let shadowed = visibility(&incident, &outgoing, alpha_squared);
    let lit = incident.front.clone() * outgoing.front.clone();
    let power_ratio = facets * shadowed * reflected * lit;
    match response {
        Response::Paper => power_ratio,
        Response::Projected => power_ratio * (incident.lit_cosine() + outgoing.lit_cosine()) * 0.5,
        Response::Field => (power_ratio * incident.lit_cosine() * outgoing.lit_cosine() + TINY).sqrt() - TINY.sqrt(),
    }
}

/// The half vector h, by the angles that are needed.
struct Half {
    /// cos² and sin² of the angle between n and h, `[point, knot]`.
    cosine_squared: Tensor<2>,
    sine_squared: Tensor<2>,
    /// cos² of the angle between i and h, the angle of incidence on the facets that reflect.
    deviation_cosine_squared: Tensor<2>,
}

impl Half {
    fn between(normal: &Tensor<3>, incident: Tensor<3>, outgoing: Tensor<3>) -> Self {
        let sum = incident + outgoing;
        let length_squared = dot(sum.clone(), sum.clone());
        let along = dot(normal.clone(), sum.clone());
        // The part of the sum across the normal: 1 − cos² would lose all digits next to the specular direction.
        let across = sum - normal.clone() * along.clone().unsqueeze_dim::<3>(2);
        let squared = length_squared.clone() + TINY;
        Self {
            cosine_squared: along.powi_scalar(2) / squared.clone(),
            // The same small number makes this 1 when there is no half vector, with opposite directions.
            sine_squared: (dot(across.clone(), across) + TINY) / squared,
            deviation_cosine_squared: length_squared * 0.25,
        }
    }
}

/// One direction, as seen from the surface; each `[point, knot]`.
struct Side {
    cosine: Tensor<2>,
    /// |cos|, at least `ROUNDED_BELOW` or `LEAST_COSINE`.
    rounded: Tensor<2>,
    /// 1 in front, 0 behind, ½ on edge.
    front: Tensor<2>,
}

impl Side {
    fn of(cosine: Tensor<2>, grazing: Grazing) -> Self {
        match grazing {
            Grazing::Smooth => {
                let rounded = (cosine.clone().powi_scalar(2) + ROUNDED_BELOW * ROUNDED_BELOW).sqrt();
                Self { front: (cosine.clone() / rounded.clone() + 1.0) * 0.5, cosine, rounded }
            }
            Grazing::Paper => Self {
                front: (cosine.clone().detach().sign() + 1.0) * 0.5,
                rounded: cosine.clone().abs().clamp_min(LEAST_COSINE),
                cosine,
            },
        }
    }

    /// max(cos, 0), rounded off.
    fn lit_cosine(&self) -> Tensor<2> {
        (self.cosine.clone() + self.rounded.clone()) * 0.5
    }
}

/// Trowbridge-Reitz: D = α² / (π (α² cos² + sin²)²), the facets' density around h per steradian.
fn distribution(half: &Half, alpha_squared: Tensor<2>) -> Tensor<2> {
    let spread = alpha_squared.clone() * half.cosine_squared.clone() + half.sine_squared.clone();
    // Squared last: the fourth power of a mirror's spread, which a quotient's gradient needs, is below f32.
    (alpha_squared.sqrt() / spread).powi_scalar(2) * std::f64::consts::FRAC_1_PI
}

/// G₂ / (4 cos θ_i cos θ_o) = ½ / (cos θ_o √(α² + (1 − α²) cos² θ_i) + cos θ_i √(α² + (1 − α²) cos² θ_o)).
fn visibility(incident: &Side, outgoing: &Side, alpha_squared: Tensor<2>) -> Tensor<2> {
    let masked = |side: &Side| {
        let cosine_squared = side.rounded.clone().powi_scalar(2);
        let sine_squared: Tensor<2> = 1.0 - cosine_squared.clone();
        (alpha_squared.clone() * sine_squared + cosine_squared).sqrt()
    };
    0.5 / (outgoing.rounded.clone() * masked(incident) + incident.rounded.clone() * masked(outgoing))
}

#[cfg(test)]
#[path = "microfacet_tests.rs"]
pub(crate) mod tests;
