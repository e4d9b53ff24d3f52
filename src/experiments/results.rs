//! What the finished stages hold, by method.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::config::Protocol;
use super::few::Material;
use super::figures::Levels;
use super::pairs::{Behind, On, Pair, asked_for};
use super::plan::{ARM_SWING, Method, MethodStages, Plan};
use super::stage::{Record, Store};
use super::steps::{Speed, Stability};
use super::variants::Variant;
use crate::data::files::read_json;
use crate::error::{Error, Result};
use crate::evaluation::{Evaluation, SequenceSummary, over_draws};
use crate::metrics::Spread;

/// All numbers of one method; means are over recordings, and over draws of what learned, with 95 % intervals over both.
#[derive(Clone, Debug, Serialize)]
pub struct MethodResults {
    pub id: String,
    #[serde(skip)]
    pub method: Method,
    /// How often it was trained, scored and recognised.
    pub draws: usize,
    /// The training subject's held-out frames.
    pub intra: Option<SequenceSummary>,
    /// The unseen subject.
    pub cross: Option<SequenceSummary>,
    /// The full simulator's PSNR less this method's, recording by recording of the unseen subject.
    pub behind: Option<Behind>,
    /// The unseen subject's walking back and forth with arm swing.
    pub arm_swing: Option<SequenceSummary>,
    pub recognition: BTreeMap<Protocol, Recognised>,
    /// Share of the unseen subject's recordings that are judged rightly after learning from measured recordings, less that after
    /// learning from this method's, recording by recording.
    pub behind_measured: BTreeMap<Protocol, Spread>,
    /// The additional unseen subject.
    pub additional: Option<SequenceSummary>,
    pub additional_recognition: Option<Recognised>,
    /// Of the first draw: folder of the training stage, its seconds, and whether they are those of its last attempt only.
    pub training: Option<Training>,
    /// Over all recordings that the first draw simulated.
    pub speed: Option<Speed>,
}

/// What is read of a recognition's whole recordings.
#[derive(Debug, Deserialize)]
struct Answers {
    answers: Vec<Answer>,
}

#[derive(Debug, Deserialize)]
struct Answer {
    action: String,
    judged: String,
}

/// A share of the test windows, with its 95 % interval over recordings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    pub value: f64,
    pub interval_sequences: [f64; 2],
}

/// What the tables say of a recognition; its own folder says more. Of several draws: means, and intervals that hold those of all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recognised {
    pub accuracy: Share,
    pub macro_f1: Share,
    /// Exact 95 % interval of the share of whole recordings that are judged rightly.
    pub sequence_interval: [f64; 2],
}

impl Recognised {
    /// `None` without draws.
    fn over(draws: &[Self]) -> Option<Self> {
        let outermost = |of: &dyn Fn(&Self) -> [f64; 2]| {
            let limits = draws.iter().map(of);
            limits.reduce(|[low, high], [least, most]| [low.min(least), high.max(most)])
        };
        let share = |of: fn(&Self) -> Share| {
            let value = draws.iter().map(|draw| of(draw).value).sum::<f64>() / draws.len() as f64;
            Some(Share { value, interval_sequences: outermost(&|draw| of(draw).interval_sequences)? })
        };
        Some(Self {
            accuracy: share(|draw| draw.accuracy)?,
            macro_f1: share(|draw| draw.macro_f1)?,
            sequence_interval: outermost(&|draw| draw.sequence_interval)?,
        })
    }
}

/// A classifier that learned from a few recordings of each action.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Few {
    pub recordings: usize,
    pub material: Material,
    pub recognised: Recognised,
}

/// Where a simulator was trained, and how long that took.
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
    pub few: Vec<Few>,
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
    let found = Found { plan, store };
    let full = plan.methods.iter().find(|(method, _)| *method == Method::Variant(Variant::Ours));
    let (ours, our_takes) = match full {
        Some((_, draws)) => (found.scores(draws, |stages| &stages.cross)?, &draws[0].cross_takes[..]),
        None => (vec![], &[][..]),
    };
    let results =
        |(method, draws): &(Method, Vec<MethodStages>)| method_results(&found, *method, draws, records, (&ours, our_takes));
    let methods = plan.methods.iter().map(results).collect::<Result<_>>()?;
    let few = plan.few.iter().map(|few| {
        let recognised = found.recognised(&few.stages)?.expect("a stage for every draw");
        Ok::<_, Error>(Few { recordings: few.recordings, material: few.material, recognised })
    });
    let few = few.collect::<Result<_>>()?;
    let folder = |stage: usize| found.folder(stage);
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
    let pairs = pairs(&found)?;
    Ok(Results { methods, pairs, few, stability, figures, effects: effects.transpose()?, seconds, device, programs })
}

/// What the stages of a plan left.
struct Found<'a> {
    plan: &'a Plan,
    store: &'a Store,
}

impl Found<'_> {
    fn folder(&self, stage: usize) -> PathBuf {
        self.store.folder(&self.plan.stages[stage].key)
    }

    /// `[draw][recording]`
    fn scores<'a>(
        &self,
        draws: &'a [MethodStages],
        of: impl Fn(&'a MethodStages) -> &'a Vec<usize>,
    ) -> Result<Vec<Vec<Evaluation>>> {
        draws.iter().map(|stages| self.evaluations(of(stages))).collect()
    }

    fn evaluations(&self, stages: &[usize]) -> Result<Vec<Evaluation>> {
        read_all(stages.iter().map(|&stage| self.folder(stage).join("scores.json")))
    }

    /// Whether each recording was judged rightly, `[draw][recording]`.
    fn right(&self, draws: &[usize]) -> Result<Vec<Vec<f64>>> {
        let all: Vec<Answers> = read_all(draws.iter().map(|&stage| self.folder(stage).join("classifier/recognition.json")))?;
        let right = |answer: &Answer| f64::from(u8::from(answer.judged == answer.action));
        Ok(all.iter().map(|found| found.answers.iter().map(right).collect()).collect())
    }

    /// What a classifier that learned from measured recordings has judged rightly under the protocol, and nothing where it was
    /// tested on others.
    fn right_by_measured(&self, protocol: Protocol, first: &MethodStages) -> Result<Option<Vec<f64>>> {
        let measured = self.plan.methods.iter().find(|(method, _)| *method == Method::Again);
        let Some((_, draws)) = measured.filter(|(_, draws)| draws[0].cross_takes == first.cross_takes) else { return Ok(None) };
        let Some(&stage) = draws[0].recognition.get(&protocol) else { return Ok(None) };
        Ok(self.right(&[stage])?.pop())
    }

    /// Over the draws' stages.
    fn recognised(&self, draws: &[usize]) -> Result<Option<Recognised>> {
        let found = read_all(draws.iter().map(|&stage| self.folder(stage).join("classifier/recognition.json")))?;
        Ok(Recognised::over(&found))
    }
}

/// `ours`: what the full simulator's draws scored on the unseen subject, and on which recordings.
fn method_results(
    found: &Found,
    method: Method,
    draws: &[MethodStages],
    records: &[Record],
    (ours, our_takes): (&[Vec<Evaluation>], &[String]),
) -> Result<MethodResults> {
    let first = &draws[0];
    let cross = found.scores(draws, |stages| &stages.cross)?;
    let arm_swing = draws.iter().map(|stages| found.evaluations(&arm_swing(stages).collect::<Vec<_>>()));
    let recognition = first.recognition.keys().map(|&protocol| {
        Ok::<_, Error>(found.recognised(&of_protocol(draws, protocol))?.map(|recognised| (protocol, recognised)))
    });
    let mut behind_measured = BTreeMap::new();
    for &protocol in first.recognition.keys().filter(|_| method != Method::Again) {
        if let Some(measured) = found.right_by_measured(protocol, first)? {
            let draws = found.right(&of_protocol(draws, protocol))?;
            let less = |recording: usize| draws.iter().map(|draw| measured[recording] - draw[recording]).collect();
            let rows: Vec<Vec<f64>> = (0..measured.len()).map(less).collect();
            behind_measured.extend(Spread::crossed(&rows).map(|spread| (protocol, spread)));
        }
    }
    Ok(MethodResults {
        id: method.id(),
        method,
        draws: draws.len(),
        intra: summary(&found.scores(draws, |stages| &stages.intra)?),
        behind: (first.cross_takes == our_takes).then(|| Behind::of(ours, &cross)).flatten(),
        cross: summary(&cross),
        arm_swing: summary(&arm_swing.collect::<Result<Vec<_>>>()?),
        recognition: recognition.filter_map(Result::transpose).collect::<Result<_>>()?,
        behind_measured,
        additional: summary(&[found.evaluations(&first.additional)?]),
        additional_recognition: found.recognised(&first.additional_recognition.into_iter().collect::<Vec<_>>())?,
        training: first.train.map(|stage| Training {
            folder: format!("stages/{}", found.plan.stages[stage].key.folder()),
            seconds: records[stage].seconds,
            resumed: records[stage].resumed,
        }),
        speed: total(&read_all(first.simulate.iter().map(|&stage| found.folder(stage).join("speed.json")))?),
    })
}

/// The classifiers of all draws.
fn of_protocol(draws: &[MethodStages], protocol: Protocol) -> Vec<usize> {
    draws.iter().filter_map(|draw| draw.recognition.get(&protocol).copied()).collect()
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
fn pairs(found: &Found) -> Result<Vec<Pair>> {
    let methods: Vec<Method> = found.plan.methods.iter().map(|(method, _)| *method).collect();
    let draws = |wanted: Method| found.plan.methods.iter().find(|(method, _)| *method == wanted).map(|(_, draws)| draws);
    let mut pairs = vec![];
    for (first, second, on) in asked_for(&methods) {
        let (Some(one), Some(other)) = (draws(first), draws(second)) else { continue };
        let of: fn(&MethodStages) -> &Vec<usize> = match on {
            On::HeldOutFrames => |stages| &stages.intra,
            _ if one[0].cross_takes == other[0].cross_takes => |stages| &stages.cross,
            _ => continue,
        };
        if let Some(difference) = Behind::of(&found.scores(one, of)?, &found.scores(other, of)?) {
            pairs.push(Pair { first: first.id(), second: second.id(), methods: (first, second), on, difference });
        }
    }
    Ok(pairs)
}

fn arm_swing(stages: &MethodStages) -> impl Iterator<Item = usize> + '_ {
    let actions = stages.cross_actions.iter();
    stages.cross.iter().zip(actions).filter(|(_, action)| *action == ARM_SWING).map(|(&stage, _)| stage)
}

fn summary(draws: &[Vec<Evaluation>]) -> Option<SequenceSummary> {
    over_draws(&draws.iter().map(Vec::as_slice).collect::<Vec<_>>())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recognition_of_several_draws_is_their_mean_within_what_all_of_them_allow() {
        let draw = |value: f64, low: f64, high: f64| {
            let share = Share { value, interval_sequences: [low, high] };
            Recognised { accuracy: share, macro_f1: share, sequence_interval: [low - 0.1, high + 0.1] }
        };
        let (first, second) = (draw(0.5, 0.25, 0.75), draw(1.0, 0.5, 1.0));
        assert_eq!(Recognised::over(&[first]), Some(first));
        let both = Recognised::over(&[first, second]).unwrap();
        assert_eq!(both.accuracy, Share { value: 0.75, interval_sequences: [0.25, 1.0] });
        assert_eq!(both.sequence_interval, [0.15, 1.1]);
        assert_eq!(Recognised::over(&[]), None);
    }
}
