//! Settings of a diagnosis.

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::statistics::UNDECIDED;
use crate::data::hex;
use crate::effects::{self, EffectInfo};
use crate::error::{Error, Result};

/// When something is claimed, and what is done to show it. Every report names these settings and their hash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiagnosisConfig {
    /// Family-wise chance of a false claim on a recording with nothing missing.
    pub alarm: f64,
    /// Least gain of the log-likelihood on held-out frames, nats.
    pub gain: f64,
    /// The same for what has no name in the library.
    pub nameless_gain: f64,
    /// Effects of different detectors within so many nats of the best are not distinguished; within a detector it is always
    /// the default, a hundred times as likely.
    pub tie: f64,
    /// Most effects that are accepted.
    pub most: usize,
    /// Epochs for which the simulator is trained, without and with the effects; zero: it is not.
    pub epochs: usize,
    /// Whether to say how strong what was not found can be at most; it takes several times as long as finding.
    pub limits: bool,
    /// Of the simulator's training.
    pub seed: u64,
    /// Effects of the library that are taken for unknown: nothing is named so, as if nobody had written them down. What they do is left
    /// without a name, if it is found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// A table of `hybridsim challenge calibrate`, by which p-values are calibrated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
}

fn short_hash(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes)[..6])
}

impl Default for DiagnosisConfig {
    fn default() -> Self {
        Self {
            alarm: 0.01,
            gain: 6.0,
            nameless_gain: 15.0,
            tie: UNDECIDED,
            most: 10,
            epochs: 8,
            limits: true,
            seed: 1,
            left_out: vec![],
            calibration: None,
        }
    }
}

impl DiagnosisConfig {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        if !(self.alarm > 0.0 && self.alarm < 1.0) {
            return Err(Error::setting("diagnosis.alarm", self.alarm, "a probability between 0 and 1"));
        }
        for (key, value) in [("gain", self.gain), ("nameless_gain", self.nameless_gain), ("tie", self.tie)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::setting(format!("diagnosis.{key}"), value, "nats, 0 or more"));
            }
        }
        if let Some(id) = self.left_out.iter().find(|id| effects::info(id).is_none()) {
            return Err(Error::setting("diagnosis.left_out", id, "ids of effects, as `hybridsim effects` lists them"));
        }
        Ok(())
    }

    /// Effects that may be named.
    pub(super) fn library(&self) -> Arc<[&'static EffectInfo]> {
        effects::library().iter().copied().filter(|info| self.left_out.iter().all(|id| id != info.id)).collect()
    }

    /// All that decides the answer beside the recording: these settings as text, the program's version and its sources (which hold
    /// every constant and table), and what else had a part, each by its hash; then the hash of all that.
    pub fn fingerprint(&self, more: &[(&str, Vec<u8>)]) -> String {
        // A table counts by what is in it, which is among the rest, and not by where it lies.
        let settings = Self { calibration: None, ..self.clone() };
        let settings = toml::to_string(&settings).expect("plain data").replace('\n', "; ");
        let program = format!("hybridsim {}, sources {}", env!("CARGO_PKG_VERSION"), env!("HYBRIDSIM_SOURCES"));
        let mut text = format!("{}; {program}", settings.trim_end_matches("; "));
        for (name, value) in more {
            text += &format!("; {name} {}", short_hash(value));
        }
        let hash = short_hash(text.as_bytes());
        format!("{text} (sha256 {hash})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_decides_changes_the_fingerprint() {
        let config = DiagnosisConfig::default();
        let plain = config.fingerprint(&[]);
        assert!(plain.contains("alarm = 0.01") && plain.contains(env!("HYBRIDSIM_SOURCES")), "{plain}");
        let simulator = |text: &str| config.fingerprint(&[("simulator", text.into())]);
        let other = DiagnosisConfig { tie: 4.7, ..config.clone() }.fingerprint(&[]);
        let table = DiagnosisConfig { calibration: Some("elsewhere.json".into()), ..config.clone() };
        assert_eq!(table.fingerprint(&[]), plain);
        let all = [plain.clone(), simulator("a"), simulator("b"), other];
        let hash = |text: &String| text.rsplit_once("(sha256 ").unwrap().1.to_string();
        let hashes: std::collections::BTreeSet<String> = all.iter().map(hash).collect();
        assert_eq!(hashes.len(), 4);
        assert_eq!(config.fingerprint(&[]), plain);
    }
}
