//! Few measured recordings: what a classifier learns from them alone, from as many simulated ones, and from both.

use serde::{Deserialize, Serialize};

use super::variants::Variant;
use crate::error::{Error, Result};

/// A classifier is tested on the unseen subject after it learned from a few recordings of each action by others. Every classifier
/// visits as many windows as one that learns from all of the others' recordings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FewConfig {
    /// Numbers of recordings of each action.
    pub recordings: Vec<usize>,
    /// Whose simulations stand beside the measured recordings.
    #[serde(default = "ours")]
    pub simulated_by: Variant,
}

fn ours() -> Variant {
    Variant::Ours
}

/// What a classifier learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// A few measured recordings.
    Measured,
    /// Simulations of the same few.
    Simulated,
    /// A few measured recordings, and simulations of all.
    Both,
}

impl Material {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Measured, Self::Simulated, Self::Both];

    /// As in folders.
    pub fn id(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Simulated => "simulated",
            Self::Both => "both",
        }
    }

    /// As in tables and pictures.
    pub fn title(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Simulated => "as many simulated",
            Self::Both => "measured, and all simulated",
        }
    }
}

impl FewConfig {
    /// `variants`: the simulators that are asked for.
    ///
    /// # Errors
    /// No numbers, a number of zero, a simulator that is not asked for.
    pub fn check(&self, variants: &[Variant]) -> Result<()> {
        if self.recordings.is_empty() || self.recordings.contains(&0) {
            return Err(Error::setting("few_measured.recordings", format!("{:?}", self.recordings), "numbers above zero"));
        }
        if !variants.contains(&self.simulated_by) {
            return Err(Error::setting("few_measured.simulated_by", self.simulated_by.id(), "one of `variants`"));
        }
        Ok(())
    }
}
