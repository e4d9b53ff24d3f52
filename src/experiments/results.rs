//! What the finished stages hold, by method.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::config::Protocol;
use super::figures::Levels;
use super::pairs::{Behind, On, Pair, asked_for};
use super::plan::{ARM_SWING, Method, MethodStages, Plan};
use super::stage::{Record, Store};
use super::steps::{Speed, Stability, read_json};
use super::variants::Variant;
use crate::error::{Error, Result};
use crate::evaluation::{Evaluation, SequenceSummary, over_sequences};

/// All numbers of one method; means are over recordings, with 95 % intervals.
#[derive(Clone, Debug, Serialize)]
pub struct MethodResults {
    pub id: String,
    #[serde(skip)]
    pub method: Method,
    /// The training subject's held-out frames.
    pub intra: Option<SequenceSummary>,
    /// The unseen subject.
    pub cross: Option<SequenceSummary>,
    /// The full simulator's PSNR less this method's, recording by recording of the unseen subject.
    pub behind: Option<Behind>,
    /// The unseen subject's walking back and forth with arm swing.
    pub arm_swing: Option<SequenceSummary>,
    pub recognition: BTreeMap<Protocol, Recognised>,
    /// The additional unseen subject.
    pub additional: Option<SequenceSummary>,
    pub additional_recognition: Option<Recognised>,
    /// Folder of the training stage, its seconds, and whether they are those of its last attempt only.
    pub training: Option<Training>,
    /// Over all simulated recordings.
    pub speed: Option<Speed>,
}

/// A share of the test windows, with its 95 % interval over recordings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    pub value: f64,
    pub interval_sequences: [f64; 2],
}

/// What the tables say of a recognition; its own folder says more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    pub accuracy: Share,
    pub macro_f1: Share,
    /// Exact 95 % interval of the share of whole recordings that are judged rightly.
    pub sequence_interval: [f64; 2],
}

#[derive(Clone, Debug, Serialize)]
pub struct Training {
    pub folder: String,
    pub seconds: f64,
    pub resumed: bool,
}

/// All numbers of a reproduction.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    pub methods: Vec<MethodResults>,
    /// Differences between methods other than the full simulator.
    pub pairs: Vec<Pair>,
    pub stability: Vec<StabilityResults>,
    pub figures: Vec<Figure>,
    /// What the diagnosis said about the diagnosed recording; ids of the effects that were added.
    pub effects: Option<Vec<String>>,
    /// Wall clock by kind of stage, seconds; what was cached counts as it was when it was made.
    pub seconds: BTreeMap<String, f64>,
    pub device: String,
    /// Stages by the build that did them: a stage is not done again because the program has changed.
    pub programs: BTreeMap<String, usize>,
}

/// A long training.
#[derive(Clone, Debug, Serialize)]
pub struct StabilityResults {
    pub variant: Variant,
    pub run: Stability,
}

/// A picture that a stage drew, and how strong what it shows is.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    pub name: String,
    #[serde(skip)]
    pub picture: PathBuf,
    pub levels: Levels,
}

/// Reads what a plan's stages left; `records` are in the plan's order.
pub fn collect(plan: &Plan, store: &Store, records: &[Record]) -> Result<Results> {
    let folder = |stage: usize| store.folder(&plan.stages[stage].key);
    let scores = |stages: &[usize]| read_all::<Evaluation>(stages.iter().map(|&stage| folder(stage).join("scores.json")));
    let full = plan.methods.iter().find(|(method, _)| *method == Method::Variant(Variant::Ours));
    let ours = scores(full.map_or(&[], |(_, stages)| &stages.cross))?;
    let our_takes = full.map_or(&[][..], |(_, stages)| &stages.cross_takes);
    let methods = plan
        .methods
        .iter()
        .map(|(method, stages)| {
            let cross = scores(&stages.cross)?;
            Ok(MethodResults {
                id: method.id(),
                method: *method,
                intra: summary(&scores(&stages.intra)?),
                behind: (stages.cross_takes == our_takes).then(|| Behind::of(&ours, &cross)).flatten(),
                cross: summary(&cross),
                arm_swing: summary(&scores(&arm_swing(stages).collect::<Vec<_>>())?),
                recognition: stages
                    .recognition
                    .iter()
                    .map(|(&protocol, &stage)| Ok((protocol, read_json(folder(stage).join("classifier/recognition.json"))?)))
                    .collect::<Result<_>>()?,
                additional: summary(&scores(&stages.additional)?),
                additional_recognition: stages
                    .additional_recognition
                    .map(|stage| read_json(folder(stage).join("classifier/recognition.json")))
                    .transpose()?,
                training: stages.train.map(|stage| Training {
                    folder: format!("stages/{}", plan.stages[stage].key.folder()),
                    seconds: records[stage].seconds,
                    resumed: records[stage].resumed,
                }),
                speed: total(&read_all(stages.simulate.iter().map(|&stage| folder(stage).join("speed.json")))?),
            })
        })
        .collect::<Result<_>>()?;
    let stability = plan.stability.iter().map(|&(variant, stage)| {
        Ok::<_, Error>(StabilityResults { variant, run: read_json(folder(stage).join("stability.json"))? })
    });
    let figures = plan.figures.iter().map(|(name, stage)| {
        let folder = folder(*stage);
        let levels = read_json(folder.join("figure.json"))?;
        Ok::<_, Error>(Figure { name: name.clone(), picture: folder.join(format!("{name}.png")), levels })
    });
    let (stability, figures) = (stability.collect::<Result<_>>()?, figures.collect::<Result<_>>()?);
    let effects = plan.diagnosis.map(|stage| {
        let found: Vec<serde_json::Value> = read_json(folder(stage).join("effects.json"))?;
        Ok::<_, Error>(found.iter().filter_map(|effect| Some(effect["id"].as_str()?.to_string())).collect())
    });
    let seconds = seconds_by_kind(records);
    let mut programs = BTreeMap::new();
    records.iter().for_each(|record| *programs.entry(record.program.clone()).or_default() += 1);
    let device = records.last().map(|record| record.device.clone()).unwrap_or_default();
    let pairs = pairs(plan, &scores)?;
    Ok(Results { methods, pairs, stability, figures, effects: effects.transpose()?, seconds, device, programs })
}

fn seconds_by_kind(records: &[Record]) -> BTreeMap<String, f64> {
    let mut seconds = BTreeMap::new();
    for record in records {
        let kind = record.name.split('/').next().expect("the first part").to_string();
        *seconds.entry(kind).or_default() += record.seconds;
    }
    seconds
}

/// Every pair that is asked for and was scored on the same recordings.
fn pairs(plan: &Plan, scores: &dyn Fn(&[usize]) -> Result<Vec<Evaluation>>) -> Result<Vec<Pair>> {
    let methods: Vec<Method> = plan.methods.iter().map(|(method, _)| *method).collect();
    let stages = |wanted: Method| plan.methods.iter().find(|(method, _)| *method == wanted).map(|(_, stages)| stages);
    let mut found = vec![];
    for (first, second, on) in asked_for(&methods) {
        let (Some(one), Some(other)) = (stages(first), stages(second)) else { continue };
        let (one, other) = match on {
            On::HeldOutFrames => (&one.intra, &other.intra),
            _ if one.cross_takes == other.cross_takes => (&one.cross, &other.cross),
            _ => continue,
        };
        if let Some(difference) = Behind::of(&scores(one)?, &scores(other)?) {
            found.push(Pair { first: first.id(), second: second.id(), methods: (first, second), on, difference });
        }
    }
    Ok(found)
}

fn arm_swing(stages: &MethodStages) -> impl Iterator<Item = usize> + '_ {
    let actions = stages.cross_actions.iter();
    stages.cross.iter().zip(actions).filter(|(_, action)| *action == ARM_SWING).map(|(&stage, _)| stage)
}

fn summary(evaluations: &[Evaluation]) -> Option<SequenceSummary> {
    over_sequences(evaluations)
}

fn total(speeds: &[Speed]) -> Option<Speed> {
    speeds.iter().copied().reduce(|a, b| Speed {
        frames: a.frames + b.frames,
        geometry_s: a.geometry_s + b.geometry_s,
        signal_s: a.signal_s + b.signal_s,
    })
}

fn read_all<T: DeserializeOwned>(paths: impl Iterator<Item = PathBuf>) -> Result<Vec<T>> {
    paths.map(|path| read_json(&path)).collect()
}
