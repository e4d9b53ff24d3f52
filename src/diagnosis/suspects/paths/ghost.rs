//! The body seen in a mirror: body and one reflection at a boundary (P4, P6), or two (P5).

use rayon::prelude::*;

use super::scene::Scene;
use crate::diagnosis::Point;
use crate::diagnosis::power::{Template, range_and_velocity};
use crate::radar::Radar;
use crate::room::Boundary;

/// A reflection at this boundary, as far as the powers outside the body's own support show it.
pub struct Ghost {
    pub boundary: Boundary,
    /// Power expected of a perfect mirror, by frame, where it is free to look; both orders.
    pub templates: Vec<Template>,
    /// Factor of the templates that the training frames make most likely.
    pub weight: f64,
    /// Of all frames, for the p-value; of the held-out ones.
    pub gain_all: f64,
    pub gain: f64,
    /// The same of cells that move: what stands still and fades is no image of somebody who walks.
    pub gain_moving: f64,
    /// Held-out frames that gain on their own, of those that could.
    pub agreeing: f64,
    pub coefficient: f64,
}

/// Rough skin returns as much to every side as at this cosine.
const ROUGH: f64 = 0.1;

/// One ghost per boundary of the room.
pub fn ghosts(scene: &Scene) -> Vec<Ghost> {
    let Some(room) = &scene.evidence.room else { return vec![] };
    room.boundaries().into_iter().filter_map(|boundary| ghost(scene, boundary, room.distance_m(boundary)?)).collect()
}

fn ghost(scene: &Scene, boundary: Boundary, distance_m: f64) -> Option<Ghost> {
    let split = &scene.evidence.split;
    let once = templates(scene, boundary, distance_m, false);
    let twice = templates(scene, boundary, distance_m, true);
    // Two reciprocal paths of one reflection each have 2 Γ² of the direct power, one of two reflections has Γ⁴.
    let mut best = (0.0, vec![], 0.0);
    for coefficient in [0.0, 0.2, 0.5, 1.0f64] {
        let ratio = (coefficient.powi(2) / 2.0) as f32;
        let both: Vec<Template> = (once.iter().zip(&twice).enumerate())
            .map(|(frame, (once, twice))| {
                let map: Vec<f32> = once.iter().zip(twice).map(|(a, b)| a + ratio * b).collect();
                scene.visible(frame, &map)
            })
            .collect();
        let weight = scene.weight(&split.training, &both);
        let gain = scene.gains(&split.training, &both, weight);
        if gain > best.2 {
            best = (weight, both, gain);
        }
    }
    let (weight, templates, training) = best;
    if weight <= 0.0 {
        return None;
    }
    let held_out: Vec<f64> = split.held_out.iter().map(|&frame| scene.gain(frame, &templates[frame], weight)).collect();
    let seen: Vec<f64> = held_out.iter().copied().filter(|gain| gain.abs() > 1e-3).collect();
    let gain = held_out.iter().sum::<f64>();
    let moving = split.held_out.iter().map(|&frame| scene.gain(frame, &scene.moving(&templates[frame]), weight)).sum();
    Some(Ghost {
        gain_moving: moving,
        boundary,
        templates,
        weight,
        gain_all: training + gain,
        gain,
        agreeing: seen.iter().filter(|gain| **gain > 0.0).count() as f64 / seen.len().max(1) as f64,
        coefficient: (weight / 2.0).sqrt(),
    })
}

/// Power of a mirror that loses nothing, by the weights that the body's parts have in its direct return.
fn templates(scene: &Scene, boundary: Boundary, distance_m: f64, twice: bool) -> Vec<Vec<f32>> {
    let radar = &scene.evidence.radar;
    let frames = scene.evidence.body.as_ref().map_or(&[][..], |body| &body.frames);
    frames
        .par_iter()
        .map(|points| {
            let returns = points.iter().map(|point| {
                let image = mirrored_return(radar, point, boundary, distance_m, twice);
                (image.range_m, image.velocity_mps, image.spread * scene.model.reflectivity(point.part, image.cosine))
            });
            scene.model.template(returns)
        })
        .collect()
}

/// One point of the body, seen by way of a mirror.
pub struct Mirrored {
    /// Half the length of the path.
    pub range_m: f64,
    pub velocity_mps: f64,
    /// Of its area over the ranges' fourth power.
    pub spread: f64,
    /// Between its normal and the middle of the two ways.
    pub cosine: f64,
}

pub fn mirrored_return(radar: &Radar, point: &Point, boundary: Boundary, distance_m: f64, twice: bool) -> Mirrored {
    let (axis, sign) = boundary.axis();
    let mut image = *point;
    image.position_m[axis] = 2.0 * sign * distance_m - point.position_m[axis];
    image.velocity_mps[axis] *= -1.0;
    let (near_m, near_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
    let (far_m, far_mps) = range_and_velocity(radar, image.position_m, image.velocity_mps);
    let (near_m, far_m) = (near_m.max(0.1), far_m.max(0.1));
    let near = way(radar, point.position_m);
    // From the point itself the mirrored way leaves towards the radar's image.
    let mut far = way(radar, image.position_m);
    far[axis] *= -1.0;
    let half: [f64; 3] = if twice { far } else { std::array::from_fn(|i| near[i] + far[i]) };
    let length = half.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
    let cosine = (half.iter().zip(point.normal).map(|(a, b)| a * b).sum::<f64>() / length).max(ROUGH);
    let (range_m, velocity_mps, ranges) = if twice {
        (far_m, far_mps, far_m.powi(4))
    } else {
        (0.5 * (near_m + far_m), 0.5 * (near_mps + far_mps), (near_m * far_m).powi(2))
    };
    Mirrored { range_m, velocity_mps, spread: point.area_m2 / ranges, cosine }
}

/// Unit vector to the radar.
fn way(radar: &Radar, from_m: [f64; 3]) -> [f64; 3] {
    let centre = radar.centre_m();
    let way: [f64; 3] = std::array::from_fn(|axis| centre[axis] - from_m[axis]);
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
    way.map(|x| x / length)
}
