//! Which case is what: kinds, effects, strengths and scenes, all from the secret.

use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::config::{ChallengeConfig, Scenes, Stratum};
use super::library::{self, Graded, Surroundings};
use super::rules::DECOYS;
use super::secret::Secret;
use super::structures::{Structure, Who};
use crate::effects;
use crate::error::{Error, Result};
use crate::person::Placement;
use crate::person::actions::{StyleConfig, placement};
use crate::radar::Radar;
use crate::recorder::{ActorConfig, EffectsConfig, RadarChoice, RecorderConfig, SurfaceConfig, WallsConfig};
use crate::room::Room;

/// The motion is under way when the recording starts, in every case: clocks that are wrong find a pose, too.
const MOTION_START_S: f64 = -0.5;

/// One case before it is recorded.
#[derive(Clone)]
pub struct Plan {
    pub index: usize,
    pub stratum: Stratum,
    /// Effects, each with its place between its weakest (0) and its strongest (1).
    pub effects: Vec<(&'static Graded, f64)>,
    /// Effect that the diagnosis is run without.
    pub left_out: Option<&'static str>,
    pub structure: Structure,
    radar: Radar,
    /// The scene without effects.
    pub scene: RecorderConfig,
    distance_m: f64,
    /// Of what the effects draw, the same at every strength.
    details: ChaCha8Rng,
    redrawn: u64,
}

/// All cases of a challenge, in the order of their numbers.
///
/// # Errors
/// As [`ChallengeConfig::kinds`], and where every effect is dealt once, one that none of the structures can have.
pub fn plans(config: &ChallengeConfig, secret: &Secret) -> Result<Vec<Plan>> {
    let kinds = config.kinds()?;
    let mut order: Vec<usize> = (0..config.cases).map(|index| index % kinds.len()).collect();
    order.shuffle(&mut secret.random("structure", 0));
    let mut random = secret.random("order", 0);
    let dealt = match config.every {
        Some(level) => every(config.cases, level, &mut random),
        None => by_shares(config, random, &|index| &kinds[order[index]]),
    };
    for (of_case, (_, effects)) in order.iter_mut().zip(&dealt) {
        let can_have =
            |(structure, radar): &(Structure, Radar)| effects.iter().all(|(graded, _)| structure.can_have(radar, graded.id));
        if !can_have(&kinds[*of_case]) {
            let ids: Vec<&str> = effects.iter().map(|(graded, _)| graded.id).collect();
            let refuse = || Error::setting("structures", "none can have it", format!("one that can have {}", ids.join(" and ")));
            *of_case = kinds.iter().position(can_have).ok_or_else(refuse)?;
        }
    }
    let left_out = left_out(config, secret, &dealt);
    let plan = |(index, ((stratum, effects), left_out))| {
        let mut random = secret.random("scene", index);
        let (structure, radar) = kinds[order[index]].clone();
        let (mut scene, distance_m) = scene(config, &radar, secret.world_seed(index), &mut random);
        scene.empty = structure.person == Who::Nobody;
        Plan {
            index,
            stratum,
            effects,
            left_out,
            structure,
            radar,
            scene,
            distance_m,
            details: secret.random("effect", index),
            redrawn: 0,
        }
    };
    Ok(dealt.into_iter().zip(left_out).enumerate().map(plan).collect())
}

/// What a case holds.
type Dealt = (Stratum, Vec<(&'static Graded, f64)>);

fn by_shares<'a>(config: &ChallengeConfig, mut random: ChaCha8Rng, kind: &dyn Fn(usize) -> &'a (Structure, Radar)) -> Vec<Dealt> {
    let mut strata: Vec<Stratum> =
        Stratum::ALL.into_iter().zip(config.counts()).flat_map(|(stratum, count)| vec![stratum; count]).collect();
    strata.shuffle(&mut random);
    let mut decks = Decks::new(random, config.leave_one_out);
    let deal = |(index, stratum)| {
        let (structure, radar) = kind(index);
        (stratum, decks.draw(stratum, &|id| structure.can_have(radar, id)))
    };
    strata.into_iter().enumerate().map(deal).collect()
}

/// By case: what is planted in those outside the library, and anything in as many nulls.
fn left_out(config: &ChallengeConfig, secret: &Secret, dealt: &[Dealt]) -> Vec<Option<&'static str>> {
    let outside = dealt.iter().filter(|(stratum, _)| *stratum == Stratum::Outside).count();
    let (mut random, all) = (secret.random("left out", 0), library::library().collect::<Vec<_>>());
    let mut decoys = outside;
    let of = |(stratum, effects): &Dealt| match stratum {
        Stratum::Outside => effects.first().map(|(graded, _)| graded.id),
        Stratum::Null if decoys > 0 => {
            decoys -= 1;
            Some(all[random.random_range(0..all.len())].id)
        }
        _ => None,
    };
    if config.leave_one_out { dealt.iter().map(of).collect() } else { vec![None; dealt.len()] }
}

/// Every effect once, at one level, and nulls.
fn every(cases: usize, level: f64, random: &mut ChaCha8Rng) -> Vec<Dealt> {
    let stratum = |graded: &Graded| if library::graded(graded.id).is_some() { Stratum::Single } else { Stratum::Outside };
    let mut dealt: Vec<Dealt> = library::every().map(|graded| (stratum(graded), vec![(graded, level)])).collect();
    dealt.resize_with(cases.max(dealt.len()), || (Stratum::Null, vec![]));
    dealt.shuffle(random);
    dealt
}

/// Effects are dealt like cards, so that none is forgotten and none comes too often.
struct Decks {
    random: ChaCha8Rng,
    leave_one_out: bool,
    library: Vec<&'static Graded>,
    masked: Vec<&'static Graded>,
    absorbed: Vec<&'static Graded>,
    look_alikes: Vec<&'static Graded>,
    outside: Vec<&'static Graded>,
}

impl Decks {
    fn new(random: ChaCha8Rng, leave_one_out: bool) -> Self {
        Self { random, leave_one_out, library: vec![], masked: vec![], absorbed: vec![], look_alikes: vec![], outside: vec![] }
    }

    /// `can_have`: whether an effect can be in the case.
    fn draw(&mut self, stratum: Stratum, can_have: &dyn Fn(&str) -> bool) -> Vec<(&'static Graded, f64)> {
        let (deck, levels) = match stratum {
            Stratum::Null => return vec![],
            Stratum::Single => (&mut self.library, [0.0, 1.0]),
            Stratum::Undetectable => (&mut self.library, [-0.2, 0.0]),
            Stratum::Pair => (&mut self.library, [0.5, 1.0]),
            Stratum::Masked => (&mut self.masked, [0.2, 1.0]),
            Stratum::Absorbed => (&mut self.absorbed, [0.3, 1.0]),
            Stratum::LookAlike => (&mut self.look_alikes, [0.6, 1.0]),
            Stratum::Outside => (&mut self.outside, [0.3, 1.0]),
        };
        let mut drawn: Vec<(&'static Graded, f64)> = vec![];
        let count = if stratum == Stratum::Pair { 2 } else { 1 };
        while drawn.len() < count {
            let Some(place) = deck.iter().rposition(|graded| can_have(graded.id)) else {
                let mut fresh: Vec<&'static Graded> = match stratum {
                    Stratum::Masked => library::MASKED.iter().collect(),
                    Stratum::Absorbed => library::ABSORBED.iter().filter_map(|id| library::graded(id)).collect(),
                    Stratum::LookAlike => DECOYS.into_iter().filter_map(library::graded).collect(),
                    Stratum::Outside if !self.leave_one_out => library::OUTSIDE.iter().collect(),
                    _ => library::library().collect(),
                };
                assert!(
                    fresh.iter().any(|graded| can_have(graded.id)),
                    "every stratum has effects that every structure can have"
                );
                fresh.shuffle(&mut self.random);
                // What other structures can have is dealt later.
                deck.splice(0..0, fresh);
                continue;
            };
            let graded = deck.remove(place);
            // d′ means nothing for what only changes the noise.
            let unfit = stratum == Stratum::Undetectable && !scalable(graded.id);
            if !unfit && drawn.iter().all(|(other, _)| other.id != graded.id) {
                let level = levels[0] + (levels[1] - levels[0]) * self.random.random::<f64>();
                drawn.push((graded, level));
            }
        }
        drawn
    }
}

/// Whether an effect has an amplitude that can be made as small as one likes and a d′ that follows it.
pub fn scalable(id: &str) -> bool {
    !matches!(
        id,
        effects::coloured_noise::ID
            | effects::impulsive_noise::ID
            | effects::correlated_noise::ID
            | effects::frame_drop::ID
            | effects::soft_occlusion::ID
            | effects::adc_saturation::ID
    )
}

fn between(bounds: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    bounds[0] + (bounds[1] - bounds[0]) * random.random::<f64>()
}

fn one<'a, T>(of: &'a [T], random: &mut ChaCha8Rng) -> &'a T {
    &of[random.random_range(0..of.len())]
}

/// A scene that holds nothing but the baseline, and how far away the person is.
fn scene(config: &ChallengeConfig, radar: &Radar, seed: u64, random: &mut ChaCha8Rng) -> (RecorderConfig, f64) {
    let scenes: &Scenes = &config.scenes;
    let room = Room {
        left_m: Some(between(scenes.side_m, random)),
        right_m: Some(between(scenes.side_m, random)),
        front_m: Some(between(scenes.front_m, random)),
        back_m: Some(between(scenes.back_m, random)),
        floor_m: Some(between(scenes.floor_m, random)),
        ceiling_m: Some(between(scenes.ceiling_m, random)),
    };
    let farthest = room.front_m.unwrap_or(f64::MAX) - 1.5;
    let nearest = scenes.distance_m[0].min(farthest);
    let distance_m = between([nearest, scenes.distance_m[1].min(farthest)], random);
    let person = ActorConfig {
        subject: one(&scenes.subjects, random).clone(),
        action: *one(&scenes.actions, random),
        style: StyleConfig {
            tempo: between([0.8, 1.25], random),
            amplitude: between([0.8, 1.2], random),
            path_scale: between([0.7, 1.0], random),
            variation: 1.0,
            backward: false,
            seed: u64::from(random.random::<u32>()),
        },
        placement: Some(Placement { start_s: MOTION_START_S, ..placement(room.floor_m.unwrap_or(1.0), distance_m) }),
        ..ActorConfig::default()
    };
    let surface = SurfaceConfig {
        returns: *one(&scenes.tiers, random),
        variation_db: between(scenes.variation_db, random),
        edge_m: scenes.edge_m,
        ..SurfaceConfig::default()
    };
    let walls = WallsConfig { clutter_gamma: 10f64.powf(between(scenes.clutter_db, random) / 10.0), ..WallsConfig::default() };
    let mut scene = RecorderConfig {
        seed,
        mesh_error_m: between(scenes.mesh_error_m, random),
        radar: RadarChoice::Full(Box::new(radar.clone())),
        room,
        person,
        surface,
        walls,
        ..RecorderConfig::default()
    };
    scene.receiver.snr_db = between(scenes.snr_db, random);
    (scene, distance_m)
}

impl Plan {
    /// The scene's effects at their strengths.
    pub fn planted(&self) -> EffectsConfig {
        let at = Surroundings::new(&self.radar, self.scene.room.clone(), self.distance_m);
        let mut effects = EffectsConfig::default();
        for (place, &(graded, level)) in self.effects.iter().enumerate() {
            let mut random = self.details.clone();
            random.set_stream(2 * self.redrawn + place as u64);
            (graded.add)(&mut effects, graded.strength(level), &at, &mut random);
        }
        effects
    }

    /// The same effects at other places.
    pub fn redraw(&mut self) {
        self.redrawn += 1;
    }

    /// Makes every effect weaker by a factor of its amplitude.
    pub fn weaken(&mut self, factor: f64) {
        for (graded, level) in &mut self.effects {
            *level -= factor.ln() / (graded.strongest / graded.weakest).ln();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::tests::config;
    use super::*;

    #[test]
    fn equal_secrets_give_equal_plans_and_every_effect_is_dealt() {
        let (config, secret) = (config(400), Secret::new(Some("x")));
        let (a, b) = (plans(&config, &secret).unwrap(), plans(&config, &secret).unwrap());
        assert!(a.iter().zip(&b).all(|(a, b)| a.scene == b.scene && a.planted() == b.planted()));
        let singles: std::collections::BTreeSet<_> =
            a.iter().filter(|plan| plan.stratum == Stratum::Single).flat_map(|plan| &plan.effects).map(|(e, _)| e.id).collect();
        assert!(singles.len() > 40, "{}", singles.len());
        for plan in &a {
            assert_eq!(plan.effects.is_empty(), plan.stratum == Stratum::Null);
            assert!(plan.distance_m + 1.0 < plan.scene.room.front_m.unwrap());
            assert_eq!(plan.scene.effects, EffectsConfig::default());
        }
        let rooms: std::collections::BTreeSet<_> = a.iter().map(|p| format!("{:?}", p.scene.room)).collect();
        assert_eq!(rooms.len(), 400);
    }

    /// A diagnosis refuses what cannot be: no case may be that.
    #[test]
    fn no_scene_is_implausible() {
        use crate::plausibility::{Facts, Kind, findings};
        use crate::recorder::body::MovingBody;
        for plan in plans(&config(24), &Secret::new(Some("p"))).unwrap() {
            let world = plan.scene.world(std::path::Path::new("")).unwrap();
            let body = MovingBody::new(world.person.as_ref().unwrap(), world.interpolation).unwrap();
            let facts = Facts::new(Some(&world.radar), Some(&world.room), world.person.as_ref(), &|pose| body.pose(pose));
            let refused: Vec<_> = findings(&facts).into_iter().filter(|finding| finding.kind == Kind::Refuse).collect();
            assert!(refused.is_empty(), "{refused:?}");
        }
    }

    #[test]
    fn every_effect_comes_once_beside_nulls() {
        let config = ChallengeConfig { every: Some(0.7), ..config(120) };
        let plans = plans(&config, &Secret::new(Some("z"))).unwrap();
        let mut ids: Vec<&str> = plans.iter().flat_map(|plan| &plan.effects).map(|(effect, _)| effect.id).collect();
        ids.sort_unstable();
        let mut wanted: Vec<&str> = library::every().map(|effect| effect.id).collect();
        wanted.sort_unstable();
        assert_eq!(ids, wanted);
        assert_eq!(plans.len(), 120);
        assert!(plans.iter().all(|plan| plan.effects.is_empty() == (plan.stratum == Stratum::Null)));
        assert!(plans.iter().flat_map(|plan| &plan.effects).all(|&(_, level)| level == 0.7));
    }

    #[test]
    fn a_weakened_effect_keeps_everything_but_its_strength() {
        let config = config(200);
        let plan = plans(&config, &Secret::new(Some("y"))).unwrap();
        let mut plan =
            plan.into_iter().find(|plan| plan.effects.first().is_some_and(|(e, _)| e.id == "static_reflector")).unwrap();
        let before = plan.planted().static_reflector[0].clone();
        plan.weaken(10.0);
        let after = plan.planted().static_reflector[0].clone();
        assert_eq!(after.position_m, before.position_m);
        assert!((before.amplitude / after.amplitude - 10.0).abs() < 1e-9);
    }
}
