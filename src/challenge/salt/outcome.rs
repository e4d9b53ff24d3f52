//! What a report of a salted copy says that the recording's own does not.

use serde::Serialize;
use serde_json::Value;

use super::offered::offered;
use crate::challenge::judge::{numbers, stands_for};
use crate::challenge::report::{Effect, Place, Report, Unexplained};

/// Of one copy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    pub case: String,
    pub effect: String,
    pub grade: usize,
    pub repeat: usize,
    pub strength: f64,
    pub verdict: String,
    /// Why there is no report.
    pub failure: Option<String>,
    /// Claimed by name, or by that of a look-alike, in addition to the background or with clearly other numbers.
    pub found: bool,
    /// The effect's own id, if it was found.
    pub exact: bool,
    /// Not named, but detected: something of its family that the background lacks.
    pub nameless: bool,
    /// Names that neither it nor the background has, or that are claimed more often than there, elsewhere or with clearly other numbers.
    pub wrong: Vec<String>,
    /// What else has no name and is not in the background.
    pub other_nameless: Vec<String>,
    /// Log-likelihood gain of the held-out frames by what was detected, nats.
    pub gain: Option<f64>,
}

/// What is planted.
pub struct Planted<'a> {
    pub case: &'a str,
    pub effect: &'a str,
    pub grade: usize,
    pub repeat: usize,
    pub strength: f64,
}

/// Holds the report of a copy, or the reason why there is none, against the recording's own.
pub fn outcome(planted: &Planted, report: &Result<Report, String>, background: &Report) -> Outcome {
    let mut outcome = Outcome {
        case: planted.case.into(),
        effect: planted.effect.into(),
        grade: planted.grade,
        repeat: planted.repeat,
        strength: planted.strength,
        verdict: String::new(),
        failure: report.as_ref().err().cloned(),
        found: false,
        exact: false,
        nameless: false,
        wrong: vec![],
        other_nameless: vec![],
        gain: None,
    };
    let Ok(report) = report else { return outcome };
    outcome.verdict = report.verdict.clone();
    let family = offered(planted.effect).map(|offered| offered.family);
    for effect in &report.effects {
        if stands_for(effect, planted.effect) {
            if is_new(effect, background) {
                outcome.found = true;
                outcome.exact |= effect.id == planted.effect;
                outcome.gain = larger(outcome.gain, effect.evidence.held_out_loglik_gain);
            }
        } else if !is_known(&effect.id, background) || is_one_more(effect, report, background) {
            outcome.wrong.push(effect.id.clone());
        }
    }
    for rest in report.unexplained.iter().filter(|rest| is_new_rest(rest, background)) {
        if family.is_some_and(|family| family.has(&rest.behaves_like)) {
            outcome.nameless |= !outcome.found;
            outcome.gain = larger(outcome.gain, rest.held_out_loglik_gain);
        } else {
            outcome.other_nameless.push(rest.behaves_like.clone());
        }
    }
    if report.verdict == "damaged" {
        // Its integrity is all that is known of it then.
        match family.is_some_and(|family| family.damaged) {
            true => outcome.nameless = true,
            false => outcome.wrong.push("damaged".into()),
        }
    }
    outcome
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        _ => a.or(b),
    }
}

/// Whether the background has a name, be it as a look-alike.
fn is_known(id: &str, background: &Report) -> bool {
    background.effects.iter().any(|known| known.id == id || known.indistinguishable_from.iter().any(|other| other == id))
}

/// Whether an effect is not in the background, or only with clearly other numbers or at another place.
fn is_new(effect: &Effect, background: &Report) -> bool {
    let same_name: Vec<&Effect> = background.effects.iter().filter(|known| known.id == effect.id).collect();
    match same_name[..] {
        [] => !is_known(&effect.id, background),
        _ => same_name.iter().all(|known| differ(effect, known) || apart(&effect.place, &known.place)),
    }
}

/// Whether a name is claimed more often than in the background, and this one is not what was claimed there.
fn is_one_more(effect: &Effect, report: &Report, background: &Report) -> bool {
    let count = |report: &Report| report.effects.iter().filter(|other| other.id == effect.id).count();
    count(report) > count(background) && is_new(effect, background)
}

/// Whether a parameter's 90 % intervals do not meet: of independent normal errors of one size that is 2.3 deviations of their difference
/// (2 %), and those of one recording's samples are far from independent.
fn differ(a: &Effect, b: &Effect) -> bool {
    a.parameters.iter().any(|(name, parameter)| {
        let other = b.parameters.get(name).map(|other| intervals(&other.ci90)).unwrap_or_default();
        intervals(&parameter.ci90).iter().zip(other).any(|(own, other)| own[1] < other[0] || other[1] < own[0])
    })
}

/// `[low, high]`, or a list of such pairs.
fn intervals(ci90: &Value) -> Vec<[f64; 2]> {
    let pair = |value: &Value| <[f64; 2]>::try_from(numbers(value)?).ok();
    match pair(ci90) {
        Some(one) => vec![one],
        None => ci90.as_array().into_iter().flatten().filter_map(pair).collect(),
    }
}

fn apart(a: &Place, b: &Place) -> bool {
    let elsewhere = |a: &Option<Vec<usize>>, b: &Option<Vec<usize>>| match (a, b) {
        (Some(a), Some(b)) => !a.iter().any(|index| b.contains(index)),
        _ => false,
    };
    let ranges = matches!((a.range_m, b.range_m), (Some(a), Some(b)) if a[1] < b[0] || b[1] < a[0]);
    ranges || elsewhere(&a.frames, &b.frames) || elsewhere(&a.rx, &b.rx)
}

fn is_new_rest(rest: &Unexplained, background: &Report) -> bool {
    let same = |known: &&Unexplained| known.behaves_like == rest.behaves_like;
    background.unexplained.iter().filter(same).all(|known| apart(&rest.place, &known.place))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::challenge::report::tests::report;

    fn of(effects: Value, unexplained: Value) -> Report {
        report(json!({
            "verdict": "explained", "effects": effects, "unexplained": unexplained, "fit": {"before": {}, "after": {}},
        }))
    }

    fn spur(low: f64, high: f64) -> Value {
        json!({
            "id": "spur", "probability": 0.9, "evidence": {"held_out_loglik_gain": 40.0},
            "parameters": {"frequency_hz": {"value": 0.5 * (low + high), "ci90": [low, high]}},
        })
    }

    fn judged(effect: &str, report: Report, background: &Report) -> Outcome {
        let planted = Planted { case: "a", effect, grade: 1, repeat: 0, strength: 0.1 };
        outcome(&planted, &Ok(report), background)
    }

    #[test]
    fn a_name_counts_that_the_background_lacks_or_has_with_clearly_other_numbers() {
        let silent = of(json!([]), json!([]));
        let found = judged("spur", of(json!([spur(1.0, 2.0)]), json!([])), &silent);
        assert!(found.found && found.exact && found.gain == Some(40.0) && found.wrong.is_empty());
        let background = of(json!([spur(1.0, 2.0)]), json!([]));
        assert!(!judged("spur", of(json!([spur(1.5, 2.5)]), json!([])), &background).found);
        assert!(judged("spur", of(json!([spur(1.5, 2.5), spur(7.0, 8.0)]), json!([])), &background).found);
        let twin = of(json!([{"id": "phase_noise", "probability": 0.9}]), json!([]));
        let twin = judged("chirp_start_jitter", twin, &silent);
        assert!(twin.found && !twin.exact);
        assert!(!judged("spur", silent.clone(), &silent).found);
    }

    #[test]
    fn other_names_are_wrong_unless_the_background_has_them() {
        let background =
            of(json!([{"id": "gain_drift", "probability": 0.9, "indistinguishable_from": ["phase_noise"]}]), json!([]));
        let both = of(
            json!([{"id": "gain_drift", "probability": 0.9}, {"id": "phase_noise", "probability": 0.9}, spur(1.0, 2.0)]),
            json!([]),
        );
        assert_eq!(judged("dc_offset", both, &background).wrong, ["spur"]);
        // A second one of a name, elsewhere; not the same with other numbers.
        let one = of(json!([spur(1.0, 2.0)]), json!([]));
        assert_eq!(judged("dc_offset", of(json!([spur(1.0, 2.0), spur(7.0, 8.0)]), json!([])), &one).wrong, ["spur"]);
        assert!(judged("dc_offset", of(json!([spur(7.0, 8.0)]), json!([])), &one).wrong.is_empty());
        let mut damaged = of(json!([]), json!([]));
        damaged.verdict = "damaged".into();
        assert_eq!(judged("dc_offset", damaged.clone(), &background).wrong, ["damaged"]);
        assert!(judged("frame_drop", damaged, &background).nameless);
    }

    #[test]
    fn what_has_no_name_is_detected_where_it_is_of_the_family_and_new() {
        let rest = |like: &str, low: f64| json!([{"behaves_like": like, "where": {"range_m": [low, low + 0.1]}, "held_out_loglik_gain": 20.0}]);
        let background = of(json!([]), rest("additive fast-time", 1.0));
        let detected = judged("dc_offset", of(json!([]), rest("additive fast-time", 3.0)), &background);
        assert!(detected.nameless && !detected.found && detected.gain == Some(20.0));
        assert!(!judged("dc_offset", of(json!([]), rest("additive fast-time", 1.05)), &background).nameless);
        let other = judged("dc_offset", of(json!([]), rest("slow-time gain", 3.0)), &background);
        assert!(!other.nameless && other.other_nameless == ["slow-time gain"]);
    }
}
