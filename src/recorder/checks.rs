//! Which worlds can be recorded.

use super::effects::EffectsConfig;
use super::world::World;
use crate::bounds;
use crate::error::{Error, Result};
use crate::person::Person;

impl World {
    /// Refuses what cannot be recorded.
    pub fn check(&self) -> Result<()> {
        self.check_radar()?;
        self.room.check("room")?;
        self.person.as_ref().map_or(Ok(()), Person::check)?;
        self.surface.check("surface")?;
        self.receiver.check("receiver")?;
        self.effects.check(self, "effects")?;
        if self.walls.images > 2 {
            return Err(Error::setting("walls.images", self.walls.images, "0, 1 or 2"));
        }
        for (key, value, least) in [
            ("walls.patch_m", self.walls.patch_m, 1.0e-3),
            ("walls.open_m", self.walls.open_m, 1.0e-3),
            ("walls.clutter_gamma", self.walls.clutter_gamma, 0.0),
            ("mesh_error_m", self.mesh_error_m, 0.0),
            ("antenna_exponent", self.antenna_exponent, 0.0),
        ] {
            if !(value.is_finite() && value >= least) {
                return Err(Error::setting(key, value, format!("a number of at least {least}")));
            }
        }
        let (low, high) = self.room.extent_m(self.walls.open_m);
        let along = |axis: usize| ((high[axis] - low[axis]) / self.walls.patch_m).ceil() as usize;
        let largest = [along(0), along(1), along(2)].into_iter().max().unwrap_or(0);
        bounds::numbers("walls.patch_m", "patches of six walls along their longest side", &[6, largest, largest])?;
        for wall in &self.walls.image_walls {
            if self.room.distance_m(*wall).is_none() {
                return Err(Error::setting("walls.image_walls", wall.name(), "a boundary that the room has")
                    .with_hint(format!("give room.{}_m", wall.name())));
            }
        }
        if let Some(bad) = self
            .furniture
            .iter()
            .find(|thing| !(thing.rcs_m2.is_finite() && thing.rcs_m2 >= 0.0 && thing.position_m.iter().all(|x| x.is_finite())))
        {
            return Err(Error::setting("furniture", format!("{bad:?}"), "a finite position and a cross-section of at least 0"));
        }
        Ok(())
    }
}

impl EffectsConfig {
    /// Refuses what cannot work in this world; `key` names the table in messages.
    pub fn check(&self, world: &World, key: &str) -> Result<()> {
        self.check_in(&world.context(), key)
    }
}
