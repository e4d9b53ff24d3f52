//! What stands still: rough walls, the walls' mirror image of the radar, furniture. Summed once per recording.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::amplitude::Laws;
use super::chirp::Chirp;
use super::mirror::Mirror;
use super::vector::{Vector, distance, dot, subtract, unit};
use super::world::{Draw, World};
use crate::radar::SPEED_OF_LIGHT;
use crate::room::Boundary;

/// A point whose return has this amplitude at 1 m from both antennas.
#[derive(Clone, Copy, Debug)]
struct Echo {
    position_m: Vector,
    amplitude: Complex64,
}

/// The static signal, `[tx, rx, sample]`.
pub fn static_signal(world: &World, laws: &Laws) -> Vec<Complex64> {
    let radar = &world.radar;
    let wavelength = radar.wavelength_m();
    // The radar equation for isotropic antennas.
    let from_rcs = |rcs_m2: f64| wavelength * rcs_m2.sqrt() / (4.0 * PI).powf(1.5);
    let mut echoes: Vec<Echo> = if world.walls.clutter { clutter(world, from_rcs) } else { vec![] };
    echoes.extend(
        world.furniture.iter().map(|thing| Echo { position_m: thing.position_m, amplitude: from_rcs(thing.rcs_m2).into() }),
    );
    let chirp = Chirp::new(radar);
    let channels: Vec<(usize, usize)> =
        (0..radar.tx_m.len()).flat_map(|tx| (0..radar.rx_m.len()).map(move |rx| (tx, rx))).collect();
    let by_channel: Vec<Vec<Complex64>> = channels
        .into_par_iter()
        .map(|(tx, rx)| {
            let (tx_m, rx_m) = (radar.tx_position_m(tx), radar.rx_position_m(rx));
            let mut signal = vec![Complex64::ZERO; radar.samples_per_chirp];
            for echo in &echoes {
                let (out, back) = (distance(tx_m, echo.position_m), distance(rx_m, echo.position_m));
                let gain = laws.antenna_gain(unit(subtract(echo.position_m, tx_m)))
                    * laws.antenna_gain(unit(subtract(echo.position_m, rx_m)));
                if gain > 0.0 {
                    chirp.add_static(&mut signal, echo.amplitude * (gain / (out * back)), (out + back) / SPEED_OF_LIGHT);
                }
            }
            if world.walls.specular {
                add_specular(world, laws, &chirp, tx_m, rx_m, &mut signal);
            }
            signal
        })
        .collect();
    by_channel.concat()
}

/// The transmitter seen in every wall: one long leg with the wall's reflection, and no cross-section.
fn add_specular(world: &World, laws: &Laws, chirp: &Chirp, tx_m: Vector, rx_m: Vector, signal: &mut [Complex64]) {
    let wavelength = world.radar.wavelength_m();
    for mirror in Mirror::images(&world.room, &Boundary::ALL, 1).iter().filter(|mirror| mirror.order() == 1) {
        let image = mirror.point(tx_m);
        let path = distance(image, rx_m);
        let arriving = unit(subtract(rx_m, image));
        let gain = laws.antenna_gain(mirror.direction(arriving)) * laws.antenna_gain(arriving.map(|x| -x));
        let cosine = dot(arriving, mirror.walls[0].normal()).abs();
        let material = world.walls.material;
        let reflection = material.reflection(cosine) * material.coherence(TAU / wavelength, 2.0 * cosine);
        chirp.add_static(signal, reflection * (gain * wavelength / (4.0 * PI * path)), path / SPEED_OF_LIGHT);
    }
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
