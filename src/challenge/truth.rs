//! The truth of a case, as it was sealed.

use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use super::commitment::{Sealed, open};
use super::config::Stratum;
use super::measure::Strength;
use super::report::Report;
use super::rules::{LIKE_SOMEBODY, SOMEBODY};
use super::structures::{Structure, Who};
use crate::error::{Error, Result};

/// What a case holds.
#[derive(Clone, Debug, Deserialize)]
pub struct Truth {
    pub stratum: Stratum,
    pub tier: String,
    pub effects: Vec<Value>,
    pub strength: Option<Strength>,
    /// The recorder's, as TOML: from them anybody records the case again.
    pub settings: String,
    #[serde(default)]
    pub structure: Structure,
    /// Effect of the library that the case was diagnosed without.
    #[serde(default)]
    pub left_out: Option<String>,
}

impl Truth {
    /// Of a case, verified against its published leaf.
    pub fn open(challenge: &Path, name: &str, leaf: &str) -> Result<Self> {
        let sealed = open(challenge, name, leaf)?;
        Self::of(&sealed).map_err(|found| Error::field(name, "truth", found, "a truth of this version"))
    }

    /// The truth in a sealed file, unverified; fails with a message where it is of another version.
    pub fn of(sealed: &Sealed) -> std::result::Result<Self, String> {
        serde_json::from_value(sealed.truth.clone()).map_err(|error| error.to_string())
    }

    /// Ids of docs/report.md; none for what is outside the library, or was left out of it.
    pub fn ids(&self) -> Vec<Option<&str>> {
        let is_known = |id: &&str| self.left_out.as_deref() != Some(*id);
        self.effects.iter().map(|effect| effect["name"].as_str().filter(is_known)).collect()
    }

    /// What a report says beside what is known of somebody whom nobody tracked.
    pub(super) fn beside_somebody(&self, mut report: Report) -> Report {
        if self.structure.person == Who::Untracked {
            report.effects.retain(|effect| !SOMEBODY.contains(&effect.id.as_str()));
            let is_somebody = |words: &str| LIKE_SOMEBODY.iter().any(|behaviour| behaviour.words() == words);
            report.unexplained.retain(|rest| !is_somebody(&rest.behaves_like));
            if report.verdict != "damaged" && report.effects.is_empty() && report.unexplained.is_empty() {
                report.verdict = "no_mismatch".into();
            }
        }
        report
    }
}
