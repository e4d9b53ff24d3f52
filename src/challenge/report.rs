//! A report as far as scoring needs it. What it holds beyond that is tolerated; what must be there and is not, is named.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Deserializer};
use serde_json::Value;

use crate::data::files::read_json;
use crate::error::Result;

/// All of a report that scoring reads.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    pub verdict: String,
    /// Of nothing being missing, and of the tests that it is made of.
    #[serde(default)]
    pub p_value: Option<f64>,
    #[serde(default)]
    pub null: BTreeMap<String, Option<f64>>,
    /// Smallest p-value of each family of detectors that had something to say.
    #[serde(default, rename = "suspects")]
    pub detectors: BTreeMap<String, f64>,
    #[serde(default)]
    pub reason: String,
    pub effects: Vec<Effect>,
    pub unexplained: Vec<Unexplained>,
    #[serde(default)]
    pub not_detectable: Vec<Limit>,
    pub fit: Fit,
    /// Of the trained simulator's heatmaps.
    #[serde(default)]
    pub simulator: Option<Fit>,
}

/// A finding with a name.
#[derive(Clone, Debug, Deserialize)]
pub struct Effect {
    pub id: String,
    pub probability: f64,
    #[serde(default)]
    pub indistinguishable_from: Vec<String>,
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
    #[serde(rename = "where", default, deserialize_with = "or_default")]
    pub place: Place,
    #[serde(default, deserialize_with = "or_default")]
    pub evidence: Evidence,
}

/// How sure a finding is.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Evidence {
    pub held_out_loglik_gain: Option<f64>,
}

/// Numbers or lists of numbers, as they come.
#[derive(Clone, Debug, Deserialize)]
pub struct Parameter {
    pub value: Value,
    #[serde(default)]
    pub ci90: Value,
}

/// Where a finding is said to be.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Place {
    pub stage: Option<String>,
    /// Nearest and farthest.
    pub range_m: Option<[f64; 2]>,
    /// Radar frame.
    pub position_m: Option<[f64; 3]>,
    pub boundary: Option<String>,
    pub frames: Option<Vec<usize>>,
    pub rx: Option<Vec<usize>>,
    pub body_part: Option<String>,
}

/// A finding without a name.
#[derive(Clone, Debug, Deserialize)]
pub struct Unexplained {
    #[serde(rename = "where", default, deserialize_with = "or_default")]
    pub place: Place,
    #[serde(default)]
    pub behaves_like: String,
    #[serde(default)]
    pub held_out_loglik_gain: Option<f64>,
}

/// What a report says of an effect that it did not find.
#[derive(Clone, Debug, Deserialize)]
pub struct Limit {
    pub id: String,
    pub at_most_db: Option<f64>,
}

/// How well the recording is predicted before and after what was found is taken into account.
#[derive(Clone, Debug, Deserialize)]
pub struct Fit {
    #[serde(deserialize_with = "or_default")]
    pub before: Measures,
    #[serde(deserialize_with = "or_default")]
    pub after: Measures,
}

/// The usual measures of a prediction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Measures {
    pub loglik_per_sample: Option<f64>,
    pub db_mse: Option<f64>,
    pub psnr_db: Option<f64>,
    pub ssim: Option<f64>,
}

fn or_default<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(deserializer: D) -> std::result::Result<T, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or_default())
}

const VERDICTS: [&str; 6] = ["explained", "partly_explained", "unexplained", "no_mismatch", "undecided", "damaged"];

impl Report {
    /// Reads `report.json`.
    ///
    /// # Errors
    /// A file that cannot be read, that lacks what scoring needs, or whose verdict is none of those known.
    pub fn read(path: &Path) -> Result<Self> {
        let report: Self = read_json(path)?;
        if !VERDICTS.contains(&report.verdict.as_str()) {
            return Err(crate::Error::field(path, "verdict", &report.verdict, VERDICTS.join(", ")));
        }
        Ok(report)
    }

    /// The usual measures before anything is explained: those of the trained simulator where there is one.
    pub fn usual(&self) -> Measures {
        self.simulator.as_ref().map_or(self.fit.before, |simulator| simulator.before)
    }

    /// Whether it says that anything is missing, by name or without, or that the samples are damaged.
    pub fn claims(&self) -> bool {
        !self.effects.is_empty()
            || !self.unexplained.is_empty()
            || matches!(self.verdict.as_str(), "explained" | "partly_explained" | "unexplained" | "damaged")
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use serde_json::json;

    use super::*;

    pub fn report(value: Value) -> Report {
        serde_json::from_value(value).unwrap()
    }

    #[test]
    fn unknown_fields_are_tolerated_and_missing_ones_named() {
        let whole = json!({
            "format": 1, "verdict": "no_mismatch", "effects": [], "unexplained": [], "later": 7,
            "fit": {"before": {"psnr_db": 20.0, "new": 1}, "after": {}}
        });
        let read = report(whole.clone());
        assert!(!read.claims());
        assert_eq!(read.fit.before.psnr_db, Some(20.0));
        let mut broken = whole;
        broken.as_object_mut().unwrap().remove("effects");
        let message = serde_json::from_value::<Report>(broken).unwrap_err().to_string();
        assert!(message.contains("missing field `effects`"), "{message}");
    }

    #[test]
    fn a_name_an_unexplained_rest_or_the_verdict_is_a_claim() {
        let with = |verdict: &str, unexplained: Value| {
            report(json!({"verdict": verdict, "effects": [], "unexplained": unexplained, "fit": {"before": {}, "after": {}}}))
        };
        assert!(!with("undecided", json!([])).claims());
        assert!(with("damaged", json!([])).claims());
        assert!(with("unexplained", json!([])).claims());
        assert!(with("no_mismatch", json!([{"where": null, "p_value": 1e-4}])).claims());
    }
}
