//! Everything that a recording is made of, each part switched separately.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::draws::{Draw, Draws};
use super::effects::{Context, EffectsConfig};
use super::material::Material;
use super::receiver::ReceiverConfig;
use super::surface::SurfaceConfig;
use super::timeline::Interpolation;
use crate::error::Result;
use crate::person::Person;
use crate::radar::Radar;
use crate::room::{Boundary, Room};

/// The walls of the room. Clutter and specular returns are static and part of the baseline; images are an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WallsConfig {
    /// Rough patches that send some of the wave straight back.
    pub clutter: bool,
    /// Backscattering cross-section of a wall per area and per cosine of incidence (γ).
    pub clutter_gamma: f64,
    /// Distance between patches.
    pub patch_m: f64,
    /// How far a wall reaches where no other boundary ends it.
    pub open_m: f64,
    /// The mirror image of the radar itself, at perpendicular incidence.
    pub specular: bool,
    pub material: Material,
    /// Effect: up to how many mirror reflections a wave makes between the antennas and the body, 0 to 2.
    pub images: usize,
    /// Which walls mirror; empty: all.
    pub image_walls: Vec<Boundary>,
    /// Of each mirror reflection; absent: Fresnel's for `material` and its roughness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_coefficient: Option<f64>,
}

impl Default for WallsConfig {
    fn default() -> Self {
        Self {
            clutter: true,
            clutter_gamma: 0.03,
            patch_m: 0.06,
            open_m: 4.0,
            specular: true,
            material: Material::PLASTERBOARD,
            images: 0,
            image_walls: vec![],
            image_coefficient: None,
        }
    }
}

/// Effect: a thing that stands in the room.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reflector {
    /// Radar frame.
    pub position_m: [f64; 3],
    /// Radar cross-section.
    pub rcs_m2: f64,
}

/// What is recorded. `World::empty` has nothing in it; `Default` is the baseline of docs/diagnosis.md without a person.
#[derive(Clone, Debug)]
pub struct World {
    pub radar: Radar,
    pub room: Room,
    pub person: Option<Person>,
    pub interpolation: Interpolation,
    pub surface: SurfaceConfig,
    pub skin: Material,
    /// Root mean square distance between the recorded surface and the one that is handed out.
    pub mesh_error_m: f64,
    pub walls: WallsConfig,
    pub furniture: Vec<Reflector>,
    /// Effect: power gain cos^q of every antenna.
    pub antenna_exponent: f64,
    pub receiver: ReceiverConfig,
    pub effects: EffectsConfig,
    pub seed: u64,
    /// Of the receiver's noise and the oscillator's alone; absent: `seed`.
    pub noise_seed: Option<u64>,
    /// Another draw of the mesh's error and of the receiver's noise, everything else the same; 0: the one of the seed.
    pub redraw: u64,
    /// Another draw of what the body's surface returns where, everything else the same.
    pub other_skin: u64,
}

impl Default for World {
    fn default() -> Self {
        Self {
            radar: Radar::small(1),
            room: Room::default(),
            person: None,
            interpolation: Interpolation::default(),
            surface: SurfaceConfig::default(),
            skin: Material::SKIN,
            mesh_error_m: 0.0,
            walls: WallsConfig::default(),
            furniture: vec![],
            antenna_exponent: 0.0,
            receiver: ReceiverConfig::default(),
            effects: EffectsConfig::default(),
            seed: 0,
            noise_seed: None,
            redraw: 0,
            other_skin: 0,
        }
    }
}

impl World {
    /// Isotropic antennas in empty space, a perfectly uniform body, an ideal receiver.
    pub fn empty() -> Self {
        Self {
            surface: SurfaceConfig { variation_db: 0.0, ..SurfaceConfig::default() },
            skin: Material { roughness_m: 0.0, ..Material::SKIN },
            walls: WallsConfig { clutter: false, specular: false, ..WallsConfig::default() },
            receiver: ReceiverConfig::ideal(),
            ..Self::default()
        }
    }

    /// Walls that mirror the body.
    pub fn image_walls(&self) -> Vec<Boundary> {
        if self.walls.images == 0 {
            return vec![];
        }
        let chosen = |wall: &Boundary| self.walls.image_walls.is_empty() || self.walls.image_walls.contains(wall);
        self.room.boundaries().into_iter().filter(chosen).collect()
    }

    /// The seeds that all of the world's random numbers come from.
    pub fn draws(&self) -> Draws {
        Draws { seed: self.seed, noise_seed: self.noise_seed, redraw: self.redraw, other_skin: self.other_skin }
    }

    /// The random numbers of one purpose.
    pub fn random(&self, draw: Draw) -> ChaCha8Rng {
        self.draws().random(draw)
    }

    /// What the effects meet.
    pub fn context(&self) -> Context<'_> {
        Context {
            radar: &self.radar,
            room: &self.room,
            person: self.person.as_ref(),
            receiver: &self.receiver,
            draws: self.draws(),
            effects: &self.effects,
            index: 0,
        }
    }

    /// Refuses a radar that cannot be recorded with.
    pub fn check_radar(&self) -> Result<()> {
        self.radar.check("radar")?;
        self.radar.refuse_falling("radar", "the recorder makes no falling ones")
    }
}
