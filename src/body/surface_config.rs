//! Settings of the body's surface: where its scatterers sit, and where it is posed.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Where the body is posed (setting `simulator.surface.posing`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Posing {
    /// On the device, as tensor operations: gradients flow to the pose. The same values to f32's rounding.
    #[default]
    Tensor,
    /// On the host in f64: positions, normals and areas are constants of training.
    Host,
}

/// Where on the mesh the scatterers sit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// The mesh's vertices, as in the paper. On a mesh with edges longer than half a wavelength the sum is not the
    /// surface's return: +13 … +22 dB at 77 GHz and 15 to 25 mm.
    Vertices,
    /// Every facet split evenly until no edge exceeds `edge_m`, with a scatterer on the middle of each edge.
    Subdivided,
    /// One scatterer per facet, whose phase is integrated over the facet in closed form ([`super::facets`]). What
    /// remains (the wave's curvature and the amplitude's change within a facet) is −35 dB at 11 mm and 2 m.
    #[default]
    Facets,
}

/// Settings of the body's surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceConfig {
    pub sampling: Sampling,
    /// Longest edge after splitting, metres; only for `subdivided`. On a sphere of flat facets the error against
    /// the surface integral is −42 dB at half a wavelength and −75 dB at a quarter.
    pub edge_m: f64,
    /// Where positions, normals and areas are computed.
    pub posing: Posing,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self { sampling: Sampling::default(), edge_m: 1.9e-3, posing: Posing::default() }
    }
}

impl SurfaceConfig {
    /// The mesh's vertices, as in the paper.
    pub fn vertices() -> Self {
        Self { sampling: Sampling::Vertices, ..Self::default() }
    }

    /// Refuses what cannot work. `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if !(self.edge_m.is_finite() && self.edge_m > 0.0) {
            return Err(Error::setting(format!("{key}.edge_m"), self.edge_m, "a length above zero in metres")
                .with_hint("half a wavelength, 0.0019 at 79 GHz, is a good start"));
        }
        Ok(())
    }
}
