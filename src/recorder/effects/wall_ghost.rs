//! A wall that mirrors the body.

use super::context::Context;
use super::effect::Effect;
use super::settings::{first_order, settings};
use crate::error::{Error, Result};
use crate::room::Boundary;

settings! {
    /// A wall that mirrors the body; its reflection coefficient.
    WallGhost { boundary: Boundary, coefficient: f64 [-1.0, 1.0], #[serde(default = "first_order")] order: usize [1.0, 2.0] }
}

impl Effect for WallGhost {
    const OF_PERSON: bool = true;

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let key = format!("{key}.boundary");
        if context.effects.wall_ghost[..context.index].iter().any(|other| other.boundary == self.boundary) {
            return Err(Error::setting(key, self.boundary.name(), "each boundary once"));
        }
        context.check_boundary(&key, self.boundary)
    }
}
