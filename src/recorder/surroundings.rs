//! Static clutter, still or nearly so: rough walls, the walls' mirror image of the radar, furniture.
//!
//! All of it is summed once per recording. Where it moves by less than a wavelength, a few sums at chosen displacements
//! are interpolated.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::amplitude::Laws;
use super::chirp::Chirp;
use super::draws::Draw;
use super::effects::{Outside, Shadow};
use super::mirror::Mirror;
use super::signal::Signal;
use super::sinusoid::SinusoidalMotion;
use super::stages::{Clock, vibration};
use super::vector::{Vector, add, distance, dot, scale, subtract, unit};
use super::world::World;
use crate::error::{Error, Result};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Boundary;

/// A point whose return has this amplitude at 1 m from both antennas.
#[derive(Clone, Copy, Debug)]
struct Echo {
    position_m: Vector,
    amplitude: Complex64,
}

/// Displacements, in parts of the largest, at which the signal of a moving part is summed.
const NODES: [f64; 5] = [-1.0, -0.6, 0.0, 0.6, 1.0];

/// Everything static, ready for any chirp.
pub struct Surroundings {
    radar: Radar,
    chirp: Chirp,
    laws: Laws,
    echoes: Vec<Echo>,
    /// The transmitter seen in every wall, with the wall's reflection at that incidence.
    mirrors: Vec<Mirror>,
    wall: super::material::Material,
    /// `[tx, rx, sample]`
    still: Vec<Complex64>,
    varying: Vec<Varying>,
}

/// A part that changes from chirp to chirp, as sums `[tx, rx, sample]` with a weight for every time.
enum Varying {
    /// One sum per displacement of [`NODES`].
    Moving {
        motion: SinusoidalMotion,
        sums: Vec<Vec<Complex64>>,
    },
    Modulated {
        rate_hz: f64,
        phase_rad: f64,
        depth: f64,
        sum: Vec<Complex64>,
    },
}

impl Surroundings {
    /// `radar` is the true one with its guard samples; `points` stand in the room besides.
    pub fn new(world: &World, radar: &Radar, laws: &Laws, points: &[(Vector, Complex64)]) -> Result<Self> {
        let wavelength = world.radar.wavelength_m();
        // The radar equation for isotropic antennas.
        let from_rcs = |rcs_m2: f64| wavelength * rcs_m2.sqrt() / (4.0 * PI).powf(1.5);
        let mut echoes: Vec<Echo> = if world.walls.clutter { clutter(world, from_rcs) } else { vec![] };
        let things = world.furniture.iter().map(|thing| (thing.position_m, from_rcs(thing.rcs_m2).into()));
        echoes.extend(things.chain(points.iter().copied()).map(|(position_m, amplitude)| Echo { position_m, amplitude }));
        let mirrors = if world.walls.specular {
            Mirror::images(&world.room, &Boundary::ALL, 1).into_iter().filter(|mirror| mirror.order() == 1).collect()
        } else {
            vec![]
        };
        let mut all = Self {
            chirp: Chirp::new(radar),
            radar: radar.clone(),
            laws: *laws,
            echoes,
            mirrors,
            wall: world.walls.material,
            still: vec![],
            varying: vec![],
        };
        all.still = all.sum(|_| 1.0, |_| 1.0, [0.0; 3], [0.0; 3]);
        all.set_varying(world)?;
        Ok(all)
    }

    /// `[tx, rx, sample]` while nothing moves.
    pub fn still(&self) -> &[Complex64] {
        &self.still
    }

    /// `radar_vibration`, and the effects outside the library that act on the static clutter.
    fn set_varying(&mut self, world: &World) -> Result<()> {
        if let Some(motion) = vibration(world) {
            let sums =
                NODES.map(|node| difference(self.sum(|_| 1.0, |_| 1.0, scale(motion.amplitude_m, node), [0.0; 3]), &self.still));
            self.varying.push(Varying::Moving { motion, sums: sums.to_vec() });
        }
        for (entry, effect) in world.effects.outside.iter().enumerate() {
            let phase_rad = Outside::phase_rad(&world.draws(), entry);
            match *effect {
                Outside::LampModulation { position_m, radius_m, rate_hz, depth } => {
                    let near = self.near(entry, position_m, radius_m)?;
                    let sum = self.sum(near, |_| 0.0, [0.0; 3], [0.0; 3]);
                    self.varying.push(Varying::Modulated { rate_hz, phase_rad, depth, sum });
                }
                Outside::MovingCurtain { position_m, radius_m, rate_hz, swing_m } => {
                    let near = self.near(entry, position_m, radius_m)?;
                    let motion = SinusoidalMotion { amplitude_m: [0.0, swing_m, 0.0], rate_hz, phase_rad };
                    let rest = self.sum(near, |_| 0.0, [0.0; 3], [0.0; 3]);
                    let at = |node: f64| self.sum(near, |_| 0.0, [0.0; 3], scale(motion.amplitude_m, node));
                    let sums = NODES.map(|node| difference(at(node), &rest)).to_vec();
                    self.varying.push(Varying::Moving { motion, sums });
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn near(&self, entry: usize, position_m: Vector, radius_m: f64) -> Result<impl Fn(&Echo) -> f64 + Copy + Sync + use<>> {
        let near = move |echo: &Echo| if distance(echo.position_m, position_m) <= radius_m { 1.0 } else { 0.0 };
        if self.echoes.iter().all(|echo| near(echo) == 0.0) {
            let key = format!("effects.outside[{entry}].position_m");
            return Err(Error::setting(key, format!("{position_m:?}"), "a place with walls or furniture within radius_m"));
        }
        Ok(near)
    }

    /// `[tx, rx, sample]` of the weighed echoes and mirror images, with the antennas and the echoes displaced.
    fn sum(
        &self,
        weight: impl Fn(&Echo) -> f64 + Sync,
        mirrored: impl Fn(&Mirror) -> f64 + Sync,
        antennas_m: Vector,
        echoes_m: Vector,
    ) -> Vec<Complex64> {
        let radar = &self.radar;
        let weights: Vec<f64> = self.echoes.par_iter().map(&weight).collect();
        let seen: Vec<f64> = self.mirrors.iter().map(&mirrored).collect();
        let channels: Vec<(usize, usize)> =
            (0..radar.tx_m.len()).flat_map(|tx| (0..radar.rx_m.len()).map(move |rx| (tx, rx))).collect();
        let by_channel: Vec<Vec<Complex64>> = channels
            .into_par_iter()
            .map(|(tx, rx)| {
                let (tx_m, rx_m) = (add(radar.tx_position_m(tx), antennas_m), add(radar.rx_position_m(rx), antennas_m));
                let mut signal = vec![Complex64::ZERO; radar.samples_per_chirp];
                for (echo, &weight) in self.echoes.iter().zip(&weights).filter(|(_, weight)| **weight != 0.0) {
                    let position = add(echo.position_m, echoes_m);
                    let (out, back) = (distance(tx_m, position), distance(rx_m, position));
                    let gain = self.laws.antenna_gain(unit(subtract(position, tx_m)))
                        * self.laws.antenna_gain(unit(subtract(position, rx_m)));
                    if gain > 0.0 {
                        let amplitude = echo.amplitude * (weight * gain / (out * back));
                        self.chirp.add_static(&mut signal, amplitude, (out + back) / SPEED_OF_LIGHT);
                    }
                }
                for (mirror, &weight) in self.mirrors.iter().zip(&seen) {
                    self.add_specular(mirror, weight, tx_m, rx_m, &mut signal);
                }
                signal
            })
            .collect();
        by_channel.concat()
    }

    /// The transmitter seen in a wall: one long leg with the wall's reflection, and no cross-section.
    fn add_specular(&self, mirror: &Mirror, weight: f64, tx_m: Vector, rx_m: Vector, signal: &mut [Complex64]) {
        let wavelength = self.radar.wavelength_m();
        let image = mirror.point(tx_m);
        let path = distance(image, rx_m);
        let arriving = unit(subtract(rx_m, image));
        let gain = self.laws.antenna_gain(mirror.direction(arriving)) * self.laws.antenna_gain(arriving.map(|x| -x));
        let cosine = dot(arriving, mirror.walls[0].normal()).abs();
        let reflection = self.wall.reflection(cosine) * self.wall.coherence(TAU / wavelength, 2.0 * cosine);
        let amplitude = reflection * (weight * gain * wavelength / (4.0 * PI * path));
        self.chirp.add_static(signal, amplitude, path / SPEED_OF_LIGHT);
    }

    /// What the body takes away, `[tx, rx, sample]` (`soft_occlusion`), both ways through the same gap.
    pub fn shadowed(&self, shadow: &Shadow) -> Vec<Complex64> {
        let lost = |target: Vector| shadow.visible(target).powi(2) - 1.0;
        let foot = |mirror: &Mirror| {
            let centre = self.radar.centre_m();
            scale(add(centre, mirror.point(centre)), 0.5)
        };
        self.sum(|echo| lost(echo.position_m), |mirror| lost(foot(mirror)), [0.0; 3], [0.0; 3])
    }

    /// Adds the surroundings to every chirp; `shadows` at the frame's start and end are blended between.
    pub fn add(&self, clock: &Clock, shadows: Option<&[Vec<Complex64>; 2]>, signal: &mut Signal) {
        let (frame, receivers, loops, samples) = (signal.frame, signal.rx, signal.loops, signal.samples);
        let mut times: Vec<Vec<(f64, &[Complex64])>> = vec![];
        for tx in 0..signal.tx {
            for index in 0..loops {
                let time_s = clock.ramp_s(&self.radar, frame, tx, index) + self.chirp.middle_s;
                let mut parts: Vec<(f64, &[Complex64])> = vec![(1.0, &self.still)];
                self.varying.iter().for_each(|varying| varying.parts(time_s, &mut parts));
                if let Some([first, last]) = shadows {
                    let share = index as f64 / self.radar.loops_per_frame as f64;
                    parts.extend([(1.0 - share, first.as_slice()), (share, last.as_slice())]);
                }
                times.push(parts);
            }
        }
        for (place, chirp) in signal.chirps_mut() {
            let start = (place.tx * receivers + place.rx) * samples;
            for &(weight, sum) in &times[place.tx * loops + place.index] {
                chirp.iter_mut().zip(&sum[start..start + samples]).for_each(|(value, part)| *value += part * weight);
            }
        }
    }
}

impl Varying {
    fn parts<'a>(&'a self, time_s: f64, parts: &mut Vec<(f64, &'a [Complex64])>) {
        match self {
            Self::Modulated { rate_hz, phase_rad, depth, sum } => {
                parts.push((depth * (TAU * rate_hz * time_s + phase_rad).cos(), sum));
            }
            Self::Moving { motion, sums } => {
                let at = (TAU * motion.rate_hz * time_s + motion.phase_rad).sin();
                for (node, sum) in NODES.iter().zip(sums) {
                    let others = NODES.iter().filter(|other| *other != node);
                    parts.push((others.map(|other| (at - other) / (node - other)).product(), sum));
                }
            }
        }
    }
}

fn difference(mut values: Vec<Complex64>, from: &[Complex64]) -> Vec<Complex64> {
    values.iter_mut().zip(from).for_each(|(value, rest)| *value -= rest);
    values
}

/// Rough patches on all walls: cross-section γ · cosθ · area, with the spread of a Rayleigh field.
fn clutter(world: &World, from_rcs: impl Fn(f64) -> f64) -> Vec<Echo> {
    let mut rng = world.random(Draw::Clutter);
    let centre = world.radar.centre_m();
    let (low, high) = world.room.extent_m(world.walls.open_m);
    let mut echoes = vec![];
    for wall in world.room.boundaries() {
        let (axis, side) = wall.axis();
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = |k: usize| ((high[k] - low[k]) / world.walls.patch_m).ceil().max(1.0) as usize;
        let step = |k: usize| (high[k] - low[k]) / count(k) as f64;
        for row in 0..count(u) {
            for column in 0..count(v) {
                let mut position = [0.0; 3];
                position[axis] = side * world.room.distance_m(wall).unwrap_or(0.0);
                position[u] = low[u] + (row as f64 + rng.random::<f64>()) * step(u);
                position[v] = low[v] + (column as f64 + rng.random::<f64>()) * step(v);
                let speckle: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
                let cosine = dot(unit(subtract(centre, position)), wall.normal()).max(0.0);
                let strength = from_rcs(world.walls.clutter_gamma * cosine * step(u) * step(v)) / 2f64.sqrt();
                echoes.push(Echo { position_m: position, amplitude: Complex64::new(speckle[0], speckle[1]) * strength });
            }
        }
    }
    echoes
}
