//! What the finished stages hold, by method.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::config::Protocol;
use super::plan::{Method, MethodStages, Plan};
use super::stage::{Record, Store};
use super::steps::{Speed, read_json};
use crate::error::{Error, Result};
use crate::evaluation::{Evaluation, SequenceSummary, over_sequences};

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
    /// The unseen subject's walking back and forth with arm swing.
    pub arm_swing: Option<SequenceSummary>,
    pub recognition: BTreeMap<Protocol, Recognised>,
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
}

/// Reads what a plan's stages left; `records` are in the plan's order.
pub fn collect(plan: &Plan, store: &Store, records: &[Record]) -> Result<Results> {
    let folder = |stage: usize| store.folder(&plan.stages[stage].key);
    let methods = plan
        .methods
        .iter()
        .map(|(method, stages)| {
            Ok(MethodResults {
                id: method.id(),
                method: *method,
                intra: summary(&read_all(stages.intra.iter().map(|&stage| folder(stage).join("scores.json")))?),
                cross: summary(&read_all(stages.cross.iter().map(|&stage| folder(stage).join("scores.json")))?),
                arm_swing: summary(&read_all(arm_swing(stages).map(|stage| folder(stage).join("scores.json")))?),
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
    let device = records.last().map(|record| record.device.clone()).unwrap_or_default();
    Ok(Results { methods, effects: effects.transpose()?, seconds, device })
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
