//! The body: what it does beside its motion, and what covers it.

use super::EffectsConfig;
use crate::error::{Error, Result};
use crate::person::{JOINT_NAMES, Person};
use crate::recorder::mesh::vertex_normals;
use crate::recorder::physiology::{Physiology, Swell};
use crate::recorder::vector::Vector;
use crate::recorder::world::World;

impl Physiology {
    /// Both `breathing` and `heartbeat` need to know which vertices are the trunk; `rest` is the rest pose `[vertex, xyz]`.
    pub fn new(world: &World, person: &Person, rest: &[Vector]) -> Result<Self> {
        let effects = &world.effects;
        let mut swells = vec![];
        if let Some(breathing) = &effects.breathing {
            swells.push(Swell {
                weights: part_weights(person, &["spine1", "spine2", "spine3"], "effects.breathing")?,
                amplitude_m: breathing.amplitude_m,
                rate_hz: breathing.rate_hz,
                phase_rad: world.phase(super::BREATHING, 0),
                harmonic: 0.0,
            });
        }
        if let Some(heartbeat) = &effects.heartbeat {
            // A body at rest faces +z.
            let front = vertex_normals(rest, person.faces());
            let chest = part_weights(person, &["spine2", "spine3"], "effects.heartbeat")?;
            swells.push(Swell {
                weights: chest.iter().zip(front).map(|(weight, normal)| weight * normal[2].max(0.0)).collect(),
                amplitude_m: heartbeat.amplitude_m,
                rate_hz: heartbeat.rate_hz,
                phase_rad: world.phase(super::HEARTBEAT, 0),
                harmonic: 0.5,
            });
        }
        let stands = effects.pose_offset.as_ref().map(|pose| {
            let (sin, cos) = pose.yaw_deg.to_radians().sin_cos();
            ([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], pose.offset_m)
        });
        Ok(Self { swells, stands })
    }
}

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

/// Decibels that `part_reflectivity` adds, `[vertex]`.
pub fn reflectivity_db(effects: &EffectsConfig, person: &Person) -> Result<Option<Vec<f64>>> {
    let Some(part) = &effects.part_reflectivity else { return Ok(None) };
    let weights = part_weights(person, &[&part.body_part], "effects.part_reflectivity.body_part")?;
    Ok(Some(weights.into_iter().map(|weight| weight * part.db).collect()))
}

/// One-way extra path under a garment (`clothing_delay`), `[vertex]`, metres.
pub fn garment_m(effects: &EffectsConfig, person: &Person) -> Result<Option<Vec<f64>>> {
    let Some(cloth) = &effects.clothing_delay else { return Ok(None) };
    let weights = part_weights(person, &cloth.body_parts, "effects.clothing_delay.body_parts")?;
    Ok(Some(weights.into_iter().map(|weight| weight * cloth.extra_m).collect()))
}
