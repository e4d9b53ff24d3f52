//! Structures of recordings: frames, chirps, channels and sampling, and what is stated of the scene.

use serde::{Deserialize, Serialize};

use super::possible::impossible;
use super::rules::SOMEBODY;
use crate::effects;
use crate::error::{Error, Result};
use crate::radar::Radar;

/// Who is before the radar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Who {
    /// A person whose motion is stated.
    #[default]
    Tracked,
    /// A person of whom nothing is stated.
    Untracked,
    Nobody,
}

/// One structure; cases are dealt all of them equally often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Structure {
    pub name: String,
    #[serde(default)]
    pub person: Who,
    /// Whether the walls are stated.
    #[serde(default = "stated")]
    pub room: bool,
    /// Keys of `[radar]` that differ.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub radar: toml::Table,
}

fn stated() -> bool {
    true
}

impl Default for Structure {
    /// The radar as it is, a tracked person, and a stated room: the one structure that needs no name.
    fn default() -> Self {
        Self { name: String::new(), person: Who::Tracked, room: true, radar: toml::Table::new() }
    }
}

impl Structure {
    /// The radar with what differs.
    ///
    /// # Errors
    /// A key that no radar has, or a radar that cannot be.
    pub fn radar(&self, of: &Radar) -> Result<Radar> {
        let key = || format!("structures.{}.radar", self.name);
        let mut table = toml::Table::try_from(of).expect("plain data");
        table.extend(self.radar.clone());
        let radar: Radar = table.try_into().map_err(|error: toml::de::Error| {
            Error::setting(key(), error.message(), "keys of [radar] with values of their kinds")
        })?;
        radar.check(&key())?;
        Ok(radar)
    }

    /// Whether the person's motion is stated.
    pub fn is_tracked(&self) -> bool {
        self.person == Who::Tracked
    }

    /// Whether an effect can be in such a recording. What needs a person needs one that is tracked: of anybody else it is unknown what
    /// would be there without it.
    pub fn can_have(&self, radar: &Radar, id: &str) -> bool {
        let needs_person = effects::info(id).is_some_and(|info| info.needs_person);
        (self.is_tracked() || !needs_person)
            && (self.person != Who::Untracked || !SOMEBODY.contains(&id))
            && impossible(id, radar).is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Sampling;

    fn structure(text: &str) -> Structure {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn a_structure_changes_what_it_names_and_refuses_what_no_radar_has() {
        let radar = Radar::small(12);
        let one = structure("name = \"one\"\nroom = false\nradar = { loops_per_frame = 1, frames = 90 }");
        assert_eq!(one.radar(&radar).unwrap(), Radar { loops_per_frame: 1, frames: 90, ..radar.clone() });
        assert!(!one.room && one.person == Who::Tracked);
        let unknown = structure("name = \"odd\"\nradar = { chirps = 3 }").radar(&radar).unwrap_err().to_string();
        assert!(unknown.contains("structures.odd.radar") && unknown.contains("chirps"), "{unknown}");
        assert!(structure("name = \"none\"\nradar = { frames = 0 }").radar(&radar).is_err());
    }

    #[test]
    fn effects_are_dealt_where_they_can_be() {
        let radar = Radar::small(12);
        let nobody = structure("name = \"n\"\nperson = \"nobody\"");
        assert!(!nobody.can_have(&radar, effects::pose_offset::ID) && nobody.can_have(&radar, effects::iq_imbalance::ID));
        assert!(nobody.can_have(&radar, effects::moving_reflector::ID));
        let untracked = structure("name = \"u\"\nperson = \"untracked\"");
        assert!(!untracked.can_have(&radar, effects::moving_reflector::ID));
        let real = Radar { sampling: Sampling::Real, ..radar.clone() };
        assert!(!Structure::default().can_have(&real, effects::iq_imbalance::ID));
        let single = Radar { rx_m: vec![[0.0; 3]], loops_per_frame: 1, ..radar };
        for id in [effects::channel_mismatch::ID, effects::chirp_settling::ID] {
            assert!(!Structure::default().can_have(&single, id), "{id}");
        }
    }
}
