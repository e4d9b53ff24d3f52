//! Whether a scene can be: radar, room, body, motion and where they are, before anything is computed from them.
//!
//! A table of checks looks at the same [`Facts`] for every verb, so that all of them say the same. A check returns
//! [`Finding`]s: *refusals* of what cannot be meant (a body of 1,750 m, a person behind the radar), and *notes* of what may
//! be meant (a person who lies). Every refusal can be overruled by the user, who may know better: `--as-stated`.
//!
//! Checks run in stages; after a stage with a refusal the later ones, which would only repeat it, are left out.

mod antennas;
mod body;
mod code_facts;
mod codes;
mod facts;
mod motion;
mod place;
mod radar;
mod room;
mod units;

#[cfg(test)]
mod test_support;

use std::path::PathBuf;

pub use code_facts::CodeFacts;
pub use facts::{BodyFacts, Course, Facts, Look, RootPath};

use crate::error::{Error, Result};

/// Of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What cannot be meant, unless the user says so.
    Refuse,
    /// What may be meant.
    Note,
}

/// The part of a scene that a finding is about: which file to name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Radar, room and placement.
    Settings,
    Samples,
    Body,
    Motion,
}

/// What a check found.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub kind: Kind,
    pub part: Part,
    /// Key of a setting or of an array.
    pub field: String,
    pub found: String,
    pub expected: String,
    pub hint: Option<String>,
}

impl Finding {
    fn new(kind: Kind, part: Part, field: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { kind, part, field: field.into(), found: found.into(), expected: expected.into(), hint: None }
    }

    fn with_hint(mut self, text: impl Into<String>) -> Self {
        self.hint = Some(text.into());
        self
    }
}

/// Where the parts of a scene were read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    pub settings: PathBuf,
    pub samples: PathBuf,
    pub body: PathBuf,
    pub motion: PathBuf,
}

impl Sources {
    /// All from one file.
    pub fn one(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        Self { settings: path.clone(), samples: path.clone(), body: path.clone(), motion: path }
    }

    /// The file of a part.
    pub fn of(&self, part: Part) -> &PathBuf {
        match part {
            Part::Settings => &self.settings,
            Part::Samples => &self.samples,
            Part::Body => &self.body,
            Part::Motion => &self.motion,
        }
    }
}

/// A rule that scenes keep.
type Check = fn(&Facts) -> Vec<Finding>;

/// All checks, in stages: what follows from a wrong unit is not reported beside it.
const STAGES: [&[Check]; 6] = [
    &[codes::unsigned, radar::frequencies, radar::times, radar::sweep, radar::frame, antennas::spacing, room::size],
    &[body::length, body::faces_outwards, body::longest_upwards],
    &[motion::angles, motion::rate],
    &[motion::speed_of_the_root],
    &[motion::speed_of_limbs, motion::upright],
    &[place::unambiguous_range, place::in_front, place::in_the_room, place::on_the_floor, place::unambiguous_velocity],
];

/// What all checks find.
pub fn findings(facts: &Facts) -> Vec<Finding> {
    let mut all = Vec::new();
    for stage in STAGES {
        all.extend(stage.iter().flat_map(|check| check(facts)));
        if all.iter().any(|finding| finding.kind == Kind::Refuse) && !facts.as_stated {
            break;
        }
    }
    all
}

/// What is to be reported of findings, line by line; or the first refusal, with the others among the lines before it.
pub struct Verdict {
    pub notes: Vec<String>,
    pub refusal: Option<Error>,
}

impl Verdict {
    /// `as_stated`: the user keeps his word, and refusals become notes.
    pub fn new(findings: Vec<Finding>, sources: &Sources, as_stated: bool) -> Self {
        let (mut notes, mut refusal) = (Vec::new(), None);
        for Finding { kind, part, field, found, expected, hint } in findings {
            let refused = kind == Kind::Refuse && !as_stated;
            let hint = match (hint, refused) {
                (Some(hint), true) => Some(format!("{hint}; {AS_STATED}")),
                (None, true) => Some(AS_STATED.to_string()),
                (hint, false) => hint,
            };
            let error = Error::Field { path: sources.of(part).clone(), field, found, expected, hint: hint.clone() };
            if refused && refusal.is_none() {
                refusal = Some(error);
                continue;
            }
            let as_stated = if kind == Kind::Refuse && as_stated { ", taken as stated" } else { "" };
            notes.push(format!("{error}{as_stated}{}", hint.map(|hint| format!(" ({hint})")).unwrap_or_default()));
        }
        Self { notes, refusal }
    }

    /// # Errors
    /// The refusal.
    pub fn into_result(self) -> Result<()> {
        self.refusal.map_or(Ok(()), Err)
    }
}

/// How a user keeps his word.
const AS_STATED: &str = "--as-stated takes it as it is";

#[cfg(test)]
mod tests;
