//! Records the cases, locks their truths away and publishes the commitment.
//!
//! A challenge is a folder: `cases/NAME/` for everybody, `sealed/` for nobody before the answers are committed, and
//! `commitment.json`, which is written last. The names are random, all cases have the same files of the same form, all
//! times of files are equal, and the person's files are those of the scene without its effects.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::commitment::Commitment;
use super::config::{ChallengeConfig, Stratum};
use super::measure::{Draws, Strength, strength};
use super::plan::{Plan, plans};
use super::rules::{MASKED_DB, OBVIOUS_D_PRIME, UNDETECTABLE_D_PRIME};
use super::sealing::{self, commit, one_case, published, set_times};
use super::secret::Secret;
use super::structures::Structure;
use crate::data::{IfFrame, IfLayout, RecordingContents, Shard, settings, write_recording};
use crate::effects;
use crate::error::{Error, Result};
use crate::radar::Sampling;
use crate::recorder::effects::Outside;
use crate::recorder::{EffectsConfig, ReceiverConfig, Recorder, RecorderConfig, Returns, World};

/// Attempts at what a kind of case asks for, after which the effect is taken as it is; what it then counts as is decided
/// by what was measured, not by what was meant.
const MOST_ATTEMPTS: usize = 4;
/// Draws of the mesh's error and of the skin by which is measured what of an effect survives them.
const DRAWS: u64 = 4;
/// And of the noise without the person.
const EMPTY_DRAWS: u64 = 3;
/// Where hardly anything survives, how much stronger an effect has to be is not estimable from it.
const LEAST_D_PRIME: f64 = 1.0;
/// An undetectable effect is brought to this d′.
const WEAK_D_PRIME: f64 = 1.0;

/// Seals a challenge into `out`; one that was interrupted goes on. `progress` receives how many cases are done.
///
/// # Errors
/// A commitment that is there already, another seed than the one begun with, and whatever the recorder refuses.
pub fn seal(
    config: &ChallengeConfig,
    seed: Option<&str>,
    out: &Path,
    shard: Shard,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Commitment> {
    if published(out, shard).exists() {
        return Err(Error::Usage {
            message: format!("{}: is committed to already", published(out, shard).display()),
            hint: Some("seal into another folder".into()),
        });
    }
    let secret = begin(config, seed, out, shard)?;
    let plans = of_shard(config, &secret, shard)?;
    let left_out = plans.iter().filter_map(|plan| Some((secret.name(plan.index), plan.left_out?.to_string()))).collect();
    let leaves = seal_cases(config, plans, &secret, out, progress)?;
    commit(out, &config.to_toml(), &secret, shard, leaves, left_out)
}

/// Makes the folders of a challenge and settles its secret, so that shards of it need no seed.
///
/// # Errors
/// Another seed, or other settings, than those begun with.
pub fn begin(config: &ChallengeConfig, seed: Option<&str>, out: &Path, shard: Shard) -> Result<Secret> {
    sealing::begin(out, &config.to_toml(), seed, shard)
}

/// Records the cases of a shard that are not there yet, and commits to nothing: who seals the whole later finds them done. The
/// secret, and the leaves by the cases' names.
///
/// # Errors
/// As [`begin`], and whatever the recorder refuses.
pub fn cases(
    config: &ChallengeConfig,
    seed: Option<&str>,
    out: &Path,
    shard: Shard,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<(Secret, BTreeMap<String, String>)> {
    let secret = begin(config, seed, out, shard)?;
    let leaves = seal_cases(config, of_shard(config, &secret, shard)?, &secret, out, progress)?;
    Ok((secret, leaves))
}

fn of_shard(config: &ChallengeConfig, secret: &Secret, shard: Shard) -> Result<Vec<Plan>> {
    Ok(plans(config, secret)?.into_iter().filter(|plan| shard.holds(plan.index)).collect())
}

/// The leaves by the cases' names.
fn seal_cases(
    config: &ChallengeConfig,
    plans: Vec<Plan>,
    secret: &Secret,
    out: &Path,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<BTreeMap<String, String>> {
    let (done, leaves) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    plans.into_par_iter().try_for_each(|plan| -> Result<()> {
        let name = secret.name(plan.index);
        let leaf = seal_case(config, plan, secret, out)?;
        leaves.lock().expect("nobody panics while holding it").insert(name, leaf);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(())
    })?;
    Ok(leaves.into_inner().expect("all threads are done"))
}

/// Records one case, unless it is there already, and returns its leaf.
fn seal_case(config: &ChallengeConfig, mut plan: Plan, secret: &Secret, out: &Path) -> Result<String> {
    let index = plan.index;
    one_case(out, secret, index, |case| {
        let recorded = record(config, &mut plan)?;
        write_frames(&recorded.world, &recorded.frames, &plan.structure, case)?;
        Ok(truth(&plan, &recorded))
    })
}

/// A case in memory.
struct Recorded {
    /// The scene without effects: what everybody is given of it.
    world: World,
    frames: Vec<IfFrame>,
    settings: RecorderConfig,
    strength: Option<Strength>,
}

/// Records a plan, and again until an undetectable effect is undetectable and a masked one masked.
fn record(config: &ChallengeConfig, plan: &mut Plan) -> Result<Recorded> {
    let mut scene = plan.scene.clone();
    // What the converter does is not seen in samples that it never touched.
    scene.receiver.adc =
        plan.effects.iter().any(|(graded, _)| matches!(graded.id, effects::adc_saturation::ID | Outside::LSB_STUCK));
    let world = scene.world(Path::new("."))?;
    if plan.stratum == Stratum::Null || config.every.is_some() {
        let settings = RecorderConfig { effects: plan.planted(), ..scene };
        let frames = match plan.stratum {
            Stratum::Null => frames_of(&world)?,
            _ => frames_of(&settings.world(Path::new("."))?)?,
        };
        return Ok(Recorded { frames, world, settings, strength: None });
    }
    let clean = draws(&scene)?;
    let mut attempts = 1;
    loop {
        let settings = RecorderConfig { effects: plan.planted(), ..scene.clone() };
        let mut planted = draws(&settings)?;
        let strength = strength(&clean, &planted);
        if attempts == MOST_ATTEMPTS || as_meant(plan, &strength) {
            return Ok(Recorded { world, frames: planted.frames.swap_remove(0), settings, strength: Some(strength) });
        }
        attempts += 1;
    }
}

/// Whether an effect came out as its kind of case asks for; if not, the plan is changed towards it.
fn as_meant(plan: &mut Plan, strength: &Strength) -> bool {
    match plan.stratum {
        Stratum::Undetectable if strength.d_prime >= UNDETECTABLE_D_PRIME => {
            plan.weaken(strength.d_prime / WEAK_D_PRIME);
            false
        }
        Stratum::Masked if !strength.masked() || strength.d_prime_surviving < OBVIOUS_D_PRIME => {
            // Some more than the measured shortfall, as far as a detectable effect remains.
            let missing_db = MASKED_DB + 3.0 - strength.below_cover_db;
            let spare_db = 20.0 * (strength.d_prime_surviving.max(LEAST_D_PRIME) / (1.5 * OBVIOUS_D_PRIME)).log10();
            if missing_db > spare_db {
                plan.redraw();
            }
            plan.weaken(10f64.powf(missing_db.min(spare_db) / 20.0));
            false
        }
        _ => true,
    }
}

fn frames_of(world: &World) -> Result<Vec<IfFrame>> {
    Recorder::new(world)?.frames().collect()
}

/// A scene, and what it would be with other errors of the mesh, other noise, and without the person.
fn draws(settings: &RecorderConfig) -> Result<Draws> {
    let folder = Path::new(".");
    let empty = RecorderConfig { empty: true, effects: settings.effects.without_person(), ..settings.clone() };
    let (world, empty) = (settings.world(folder)?, empty.world(folder)?);
    let first = Recorder::new(&world)?;
    let level = first.level();
    let redrawn = |world: &World, redraw: u64| {
        let receiver = ReceiverConfig { level: Some(level), ..world.receiver };
        frames_of(&World { redraw, other_skin: redraw, receiver, ..world.clone() })
    };
    let mut frames = vec![first.frames().collect::<Result<Vec<_>>>()?];
    for redraw in 1..DRAWS {
        frames.push(redrawn(&world, redraw)?);
    }
    let empty = (0..EMPTY_DRAWS).map(|redraw| redrawn(&empty, redraw)).collect::<Result<_>>()?;
    Ok(Draws { frames, empty, gain: level.gain })
}

/// How strong the effects of a sealed case are by the measure of this program: records it again with and without them.
pub fn measured(settings: &str, case: &Path) -> Result<Strength> {
    let planted = settings_of(settings, case)?;
    let clean = RecorderConfig { effects: EffectsConfig::default(), ..planted.clone() };
    Ok(strength(&draws(&clean)?, &draws(&planted)?))
}

fn settings_of(settings: &str, case: &Path) -> Result<RecorderConfig> {
    settings::read_text(settings).map_err(|error| Error::Parse { path: case.into(), message: error.to_string() })
}

/// Records the same scene, noise included, without its effects: what a perfect diagnosis would be left with.
pub fn record_twin(settings: &str, structure: &Structure, case: &Path) -> Result<()> {
    let world = RecorderConfig { effects: EffectsConfig::default(), ..settings_of(settings, case)? }.world(Path::new("."))?;
    write_frames(&world, &frames_of(&world)?, structure, case)
}

/// The recording without a truth and without labels.
fn write_frames(world: &World, frames: &[IfFrame], structure: &Structure, case: &Path) -> Result<()> {
    let layout = match world.radar.sampling {
        Sampling::Complex => IfLayout::Codes,
        Sampling::Real => IfLayout::RealCodes,
    };
    let contents = RecordingContents {
        radar: &world.radar,
        room: structure.room.then_some(&world.room),
        person: world.person.as_ref().filter(|_| structure.is_tracked()),
        body_file: None,
        labels: BTreeMap::new(),
        layout,
        truth: None,
    };
    write_recording(case, &contents, &mut |frame| Ok(frames[frame].clone()))?;
    set_times(case)
}

fn truth(plan: &Plan, recorded: &Recorded) -> Value {
    let settings = &recorded.settings;
    let mut truth = json!({
        "format": 1,
        "index": plan.index,
        "stratum": plan.stratum,
        "tier": if settings.surface.returns == Returns::Random { "B" } else { "A" },
        "effects": effects(&settings.effects),
        "strength": recorded.strength,
        "settings": toml::to_string(settings).expect("settings are plain data"),
    });
    let mut add = |key: &str, value: Value| truth.as_object_mut().expect("a table").insert(key.into(), value);
    if plan.structure != Structure::default() {
        add("structure", json!(plan.structure));
    }
    if let Some(id) = plan.left_out {
        add("left_out", id.into());
    }
    truth
}

/// Every effect with its id (none: outside the library) and the recorder's numbers.
pub fn effects(config: &EffectsConfig) -> Vec<Value> {
    let Ok(Value::Object(tables)) = serde_json::to_value(config) else { unreachable!("a struct") };
    let mut found = vec![];
    for (key, value) in tables {
        let entries = match value {
            Value::Array(entries) => entries,
            one => vec![one],
        };
        for mut entry in entries {
            let members = entry.as_object_mut().expect("every effect is a table");
            let id = if key == "outside" { Value::Null } else { key.as_str().into() };
            members.insert("name".into(), id);
            found.push(entry);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_draws_of_the_mesh_and_the_noise_are_no_effect_and_a_delayed_surface_is_next_to_none() {
        let text = |effects: &str| {
            format!(
                "seed = 3\nmesh_error_m = 2e-3\nradar = \"small\"\n[surface]\nedge_m = 0.012\n[receiver]\nadc = false\n{effects}"
            )
        };
        let scene = |effects: &str| RecorderConfig { frames: Some(4), ..settings::read_text(&text(effects)).unwrap() };
        let clean = draws(&scene("")).unwrap();
        let world = scene("").world(Path::new(".")).unwrap();
        let level = Some(Recorder::new(&world).unwrap().level());
        let redrawn_frames = |redraw: u64| {
            let receiver = ReceiverConfig { level, ..world.receiver };
            let redraw = redraw + 100;
            frames_of(&World { redraw, other_skin: redraw, receiver, ..world.clone() }).unwrap()
        };
        let redrawn =
            Draws { frames: (0..DRAWS).map(redrawn_frames).collect(), empty: draws(&scene("")).unwrap().empty, gain: clean.gain };
        let none = strength(&clean, &redrawn);
        assert!(none.d_prime > 1000.0 && none.d_prime_surviving < 4.0, "{none:?}");
        let of = |effects: &str| strength(&clean, &draws(&scene(effects)).unwrap());
        // Half a millimetre turns everything alike; another wavelength every range otherwise.
        let bias = of("[effects.range_bias]\noffset_m = 5e-4\n");
        let wave = of("[effects.start_frequency_error]\nrelative = 3e-4\n");
        assert!(bias.d_prime_surviving < 4.0 && wave.d_prime > 100.0 && wave.d_prime_surviving < 8.0, "{bias:?} {wave:?}");
        let clothing = of("[effects.clothing_delay]\nextra_m = 1e-3\nbody_parts = [\"pelvis\", \"spine1\", \"spine2\"]\n");
        // Where the cloth ends, next to the skin, there is a little that no smooth error of the mesh can do.
        assert!(clothing.d_prime > 300.0 && clothing.d_prime_surviving < 0.05 * clothing.d_prime, "{clothing:?}");
        let leakage = of("[effects.tx_leakage]\nrange_m = 0.1\nrelative = 1.0\n");
        assert!(leakage.d_prime_surviving > 100.0, "{leakage:?}");
        // Beside the body it is of the same strength in a room with the person and in one without.
        let mover = of("[[effects.moving_reflector]]\nposition_m = [-1.2, 1.5, 0.0]\naxis = [0.0, 1.0, 0.0]\nswing_m = 0.2\n\
                        rate_hz = 1.0\namplitude = 0.05\n");
        let share = mover.d_prime_surviving / mover.d_prime;
        assert!((0.6..1.1).contains(&share), "{share} of {mover:?}");
    }

    #[test]
    fn truths_name_effects_by_id_and_the_rest_by_nothing() {
        let text = "[iq_imbalance]\ngain_db = 0.5\nphase_deg = 2.0\n\n[[outside]]\nkind = \"lo_pulling\"\npeak_rad = 0.1\n";
        let found = effects(&settings::read_text(text).unwrap());
        assert_eq!(found.len(), 2);
        assert_eq!((found[0]["name"].as_str(), found[0]["gain_db"].as_f64()), (Some("iq_imbalance"), Some(0.5)));
        assert_eq!((&found[1]["name"], found[1]["kind"].as_str()), (&Value::Null, Some("lo_pulling")));
        assert!(effects(&EffectsConfig::default()).is_empty());
    }
}
