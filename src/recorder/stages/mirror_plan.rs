//! Detours over walls that mirror the body.

use crate::recorder::world::World;
use crate::room::Boundary;

/// Which walls mirror the body, how often, and how well.
#[derive(Clone, Debug, Default)]
pub struct MirrorPlan {
    pub walls: Vec<Boundary>,
    /// Reflections on one leg.
    pub on_a_leg: usize,
    /// Reflections on both legs together.
    pub together: usize,
    /// Of them in each boundary.
    pub limits: [usize; 6],
    /// Of each boundary, where it is given.
    pub coefficients: [Option<f64>; 6],
}

impl MirrorPlan {
    /// Gathers the walls that mirror the body by the world's settings, its wall ghosts and its floor bounce.
    pub fn new(world: &World) -> Self {
        let mut plan = Self { on_a_leg: world.walls.images, together: world.walls.images, ..Self::default() };
        for wall in world.image_walls() {
            plan.admit(wall, world.walls.images, world.walls.image_coefficient);
        }
        for ghost in &world.effects.wall_ghost {
            plan.admit(ghost.boundary, ghost.order, Some(ghost.coefficient));
        }
        if let Some(bounce) = &world.effects.floor_bounce {
            plan.admit(Boundary::Floor, 2, Some(bounce.coefficient));
        }
        plan
    }

    fn admit(&mut self, wall: Boundary, order: usize, coefficient: Option<f64>) {
        if !self.walls.contains(&wall) {
            self.walls.push(wall);
        }
        self.on_a_leg = self.on_a_leg.max(1);
        self.together = self.together.max(order);
        self.limits[wall as usize] = self.limits[wall as usize].max(order);
        self.coefficients[wall as usize] = coefficient.or(self.coefficients[wall as usize]);
    }
}
