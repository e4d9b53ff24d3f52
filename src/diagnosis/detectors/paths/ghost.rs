//! The body seen in a mirror: body and one reflection at a boundary (`wall_ghost`, `floor_bounce`), or two.

use rayon::prelude::*;

use super::scene::Scene;
use crate::diagnosis::power::Template;
use crate::diagnosis::prediction::mirrored_return;
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
    /// The same of cells that move: static clutter that fades is no image of somebody who walks.
    pub gain_moving: f64,
    /// Held-out frames that gain on their own, of those that could.
    pub agreeing: f64,
    pub coefficient: f64,
}

/// One ghost per boundary of the room.
pub fn ghosts(scene: &Scene) -> Vec<Ghost> {
    let Some(room) = &scene.evidence.room else { return vec![] };
    let body = body_ratio(scene).unwrap_or(1.0);
    room.boundaries().into_iter().filter_map(|boundary| ghost(scene, boundary, room.distance_m(boundary)?, body)).collect()
}

/// `body`: its [`body_ratio`].
fn ghost(scene: &Scene, boundary: Boundary, distance_m: f64, body: f64) -> Option<Ghost> {
    let split = &scene.evidence.split;
    let once = templates(scene, boundary, distance_m, false);
    let twice = templates(scene, boundary, distance_m, true);
    // The two ways with one reflection have Γ² of a perfect mirror's power, the one with two has Γ⁴.
    let mut best = (0.0, vec![], 0.0);
    for coefficient in [0.0, 0.2, 0.5, 1.0f64] {
        let ratio = coefficient.powi(2) as f32;
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
        coefficient: (weight / body).sqrt(),
    })
}

/// Energy of the body's direct return over what is expected of it, in training frames. Likelihoods follow cells where the body is weakest:
/// of a mesh that is not the body's, the level can be tens of decibels off. None where nothing is expected.
fn body_ratio(scene: &Scene) -> Option<f64> {
    let model = scene.model;
    let (mut measured, mut expected) = (0.0, 0.0);
    for &frame in &scene.evidence.split.training {
        let cells = model.support(frame).iter().zip(model.usable());
        let powers = scene.map(frame).iter().zip(model.expected(frame)).zip(cells);
        for ((power, mean), _) in powers.filter(|(_, (support, usable))| **support && **usable) {
            measured += f64::from(power - 1.0);
            expected += f64::from(mean - 1.0);
        }
    }
    let ratio = measured / expected;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
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
