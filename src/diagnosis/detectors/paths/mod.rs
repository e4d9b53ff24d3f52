//! Returns from where neither the body nor static clutter can be: mirror images, other movers, echoes.

mod background;
mod bank;
mod beams;
mod coloured;
mod echo;
mod factor;
mod ghost;
mod ground;
mod image;
mod mover;
mod oscillation;
pub mod product;
mod removal;
mod returns;
mod scene;
mod sidelobes;
mod sinusoidal;
mod static_point;
mod texture;
mod track;
mod whereabouts;
mod whitened;

#[cfg(test)]
mod tests;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::{Candidate, Evidence};
use crate::effects;

pub use scene::FILTERS;
use scene::Scene;
pub use static_point::body_rms;

/// A ghost must predict at least this share of the held-out frames that show it.
const AGREEING: f64 = 0.6;
/// Least log-likelihood gain on held-out frames that is worth a name, nats.
const LEAST_GAIN: f64 = 6.0;
/// Of a track that follows the law of a thing that moves: faint products of two paths come near it.
const LEAST_GAIN_TRACK: f64 = 12.0;
/// Of a sinusoidal motion that no single frame shows: where the body is not quite where it should be, something near it comes close
/// to one, and faint images do. What is strong among the body's returns, and comes from aside, is neither.
const LEAST_GAIN_SINUSOIDAL: f64 = 8.0;
const STRONG: f64 = 100.0;
/// Of a track that follows no law of motion: the residual of a strong path that was subtracted looks like that.
const LEAST_GAIN_UNNAMED: f64 = 25.0;
/// Of a second path: it must be no residual of the first.
const LEAST_GAIN_SECOND: f64 = 50.0;
/// Share of a track's or an image's gain from which on a product of the signal with itself explains as much.
const NEARLY: f64 = 0.5;
/// Share of a mirror image's gain from which on a copy of the body, phases and all, may be the same thing; and a wall returns no
/// more than this.
const ALIKE: f64 = 0.25;
const STRONGEST_WALL: f64 = 0.75;
/// Kinds of answers that this family may give: every one is a chance to be wrong.
const TRIED: f64 = 6.0;

/// Effects of which there may be several.
pub const MANY: [&str; 3] = [effects::wall_ghost::ID, effects::floor_bounce::ID, effects::moving_reflector::ID];

/// What leaves a residual when it is subtracted that no single frame shows and that moves by a law: other views and replicas of the
/// body, movers, and a receiver in which all these change one another.
pub const LEAVE_RESIDUAL: [&str; 8] = [
    effects::wall_ghost::ID,
    effects::floor_bounce::ID,
    effects::body_multibounce::ID,
    effects::object_radar_object::ID,
    effects::soft_occlusion::ID,
    effects::moving_reflector::ID,
    effects::range_alias::ID,
    effects::compression::ID,
];

/// Mirror images of the body at the room's boundaries, and movers that are none.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = static_point::find(evidence).into_iter().collect();
    if let Some(scene) = Scene::new(evidence) {
        let moving = moving(&scene);
        let elsewhere = moving.iter().any(|found| found.nats > LEAST_GAIN);
        found.extend(moving);
        if !elsewhere {
            let residual = LEAVE_RESIDUAL.iter().any(|id| evidence.accepted.contains(id));
            // Noise that receivers share comes from one direction, as if something were there.
            let shared = evidence.accepted.contains(&effects::correlated_noise::ID);
            let motion = (!residual && !shared).then(|| sinusoidal::strongest(&scene)).flatten();
            let least = |mover: &mover::Mover| {
                let distinct = mover.power > STRONG && mover::aside(&scene, &mover.track.sightings);
                if distinct { LEAST_GAIN } else { LEAST_GAIN_SINUSOIDAL }
            };
            let motion = motion.filter(|motion| motion.mover.gain > least(&motion.mover));
            let over = scene.over_the_body();
            // What single frames show needs no law.
            found.extend(over_the_body(&over).or_else(|| motion.map(|motion| moves_sinusoidally(&motion, &over))));
        }
    }
    let is_accepted = |id: &str| evidence.accepted.contains(&id);
    found.retain(|found| match found.id {
        Some(id) if is_accepted(id) => MANY.contains(&id) && found.nats > LEAST_GAIN_SECOND,
        Some(id) => !MANY.contains(&id) || !MANY.into_iter().any(is_accepted) || found.nats > LEAST_GAIN_UNNAMED,
        None => !MANY.into_iter().any(is_accepted) || found.nats > LEAST_GAIN_SECOND,
    });
    found
}

/// Something far stronger than the body, where the body is.
fn over_the_body(scene: &Scene) -> Option<Candidate> {
    let mover = mover::Mover::new(scene, track::strongest(scene)?)?;
    let found = mover.candidate(scene, TRIED);
    (mover.gain > LEAST_GAIN_UNNAMED).then(|| Candidate { behaves_like: Behaviour::PathLikeOverTheBody, ..found })
}

/// A sinusoidal motion; without a name it is what has no law either.
fn moves_sinusoidally(motion: &sinusoidal::Found, scene: &Scene) -> Candidate {
    let found = motion.candidate(scene, TRIED);
    if found.id.is_some() { found } else { Candidate { behaves_like: Behaviour::PathLikeOverTheBody, ..found } }
}

/// Paths whose lengths change.
fn moving(scene: &Scene) -> Vec<Candidate> {
    let ghosts = ghost::ghosts(scene);
    let boundaries = ghosts.len().max(1) as f64;
    let mover = track::strongest(scene).and_then(|track| mover::Mover::new(scene, track));
    let mover_gain = mover.as_ref().map_or(0.0, |mover| mover.gain);
    let seen = |ghost: &&ghost::Ghost| ghost.gain > LEAST_GAIN && ghost.agreeing >= AGREEING;
    let (images, fading): (Vec<_>, Vec<_>) = ghosts.iter().filter(seen).partition(|ghost| ghost.gain_moving > LEAST_GAIN);
    let best = images.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    // What an image explains best, but only where nothing moves, is neither an image nor something that moves.
    let fades = fading.iter().map(|ghost| ghost.gain).fold(0.0, f64::max);
    let mover = mover.filter(|mover| mover.gain > fades);
    let mut found = vec![];
    match (best, mover) {
        (Some(ghost), _) if ghost.gain > mover_gain => found.push(image::candidate(scene, ghost, &ghosts, TRIED * boundaries)),
        (_, Some(mover)) if mover.gain > if mover.id.is_some() { LEAST_GAIN_TRACK } else { LEAST_GAIN_UNNAMED } => {
            found.push(mover.candidate(scene, TRIED))
        }
        _ => {}
    }
    let product = product::find(scene, TRIED);
    // One number that explains as much as a track or an image does comes first; the others are tested without it.
    if let Some(product) = &product {
        found.retain(|found| product.nats < NEARLY * found.nats);
    }
    let mut multibounce = echo::multibounce(scene, TRIED);
    if let Some(multibounce) = &mut multibounce {
        keep_one(&mut found, multibounce);
    }
    found.extend(multibounce.into_iter().chain(product));
    found
}

/// Of a multibounce and a wall's image that explain the same, the one that is possible; the other becomes its look-alike. A wall behind
/// the radar returns nearly the same of a body before it as the body's own echoes do: a copy that keeps its phases.
fn keep_one(found: &mut Vec<Candidate>, multibounce: &mut Candidate) {
    let alike = |found: &Candidate| found.id == Some(effects::wall_ghost::ID) && multibounce.nats > ALIKE * found.nats;
    let Some(index) = found.iter().position(alike) else { return };
    if found[index].estimates.iter().any(|estimate| estimate.name == "coefficient" && estimate.values[0].abs() > STRONGEST_WALL) {
        found.remove(index);
        multibounce.look_alikes.push(effects::wall_ghost::ID);
    } else {
        found[index].look_alikes.push(effects::body_multibounce::ID);
    }
}
