//! Who is learned from and who is tested on: recordings are divided by a label, never within one of its values.

use std::collections::{BTreeMap, BTreeSet};

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Shares of a label's values; the rest is for training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SplitConfig {
    pub validation: f64,
    pub test: f64,
    /// Equal seeds divide equal values equally.
    pub seed: u64,
}

impl Default for SplitConfig {
    fn default() -> Self {
        Self { validation: 0.15, test: 0.15, seed: 1 }
    }
}

impl SplitConfig {
    /// Refuses a share that is negative or leaves nothing to train on.
    pub fn check(&self) -> Result<()> {
        for (key, share) in [("split.validation", self.validation), ("split.test", self.test)] {
            if !(0.0..1.0).contains(&share) {
                return Err(Error::setting(key, share, "a share from 0, below 1"));
            }
        }
        Ok(())
    }

    /// The split (`train`, `validation` or `test`) of every value of the label `key`. Values in `unseen` are for the test
    /// whatever the seed, and no others then are; every share above zero gets one value at least.
    ///
    /// # Errors
    /// Too few values.
    pub fn divide(&self, key: &str, values: &BTreeSet<String>, unseen: &[String]) -> Result<BTreeMap<String, &'static str>> {
        let (stated, mut free): (Vec<&String>, Vec<&String>) = values.iter().partition(|value| unseen.contains(value));
        let count = |share: f64| if share > 0.0 { ((share * values.len() as f64).round() as usize).max(1) } else { 0 };
        let test = if stated.is_empty() { count(self.test) } else { 0 };
        let validation = count(self.validation);
        if free.len() <= test + validation {
            let expected = format!("at least {} values, one of them to train on", test + validation + 1);
            return Err(Error::setting(format!("--split-by {key}"), format!("{} values to divide", free.len()), expected)
                .with_hint("split by another label, or give --set split.validation=0"));
        }
        free.shuffle(&mut ChaCha8Rng::seed_from_u64(self.seed));
        let name = |place: usize| match place {
            place if place < test => "test",
            place if place < test + validation => "validation",
            _ => "train",
        };
        let divided = free.into_iter().enumerate().map(|(place, value)| (value.clone(), name(place)));
        Ok(divided.chain(stated.into_iter().map(|value| (value.clone(), "test"))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(count: usize) -> BTreeSet<String> {
        (0..count).map(|index| format!("s{index}")).collect()
    }

    fn counted(divided: &BTreeMap<String, &'static str>) -> [usize; 3] {
        ["train", "validation", "test"].map(|name| divided.values().filter(|split| **split == name).count())
    }

    #[test]
    fn every_value_is_in_one_split_and_equal_seeds_agree() {
        let config = SplitConfig { validation: 0.2, test: 0.3, seed: 4 };
        let divided = config.divide("subject", &values(10), &[]).unwrap();
        assert_eq!(counted(&divided), [5, 2, 3]);
        assert_eq!(config.divide("subject", &values(10), &[]).unwrap(), divided);
        assert_ne!(SplitConfig { seed: 5, ..config }.divide("subject", &values(10), &[]).unwrap(), divided);
    }

    #[test]
    fn who_is_unseen_is_tested_on() {
        let unseen = ["s1".to_string(), "s3".to_string()];
        let divided = SplitConfig::default().divide("subject", &values(4), &unseen).unwrap();
        assert_eq!((counted(&divided), divided["s1"], divided["s3"]), ([1, 1, 2], "test", "test"));
    }

    #[test]
    fn too_few_values_are_refused() {
        let error = SplitConfig::default().divide("subject", &values(2), &[]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "`--split-by subject` is 2 values to divide, expected at least 3 values, one of them to train on"
        );
    }
}
