//! The world in which an effect is planted.

use super::EffectsConfig;
use crate::error::{Error, Result};
use crate::person::Person;
use crate::radar::Radar;
use crate::recorder::draws::Draws;
use crate::recorder::receiver::ReceiverConfig;
use crate::room::{Boundary, Room};

/// What an effect may ask of the world that it is planted in.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// As it is stated.
    pub radar: &'a Radar,
    pub room: &'a Room,
    pub person: Option<&'a Person>,
    pub receiver: &'a ReceiverConfig,
    pub draws: Draws,
    /// All effects of the world.
    pub effects: &'a EffectsConfig,
    /// Which of its kind the effect is.
    pub index: usize,
}

impl Context<'_> {
    /// Refuses an effect of a boundary that the room has not; `key` names the effect's settings.
    pub fn check_boundary(&self, key: &str, wall: Boundary) -> Result<()> {
        match self.room.distance_m(wall) {
            Some(_) => Ok(()),
            None => Err(Error::setting(key, wall.name(), "a boundary that the room has")
                .with_hint(format!("give room.{}_m", wall.name()))),
        }
    }

    /// Refuses an effect of the noise where the receiver makes none; `key` names the effect's settings.
    pub fn check_noise(&self, key: &str) -> Result<()> {
        if self.receiver.noise { Ok(()) } else { Err(Error::setting(key, "on", "off without receiver.noise")) }
    }
}
