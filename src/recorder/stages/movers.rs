//! Single points that move on their own, and the radar's own vibration.

use super::clock::Clock;
use crate::error::Result;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::body::MovingBody;
use crate::recorder::chirp::Chirp;
use crate::recorder::signal::{Place, Signal};
use crate::recorder::sinusoid::SinusoidalMotion;
use crate::recorder::vector::{Vector, add, add_scaled, distance, dot, length, scale, subtract};
use crate::recorder::world::World;

/// `radar_vibration`.
pub fn vibration(world: &World) -> Option<SinusoidalMotion> {
    world.effects.radar_vibration.as_ref().map(|effect| effect.motion(&world.draws()))
}

/// A point reflector with its own motion.
#[derive(Clone, Debug)]
pub struct Mover {
    place: Track,
    /// At 1 m from both antennas.
    amplitude: f64,
}

#[derive(Clone, Debug)]
enum Track {
    Oscillating {
        rest_m: Vector,
        motion: SinusoidalMotion,
    },
    /// Weights of the vertices, `[(vertex, weight)]`.
    Carried(Vec<(usize, f64)>),
}

/// `moving_reflector`, `range_alias` and `carried_reflector`. `level` is what their amplitudes are relative to.
pub fn movers(world: &World, body: Option<&MovingBody>, level: f64) -> Result<Vec<Mover>> {
    let (effects, draws) = (&world.effects, world.draws());
    let centre = world.radar.centre_m();
    let at = |rest_m: Vector, motion: SinusoidalMotion, amplitude: f64| Mover {
        place: Track::Oscillating { rest_m, motion },
        amplitude: amplitude * level * distance(rest_m, centre).powi(2),
    };
    let mut all: Vec<Mover> = vec![];
    for (index, moving) in effects.moving_reflector.iter().enumerate() {
        all.push(at(moving.position_m, moving.motion(&draws, index), moving.amplitude));
    }
    if let Some(alias) = &effects.range_alias {
        let (rest_m, motion) = alias.track(centre, &draws);
        all.push(at(rest_m, motion, alias.amplitude));
    }
    if let (Some(carried), Some(person), Some(body)) = (&effects.carried_reflector, &world.person, body) {
        let place = Track::Carried(carried.vertices(person)?);
        let clock = Clock::new(effects);
        let start = weighted(&place, body, clock.motion_s(clock.ramp_s(&world.radar, 0, 0, 0)))?;
        all.push(Mover { place, amplitude: carried.amplitude * level * distance(start, centre).powi(2) });
    }
    Ok(all)
}

fn weighted(place: &Track, body: &MovingBody, motion_s: f64) -> Result<Vector> {
    let Track::Carried(share) = place else { return Ok([0.0; 3]) };
    let mut sum = [0.0; 3];
    for (pose, weight) in body.weights(motion_s)? {
        let vertices = body.pose(pose);
        for &(vertex, part) in share {
            sum = add_scaled(sum, vertices[vertex], weight * part);
        }
    }
    Ok(sum)
}

/// What the movers need to know of the recording.
pub struct Stage<'a> {
    pub radar: &'a Radar,
    pub chirp: &'a Chirp,
    pub clock: &'a Clock,
    pub body: Option<&'a MovingBody>,
    pub vibration: Option<&'a SinusoidalMotion>,
}

impl Mover {
    /// Adds the point's return to every chirp of a frame, exactly but for its acceleration within a chirp.
    pub fn add(&self, stage: &Stage, signal: &mut Signal) -> Result<()> {
        let frame = signal.frame;
        // A carried point is followed by a straight line through the frame's ends and its middle.
        let times = [0, signal.loops / 2, signal.loops.saturating_sub(1)]
            .map(|index| stage.clock.ramp_s(stage.radar, frame, 0, index) + stage.chirp.middle_s);
        let nodes = match (&self.place, stage.body) {
            (Track::Carried(_), Some(body)) => {
                let mut nodes = vec![];
                for time in times {
                    nodes.push((time, weighted(&self.place, body, stage.clock.motion_s(time))?));
                }
                nodes.dedup_by(|a, b| a.0 == b.0);
                nodes
            }
            _ => vec![],
        };
        for (Place { tx, rx, index }, chirp) in signal.chirps_mut() {
            let time_s = stage.clock.ramp_s(stage.radar, frame, tx, index) + stage.chirp.middle_s;
            let (position, velocity) = match &self.place {
                Track::Oscillating { rest_m, motion } => (add(*rest_m, motion.position(time_s)), motion.velocity(time_s)),
                Track::Carried(_) => along(&nodes, time_s),
            };
            let shake = stage.vibration.map_or([0.0; 3], |motion| motion.position(time_s));
            let leg = |antenna: Vector| {
                let away = subtract(position, add(antenna, shake));
                let range = length(away).max(1e-6);
                (range, dot(away, velocity) / range)
            };
            let (out, out_rate) = leg(stage.radar.tx_position_m(tx));
            let (back, back_rate) = leg(stage.radar.rx_position_m(rx));
            let (delay, rate) = ((out + back) / SPEED_OF_LIGHT, (out_rate + back_rate) / SPEED_OF_LIGHT);
            stage.chirp.add_moving(chirp, (self.amplitude / (out * back)).into(), delay, rate);
        }
        Ok(())
    }
}

/// Position and velocity by a polynomial through the nodes.
fn along(nodes: &[(f64, Vector)], time_s: f64) -> (Vector, Vector) {
    let value = |time: f64| {
        nodes.iter().fold([0.0; 3], |sum, &(own, point)| {
            let share: f64 =
                nodes.iter().filter(|(other, _)| *other != own).map(|(other, _)| (time - other) / (own - other)).product();
            add_scaled(sum, point, share)
        })
    };
    const STEP: f64 = 1e-6;
    let velocity = scale(subtract(value(time_s + STEP), value(time_s - STEP)), 0.5 / STEP);
    (value(time_s), velocity)
}
