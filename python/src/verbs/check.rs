//! Whether a recording is whole, and can be.

use std::path::PathBuf;

use hybridsim::{
    data::Recording,
    integrity,
    plausibility::{Kind, findings},
    radar::checks,
    room::Room,
    verbs::{Notice, plausible},
};
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::{verbs::read::radar_json, work::run};

/// All findings about a recording, as JSON: the radar's rules, its plausibility, the integrity of its samples.
#[pyfunction]
pub fn check(py: Python<'_>, path: PathBuf, as_stated: bool, notify: &Bound<'_, PyAny>) -> PyResult<String> {
    run(py, notify, move |notify| {
        let recording = Recording::open(&path)?;
        notify(Notice::Begun { what: "checking", steps: 3 });
        let mut all = radar_rules(&recording);
        notify(Notice::Done(1));
        let (mut facts, sources) = plausible::of_recording(&recording)?;
        facts.as_stated = as_stated;
        all.extend(findings(&facts).into_iter().map(|finding| {
            json!({
                "about": "plausibility",
                "check": finding.field,
                "expected": finding.expected,
                "found": finding.found,
                "ok": finding.kind == Kind::Note || as_stated,
                "hint": finding.hint,
                "file": sources.of(finding.part),
            })
        }));
        notify(Notice::Done(2));
        // Every frame is read once, so that a truncated or lying file shows here.
        let found = integrity::inspect(&recording, recording.radar.frames)?;
        all.extend(found.iter().chain(&integrity::never_decided(&recording.radar)).map(convention));
        notify(Notice::Done(3));
        let about = json!({ "radar": radar_json(&recording.radar), "notes": recording.notes, "findings": all });
        Ok(about.to_string())
    })
}

/// A row of the table that `hybridsim check` prints.
fn convention(finding: &integrity::Finding) -> Value {
    json!({
        "about": "integrity",
        "check": finding.check,
        "kept": finding.kept(integrity::Against::Questioned),
        "expected": finding.expected,
        "found": finding.found,
        "ok": finding.ok,
        "frames": finding.frames,
        "p_value": finding.p_value,
    })
}

fn radar_rules(recording: &Recording) -> Vec<Value> {
    let farthest_m = recording.room.as_ref().and_then(Room::farthest_wall_m);
    let rules = checks(&recording.radar, farthest_m);
    let of = |rule: hybridsim::radar::Check| {
        let hint = (rule.passed == Some(false)).then_some(rule.reason);
        rule.passed.map(|passed| {
            json!({ "about": "radar", "check": rule.rule, "expected": rule.rule, "found": rule.found, "ok": passed, "hint": hint })
        })
    };
    rules.into_iter().filter_map(of).collect()
}
