//! The body's shadow on the room.

use super::effect::Effect;
use super::settings::{settings, unit};
use crate::recorder::vector::{self, Vector, add_scaled, cross, distance, scale, subtract};
use crate::recorder::visibility::Obstacle;

settings! {
    /// The body shadows the room behind it, with the soft edge of the first Fresnel zone.
    SoftOcclusion {
        /// Width of the edge over that of the first Fresnel zone.
        #[serde(default = "unit")] width: f64 [0.05, 10.0],
    }
}

impl Effect for SoftOcclusion {
    const OF_PERSON: bool = true;
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
    /// The shadow of an obstacle with these `vertices` (metres, radar frame) as seen from `viewpoint`; `width` as in the
    /// settings.
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
        let ahead = vector::unit(away);
        let right = vector::unit(cross(ahead, [0.0, 0.0, 1.0]));
        let up = cross(right, ahead);
        let free = (0..RAYS)
            .filter(|&ray| {
                let reach = radius * ((ray as f64 + 0.5) / RAYS as f64).sqrt();
                let (sin, cos) = (2.399_963 * ray as f64).sin_cos();
                let through = add_scaled(scale(ahead, self.body_m), right, reach * cos);
                let through = vector::unit(add_scaled(through, up, reach * sin));
                self.obstacle.sees(self.viewpoint, add_scaled(self.viewpoint, through, range))
            })
            .count();
        free as f64 / RAYS as f64
    }
}
