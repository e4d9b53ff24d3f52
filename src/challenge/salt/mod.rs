//! What the diagnosis would find in somebody's own radar: graded effects planted into the samples of a real recording, under a seal.
//!
//! The way of a salted recording, in the order of the files:
//! - [`offered`]: which effects samples alone can be given
//! - [`plan`]: every effect at every grade
//! - [`ground`]: peak, noise, zero and full scale of the samples
//! - [`background`], [`seal`], [`answer()`], here: what the recording says of itself; copies with effects, their truths locked away and
//!   committed to; one process for each, which sees the copy alone
//! - [`outcome`], [`dose`]: what a report says that the background does not, and how that grows with strength

pub mod dose;
pub mod ground;
pub mod offered;
pub mod outcome;
pub mod plan;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde_json::{Value, json};

pub use plan::{Plan, Resolved, SaltConfig};

use super::answer::{self, Answers, Failure, RunConfig};
use super::commitment::Commitment;
use super::config::Stratum;
use super::library;
use super::report::Report;
use super::rules;
use super::seal::effects;
use super::sealing::{begin, commit, one_case, published, set_times};
use super::secret::Secret;
use crate::data::files::read_json;
use crate::data::{IfLayout, Recording, Scratch, Shard};
use crate::error::{Error, Result};
use crate::radar::Sampling;
use crate::recorder::EffectsConfig;
use crate::recorder::stages::{Ground, Onto};

/// Folder of what is answered about the recording itself.
pub const BACKGROUND: &str = "background";
/// Folder of what is answered about the copies.
pub const ANSWERS: &str = "answers";

/// How samples are stored again: codes that two bytes cannot hold as floating-point numbers.
fn layout(recording: &Recording, ground: Option<&Ground>) -> IfLayout {
    let wide = ground.and_then(|ground| ground.rail).is_some_and(|[low, high]| low < i16::MIN.into() || high > i16::MAX.into());
    match (recording.radar.sampling, recording.layout()) {
        (Sampling::Complex, IfLayout::Codes) if wide => IfLayout::Complex,
        (Sampling::Real, IfLayout::RealCodes) if wide => IfLayout::Real,
        (_, own) => own,
    }
}

/// The recording's own report, by a process of its own as the copies get: what it says already.
///
/// # Errors
/// A recording that the diagnosis does not answer: nothing planted into it could be found.
pub fn background(recording: &Recording, ground: &Ground, out: &Path, how: &RunConfig) -> Result<Report> {
    let folder = out.join(BACKGROUND);
    if !answer::answered(&folder) {
        std::fs::create_dir_all(out).map_err(|source| Error::write(out, source))?;
        let workplace = Scratch::new()?;
        let case = workplace.path().join("recording");
        let all: Vec<usize> = (0..recording.frames()).collect();
        recording.write_altered(&case, &all, layout(recording, Some(ground)), &mut |frame| recording.frame(frame))?;
        answer::diagnose(&case, &folder, how, &mut || ())?;
    }
    let unanswered = |reason: String| Error::Usage {
        message: format!("{}: its own diagnosis gives no answer: {reason}", recording.folder.display()),
        hint: Some(format!("what is planted into it could not be found; settle this first, then remove {}", folder.display())),
    };
    let failure = folder.join("failure.json");
    if failure.is_file() {
        return Err(unanswered(read_json::<Failure>(&failure)?.reason));
    }
    let report = Report::read(&folder.join("report.json"))?;
    match report.verdict.as_str() {
        "undecided" | "damaged" => Err(unanswered(format!("{}: {}", report.verdict, report.reason))),
        _ => Ok(report),
    }
}

/// Makes the copies of a part and commits to them; what is there already stays. `progress` receives how many are done.
///
/// # Errors
/// A folder that was begun with another recording, other effects or another seed.
pub fn seal(
    recording: &Recording,
    ground: &Ground,
    (resolved, plans): &(Resolved, Vec<Plan>),
    seed: Option<&str>,
    out: &Path,
    shard: Shard,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Commitment> {
    let settings = toml::to_string(resolved).expect("plain data");
    let secret = begin(out, &settings, seed, shard)?;
    if published(out, shard).exists() {
        let mut all = Commitment::read_all(out)?.into_iter();
        return Ok(all.find(|commitment| commitment.shard == [shard.number, shard.of]).expect("it is there"));
    }
    let (done, leaves) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    plans.par_iter().filter(|plan| shard.holds(plan.index)).try_for_each(|plan| -> Result<()> {
        let leaf = one_case(out, &secret, plan.index, |case| copy(recording, ground, plan, &secret, case))?;
        leaves.lock().expect("nobody panics while holding it").insert(secret.name(plan.index), leaf);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(())
    })?;
    commit(out, &settings, &secret, shard, leaves.into_inner().expect("all threads are done"), BTreeMap::new())
}

/// A copy with an effect; returns its truth.
fn copy(recording: &Recording, ground: &Ground, plan: &Plan, secret: &Secret, case: &Path) -> Result<Value> {
    let (planted, seed) = (plan.planted(recording, secret), plan.seed(secret));
    let onto = Onto::new(&recording.radar, &planted, seed, ground)?;
    let lost = planted.frame_drop.as_ref().map_or(0..0, |lost| lost.at..lost.at + lost.count);
    let frames: Vec<usize> = (0..recording.frames()).filter(|frame| !lost.contains(frame)).collect();
    let mut salted = |frame: usize| Ok(onto.apply(frame, &recording.frame(frame)?));
    recording.write_altered(case, &frames, layout(recording, Some(ground)), &mut salted)?;
    set_times(case)?;
    Ok(truth(plan, &planted, seed))
}

fn truth(plan: &Plan, planted: &EffectsConfig, seed: u64) -> Value {
    let id = plan.graded.id;
    let stratum = if library::graded(id).is_some() { Stratum::Single } else { Stratum::Outside };
    json!({
        "format": 1,
        "index": plan.index,
        "stratum": stratum,
        "tier": "recording",
        "effects": effects(planted),
        "strength": null,
        "settings": toml::to_string(planted).expect("settings are plain data"),
        "salt": {
            "id": id, "stage": rules::stage(id), "grade": plan.grade, "strength": plan.strength, "repeat": plan.repeat, "seed": seed,
        },
    })
}

/// Has the copies of a part diagnosed that have no answer yet, and commits to the answers.
pub fn answer(out: &Path, how: &RunConfig, progress: &mut dyn FnMut(usize)) -> Result<Answers> {
    let answers = out.join(ANSWERS);
    let commitments = Commitment::read_all(out)?;
    answer::each(mine(&commitments, how.shard), out, &commitments, &answers, how, progress)?;
    let all: Vec<&String> = commitments.iter().flat_map(|commitment| commitment.leaves.keys()).collect();
    answer::gather(&all, &answers, &commitments, &how.program)
}

/// Copies of a part that have no answer yet.
pub fn waiting(out: &Path, how: &RunConfig) -> Result<usize> {
    let commitments = Commitment::read_all(out)?;
    let open = mine(&commitments, how.shard).filter(|name| !answer::answered(&out.join(ANSWERS).join(name)));
    Ok(open.take(how.most.unwrap_or(usize::MAX)).count())
}

/// Names of the copies that a part has committed to.
fn mine(commitments: &[Commitment], shard: Shard) -> impl Iterator<Item = &String> {
    let own = commitments.iter().filter(move |commitment| commitment.shard == [shard.number, shard.of]);
    own.flat_map(|commitment| commitment.leaves.keys())
}

/// Whether all parts are committed to and answered, so that the truths may be opened.
pub fn is_complete(out: &Path, answers: &Answers) -> Result<bool> {
    let commitments = Commitment::read_all(out)?;
    let parts = commitments.first().map_or(1, |commitment| commitment.shard[1]);
    Ok(commitments.len() == parts && answers.complete && out.join(BACKGROUND).join("report.json").is_file())
}
