//! How detection grows with strength in one recording: the table, its picture, and what programs read.

use std::fmt::Write as _;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::offered::{offered, refusal};
use super::outcome::{Outcome, Planted, outcome};
use super::{ANSWERS, BACKGROUND};
use crate::challenge::answer::Answers;
use crate::challenge::commitment::{Commitment, joint_root, open};
use crate::challenge::library;
use crate::challenge::psychometric::Logistic;
use crate::challenge::report::Report;
use crate::data::Recording;
use crate::data::atomic::write_text;
use crate::diagnosis::statistics::{binomial_interval, median};
use crate::error::{Error, Result};
use crate::pictures::{Panel, Scale, panels};
use crate::text::shown;

/// `dose.json`.
#[derive(Debug, Serialize)]
pub struct Dose {
    pub format: u32,
    pub recording: String,
    /// What was committed to: copies with their truths, then answers.
    pub copies: String,
    pub answers: String,
    /// What the recording shows by itself: ids, and how what has no name behaves.
    pub background: Vec<String>,
    pub rows: Vec<Row>,
    /// Per effect, where some copies were detected and others not.
    pub curves: Vec<Curve>,
    /// What this recording cannot be given, and why.
    pub refused: Vec<[String; 2]>,
    pub outcomes: Vec<Outcome>,
}

/// One effect at one grade.
#[derive(Debug, Serialize)]
pub struct Row {
    pub effect: String,
    pub grade: usize,
    pub strength: f64,
    pub unit: String,
    pub copies: usize,
    pub found: usize,
    pub nameless: usize,
    /// Copies with a wrong name, found or not.
    pub wrong: usize,
    /// Without a report, or undecided.
    pub unanswered: usize,
    /// Clopper and Pearson's 95 % for the share that was detected.
    pub interval: [f64; 2],
    /// Log-likelihood gain, median over the copies that were detected, nats.
    pub gain: Option<f64>,
}

/// A logistic law through the copies of one effect.
#[derive(Debug, Serialize)]
pub struct Curve {
    pub effect: String,
    /// Against log₁₀ of the strength.
    pub logistic: Logistic,
    /// Strength at which half are detected.
    pub half: f64,
}

/// What a truth says of its copy.
#[derive(Deserialize)]
struct Truth {
    salt: Salt,
}

#[derive(Deserialize)]
struct Salt {
    id: String,
    grade: usize,
    strength: f64,
    repeat: usize,
}

impl Outcome {
    /// By name or without one.
    fn detected(&self) -> bool {
        self.found || self.nameless
    }
}

/// Opens and verifies the truths, and holds the reports against them and the background.
///
/// # Errors
/// Anything that is not as it was committed to; the message names the copy.
pub fn dose(recording: &Recording, out: &Path) -> Result<Dose> {
    let commitments = Commitment::read_all(out)?;
    let answers = Answers::read(&out.join(ANSWERS))?;
    let copies = joint_root(&commitments);
    if answers.challenge != copies {
        return Err(Error::Usage {
            message: format!("the answers are to {}, the copies are {copies}", answers.challenge),
            hint: Some("the folder was changed after it was answered; nothing is scored".into()),
        });
    }
    let background = Report::read(&out.join(BACKGROUND).join("report.json"))?;
    let mut outcomes = vec![];
    for (name, leaf) in commitments.iter().flat_map(|commitment| &commitment.leaves) {
        let sealed = open(out, name, leaf)?;
        let Truth { salt } = serde_json::from_value(sealed.truth)
            .map_err(|error| Error::field(name, "truth", error.to_string(), "the truth of a salted copy"))?;
        let report = match (answers.reports.get(name), answers.failures.get(name)) {
            (Some(_), _) => Report::read(&out.join(ANSWERS).join(name).join("report.json")).map_err(|error| error.to_string()),
            (None, Some(reason)) => Err(reason.clone()),
            (None, None) => Err("no answer".into()),
        };
        let planted = Planted { case: name, effect: &salt.id, grade: salt.grade, repeat: salt.repeat, strength: salt.strength };
        outcomes.push(outcome(&planted, &report, &background));
    }
    let order = |effect: &str| super::offered::OFFERED.iter().position(|offered| offered.id == effect);
    outcomes.sort_by_key(|outcome| (order(&outcome.effect), outcome.grade, outcome.repeat));
    Ok(Dose::new(recording, [copies, answers.sha256], &background, outcomes))
}

impl Dose {
    fn new(recording: &Recording, [copies, answers]: [String; 2], background: &Report, outcomes: Vec<Outcome>) -> Self {
        let same_grade = |a: &Outcome, b: &Outcome| (&a.effect, a.grade) == (&b.effect, b.grade);
        let by_effect = outcomes.chunk_by(|a, b| a.effect == b.effect);
        let known = background.effects.iter().map(|effect| effect.id.clone());
        let (radar, codes) = (&recording.radar, recording.holds_codes());
        let refused = library::every().filter_map(|graded| Some([graded.id.into(), refusal(graded.id, radar, codes)?.into()]));
        Self {
            format: 1,
            recording: recording.folder.display().to_string(),
            copies,
            answers,
            background: known.chain(background.unexplained.iter().map(|rest| format!("({})", rest.behaves_like))).collect(),
            rows: outcomes.chunk_by(same_grade).map(Row::of).collect(),
            curves: by_effect.filter_map(Curve::of).collect(),
            refused: refused.collect(),
            outcomes,
        }
    }

    /// `results.md`, `dose.json` and `dose.png` in a folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        write_text(folder.join("results.md"), &shown(&self.markdown()))?;
        let value = serde_json::to_value(self).expect("plain data");
        write_text(folder.join("dose.json"), &format!("{value:#}\n"))?;
        panels(&folder.join("dose.png"), &self.panels())
    }

    /// The table, in Markdown, with half points and what was not planted.
    pub fn markdown(&self) -> String {
        let background = if self.background.is_empty() { "nothing".into() } else { self.background.join(", ") };
        let mut text = format!(
            "## What would be found in this recording\n\n`{}`; copies with effects committed to as `{}`, answers as `{}` before the \
             truths were opened. By itself the recording shows {background}: that counts for nothing below.\n\n{}",
            self.recording,
            self.copies,
            self.answers,
            self.table()
        );
        text.push_str("\n![Share detected over the strength](dose.png)\n");
        for curve in &self.curves {
            let unit = offered(&curve.effect).map_or("", |offered| offered.unit);
            let _ = write!(text, "\n- `{}`: half are detected at {} {unit}", curve.effect, number(curve.half));
        }
        text.push_str("\n\n### Not planted\n\n");
        for [id, reason] in &self.refused {
            let _ = writeln!(text, "- `{id}`: {reason}");
        }
        text
    }

    fn table(&self) -> String {
        let mut text = String::from(
            "| effect | strength | unit | copies | found by name | detected without a name | 95 % interval of both \
             | wrong name | unanswered | gain, nats |\n\
             |---|---|---|---|---|---|---|---|---|---|\n",
        );
        for row in &self.rows {
            let gain = row.gain.map_or("–".into(), |gain| format!("{gain:.1}"));
            let Row { effect, unit, copies, found, nameless, wrong, unanswered, interval: [low, high], .. } = row;
            let _ = writeln!(
                text,
                "| {effect} | {} | {unit} | {copies} | {found} | {nameless} | {low:.2} to {high:.2} | {wrong} | {unanswered} | {gain} |",
                number(row.strength)
            );
        }
        text
    }

    fn panels(&self) -> Vec<Panel> {
        let of = |rows: &[Row]| {
            let point = |row: &Row| {
                let share = (row.found + row.nameless) as f64 / row.copies.max(1) as f64;
                [row.strength, share, row.interval[0], row.interval[1]]
            };
            let points: Vec<[f64; 4]> = rows.iter().map(point).collect();
            let [low, high] = [points[0], points[points.len() - 1]].map(|point| point[0].log10());
            let logistic = self.curves.iter().find(|curve| curve.effect == rows[0].effect).map(|curve| curve.logistic);
            let along = (0..=100).map(|step| low + (high - low) * f64::from(step) / 100.0);
            let curve = logistic.map_or(vec![], |law| along.map(|x| [10f64.powf(x), law.at(x)]).collect());
            let (title, x_label) = (rows[0].effect.clone(), format!("strength ({})", rows[0].unit));
            Panel { title, x_label, x_scale: Scale::Log, points, curve }
        };
        self.rows.chunk_by(|a, b| a.effect == b.effect).map(of).collect()
    }
}

/// Three digits.
fn number(value: f64) -> String {
    if (1e-2..1e4).contains(&value) { format!("{value:.3}") } else { format!("{value:.2e}") }
}

impl Row {
    /// Of copies of one effect and grade.
    fn of(outcomes: &[Outcome]) -> Self {
        let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| of(outcome)).count();
        let mut gains: Vec<f64> =
            outcomes.iter().filter(|outcome| outcome.detected()).filter_map(|outcome| outcome.gain).collect();
        let first = &outcomes[0];
        Self {
            effect: first.effect.clone(),
            grade: first.grade,
            strength: first.strength,
            unit: offered(&first.effect).map_or("", |offered| offered.unit).into(),
            copies: outcomes.len(),
            found: count(|outcome| outcome.found),
            nameless: count(|outcome| outcome.nameless),
            wrong: count(|outcome| !outcome.wrong.is_empty()),
            unanswered: count(|outcome| outcome.failure.is_some() || outcome.verdict == "undecided"),
            interval: binomial_interval(count(Outcome::detected), outcomes.len(), 0.95),
            gain: (!gains.is_empty()).then(|| median(&mut gains)),
        }
    }
}

impl Curve {
    fn of(outcomes: &[Outcome]) -> Option<Self> {
        let points: Vec<(f64, bool)> = outcomes.iter().map(|outcome| (outcome.strength.log10(), outcome.detected())).collect();
        let logistic = Logistic::fit(&points).filter(|law| law.slope > 0.0)?;
        let half = 10f64.powf(logistic.level(0.5));
        half.is_finite().then(|| Self { effect: outcomes[0].effect.clone(), logistic, half })
    }
}
