//! Parts of a body by the names of its joints.

use crate::error::{Error, Result};
use crate::person::{JOINT_NAMES, Person};

/// How much of each vertex belongs to the named joints, `[vertex]` 0 to 1. `key` names who asks.
pub fn part_weights(person: &Person, parts: &[impl AsRef<str>], key: &str) -> Result<Vec<f64>> {
    let Person::Skinned { model, .. } = person else {
        return Err(Error::setting(key, "on", "off for a person given as meshes, which have no joints"));
    };
    let joints: Vec<usize> = parts.iter().map(|part| joint(part.as_ref(), key)).collect::<Result<_>>()?;
    let own = |weights: &Vec<(usize, f64)>| weights.iter().filter(|(joint, _)| joints.contains(joint)).map(|(_, w)| w).sum();
    let weights: Vec<f64> = model.skinning.iter().map(own).collect();
    if weights.iter().all(|weight| *weight == 0.0) {
        return Err(Error::setting(key, "a part without surface", "a joint that moves some vertices of this body"));
    }
    Ok(weights)
}

fn joint(name: &str, key: &str) -> Result<usize> {
    JOINT_NAMES.iter().position(|known| *known == name).ok_or_else(|| {
        Error::setting(key, format!("`{name}`"), "the name of an SMPL joint")
            .with_hint(format!("one of {}", JOINT_NAMES.join(", ")))
    })
}
