//! Where amplitudes differ from eq. 2 and 3 as the paper prints them, one setting each.
//!
//! The paper sums Σ_p L_p exp(…) / (|tx − p| |p − rx|) with L_p(x_p(t), ω_i, ω_o) = f_r, and the same with SH_{p,k} and three
//! legs. `paper` is that formula; what is not the paper's is the default where it is the better physics or costs much less
//! (`docs/paper.md`). Phases are no part of this: they are those of `simulator.dechirp`.

use serde::{Deserialize, Serialize};

use crate::{
    body::Sampling,
    error::{Error, Result},
    scatterers::microfacet::Grazing,
};

/// What a scatterer's amplitude is multiplied by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Weights {
    /// The area that it stands for, m²: a surface then returns the same however densely it is sampled.
    #[default]
    Area,
    /// Nothing: every scatterer counts once.
    Paper,
}

/// From amplitude to the recording's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gains {
    /// One factor for the body and one for the room, which start at the recording's levels and are learned.
    #[default]
    Learned,
    /// None: what is decoded must reach the recording's level by itself.
    Paper,
}

/// When and for which antennas amplitudes are evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Amplitudes {
    /// Once per frame, at its middle and between the antennas' centres.
    #[default]
    Frame,
    /// At every chirp, with its positions, normals and tangents, from every transmitter to every receiver (of the indirect
    /// path: to every wall's receiver). Costs as many evaluations as there are chirps, transmitters and receivers. Facets
    /// keep the receivers' centre for their integral.
    Paper,
}

/// Choices between the paper's equations and ours.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EquationsConfig {
    pub weights: Weights,
    pub gains: Gains,
    pub grazing: Grazing,
    pub amplitudes: Amplitudes,
}

impl EquationsConfig {
    /// All as the paper has it.
    pub fn paper() -> Self {
        Self { weights: Weights::Paper, gains: Gains::Paper, grazing: Grazing::Paper, amplitudes: Amplitudes::Paper }
    }

    /// Refuses what cannot be meant. `key` names these settings in messages.
    pub fn check(&self, key: &str, sampling: Sampling) -> Result<()> {
        if self.weights == Weights::Paper && sampling != Sampling::Vertices {
            return Err(Error::setting(
                format!("{key}.weights"),
                "paper",
                "area, unless simulator.surface.sampling = \"vertices\"",
            )
            .with_hint("without areas a finer surface returns more"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finer_surface_needs_its_areas() {
        let paper = EquationsConfig::paper();
        assert!(paper.check("simulator.equations", Sampling::Vertices).is_ok());
        let error = paper.check("simulator.equations", Sampling::Facets).unwrap_err();
        let wanted = "`simulator.equations.weights` is paper, expected area, unless simulator.surface.sampling = \"vertices\"";
        assert_eq!(error.to_string(), wanted);
        assert!(EquationsConfig::default().check("simulator.equations", Sampling::Facets).is_ok());
    }
}
