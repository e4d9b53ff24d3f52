//! `report.json`, as docs/report.md fixes it, and what of it is words.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::audit::Check;
use super::calibration::Calibrated;
use super::cube::Split;
use super::finding::Place;
use super::limits::Limit;
use super::locate;
use super::misfit::Misfit;
use super::never;
use super::null::Null;
use super::select::{Accepted, Explanation};
use super::statistics::decibels;
use crate::effects::EffectInfo;

/// Version of the report's format.
pub const FORMAT: u32 = 1;

/// What a report says of a recording, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Explained,
    PartlyExplained,
    Unexplained,
    NoMismatch,
    Undecided,
    /// The samples are not whole: no physics was asked.
    Damaged,
}

/// Which part of the recording findings were judged on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// `frames` or `loops`.
    pub axis: String,
    pub indices: Vec<usize>,
}

/// What is estimated of a parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// A number, or a list of them.
    pub value: serde_json::Value,
    /// `[low, high]`, or a list of such pairs.
    pub ci90: serde_json::Value,
}

/// How sure a named effect is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    pub held_out_loglik_gain: f64,
    pub held_out_db_mse_before: f64,
    pub held_out_db_mse_after: f64,
    pub p_value: f64,
}

/// A finding with the name of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    pub id: String,
    pub probability: f64,
    pub indistinguishable_from: Vec<String>,
    pub statement: String,
    pub equation: String,
    pub parameters: BTreeMap<String, Parameter>,
    #[serde(rename = "where")]
    pub place: Place,
    pub evidence: Evidence,
    /// Null where nothing else would explain the recording as well.
    pub separate_by: Option<String>,
}

/// A finding that no effect of the library explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    #[serde(rename = "where")]
    pub place: Place,
    pub p_value: f64,
    pub behaves_like: String,
    pub fraction_of_energy_db: f64,
    pub statement: String,
    pub held_out_loglik_gain: f64,
}

/// An effect that was not found, and how strong it may be all the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotDetectable {
    pub id: String,
    /// Null where there is no bound: it may be of any strength.
    pub at_most_db: Option<f64>,
    pub reason: String,
}

/// How well the recording is predicted before and after what was found is taken into account.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    pub before: Misfit,
    pub after: Misfit,
}

/// A place with more power than the baseline expects, before anything was taken into account.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Located {
    #[serde(rename = "where")]
    pub place: Place,
    pub excess_db: f64,
    pub p_value: f64,
}

/// The residual by parts of the body and by walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    pub name: String,
    pub excess_db: f64,
    pub p_value: f64,
}

/// Where the untouched recording holds more than is expected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Location {
    /// Boxes of range, velocity and frames.
    pub regions: Vec<Located>,
    pub body_parts: Vec<Share>,
    pub walls: Vec<Share>,
}

impl Location {
    /// What the residual of an evidence shows, by regions, parts of the body and walls.
    pub fn of(evidence: &super::Evidence) -> Self {
        let shares = |seen: Vec<locate::Seen>| {
            seen.into_iter().map(|seen| Share { name: seen.name, excess_db: seen.excess_db, p_value: seen.p_value }).collect()
        };
        let located =
            |region: locate::Region| Located { place: region.place, excess_db: region.excess_db, p_value: region.p_value };
        Self {
            regions: locate::locate(evidence).into_iter().map(located).collect(),
            body_parts: shares(locate::by_part(evidence)),
            walls: shares(locate::by_wall(evidence)),
        }
    }
}

/// The trained simulator's heatmaps against those of held-out frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorScores {
    /// All cells.
    pub db_mse: f64,
    pub psnr_db: f64,
    pub ssim: f64,
    /// Mean error on the cells that the person occupies.
    pub person_error_db: Option<f64>,
}

/// The trained simulator's scores before and after what was found is taken into account.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatorFit {
    pub before: SimulatorScores,
    pub after: SimulatorScores,
}

/// All of `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub format: u32,
    pub recording: String,
    pub held_out: HeldOut,
    pub verdict: Verdict,
    pub reason: String,
    pub probability_nothing_missing: f64,
    /// Probability of a statistic at least as extreme where nothing is missing: uniform there. None where it was not asked.
    #[serde(default)]
    pub p_value: Option<f64>,
    /// What that is made of.
    #[serde(default)]
    pub null: Null,
    /// What the p-value was before nulls of this radar calibrated it, where they did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibrated>,
    /// Smallest p-value of each family of detectors that had something to say of the untouched recording.
    #[serde(default, rename = "suspects")]
    pub detectors: BTreeMap<String, f64>,
    pub audit: Vec<Check>,
    pub effects: Vec<Effect>,
    pub unexplained: Vec<Unexplained>,
    pub not_detectable: Vec<NotDetectable>,
    pub fit: Fit,
    /// Where the untouched recording holds more power than the baseline expects.
    #[serde(default)]
    pub located: Location,
    /// What this recording does not allow to look for, and notes about how it was read.
    #[serde(default)]
    pub notes: Vec<String>,
    /// The trained simulator on the held-out frames, where a body or a room is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulator: Option<SimulatorFit>,
    /// Settings that shaped the answer, and their hash.
    #[serde(default)]
    pub settings: String,
}

impl HeldOut {
    /// A split's held-out frames, or the loops of its blocks.
    pub fn of(split: &Split) -> Self {
        match split.block_loops {
            None => Self { axis: "frames".into(), indices: split.held_out.clone() },
            Some(loops) => {
                let indices = split.held_out.iter().flat_map(|block| block * loops..(block + 1) * loops).collect();
                Self { axis: "loops".into(), indices }
            }
        }
    }
}

/// Energy of what moves in the recording: without static clutter over all frames.
pub fn moving_energy(evidence: &super::Evidence) -> f64 {
    let cube = &evidence.cube;
    let all: Vec<usize> = (0..cube.dims[0]).collect();
    let clutter_energy: f64 = cube.clutter(&all).iter().map(|value| value.norm_sqr()).sum();
    let total: f64 = cube.samples.iter().map(|value| value.norm_sqr()).sum();
    total - clutter_energy * cube.chirps()
}

/// With a capital in front and a stop behind.
fn sentence(text: &str) -> String {
    let mut letters = text.trim().chars();
    let first: String = letters.next().map(|letter| letter.to_uppercase().collect()).unwrap_or_default();
    let whole = first + letters.as_str();
    if whole.ends_with(['.', '!', '?']) { whole } else { whole + "." }
}

/// A bound on how probable it is that nothing is missing, from a p-value (Sellke, Bayarri and Berger 2001), equal
/// odds beforehand.
pub fn probability_of_nothing(p_value: f64) -> f64 {
    let p = p_value.clamp(1e-300, 1.0);
    if p >= (-1.0f64).exp() {
        return 0.5;
    }
    let bound = -std::f64::consts::E * p * p.ln();
    bound / (1.0 + bound)
}

impl NotDetectable {
    /// What this recording would have shown, had it been stronger.
    pub fn at_most(limit: Limit) -> Self {
        let reason = "it was not found, and was found when it was put into this recording as strongly as that, in dB relative to \
                      the energy of what moves";
        Self { id: limit.id.into(), at_most_db: Some(limit.at_most_db), reason: reason.into() }
    }
}

impl Effect {
    /// Its id, and those from which it is indistinguishable.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.id.as_str()).chain(self.indistinguishable_from.iter().map(String::as_str))
    }

    fn of(accepted: &Accepted, id: &str, info: Option<&EffectInfo>) -> Self {
        let candidate = &accepted.candidate;
        let parameters = candidate.estimates.iter().map(|estimate| {
            let single = estimate.values.len() == 1;
            let value = if single { estimate.values[0].into() } else { estimate.values.clone().into() };
            let ci90 = if single { serde_json::json!(estimate.ci90[0]) } else { serde_json::json!(estimate.ci90) };
            (estimate.name.to_string(), Parameter { value, ci90 })
        });
        let mut parameters: BTreeMap<String, Parameter> = parameters.collect();
        // docs/report.md counts a boundary and a part of the body among the parameters.
        for (name, choice) in [("boundary", &candidate.place.boundary), ("body_part", &candidate.place.body_part)] {
            if let Some(choice) = choice {
                let value = serde_json::Value::from(choice.clone());
                parameters.insert(name.into(), Parameter { value, ci90: serde_json::Value::Null });
            }
        }
        let mut place = candidate.place.clone();
        place.stage = place.stage.or(info.map(|info| info.stage));
        Self {
            id: id.into(),
            probability: accepted.probability * (1.0 - candidate.p_value),
            indistinguishable_from: accepted.rivals.iter().map(|&rival| rival.to_string()).collect(),
            statement: sentence(&candidate.statement),
            equation: info.map_or_else(String::new, |info| info.equation.into()),
            parameters,
            place,
            evidence: Evidence {
                held_out_loglik_gain: candidate.nats,
                held_out_db_mse_before: accepted.before.db_mse,
                held_out_db_mse_after: accepted.after.db_mse,
                p_value: candidate.p_value,
            },
            separate_by: info.filter(|_| !accepted.rivals.is_empty()).map(|info| info.separate_by.into()),
        }
    }
}

/// Effects, what has no name, and the verdict, from what the rounds found.
pub struct Findings {
    pub effects: Vec<Effect>,
    pub unexplained: Vec<Unexplained>,
    pub verdict: Verdict,
    pub reason: String,
}

/// Reason of a verdict of no mismatch where the recording as a whole is not improbable either.
pub const NOTHING: &str = "nothing is significant beyond body, static clutter and noise";

impl Findings {
    /// `moving_energy`: of the untouched recording.
    pub fn of(explanation: &Explanation, moving_energy: f64) -> Self {
        let mut effects = vec![];
        let mut unexplained = vec![];
        let mut accepted: Vec<&Accepted> = explanation.accepted.iter().collect();
        accepted.sort_by(|a, b| b.candidate.nats.total_cmp(&a.candidate.nats));
        for effect in accepted {
            let candidate = &effect.candidate;
            match candidate.id {
                Some(id) => effects.push(Effect::of(effect, id, explanation.evidence.info(id))),
                None => unexplained.push(Unexplained {
                    place: candidate.place.clone(),
                    p_value: candidate.p_value,
                    behaves_like: candidate.behaves_like.words().into(),
                    fraction_of_energy_db: decibels(candidate.energy / moving_energy.max(f64::MIN_POSITIVE)),
                    statement: sentence(&candidate.statement),
                    held_out_loglik_gain: candidate.nats,
                }),
            }
        }
        let (verdict, reason) = match (effects.is_empty(), unexplained.is_empty()) {
            (true, true) => (Verdict::NoMismatch, NOTHING.to_string()),
            (false, true) => (Verdict::Explained, "every significant mismatch has a name".to_string()),
            (false, false) => (Verdict::PartlyExplained, "some of the mismatch has no name in the library".to_string()),
            (true, false) => {
                (Verdict::Unexplained, "the mismatch is located, but nothing in the library explains it".to_string())
            }
        };
        Self { effects, unexplained, verdict, reason }
    }
}

/// Effects that no recording of this kind can show; `body`: somebody was tracked.
pub fn never_detectable(body: bool) -> Vec<NotDetectable> {
    never::all(body).map(|(id, reason)| NotDetectable { id: id.into(), at_most_db: None, reason: reason.into() }).collect()
}
