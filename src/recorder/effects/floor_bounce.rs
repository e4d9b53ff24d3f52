//! Two-ray propagation over the floor.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::room::Boundary;

settings! {
    /// Two-ray propagation over the floor, both legs.
    FloorBounce { coefficient: f64 [-1.0, 1.0] }
}

impl Effect for FloorBounce {
    const OF_PERSON: bool = true;

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        if context.effects.wall_ghost.iter().any(|ghost| ghost.boundary == Boundary::Floor) {
            return Err(Error::setting(key, "on", "off where a wall_ghost has the floor"));
        }
        context.check_boundary(key, Boundary::Floor)
    }
}
