//! What the finished stages hold, by method.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::config::Protocol;
use super::plan::{Method, MethodStages, Plan};
use super::stage::{Record, Store};
use super::steps::{Speed, read_json};
use super::variants::Variant;
use crate::error::{Error, Result};
use crate::evaluation::{Evaluation, ScoreSummary, SequenceSummary, over_sequences};
use crate::metrics::Spread;

/// The action on which the paper looks at the graph convolution more closely (table 6).
pub const ARM_SWING: &str = "walk_back_forth_armswing";

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
    /// Folder of the training stage, its seconds, and whether they are those of its last attempt only.
    pub training: Option<Training>,
    /// Over all simulated recordings.
    pub speed: Option<Speed>,
}

/// Paired differences of PSNR, dB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Behind {
    pub global: Option<Spread>,
    pub moving: Option<Spread>,
    pub person: Option<Spread>,
}

impl Behind {
    /// None where the two were not scored on the same recordings.
    fn of(ours: &[Evaluation], other: &[Evaluation]) -> Option<Self> {
        let region = |of: fn(&Evaluation) -> Option<&ScoreSummary>| {
            let pairs = ours.iter().zip(other).filter_map(|(ours, other)| Some((of(ours)?, of(other)?)));
            Spread::of(pairs.map(|(ours, other)| ours.psnr_db.mean - other.psnr_db.mean))
        };
        (!ours.is_empty() && ours.len() == other.len()).then(|| Self {
            global: region(|evaluation| evaluation.global.as_ref()),
            moving: region(|evaluation| evaluation.moving.as_ref()),
            person: region(|evaluation| evaluation.person.as_ref()),
        })
    }
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
    /// What the detective said about the diagnosed recording; ids of the effects that were added.
    pub effects: Option<Vec<String>>,
    /// Wall clock by kind of stage, seconds; what was cached counts as it was when it was made.
    pub seconds: BTreeMap<String, f64>,
    pub device: String,
    /// Stages by the build that did them: a stage is not done again because the program has changed.
    pub programs: BTreeMap<String, usize>,
}

/// Reads what a plan's stages left; `records` are in the plan's order.
pub fn collect(plan: &Plan, store: &Store, records: &[Record]) -> Result<Results> {
    let folder = |stage: usize| store.folder(&plan.stages[stage].key);
    let scores = |stages: &[usize]| read_all::<Evaluation>(stages.iter().map(|&stage| folder(stage).join("scores.json")));
    let full = plan.methods.iter().find(|(method, _)| *method == Method::Variant(Variant::Ours));
    let ours = scores(full.map_or(&[], |(_, stages)| &stages.cross))?;
    let methods = plan
        .methods
        .iter()
        .map(|(method, stages)| {
            let cross = scores(&stages.cross)?;
            Ok(MethodResults {
                id: method.id(),
                method: *method,
                intra: summary(&scores(&stages.intra)?),
                behind: Behind::of(&ours, &cross),
                cross: summary(&cross),
                arm_swing: summary(&scores(&arm_swing(stages).collect::<Vec<_>>())?),
                recognition: stages
                    .recognition
                    .iter()
                    .map(|(&protocol, &stage)| Ok((protocol, read_json(folder(stage).join("classifier/recognition.json"))?)))
                    .collect::<Result<_>>()?,
                training: stages.train.map(|stage| Training {
                    folder: format!("stages/{}", plan.stages[stage].key.folder()),
                    seconds: records[stage].seconds,
                    resumed: records[stage].resumed,
                }),
                speed: total(&read_all(stages.simulate.iter().map(|&stage| folder(stage).join("speed.json")))?),
            })
        })
        .collect::<Result<_>>()?;
    let effects = plan.diagnosis.map(|stage| {
        let found: Vec<serde_json::Value> = read_json(folder(stage).join("effects.json"))?;
        Ok::<_, Error>(found.iter().filter_map(|effect| Some(effect["id"].as_str()?.to_string())).collect())
    });
    let mut seconds = BTreeMap::new();
    for record in records {
        let kind = record.name.split('/').next().expect("the first part").to_string();
        *seconds.entry(kind).or_default() += record.seconds;
    }
    let mut programs = BTreeMap::new();
    records.iter().for_each(|record| *programs.entry(record.program.clone()).or_default() += 1);
    let device = records.last().map(|record| record.device.clone()).unwrap_or_default();
    Ok(Results { methods, effects: effects.transpose()?, seconds, device, programs })
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
