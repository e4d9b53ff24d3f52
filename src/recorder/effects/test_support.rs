//! Small worlds for the tests of the effects.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::EffectsConfig;
use crate::person::{BodyModel, JOINT_NAMES, Motion, Person, Placement};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::record::Recorder;
use crate::recorder::test_support::{bare_world, gliding, sphere};
use crate::recorder::world::{Reflector, World};

pub const POINT_M: [f64; 3] = [0.3, 3.0, 0.1];

pub fn radar(frames: usize) -> Radar {
    Radar { samples_per_chirp: 128, loops_per_frame: 16, ..Radar::small(frames) }
}

/// One still point in empty space, seen by an ideal receiver, with these effects.
pub fn point_world(effects: EffectsConfig) -> World {
    World { radar: radar(4), furniture: vec![Reflector { position_m: POINT_M, rcs_m2: 1.0 }], effects, ..World::empty() }
}

/// A ball that recedes at 1 m/s.
pub fn ball_world(effects: EffectsConfig) -> World {
    let radar = Radar { loops_per_frame: 4, ..radar(3) };
    World { effects, ..bare_world(radar, gliding(sphere([0.1, 3.0, 0.0], 0.05, 2), [0.0, 1.0, 0.0])) }
}

/// A ball with the joints of SMPL, all of it `part`, at rest in front of the radar.
pub fn skinned_ball(part: &str) -> Person {
    // SMPL's frame: y up, facing +z.
    let (template, faces) = sphere([0.0, 1.0, 0.0], 0.1, 2);
    let own = JOINT_NAMES.iter().position(|name| *name == part).unwrap();
    let joints = JOINT_NAMES.len();
    let vertices = template.len();
    let model = BodyModel {
        shape_directions: vec![],
        pose_directions: vec![],
        joint_regressor: vec![vec![(0, 1.0)]; joints],
        skinning: vec![vec![(own, 1.0)]; vertices],
        parents: (0..joints).map(|joint| if joint == 0 { None } else { Some(0) }).collect(),
        faces,
        template,
    };
    let motion =
        Motion { poses: vec![vec![[0.0; 3]; joints]; 61], translations: vec![[0.0; 3]; 61], betas: vec![], rate_hz: 60.0 };
    Person::Skinned { model, motion, placement: Placement { origin_m: [0.0, 3.0, -1.0], ..Placement::default() } }
}

pub fn skinned_world(effects: EffectsConfig) -> World {
    let radar = Radar { loops_per_frame: 2, ..radar(4) };
    World { effects, ..bare_world(radar, skinned_ball("spine2")) }
}

/// `[tx, rx, loop, sample]`.
pub fn field(world: &World, frame: usize) -> Vec<Complex64> {
    Recorder::new(world).unwrap().field(frame).unwrap()
}

pub fn peak(world: &World) -> f64 {
    Recorder::new(world).unwrap().peak()
}

/// The first chirp of a receiver.
pub fn chirp<'a>(field: &'a [Complex64], radar: &Radar, rx: usize) -> &'a [Complex64] {
    let start = rx * radar.loops_per_frame * radar.samples_per_chirp;
    &field[start..start + radar.samples_per_chirp]
}

pub fn energy(signal: &[Complex64]) -> f64 {
    signal.iter().map(Complex64::norm_sqr).sum()
}

/// Energy of a − b relative to that of `reference`, decibels.
pub fn difference_db(a: &[Complex64], b: &[Complex64], reference: f64) -> f64 {
    10.0 * (a.iter().zip(b).map(|(x, y)| (x - y).norm_sqr()).sum::<f64>() / reference).log10()
}

/// Energy of a − b.
pub fn change(a: &[Complex64], b: &[Complex64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).norm_sqr()).sum()
}

/// The dechirped path by its definition, in the chirp of `radar`.
pub fn path(radar: &Radar, delay_s: f64) -> Vec<Complex64> {
    let phase = |t: f64| radar.start_frequency_hz * t + 0.5 * radar.slope_hz_per_s * t * t;
    (0..radar.samples_per_chirp)
        .map(|n| radar.sample_time_s(n))
        .map(|t| Complex64::cis(TAU * (phase(t) - phase(t - delay_s)).fract()))
        .collect()
}

pub fn delay(radar: &Radar, position_m: [f64; 3], rx: usize) -> f64 {
    let distance = |antenna: [f64; 3]| (0..3).map(|axis| (position_m[axis] - antenna[axis]).powi(2)).sum::<f64>().sqrt();
    (distance(radar.tx_position_m(0)) + distance(radar.rx_position_m(rx))) / SPEED_OF_LIGHT
}

/// Amplitude of a tone in a signal, by projection.
pub fn tone(signal: &[Complex64], turns_per_sample: f64) -> Complex64 {
    let sum: Complex64 = signal.iter().enumerate().map(|(n, v)| v * Complex64::cis(-TAU * turns_per_sample * n as f64)).sum();
    sum / signal.len() as f64
}

/// What the truth says of the effect that was planted last.
pub fn planted(world: &World) -> serde_json::Value {
    let truth = crate::recorder::truth(world, None);
    truth["effects"].as_array().and_then(|effects| effects.last().cloned()).unwrap()
}
