//! The settings of `hybridsim record`, and the world they describe.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Deserializer, Serialize, de};

use super::effects::EffectsConfig;
use super::material::Material;
use super::receiver::ReceiverConfig;
use super::stages::Clock;
use super::surface::SurfaceConfig;
use super::timeline::Interpolation;
use super::world::{Reflector, WallsConfig, World};
use crate::data::{MotionOptions, read_body, read_motion, read_motion_upright};
use crate::error::{Error, Result};
use crate::person::actions::{self, Action, StyleConfig};
use crate::person::{BodyModel, Motion, Person, Placement, procedural};
use crate::radar::Radar;
use crate::room::Room;

/// A radar by name or in full.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum RadarChoice {
    /// `mmmesh` or `small`.
    Preset(String),
    Full(Box<Radar>),
}

impl RadarChoice {
    /// The radar that is meant, presets with 24 frames.
    ///
    /// # Errors
    /// A name that no preset has.
    pub fn radar(&self) -> Result<Radar> {
        match self {
            Self::Full(radar) => Ok((**radar).clone()),
            Self::Preset(name) => match name.as_str() {
                "mmmesh" => Ok(Radar::mmmesh(24)),
                "small" => Ok(Radar::small(24)),
                _ => Err(Error::setting("radar", name, "`mmmesh`, `small`, or a table [radar]")),
            },
        }
    }
}

/// By hand, so that a mistake inside the table is reported as what it is.
impl<'de> Deserialize<'de> for RadarChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = RadarChoice;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                formatter.write_str("the name of a radar or a table")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> std::result::Result<RadarChoice, E> {
                Ok(RadarChoice::Preset(name.into()))
            }

            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> std::result::Result<RadarChoice, A::Error> {
                Radar::deserialize(de::value::MapAccessDeserializer::new(map)).map(|radar| RadarChoice::Full(Box::new(radar)))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// Who moves, and how. Paths are relative to the settings' folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ActorConfig {
    /// One of the embedded subjects; used when there is no `body`.
    pub subject: String,
    /// A skinned body in SMPL layout (`.npz`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<PathBuf>,
    /// Shape parameters of an embedded action; a motion file brings its own.
    pub betas: Vec<f64>,
    /// An embedded action; used when there is no `motion`.
    pub action: Action,
    pub style: StyleConfig,
    /// Poses per second of an embedded action.
    pub rate_hz: f64,
    /// Poses in AMASS layout (`.npz`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<PathBuf>,
    /// Horizontal distance of the motion's origin, straight ahead; used when there is no `placement`.
    pub distance_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<Placement>,
}

impl Default for ActorConfig {
    fn default() -> Self {
        Self {
            subject: "s1".into(),
            body: None,
            betas: vec![],
            action: Action::WalkBackForth,
            style: StyleConfig::default(),
            rate_hz: 60.0,
            motion: None,
            distance_m: 3.0,
            placement: None,
        }
    }
}

/// All settings of `hybridsim record`. The default is a baseline recording: nothing beyond the baseline of docs/diagnosis.md.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecorderConfig {
    pub seed: u64,
    /// Of the receiver's noise and the oscillator's alone, so that one truth can be recorded twice; absent: `seed`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_seed: Option<u64>,
    /// Another draw of the mesh's error and of the receiver's noise, everything else the same: the motion as another
    /// equally wrong mesh has it. The receiver's gain follows the recording; a site keeps that of its first sequence.
    #[serde(skip_serializing_if = "is_zero")]
    pub redraw: u64,
    /// Overrides the radar's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    pub interpolation: Interpolation,
    /// Honest error of the body model, root mean square.
    pub mesh_error_m: f64,
    /// Effect: power gain cos^q of every antenna; `effects.antenna_pattern` says the same.
    pub antenna_exponent: f64,
    /// Without it nobody is in the room.
    pub empty: bool,
    pub radar: RadarChoice,
    pub room: Room,
    pub person: ActorConfig,
    pub surface: SurfaceConfig,
    pub skin: Material,
    pub walls: WallsConfig,
    /// Effect.
    pub furniture: Vec<Reflector>,
    pub receiver: ReceiverConfig,
    pub effects: EffectsConfig,
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

impl Default for RecorderConfig {
    fn default() -> Self {
        Self {
            seed: 0,
            noise_seed: None,
            redraw: 0,
            frames: None,
            interpolation: Interpolation::default(),
            mesh_error_m: 0.0,
            antenna_exponent: 0.0,
            empty: false,
            radar: RadarChoice::Preset("small".into()),
            room: Room {
                left_m: Some(1.9),
                right_m: Some(2.4),
                front_m: Some(5.6),
                back_m: Some(0.6),
                floor_m: Some(1.0),
                ceiling_m: Some(1.7),
            },
            person: ActorConfig::default(),
            surface: SurfaceConfig::default(),
            skin: Material::SKIN,
            walls: WallsConfig::default(),
            furniture: vec![],
            receiver: ReceiverConfig::default(),
            effects: EffectsConfig::default(),
        }
    }
}

impl RecorderConfig {
    /// The world of these settings; `folder` is what relative paths start from.
    pub fn world(&self, folder: &Path) -> Result<World> {
        let mut radar = self.radar.radar()?;
        radar.frames = self.frames.unwrap_or(radar.frames);
        radar.check("radar")?;
        let person =
            if self.empty { None } else { Some(self.person.person(folder, &radar, &self.room, &Clock::new(&self.effects))?) };
        let world = World {
            radar,
            room: self.room.clone(),
            person,
            interpolation: self.interpolation,
            surface: self.surface,
            skin: self.skin,
            mesh_error_m: self.mesh_error_m,
            walls: self.walls.clone(),
            furniture: self.furniture.clone(),
            antenna_exponent: self.antenna_exponent,
            receiver: self.receiver,
            effects: self.effects.clone(),
            seed: self.seed,
            noise_seed: self.noise_seed,
            redraw: self.redraw,
            other_skin: 0,
        };
        world.check()?;
        Ok(world)
    }

    /// What is assumed of the motion file, a line each; empty without one.
    pub fn motion_notes(&self, folder: &Path) -> Result<Vec<String>> {
        match &self.person.motion {
            Some(path) if !self.empty => Ok(self.person.read(&folder.join(path), &self.person.model(folder)?)?.1),
            _ => Ok(Vec::new()),
        }
    }

    /// Name of what is done, for the recording's labels.
    pub fn action(&self) -> Option<&str> {
        (!self.empty && self.person.motion.is_none()).then(|| self.person.action.name())
    }

    /// Name of who does it.
    pub fn subject(&self) -> Option<&str> {
        (!self.empty && self.person.body.is_none()).then_some(self.person.subject.as_str())
    }
}

impl ActorConfig {
    fn person(&self, folder: &Path, radar: &Radar, room: &Room, clock: &Clock) -> Result<Person> {
        let (first_s, last_s) = clock.motion_span_s(radar);
        let model = self.model(folder)?;
        let placement = self.placement.clone().unwrap_or_else(|| {
            // Without a floor the radar is on a table.
            Placement { start_s: first_s, ..actions::placement(room.floor_m.unwrap_or(1.0), self.distance_m) }
        });
        let motion: Motion = match &self.motion {
            Some(path) => self.read(&folder.join(path), &model)?.0,
            None => {
                let duration_s = (last_s - placement.start_s).max(1.0 / self.rate_hz);
                // All of the body's parameters are written, so that no reader has to guess the rest.
                let mut betas = self.betas.clone();
                betas.resize(betas.len().max(model.shape_directions.len()), 0.0);
                actions::motion(self.action, &self.style, &model, &betas, duration_s, self.rate_hz)?
            }
        };
        Ok(Person::Skinned { model, motion, placement })
    }
}

impl ActorConfig {
    /// The motion file, and what was assumed of it. With a `placement`, that says how the file's axes lie; without, the
    /// person is made to stand.
    fn read(&self, path: &Path, model: &BodyModel) -> Result<(Motion, Vec<String>)> {
        match self.placement {
            Some(_) => read_motion(path, model.parents.len(), model.shape_directions.len()),
            None => read_motion_upright(path, model, &MotionOptions::default()),
        }
    }

    fn model(&self, folder: &Path) -> Result<BodyModel> {
        match &self.body {
            Some(path) => read_body(folder.join(path)),
            None => embedded(&self.subject),
        }
    }
}

/// An embedded subject, generated once per process: a site asks for the same few again and again.
fn embedded(subject: &str) -> Result<BodyModel> {
    static MADE: Mutex<BTreeMap<String, BodyModel>> = Mutex::new(BTreeMap::new());
    let config = procedural::subject(subject)?;
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(model) = made.get(subject) {
        return Ok(model.clone());
    }
    let model = procedural::person(&config)?;
    made.insert(subject.into(), model.clone());
    Ok(model)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::settings::read_text;

    #[test]
    fn the_default_settings_survive_a_round_trip_and_describe_a_world() {
        let config = RecorderConfig::default();
        let text = toml::to_string(&config).unwrap();
        assert_eq!(read_text::<RecorderConfig>(&text).unwrap(), config);
        let world = RecorderConfig { frames: Some(2), ..config }.world(Path::new(".")).unwrap();
        assert_eq!(world.radar.frames, 2);
        assert!(world.image_walls().is_empty() && world.furniture.is_empty());
    }

    #[test]
    fn a_radar_is_a_name_or_a_table_and_mistakes_are_named() {
        let named: RecorderConfig = read_text("radar = \"mmmesh\"").unwrap();
        assert_eq!(named.radar.radar().unwrap().samples_per_chirp, 256);
        let unknown = RadarChoice::Preset("bmmesh".into()).radar().unwrap_err().to_string();
        assert!(unknown.contains("`mmmesh`"), "{unknown}");
        let table =
            toml::to_string(&RecorderConfig { radar: RadarChoice::Full(Box::new(Radar::small(3))), ..RecorderConfig::default() });
        assert_eq!(read_text::<RecorderConfig>(&table.unwrap()).unwrap().radar.radar().unwrap().frames, 3);
        let message = read_text::<RecorderConfig>("[radar]\nslope = 1.0").unwrap_err().to_string();
        assert!(message.contains("unknown field `slope`"), "{message}");
    }

    #[test]
    fn a_wall_that_the_room_lacks_cannot_mirror() {
        let mut config = RecorderConfig { empty: true, ..RecorderConfig::default() };
        config.room.left_m = None;
        config.walls.image_walls = vec![crate::room::Boundary::Left];
        let error = config.world(Path::new(".")).unwrap_err();
        assert!(error.to_string().contains("walls.image_walls") && error.hint().unwrap().contains("room.left_m"));
    }
}
