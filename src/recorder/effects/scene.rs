//! Single points that move on their own, and the radar's own vibration.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::signal::{Place, Signal};
use super::timing::Clock;
use super::{EffectsConfig, body::part_weights};
use crate::error::{Error, Result};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::body::MovingBody;
use crate::recorder::chirp::Chirp;
use crate::recorder::vector::{Vector, add, add_scaled, distance, dot, length, scale, subtract};
use crate::recorder::world::World;

/// A sinusoidal motion.
#[derive(Clone, Copy, Debug)]
pub struct SinusoidalMotion {
    pub amplitude_m: Vector,
    pub rate_hz: f64,
    pub phase_rad: f64,
}

impl SinusoidalMotion {
    pub fn position(&self, time_s: f64) -> Vector {
        scale(self.amplitude_m, (TAU * self.rate_hz * time_s + self.phase_rad).sin())
    }

    fn velocity(&self, time_s: f64) -> Vector {
        let rate = TAU * self.rate_hz;
        scale(self.amplitude_m, rate * (rate * time_s + self.phase_rad).cos())
    }
}

/// `radar_vibration`.
pub fn vibration(world: &World) -> Option<SinusoidalMotion> {
    let effect = world.effects.radar_vibration.as_ref()?;
    let phase_rad = world.phase(super::RADAR_VIBRATION, 0);
    Some(SinusoidalMotion { amplitude_m: [0.0, effect.amplitude_m, 0.0], rate_hz: effect.frequency_hz, phase_rad })
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
    let effects = &world.effects;
    let centre = world.radar.centre_m();
    let at = |rest_m: Vector, axis: Vector, swing_m: f64, rate_hz: f64, phase_rad: f64, amplitude: f64| {
        let amplitude_m = scale(axis, swing_m / length(axis).max(1e-300));
        Mover {
            place: Track::Oscillating { rest_m, motion: SinusoidalMotion { amplitude_m, rate_hz, phase_rad } },
            amplitude: amplitude * level * distance(rest_m, centre).powi(2),
        }
    };
    let mut all: Vec<Mover> = vec![];
    for (index, m) in effects.moving_reflector.iter().enumerate() {
        let phase = world.phase(super::MOVING_REFLECTOR, index);
        all.push(at(m.position_m, m.axis, m.swing_m, m.rate_hz, phase, m.amplitude));
    }
    if let Some(alias) = &effects.range_alias {
        let (sin, cos) = alias.azimuth_deg.to_radians().sin_cos();
        let rest = add_scaled(centre, [sin, cos, 0.0], alias.range_m);
        let phase = world.phase(super::RANGE_ALIAS, 0);
        all.push(at(rest, [sin, cos, 0.0], alias.swing_m, alias.rate_hz, phase, alias.amplitude));
    }
    if let (Some(carried), Some(person), Some(body)) = (&effects.carried_reflector, &world.person, body) {
        let weights = part_weights(person, &[&carried.body_part], "effects.carried_reflector.body_part")?;
        let total: f64 = weights.iter().sum();
        let share = weights.iter().enumerate().filter(|(_, w)| **w > 0.0).map(|(vertex, w)| (vertex, w / total));
        let place = Track::Carried(share.collect());
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

/// Points of `static_reflector`, with their amplitude at 1 m.
pub fn static_points(effects: &EffectsConfig, centre: Vector, level: f64) -> Vec<(Vector, Complex64)> {
    let amplitude = |point: &super::StaticReflector| point.amplitude * level * distance(point.position_m, centre).powi(2);
    effects.static_reflector.iter().map(|point| (point.position_m, amplitude(point).into())).collect()
}

pub fn check(world: &World, key: &str) -> Result<()> {
    let effects = &world.effects;
    for (index, mover) in effects.moving_reflector.iter().enumerate() {
        let axis = length(mover.axis);
        if axis == 0.0 && mover.swing_m > 0.0 {
            return Err(Error::setting(format!("{key}.moving_reflector[{index}].axis"), "zero", "a direction"));
        }
    }
    if let Some(alias) = &effects.range_alias
        && alias.range_m <= world.radar.max_range_m()
    {
        let wanted = format!("beyond the unambiguous range, {:.2} metres", world.radar.max_range_m());
        return Err(Error::setting(format!("{key}.range_alias.range_m"), alias.range_m, wanted));
    }
    if let Some(vibration) = &effects.radar_vibration
        && 2.0 * TAU * vibration.amplitude_m / world.radar.wavelength_m() > PI
    {
        let most = 0.25 * world.radar.wavelength_m();
        return Err(Error::setting(
            format!("{key}.radar_vibration.amplitude_m"),
            vibration.amplitude_m,
            format!("at most a quarter of a wavelength, {most:.2e} metres"),
        ));
    }
    Ok(())
}
