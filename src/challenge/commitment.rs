//! What is published before anybody diagnoses: one hash per case, and one over them all.
//!
//! A case's leaf is SHA-256(canonical JSON of its truth | salt | SHA-256 of its data). The salt keeps anybody from
//! trying out truths; the root is the Merkle root of the leaves in the order of the cases' names.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::data::files::{self, read_json};
use crate::data::{entries::entries, hex};
use crate::error::{Error, Result};

/// `commitment.json`, or one of several where the cases were sealed in shards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Commitment {
    pub format: i64,
    /// Which part of all cases: number and count, from 1.
    pub shard: [usize; 2],
    pub cases: usize,
    /// Of the resolved settings.
    pub config_sha256: String,
    /// Of the program that sealed.
    pub executable_sha256: String,
    /// Of the secret seed: after unsealing, anybody can record everything again.
    pub secret_sha256: String,
    /// Merkle root of the leaves.
    pub root: String,
    /// Name of the case → leaf.
    pub leaves: BTreeMap<String, String>,
    /// Name of a case → effect of the library that it is to be diagnosed without; its truth has the same.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub left_out: BTreeMap<String, String>,
}

/// `sealed/NAME.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sealed {
    pub salt: String,
    pub truth: Value,
}

/// SHA-256 as hexadecimal digits.
pub fn sha256(bytes: impl AsRef<[u8]>) -> String {
    hex(&Sha256::digest(bytes.as_ref()))
}

/// SHA-256 of a file's content; fails where it cannot be read.
pub fn hash_file(path: &Path) -> Result<String> {
    files::read(path).map(sha256)
}

/// Keys in order, no spaces: equal values give equal texts.
pub fn canonical(value: &Value) -> String {
    match value {
        Value::Object(map) => {
            let sorted: BTreeMap<&String, &Value> = map.iter().collect();
            let members: Vec<String> =
                sorted.into_iter().map(|(key, value)| format!("{}:{}", Value::from(key.as_str()), canonical(value))).collect();
            format!("{{{}}}", members.join(","))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(canonical).collect::<Vec<_>>().join(",")),
        other => other.to_string(),
    }
}

/// Over the names and contents of all files in a folder.
pub fn hash_folder(folder: &Path) -> Result<String> {
    let mut all = String::new();
    for file in entries(folder)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        all.push_str(&format!("{name}:{}\n", hash_file(&file)?));
    }
    Ok(sha256(all))
}

/// The hash that is published for a case, from its truth, its salt and the hash of its data.
pub fn leaf(sealed: &Sealed, data_sha256: &str) -> String {
    sha256(format!("{}|{}|{data_sha256}", canonical(&sealed.truth), sealed.salt))
}

/// Pairs are hashed together until one is left; an odd one goes up alone.
pub fn merkle_root(leaves: &BTreeMap<String, String>) -> String {
    let mut level: Vec<String> = leaves.iter().map(|(name, leaf)| sha256(format!("{name}:{leaf}"))).collect();
    while level.len() > 1 {
        level = level.chunks(2).map(|pair| if pair.len() == 2 { sha256(pair.concat()) } else { pair[0].clone() }).collect();
    }
    level.pop().unwrap_or_else(|| sha256(""))
}

impl Commitment {
    /// All commitments of a folder, in the order of their shards, each consistent with itself.
    pub fn read_all(folder: &Path) -> Result<Vec<Self>> {
        let mut found = vec![];
        for path in entries(folder)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.starts_with("commitment") && name.ends_with(".json") {
                let commitment: Self = read_json(&path)?;
                if merkle_root(&commitment.leaves) != commitment.root {
                    return Err(Error::field(path, "root", "not the root of the leaves", "an untouched commitment"));
                }
                found.push(commitment);
            }
        }
        if found.is_empty() {
            return Err(Error::Usage {
                message: format!("{}: no commitment.json", folder.display()),
                hint: Some("make a challenge with `hybridsim challenge seal`".into()),
            });
        }
        found.sort_by_key(|commitment| commitment.shard);
        Ok(found)
    }
}

/// Effect of the library that a case is to be diagnosed without.
pub fn left_out<'a>(commitments: &'a [Commitment], case: &str) -> Option<&'a String> {
    commitments.iter().find_map(|commitment| commitment.left_out.get(case))
}

/// One hash over all shards.
pub fn joint_root(commitments: &[Commitment]) -> String {
    match commitments {
        [one] => one.root.clone(),
        several => sha256(several.iter().map(|commitment| commitment.root.as_str()).collect::<Vec<_>>().join("\n")),
    }
}

/// Opens a case: its truth, once data, truth and salt give the leaf that was published.
pub fn open(folder: &Path, name: &str, leaf_published: &str) -> Result<Sealed> {
    let path = folder.join("sealed").join(format!("{name}.json"));
    let sealed: Sealed = read_json(&path)?;
    let data = hash_folder(&folder.join("cases").join(name))?;
    if leaf(&sealed, &data) != leaf_published {
        return Err(Error::Usage {
            message: format!("case {name}: truth, salt and data do not give the leaf that was committed to"),
            hint: Some("the case was changed after sealing; nothing is scored".into()),
        });
    }
    Ok(sealed)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn canonical_text_does_not_depend_on_the_order_of_keys() {
        let a: Value = serde_json::from_str(r#"{"b": [1, 2.5], "a": {"d": null, "c": "x\"y"}}"#).unwrap();
        let b: Value = serde_json::from_str(r#"{"a": {"c": "x\"y", "d": null}, "b": [1, 2.5]}"#).unwrap();
        assert_eq!(canonical(&a), canonical(&b));
        assert_eq!(canonical(&a), r#"{"a":{"c":"x\"y","d":null},"b":[1,2.5]}"#);
    }

    #[test]
    fn the_root_depends_on_every_leaf_and_name_and_the_leaf_on_truth_salt_and_data() {
        let leaves =
            |last: &str| BTreeMap::from([("a", "1"), ("b", "2"), ("c", last)].map(|(k, v)| (k.to_string(), v.to_string())));
        assert_ne!(merkle_root(&leaves("3")), merkle_root(&leaves("4")));
        let renamed = BTreeMap::from([("a", "1"), ("b", "2"), ("d", "3")].map(|(k, v)| (k.to_string(), v.to_string())));
        assert_ne!(merkle_root(&leaves("3")), merkle_root(&renamed));
        let sealed = Sealed { salt: "s".into(), truth: json!({"effects": []}) };
        let of = |sealed: &Sealed, data: &str| leaf(sealed, data);
        assert_ne!(of(&sealed, "d"), of(&sealed, "e"));
        assert_ne!(of(&sealed, "d"), of(&Sealed { salt: "t".into(), ..sealed.clone() }, "d"));
        assert_ne!(of(&sealed, "d"), of(&Sealed { truth: json!({"effects": [1]}), ..sealed.clone() }, "d"));
    }
}
