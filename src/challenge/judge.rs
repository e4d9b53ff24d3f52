//! One report held against one truth.

use serde::Serialize;
use serde_json::Value;

use super::config::Stratum;
use super::measure::Strength;
use super::report::{Effect, Place, Report};
use super::rules::{CONFIDENT, PLACE_M, RANGE_SLACK_M, look_alike, stage};
use super::truth::Truth;
use crate::effects;

/// A parameter and whether its 90 % interval holds the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Covered {
    pub id: String,
    pub parameter: String,
    pub covered: bool,
}

/// What becomes of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Judgement {
    pub case: String,
    pub stratum: Stratum,
    pub structure: String,
    pub tier: String,
    /// Id, or the recorder's word for what is outside the library.
    pub truth: Vec<String>,
    pub strength: Option<Strength>,
    /// Why there is nothing to judge.
    pub failure: Option<String>,
    pub verdict: String,
    /// Says that anything is missing.
    pub claims: bool,
    /// Ids that were named, strongest evidence first.
    pub named: Vec<String>,
    /// Per true effect: named, or among the look-alikes of a name, or their set's.
    pub found: Vec<bool>,
    /// Whether the first name is right in that sense.
    pub first_right: bool,
    /// Whether the first name is the true one itself.
    pub first_exact: bool,
    /// Confident names, without look-alikes, of what is not there.
    pub overclaims: Vec<String>,
    /// Confident names, without look-alikes, of a twin of what is there.
    pub twins_overclaimed: Vec<String>,
    /// Where the effect was found by name: whether the place is right.
    pub located: Option<bool>,
    /// Outside the library: found, without a name, at the right place.
    pub left_unnamed: Option<bool>,
    pub parameters: Vec<Covered>,
    /// Nothing detectable is there, and the stated limit is not below the truth.
    pub limit_holds: Option<bool>,
    /// Nothing is claimed, and the report says of everything that is there that no such recording can show it.
    pub said_hidden: bool,
}

impl Judgement {
    /// Before anything is held against the truth.
    fn unanswered(case: &str, truth: &Truth, failure: Option<String>) -> Self {
        Self {
            case: case.into(),
            stratum: truth.stratum,
            structure: truth.structure.name.clone(),
            tier: truth.tier.clone(),
            truth: truth.effects.iter().map(word).collect(),
            strength: truth.strength,
            failure,
            verdict: String::new(),
            claims: false,
            named: vec![],
            found: vec![false; truth.effects.len()],
            first_right: false,
            first_exact: false,
            overclaims: vec![],
            twins_overclaimed: vec![],
            located: None,
            left_unnamed: None,
            parameters: vec![],
            limit_holds: None,
            said_hidden: false,
        }
    }

    /// What survives unknown phases and amplitudes, and what is coherent. What was planted without being measured counts as
    /// strong.
    pub fn d_primes(&self) -> [f64; 2] {
        match self.strength {
            Some(strength) => [strength.d_prime_surviving, strength.d_prime],
            None if self.truth.is_empty() => [0.0; 2],
            None => [f64::MAX; 2],
        }
    }
}

fn word(effect: &Value) -> String {
    effect["name"].as_str().or(effect["kind"].as_str()).unwrap_or("unknown").to_string()
}

/// Whether a reported effect stands for the true id.
pub(super) fn stands_for(reported: &Effect, id: &str) -> bool {
    look_alike(&reported.id, id) || reported.indistinguishable_from.iter().any(|other| other == id)
}

/// Holds a report, or the reason why there is none, against what the case of this name really holds.
pub fn judge(case: &str, truth: &Truth, report: &std::result::Result<Report, String>) -> Judgement {
    let mut judgement = Judgement::unanswered(case, truth, report.as_ref().err().cloned());
    let Ok(report) = report else { return judgement };
    let report = &truth.beside_somebody(report.clone());
    let ids: Vec<&str> = truth.ids().into_iter().flatten().collect();
    judgement.verdict = report.verdict.clone();
    judgement.claims = report.claims();
    judgement.named = report.effects.iter().map(|effect| effect.id.clone()).collect();
    let hidden = |id: &&str| report.not_detectable.iter().any(|limit| limit.id == **id && limit.at_most_db.is_none());
    judgement.said_hidden = !judgement.claims && !ids.is_empty() && ids.len() == truth.ids().len() && ids.iter().all(hidden);
    for (found, id) in judgement.found.iter_mut().zip(truth.ids()) {
        *found = id.is_some_and(|id| report.effects.iter().any(|reported| stands_for(reported, id)));
    }
    if let Some(first) = report.effects.first() {
        judgement.first_right = ids.iter().any(|id| stands_for(first, id));
        judgement.first_exact = ids.contains(&first.id.as_str());
    }
    for reported in &report.effects {
        let alone = reported.probability >= CONFIDENT && reported.indistinguishable_from.is_empty();
        if alone && !ids.contains(&reported.id.as_str()) {
            // Also of one that is left out: nothing that is left is nearer to it.
            let twin = truth.effects.iter().filter_map(|effect| effect["name"].as_str()).any(|id| look_alike(&reported.id, id));
            if twin { &mut judgement.twins_overclaimed } else { &mut judgement.overclaims }.push(reported.id.clone());
        }
    }
    for (effect, id) in truth.effects.iter().zip(truth.ids()) {
        match id {
            Some(id) => {
                if let Some(reported) = report.effects.iter().find(|reported| stands_for(reported, id)) {
                    let right = reported.place.stage.as_deref().is_some_and(|found| stage_fits(found, id, &reported.id))
                        && at_place(effect, &reported.place);
                    judgement.located = Some(judgement.located.unwrap_or(true) && right);
                }
                if let Some(reported) = report.effects.iter().find(|reported| reported.id == id) {
                    judgement.parameters.extend(coverage(id, effect, reported));
                }
                if let (false, Some(strength)) = (judgement.claims, truth.strength) {
                    let limit = report.not_detectable.iter().find(|limit| limit.id == id).and_then(|limit| limit.at_most_db);
                    judgement.limit_holds = limit.map(|limit| limit >= strength.effect_to_moving_db);
                }
            }
            None => {
                let there = report.unexplained.iter().any(|rest| at_place(effect, &rest.place));
                judgement.left_unnamed = Some(there && report.effects.is_empty());
            }
        }
    }
    judgement
}

/// The stage of the true effect, or of the twin that was named in its place.
fn stage_fits(found: &str, id: &str, named: &str) -> bool {
    [id, named].into_iter().any(|id| stage(id) == Some(found))
}

pub(super) fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(values) => values.iter().map(Value::as_f64).collect(),
        one => one.as_f64().map(|value| vec![value]),
    }
}

/// Whether a place is where the effect is, along every axis on which the effect has a place.
fn at_place(effect: &Value, place: &Place) -> bool {
    let within = |wanted: Option<u64>, found: &Option<Vec<usize>>| match wanted {
        Some(index) => found.as_ref().is_some_and(|indices| indices.contains(&(index as usize))),
        None => true,
    };
    let position = numbers(&effect["position_m"]).filter(|position| position.len() == 3);
    let near = position.is_none_or(|wanted| {
        let range = |at: &[f64]| at.iter().map(|x| x * x).sum::<f64>().sqrt();
        match (place.position_m, place.range_m) {
            // A row of receivers does not see the height: range and azimuth are held against each other.
            (Some(found), _) => {
                let angle = (wanted[0].atan2(wanted[1]) - found[0].atan2(found[1])).to_degrees().abs();
                (range(&found) - range(&wanted)).abs() <= PLACE_M && angle <= 15.0
            }
            (None, Some([low, high])) => (low - RANGE_SLACK_M..=high + RANGE_SLACK_M).contains(&range(&wanted)),
            (None, None) => false,
        }
    });
    let same = |key: &str, found: &Option<String>| effect[key].as_str().is_none_or(|wanted| found.as_deref() == Some(wanted));
    let frame = effect["frame"].as_u64().or(effect["at"].as_u64());
    near && same("boundary", &place.boundary)
        && same("body_part", &place.body_part)
        && within(effect["rx"].as_u64(), &place.rx)
        && within(frame, &place.frames)
}

/// What a parameter of docs/report.md is by the recorder's numbers; none where the two are not comparable, because the
/// report's unit is not fixed (amplitudes, levels of a direct current).
fn true_value(id: &str, parameter: &str, effect: &Value) -> Option<Vec<f64>> {
    if id == effects::dc_offset::ID || parameter == "amplitude" {
        return None;
    }
    if parameter == "level_db" && effect["relative"].is_f64() {
        return effect["relative"].as_f64().map(|relative| vec![20.0 * relative.log10()]);
    }
    let values = numbers(&effect[parameter])?;
    // The carrier's phase along a path is unknown to everybody, and so is the sign of a coefficient.
    Some(if parameter == "coefficient" { values.iter().map(|value| value.abs()).collect() } else { values })
}

fn coverage(id: &str, effect: &Value, reported: &Effect) -> Vec<Covered> {
    let mut all = vec![];
    for (name, parameter) in &reported.parameters {
        let (Some(truth), Some(_)) = (true_value(id, name, effect), numbers(&parameter.value)) else { continue };
        let intervals: Vec<Vec<f64>> = match numbers(&parameter.ci90) {
            Some(one) => vec![one],
            None => parameter.ci90.as_array().map(|list| list.iter().filter_map(numbers).collect()).unwrap_or_default(),
        };
        let magnitude = name == "coefficient";
        for (index, truth) in truth.iter().enumerate() {
            // The first receiver is what the others are relative to.
            if truth.abs() == 0.0 && index == 0 && intervals.len() > 1 && name != "position_m" {
                continue;
            }
            let covered = match intervals.get(index).map(Vec::as_slice) {
                Some(&[low, high]) if magnitude && low < 0.0 && high < 0.0 => (-high..=-low).contains(truth),
                Some(&[low, high]) => (low..=high).contains(truth),
                // No interval covers nothing.
                _ => false,
            };
            all.push(Covered { id: id.into(), parameter: name.clone(), covered });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::report::tests::report;
    use super::super::structures::{Structure, Who};
    use super::*;

    fn truth(stratum: &str, effects: Value, d_prime: f64) -> Truth {
        let strength = json!({
            "effect_to_noise_db": -20.0, "effect_to_moving_db": -30.0, "d_prime": d_prime, "d_prime_held_out": d_prime / 2.0, "d_prime_surviving": d_prime,
            "below_cover_db": 5.0, "gain_db": 0.0,
        });
        serde_json::from_value(json!({
            "stratum": stratum, "tier": "A", "effects": effects, "settings": "",
            "strength": if stratum == "null" { Value::Null } else { strength },
        }))
        .unwrap()
    }

    fn answer(effects: Value, unexplained: Value) -> std::result::Result<Report, String> {
        let verdict = if effects == json!([]) && unexplained == json!([]) { "no_mismatch" } else { "explained" };
        Ok(report(json!({
            "verdict": verdict, "effects": effects, "unexplained": unexplained,
            "not_detectable": [
                {"id": "breathing", "at_most_db": -25.0},
                {"id": "spur", "at_most_db": -40.0},
                {"id": "part_reflectivity", "at_most_db": null},
            ],
            "fit": {"before": {}, "after": {}},
        })))
    }

    #[test]
    fn a_name_a_stated_twin_and_a_theoretical_twin_are_right_and_anything_else_is_not() {
        let truth = truth("single", json!([{"name": "adc_start_error", "offset_s": 1e-7}]), 20.0);
        let named = |id: &str, probability: f64, twins: Value| {
            judge(
                "a",
                &truth,
                &answer(json!([{"id": id, "probability": probability, "indistinguishable_from": twins}]), json!([])),
            )
        };
        let exact = named("adc_start_error", 0.9, json!([]));
        assert!(exact.first_exact && exact.first_right && exact.overclaims.is_empty() && exact.found == [true]);
        let stated = named("if_highpass", 0.9, json!(["adc_start_error"]));
        assert!(!stated.first_exact && stated.first_right && stated.overclaims.is_empty());
        let theoretical = named("if_delay", 0.9, json!([]));
        assert!(theoretical.first_right && theoretical.overclaims.is_empty() && theoretical.twins_overclaimed == ["if_delay"]);
        let wrong = named("spur", 0.9, json!([]));
        assert!(!wrong.first_right && wrong.overclaims == ["spur"] && wrong.claims);
        assert!(named("spur", 0.6, json!([])).overclaims.is_empty());
    }

    #[test]
    fn intervals_are_held_against_the_truth_and_missing_ones_cover_nothing() {
        let truth = truth("single", json!([{"name": "tx_leakage", "range_m": 0.1, "relative": 0.1}]), 20.0);
        let with = |parameters: Value| {
            let effect = json!([{"id": "tx_leakage", "probability": 0.9, "parameters": parameters}]);
            judge("a", &truth, &answer(effect, json!([]))).parameters.iter().map(|p| p.covered).collect::<Vec<_>>()
        };
        assert_eq!(with(json!({"level_db": {"value": -20.5, "ci90": [-21.0, -19.0]}})), [true]);
        assert_eq!(with(json!({"level_db": {"value": -10.0, "ci90": [-11.0, -9.0]}})), [false]);
        assert_eq!(with(json!({"range_m": {"value": 0.1}})), [false]);
        assert_eq!(with(json!({"unheard_of": {"value": 0.1, "ci90": [0, 1]}})), Vec::<bool>::new());
    }

    #[test]
    fn places_are_compared_along_the_axes_that_the_effect_has() {
        let truth = truth("single", json!([{"name": "static_reflector", "position_m": [0.5, 3.0, 0.2], "amplitude": 1.0}]), 20.0);
        let at = |place: Value| {
            let effect = json!([{"id": "static_reflector", "probability": 0.9, "where": place}]);
            judge("a", &truth, &answer(effect, json!([]))).located
        };
        assert_eq!(at(json!({"stage": "scene", "position_m": [0.45, 3.1, 0.0]})), Some(true));
        assert_eq!(at(json!({"stage": "scene", "position_m": [-1.5, 2.6, 0.0]})), Some(false));
        assert_eq!(at(json!({"stage": "scene", "range_m": [2.9, 3.2]})), Some(true));
        assert_eq!(at(json!({"stage": "receiver", "range_m": [2.9, 3.2]})), Some(false));
        assert_eq!(at(json!({"stage": "scene"})), Some(false));
        assert_eq!(at(Value::Null), Some(false));
    }

    #[test]
    fn what_is_left_out_must_be_left_unnamed_and_its_twin_is_no_other_effect() {
        let mut truth = truth("outside", json!([{"name": "if_delay", "delay_s": 1e-8}]), 20.0);
        truth.left_out = Some("if_delay".into());
        let named = |id: &str| judge("a", &truth, &answer(json!([{"id": id, "probability": 0.9}]), json!([])));
        let unnamed = judge("a", &truth, &answer(json!([]), json!([{"where": {}, "behaves_like": "delay-proportional phase"}])));
        assert!(unnamed.left_unnamed == Some(true) && unnamed.overclaims.is_empty() && unnamed.found == [false]);
        let twin = named("adc_start_error");
        assert!(twin.left_unnamed == Some(false) && twin.overclaims.is_empty() && twin.twins_overclaimed == ["adc_start_error"]);
        assert_eq!(named("spur").overclaims, ["spur"]);
    }

    #[test]
    fn somebody_whom_nobody_tracked_is_no_false_alarm_and_anything_else_is() {
        let claims = |untracked: bool, effects: Value, unexplained: Value| {
            let person = if untracked { Who::Untracked } else { Who::Tracked };
            let structure = Structure { person, ..Structure::default() };
            let truth = Truth { structure, ..truth("null", json!([]), 0.0) };
            let judged = judge("a", &truth, &answer(effects, unexplained));
            (judged.claims, judged.overclaims)
        };
        let named = |id: &str| json!([{"id": id, "probability": 0.9}]);
        assert_eq!(claims(true, named("moving_reflector"), json!([{"behaves_like": "path-like"}])), (false, vec![]));
        assert_eq!(claims(false, named("moving_reflector"), json!([])), (true, vec!["moving_reflector".to_string()]));
        assert_eq!(claims(true, named("spur"), json!([])), (true, vec!["spur".to_string()]));
        assert!(claims(true, json!([]), json!([{"behaves_like": "quadratic in the signal"}])).0);
    }

    #[test]
    fn what_is_outside_must_be_found_and_left_unnamed() {
        let truth = truth("outside", json!([{"name": null, "kind": "gain_hop", "rx": 2, "db": 1.0}]), 20.0);
        let of = |effects: Value, unexplained: Value| judge("a", &truth, &answer(effects, unexplained));
        let good = of(json!([]), json!([{"where": {"rx": [2]}, "p_value": 1e-5}]));
        assert_eq!((good.left_unnamed, good.truth), (Some(true), vec!["gain_hop".to_string()]));
        assert_eq!(of(json!([]), json!([{"where": {"rx": [1]}, "p_value": 1e-5}])).left_unnamed, Some(false));
        let named = of(json!([{"id": "gain_drift", "probability": 0.95}]), json!([{"where": {"rx": [2]}}]));
        assert_eq!((named.left_unnamed, named.overclaims.len()), (Some(false), 1));
    }

    #[test]
    fn a_limit_holds_when_it_is_not_below_the_truth_and_failures_are_kept() {
        let weak = |id: &str| truth("undetectable", json!([{"name": id}]), 1.0);
        let silent = answer(json!([]), json!([]));
        assert_eq!(judge("a", &weak("breathing"), &silent).limit_holds, Some(true));
        assert_eq!(judge("a", &weak("spur"), &silent).limit_holds, Some(false));
        assert_eq!(judge("a", &weak("slope_error"), &silent).limit_holds, None);
        assert!(!judge("a", &weak("spur"), &silent).said_hidden && !judge("a", &weak("slope_error"), &silent).said_hidden);
        assert!(judge("a", &weak("part_reflectivity"), &silent).said_hidden);
        let failed = judge("a", &weak("spur"), &Err("no answer".into()));
        assert_eq!((failed.failure.as_deref(), failed.claims), (Some("no answer"), false));
    }
}
