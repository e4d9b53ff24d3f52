//! Amplitude of the indirect path: flat Gaussian patches with spherical harmonics (paper, section 3.3 and fig. 3a).
//!
//! A patch lies in the tangent plane (no extent along the normal) as a Gaussian with two scales and an in-plane
//! rotation. A plane wave that comes in from ω_i and leaves to ω_o meets it with the phase k (ω_i + ω_o)·x, so what
//! leaves is the Fourier transform of the Gaussian at the tangential part κ of k (ω_i + ω_o): exp(−½ ‖S Rᵀ κ‖²). Large
//! patches are mirrors that return only around the specular direction, small ones scatter to all sides.
//!
//! SH_{p,k} = reflectance · Σ coefficient · Y(ω_o) · aperture. The harmonics live in the patch's own frame, so that
//! their lobes turn with the body.

use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use super::column;
use super::material::Range;
use super::spherical_harmonics::{self, MAX_DEGREE, coefficients};
use super::tangent::Frame;
use crate::error::{Error, Result};
use crate::features::RowIndex;

/// Settings of the patches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PatchConfig {
    /// Of the spherical harmonics, 0 … 3.
    pub degree: usize,
    /// Farthest that a patch may move along each canonical axis.
    pub offset_m: f64,
    /// Standard deviations of the Gaussian. Beyond about a wavelength a patch is a mirror, and its gradient vanishes
    /// off the specular direction, hence the small start.
    pub scale_m: Range,
    pub reflectance: Range,
}

impl Default for PatchConfig {
    fn default() -> Self {
        Self { degree: 2, offset_m: 0.01, scale_m: Range::new(1e-4, 5e-3, 5e-4), reflectance: Range::new(0.0, 1.0, 0.1) }
    }
}

impl PatchConfig {
    /// Refuses what no patch can be. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if self.degree > MAX_DEGREE {
            return Err(Error::setting(format!("{key}.degree"), self.degree, format!("0 to {MAX_DEGREE}")));
        }
        if !(0.0..=1.0).contains(&self.offset_m) {
            return Err(Error::setting(format!("{key}.offset_m"), self.offset_m, "0 to 1 metre"));
        }
        self.scale_m.check(&format!("{key}.scale_m"), 1e-6..=1.0)?;
        self.reflectance.check(&format!("{key}.reflectance"), 0.0..=1.0)
    }

    /// Raw outputs at which all patches are the initial one: at rest, round, the same to all sides.
    pub fn raw_initial(&self) -> Vec<f64> {
        let mut raw = vec![0.0; 4];
        raw.extend([self.scale_m.raw_initial_by_ratio(); 2]);
        raw.push(self.reflectance.raw_initial());
        raw.push(1.0 / spherical_harmonics::CONSTANT);
        raw.resize(7 + coefficients(self.degree), 0.0);
        raw
    }

    /// # Shapes
    /// - `raw`: `[point, feature]`, unbounded, as many as `raw_initial`
    ///
    /// # Gradient
    /// Flows to `raw`.
    pub fn real(&self, raw: Tensor<2>) -> Patch {
        let [point, _] = raw.dims();
        let part = |start: usize, length: usize| raw.clone().narrow(1, start, length);
        Patch {
            offset_m: part(0, 3).tanh() * self.offset_m,
            rotation_rad: part(3, 1).reshape([point]),
            scale_m: self.scale_m.real_by_ratio(part(4, 2)),
            reflectance: self.reflectance.real(part(6, 1).reshape([point])),
            lobes: part(7, coefficients(self.degree)),
        }
    }
}

/// Decoded patches.
#[derive(Clone, Debug)]
pub struct Patch {
    /// `[point, xyz]`, metres, in the canonical pose: the caller moves the point by it before skinning.
    pub offset_m: Tensor<2>,
    /// `[point]`, radians, from the tangent towards the bitangent.
    pub rotation_rad: Tensor<1>,
    /// `[point, 2]`, metres, along the rotated tangent and bitangent.
    pub scale_m: Tensor<2>,
    /// `[point]`, 0 … 1.
    pub reflectance: Tensor<1>,
    /// `[point, coefficient]` of the spherical harmonics in the patch's frame.
    pub lobes: Tensor<2>,
}

impl Patch {
    /// Body and room together. The degrees must agree.
    pub fn cat(parts: Vec<Self>) -> Self {
        let one = |field: fn(&Self) -> &Tensor<1>| Tensor::cat(parts.iter().map(|part| field(part).clone()).collect(), 0);
        let two = |field: fn(&Self) -> &Tensor<2>| Tensor::cat(parts.iter().map(|part| field(part).clone()).collect(), 0);
        Self {
            offset_m: two(|part| &part.offset_m),
            rotation_rad: one(|part| &part.rotation_rad),
            scale_m: two(|part| &part.scale_m),
            reflectance: one(|part| &part.reflectance),
            lobes: two(|part| &part.lobes),
        }
    }

    /// Only some points: those that a receiver sees.
    pub fn pick(&self, points: &RowIndex) -> Self {
        Self {
            offset_m: points.pick(self.offset_m.clone()),
            rotation_rad: points.pick_one(self.rotation_rad.clone()),
            scale_m: points.pick(self.scale_m.clone()),
            reflectance: points.pick_one(self.reflectance.clone()),
            lobes: points.pick(self.lobes.clone()),
        }
    }
}

/// Directional amplitude SH_{p,k} of eq. 3. Several receivers can share a call, their directions one after the other
/// along the knot axis.
///
/// # Shapes
/// - `frame`, `incident`, `outgoing`: `[point, knot, xyz]`, unit vectors away from the patch, towards the transmitter
///   and towards the receiver; each may have one knot for all
/// - `wavenumber`: 2π / wavelength, rad/m
/// - result: `[point, knot]`, without unit, may be negative
///
/// # Gradient
/// Flows to everything but the wavenumber; smooth everywhere.
pub fn amplitude(patch: &Patch, frame: &Frame, incident: Tensor<3>, outgoing: Tensor<3>, wavenumber: f64) -> Tensor<2> {
    let incident = frame.coordinates(incident);
    let outgoing = frame.coordinates(outgoing);
    let tangential = [0, 1].map(|axis| (incident[axis].clone() + outgoing[axis].clone()) * wavenumber);
    let lobes = spherical_harmonics::directional(patch.lobes.clone(), outgoing);
    lobes * column(patch.reflectance.clone()) * aperture(patch, tangential)
}

/// exp(−½ ‖S Rᵀ κ‖²): Fourier transform of the patch's Gaussian, 1 at κ = 0.
///
/// # Shapes
/// - `tangential`: κ along tangent and bitangent, each `[point, knot]`, rad/m
/// - result: `[point, knot]`
pub fn aperture(patch: &Patch, tangential: [Tensor<2>; 2]) -> Tensor<2> {
    let [along, across] = tangential;
    let angle = column(patch.rotation_rad.clone());
    let (cosine, sine) = (angle.clone().cos(), angle.sin());
    let scale = |axis: usize| patch.scale_m.clone().narrow(1, axis, 1);
    let first = (along.clone() * cosine.clone() + across.clone() * sine.clone()) * scale(0);
    let second = (across * cosine - along * sine) * scale(1);
    ((first.powi_scalar(2) + second.powi_scalar(2)) * -0.5).exp()
}

#[cfg(test)]
#[path = "patches_tests.rs"]
pub(crate) mod tests;
