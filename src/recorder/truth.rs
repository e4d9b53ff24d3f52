//! `truth.json`: what a recording holds beyond the baseline, and nothing else.

use std::cell::LazyCell;

use serde_json::{Value, json};

use super::stages::Stages;
use super::surface::Returns;
use super::world::World;
use crate::room::Boundary;

/// The effects of a world, in the terms of docs/report.md: nothing but the baseline gives an empty list.
pub fn truth(world: &World, action: Option<&str>) -> Value {
    let mut effects = vec![];
    for wall in world.image_walls() {
        let name = if wall == Boundary::Floor { "floor_bounce" } else { "wall_ghost" };
        effects.push(json!({
            "id": "wall_image",
            "name": name,
            "boundary": wall.name(),
            "coefficient": world.walls.image_coefficient,
            "order": world.walls.images,
        }));
    }
    for thing in &world.furniture {
        effects.push(json!({
            "id": "furniture",
            "name": "static_reflector",
            "position_m": thing.position_m,
            "rcs_m2": thing.rcs_m2,
        }));
    }
    if world.antenna_exponent > 0.0 && world.effects.antenna_pattern.is_none() {
        effects.push(json!({ "id": "antenna_exponent", "name": "antenna_pattern", "exponent": world.antenna_exponent }));
    }
    let stages = LazyCell::new(|| Stages::new(world));
    effects.extend(world.effects.truth(&world.context(), &|frame| stages.chirp_errors(world, frame)));
    json!({
        "action": action,
        "tier": if world.surface.returns == Returns::Random { "B" } else { "A" },
        "frames": world.radar.frames,
        "effects": effects,
        "snr_db": world.receiver.noise.then_some(world.receiver.snr_db),
    })
}
