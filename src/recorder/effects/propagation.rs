//! Detours: walls that mirror the body, the board that sends the scene back into it, and the body's shadow on the room.

use num_complex::Complex64;

use super::EffectsConfig;
use super::resample::Resampler;
use super::signal::Signal;
use crate::error::{Error, Result};
use crate::radar::Radar;
use crate::recorder::vector::{Vector, add_scaled, cross, distance, scale, subtract, unit};
use crate::recorder::visibility::Obstacle;
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

/// The two beams of R6 multiplied: tx → scene → board and board → scene → rx, as fractions of `peak`.
///
/// The dechirp adds delays, but of −πS(τ₁ + τ₂)² the mixed part −2πSτ₁τ₂ is in neither beam; to first order it is a
/// product of derivatives, as each brings down 2πSτ.
pub fn twice_bounced(out: &Signal, back: &Signal, radar: &Radar, resampler: &Resampler, factor: f64) -> Signal {
    let mut product = back.clone();
    for (place, chirp) in product.chirps_mut() {
        let first = out.chirp(super::signal::Place { rx: 0, ..place });
        let second = back.chirp(place);
        let derivative = |signal: &[Complex64], n: usize| {
            const STEP: f64 = 0.1;
            let [before, after] = [-STEP, STEP].map(|step| resampler.at(signal, n as f64 + step));
            (after - before) * (radar.sample_rate_hz / (2.0 * STEP))
        };
        let mixed = Complex64::new(0.0, 1.0 / (std::f64::consts::TAU * radar.slope_hz_per_s));
        for (n, value) in chirp.iter_mut().enumerate() {
            *value = factor * (first[n] * second[n] + mixed * derivative(first, n) * derivative(second, n));
        }
    }
    product
}

/// How much of a ray's first Fresnel zone at the body is free, 0 to 1, for many targets.
pub struct Shadow<'a> {
    obstacle: &'a Obstacle<'a>,
    viewpoint: Vector,
    body_m: f64,
    nearest_m: f64,
    /// Unit vectors of the box around the body: (x/y and z/y) ranges.
    low: [f64; 2],
    high: [f64; 2],
    wavelength_m: f64,
    width: f64,
}

/// Rays through the zone, on a sunflower of equal areas.
const RAYS: usize = 16;

impl<'a> Shadow<'a> {
    pub fn new(obstacle: &'a Obstacle<'a>, vertices: &[Vector], viewpoint: Vector, wavelength_m: f64, width: f64) -> Self {
        let (mut low, mut high, mut sum, mut nearest_m) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0.0, f64::INFINITY);
        for vertex in vertices {
            let [x, y, z] = subtract(*vertex, viewpoint);
            for (side, slope) in [x, z].into_iter().map(|offset| offset / y.max(0.1)).enumerate() {
                low[side] = low[side].min(slope);
                high[side] = high[side].max(slope);
            }
            let range = distance(*vertex, viewpoint);
            sum += range;
            nearest_m = nearest_m.min(range);
        }
        let body_m = sum / vertices.len().max(1) as f64;
        Self { obstacle, viewpoint, body_m, nearest_m, low, high, wavelength_m, width }
    }

    /// Part of the field that reaches `target` past the body.
    pub fn visible(&self, target: Vector) -> f64 {
        let away = subtract(target, self.viewpoint);
        let range = distance(target, self.viewpoint);
        if range <= self.nearest_m || away[1] <= 0.0 {
            return 1.0;
        }
        let beyond = (range - self.body_m).max(0.05);
        let radius = self.width * (self.wavelength_m * self.body_m * beyond / range).sqrt();
        let margin = 2.0 * radius / self.nearest_m.max(0.1);
        let slopes = [away[0] / away[1], away[2] / away[1]];
        if (0..2).any(|side| slopes[side] < self.low[side] - margin || slopes[side] > self.high[side] + margin) {
            return 1.0;
        }
        let ahead = unit(away);
        let right = unit(cross(ahead, [0.0, 0.0, 1.0]));
        let up = cross(right, ahead);
        let free = (0..RAYS)
            .filter(|&ray| {
                let reach = radius * ((ray as f64 + 0.5) / RAYS as f64).sqrt();
                let (sin, cos) = (2.399_963 * ray as f64).sin_cos();
                let through = add_scaled(scale(ahead, self.body_m), right, reach * cos);
                let through = unit(add_scaled(through, up, reach * sin));
                self.obstacle.sees(self.viewpoint, add_scaled(self.viewpoint, through, range))
            })
            .count();
        free as f64 / RAYS as f64
    }
}

pub fn check(world: &World, key: &str) -> Result<()> {
    let effects: &EffectsConfig = &world.effects;
    let mut needed: Vec<(String, Boundary)> = vec![];
    for (index, ghost) in effects.wall_ghost.iter().enumerate() {
        needed.push((format!("{key}.wall_ghost[{index}].boundary"), ghost.boundary));
        if effects.wall_ghost[..index].iter().any(|other| other.boundary == ghost.boundary) {
            let wanted = "each boundary once";
            return Err(Error::setting(format!("{key}.wall_ghost[{index}].boundary"), ghost.boundary.name(), wanted));
        }
    }
    if effects.floor_bounce.is_some() {
        needed.push((format!("{key}.floor_bounce"), Boundary::Floor));
        if effects.wall_ghost.iter().any(|ghost| ghost.boundary == Boundary::Floor) {
            return Err(Error::setting(format!("{key}.floor_bounce"), "on", "off where a wall_ghost has the floor"));
        }
    }
    for (key, wall) in needed {
        if world.room.distance_m(wall).is_none() {
            return Err(Error::setting(key, wall.name(), "a boundary that the room has")
                .with_hint(format!("give room.{}_m", wall.name())));
        }
    }
    match effects.of_person().filter(|_| world.person.is_none()) {
        Some(name) => Err(Error::setting(format!("{key}.{name}"), "on", "off without a person")),
        None => Ok(()),
    }
}
