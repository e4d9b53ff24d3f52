//! From a site's settings to the settings of each of its sequences.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::config::SiteConfig;
use crate::data::Shard;
use crate::error::{Error, Result};
use crate::person::Placement;
use crate::person::actions::{self, Action, StyleConfig};
use crate::plausibility::{Facts, Finding, findings};
use crate::recorder::{Recorder, RecorderConfig, World, body::MovingBody};
use crate::room::Boundary;

/// How far soles may be below the floor: a procedural foot rolls over its ball.
const SOLE_M: f64 = 0.06;
/// Least horizontal distance between the radar and the body.
const NEAREST_M: f64 = 0.3;
/// Poses per second at which a motion is held against the room.
const CHECKED_HZ: f64 = 15.0;

/// One recording of a site.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// `<subject>_<action>_<repetition>`, the folder's name.
    pub name: String,
    pub subject: String,
    pub action: Action,
    /// From 1.
    pub repetition: usize,
    pub recorder: RecorderConfig,
}

/// All sequences of a site in a fixed order, subject by subject. Equal settings give equal sequences.
///
/// Everything that can be refused is refused here: settings, a person who leaves the room, a radar that cannot be.
/// `settings_folder`: what relative paths start from. Gain and noise are settled on the first sequence and hold for all.
///
/// # Errors
/// Settings that cannot be a site, a body that comes nearer to a boundary than `margin_m`, what the recorder refuses.
pub fn sequences(config: &SiteConfig, settings_folder: &Path) -> Result<Vec<Sequence>> {
    sequences_for(config, settings_folder, Shard::ALL)
}

/// The same, where only those of a shard are held against the room.
pub(super) fn sequences_for(config: &SiteConfig, settings_folder: &Path, shard: Shard) -> Result<Vec<Sequence>> {
    let mut all = drawn(config)?;
    all.par_iter().enumerate().filter(|(index, _)| shard.holds(*index)).try_for_each(|(_, sequence)| {
        let world = sequence.recorder.world(settings_folder)?;
        stays_inside(&world, config.margin_m, &sequence.name)
    })?;
    if config.record.receiver.level.is_none() {
        // Another draw of the mesh is recorded by the same receiver.
        let first = RecorderConfig { redraw: 0, ..all[0].recorder.clone() };
        let level = Recorder::new(&first.world(settings_folder)?)?.level();
        all.iter_mut().for_each(|sequence| sequence.recorder.receiver.level = Some(level));
    }
    Ok(all)
}

/// What is implausible about each sequence of a shard, by its name; nothing is recorded for it.
///
/// # Errors
/// Settings that cannot be a site, what the recorder refuses.
pub fn implausible(
    config: &SiteConfig,
    settings_folder: &Path,
    as_stated: bool,
    shard: Shard,
) -> Result<Vec<(String, Vec<Finding>)>> {
    let look = |sequence: &Sequence| -> Result<(String, Vec<Finding>)> {
        let world = sequence.recorder.world(settings_folder)?;
        let body = world.person.as_ref().map(|person| MovingBody::new(person, world.interpolation)).transpose()?;
        let pose = |pose| body.as_ref().map_or_else(Vec::new, |body| body.pose(pose));
        let facts = Facts { as_stated, ..Facts::new(Some(&world.radar), Some(&world.room), world.person.as_ref(), &pose) };
        Ok((sequence.name.clone(), findings(&facts)))
    };
    let drawn = drawn(config)?;
    drawn.par_iter().enumerate().filter(|(index, _)| shard.holds(*index)).map(|(_, sequence)| look(sequence)).collect()
}

/// All sequences as they are drawn, not looked at yet, and without the receiver's level.
///
/// # Errors
/// Settings that cannot be a site.
pub fn drawn(config: &SiteConfig) -> Result<Vec<Sequence>> {
    config.check()?;
    let mut all = Vec::new();
    for subject in &config.subjects {
        for &action in &config.actions {
            all.extend((1..=config.repetitions).map(|repetition| sequence(config, subject, action, repetition)));
        }
    }
    Ok(all)
}

fn sequence(config: &SiteConfig, subject: &str, action: Action, repetition: usize) -> Sequence {
    let name = format!("{subject}_{}_{repetition}", action.name());
    let seed = |purpose: &str| derived_seed(config.seed, &format!("{name}/{purpose}"));
    let mut random = ChaCha8Rng::seed_from_u64(seed("style"));
    let mut draw = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
    let ranges = &config.style;
    let mut recorder = config.record.clone();
    // What belongs to the room, the board and the subject's surface is the same in all sequences.
    recorder.seed = config.seed;
    recorder.noise_seed = Some(seed("noise"));
    let person = &mut recorder.person;
    (person.subject, person.action) = (subject.into(), action);
    person.style = StyleConfig {
        tempo: draw(ranges.tempo),
        amplitude: draw(ranges.amplitude),
        path_scale: draw(ranges.path_scale),
        variation: draw(ranges.variation),
        seed: seed("motion"),
        backward: ranges.backward,
    };
    person.distance_m = draw(ranges.distance_m);
    let upright = actions::placement(recorder.room.floor_m.unwrap_or(1.0), person.distance_m);
    let [_, ahead, up] = upright.origin_m;
    let turned = upright.turned(draw(ranges.turn_deg));
    let origin_m = [draw(ranges.sideways_m), ahead, up];
    person.placement = Some(Placement { origin_m, start_s: -draw(ranges.begun_s), ..turned });
    Sequence { name, subject: subject.into(), action, repetition, recorder }
}

/// Settings of the same truth with independent noise.
pub(super) fn again(config: &SiteConfig, sequence: &Sequence) -> RecorderConfig {
    let noise_seed = Some(derived_seed(config.seed, &format!("{}/noise again", sequence.name)));
    RecorderConfig { noise_seed, ..sequence.recorder.clone() }
}

/// 48 bits of a hash, so that TOML holds them and people can read them.
fn derived_seed(seed: u64, purpose: &str) -> u64 {
    let digest = Sha256::digest(format!("{seed}/{purpose}"));
    digest.iter().take(6).fold(0, |sum, &byte| (sum << 8) | u64::from(byte))
}

/// Refuses a body that is not wholly in the room at all times.
fn stays_inside(world: &World, margin_m: f64, name: &str) -> Result<()> {
    let Some(person) = &world.person else { return Ok(()) };
    let body = MovingBody::new(person, world.interpolation)?;
    let times = person.pose_times_s();
    let rate_hz = (times.len() - 1) as f64 / (times[times.len() - 1] - times[0]);
    let stride = ((rate_hz / CHECKED_HZ).floor() as usize).max(1);
    for (pose, time_s) in times.iter().enumerate().filter(|(pose, time)| pose % stride == 0 && **time >= 0.0) {
        for vertex in body.pose(pose) {
            let outside = |boundary: &Boundary| {
                let (axis, sign) = boundary.axis();
                let margin = if *boundary == Boundary::Floor { -SOLE_M } else { margin_m };
                world.room.distance_m(*boundary).is_some_and(|distance| sign * vertex[axis] > distance - margin)
            };
            let place = || format!("at [{:.2}, {:.2}, {:.2}] m after {time_s:.2} s", vertex[0], vertex[1], vertex[2]);
            if let Some(boundary) = Boundary::ALL.iter().find(|boundary| outside(boundary)) {
                let distance = world.room.distance_m(*boundary).unwrap_or_default();
                let expected = format!("everybody within the room, whose {} boundary is {distance} m away", boundary.name());
                return Err(Error::setting(format!("style of {name}"), format!("a person {}", place()), expected)
                    .with_hint("narrow style.path_scale, style.distance_m or style.sideways_m, or give a larger room"));
            }
            if vertex[0].hypot(vertex[1]) < NEAREST_M {
                let expected = format!("nobody nearer to the radar than {NEAREST_M} m");
                return Err(Error::setting(format!("style of {name}"), format!("a person {}", place()), expected)
                    .with_hint("raise style.distance_m or lower style.path_scale"));
            }
        }
    }
    Ok(())
}
