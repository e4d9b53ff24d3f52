//! All cases together: verified, judged, counted.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::answer::Answers;
use super::baselines::{self, Statistics};
use super::commitment::{Commitment, joint_root, left_out, sha256};
use super::config::Stratum;
use super::judge::{Judgement, judge};
use super::plan::scalable;
use super::psychometric::{Logistic, chart};
use super::report::{Measures, Report};
use super::rules::*;
use super::seal::measured;
use super::secret::Secret;
use super::structures::Who;
use super::table::{Row, markdown};
use super::truth::Truth;
use crate::data::atomic::write_text;
use crate::data::entries::entries;
use crate::data::files::read_json;
use crate::data::{Recording, read_toml};
use crate::error::{Error, Result};
use crate::text::shown;

mod rows;
mod usual;

/// A misfit per sample below this, nats, is nothing that could be removed.
const LEAST_REMOVABLE: f64 = 2.0e-3;

/// A case with everything that was found out about it.
struct Case {
    judgement: Judgement,
    report: Option<Report>,
    before: Measures,
    after: Measures,
    /// Of the twin.
    oracle: Option<Measures>,
    baseline: Option<Statistics>,
    concealed: bool,
    /// Somebody is there whom nobody tracks.
    untracked: bool,
}

/// The whole result, as `score.json` keeps it.
#[derive(Debug, Serialize)]
pub struct Score {
    pub challenge: String,
    pub answers: String,
    pub cases: usize,
    pub rows: Vec<Row>,
    /// Against log₁₀ d′.
    pub psychometric: Option<Logistic>,
    pub judgements: Vec<Judgement>,
    /// What did not go as it should, in words.
    pub failures: Vec<String>,
    #[serde(skip)]
    points: Vec<(f64, bool)>,
}

/// Verifies and scores. `twins`: the folder of [`super::twins`], where there is one. `remeasure`: strengths are measured anew, by
/// the measure of this program, and not taken from the truths.
///
/// # Errors
/// Anything that is not as it was committed to; the message names the case.
pub fn score(
    challenge: &Path,
    answers_folder: &Path,
    twins: Option<&Path>,
    remeasure: bool,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Score> {
    let commitments = Commitment::read_all(challenge)?;
    let answers = Answers::read(answers_folder)?;
    let root = joint_root(&commitments);
    if answers.challenge != root {
        return Err(Error::Usage {
            message: format!("the answers are to {}, the challenge is {root}", answers.challenge),
            hint: Some("score the folder that was answered".into()),
        });
    }
    verify_secret(challenge, &commitments)?;
    let leaves: Vec<(&String, &String)> = commitments.iter().flat_map(|commitment| &commitment.leaves).collect();
    nothing_else(challenge, &leaves)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let mut cases: Vec<Case> = leaves
        .par_iter()
        .map(|(name, leaf)| {
            let mut truth = Truth::open(challenge, name, leaf)?;
            let published = left_out(&commitments, name);
            if published != truth.left_out.as_ref() {
                return Err(Error::field(
                    name.as_str(),
                    "left_out",
                    format!("{published:?}"),
                    format!("{:?}, as the truth has it", truth.left_out),
                ));
            }
            if remeasure && truth.strength.is_some() {
                truth.strength = Some(measured(&truth.settings, Path::new(name))?);
            }
            let case = one(challenge, answers_folder, twins, &answers, name, &truth);
            progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1);
            Ok(case)
        })
        .collect::<Result<_>>()?;
    usual::mark_concealed(&mut cases);
    let points = points(&cases);
    let psychometric = Logistic::fit(&points);
    Ok(Score {
        challenge: root,
        answers: answers.sha256,
        cases: cases.len(),
        rows: rows::all(&cases, psychometric),
        psychometric,
        failures: cases.iter().filter_map(|case| failure(&case.judgement)).collect(),
        judgements: cases.into_iter().map(|case| case.judgement).collect(),
        points,
    })
}

fn verify_secret(challenge: &Path, commitments: &[Commitment]) -> Result<()> {
    let path = challenge.join("sealed/secret.toml");
    let secret: Secret = read_toml(&path)?;
    if commitments.iter().any(|commitment| commitment.secret_sha256 != sha256(&secret.seed)) {
        return Err(Error::field(path, "seed", "another one", "the seed that was committed to"));
    }
    Ok(())
}

/// The registry is closed: nothing was planted that was not committed to.
fn nothing_else(challenge: &Path, leaves: &[(&String, &String)]) -> Result<()> {
    let folder = challenge.join("cases");
    for case in entries(&folder)? {
        let name = case.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !leaves.iter().any(|(leaf, _)| **leaf == name) {
            return Err(Error::Usage { message: format!("case {name}: was never committed to"), hint: None });
        }
    }
    Ok(())
}

fn one(challenge: &Path, folder: &Path, twins: Option<&Path>, answers: &Answers, name: &str, truth: &Truth) -> Case {
    let report = match (answers.reports.get(name), answers.failures.get(name)) {
        (Some(_), _) => Report::read(&folder.join(name).join("report.json")).map_err(|error| error.to_string()),
        (None, Some(reason)) => Err(reason.clone()),
        (None, None) => Err("no answer".into()),
    };
    let fit = report.as_ref().map(|report| (report.usual(), report.fit.before, report.fit.after)).unwrap_or_default();
    let oracle =
        twins.and_then(|twins| read_json::<Report>(&twins.join(name).join("report.json")).ok()).map(|twin| twin.fit.before);
    let baseline = Recording::open(challenge.join("cases").join(name)).and_then(|case| baselines::statistics(&case)).ok();
    let (usual, before, after) = fit;
    Case {
        judgement: judge(name, truth, &report),
        report: report.ok(),
        before: Measures { loglik_per_sample: before.loglik_per_sample, ..usual },
        after: Measures { ..after },
        oracle,
        baseline,
        concealed: false,
        untracked: truth.structure.person == Who::Untracked,
    }
}

impl Case {
    fn is(&self, stratum: Stratum) -> bool {
        self.judgement.stratum == stratum
    }

    fn planted(&self) -> bool {
        !self.is(Stratum::Null)
    }

    /// What survives unknown phases of the body and amplitudes of the room.
    fn d_prime(&self) -> f64 {
        self.judgement.d_primes()[0]
    }

    /// What an observer would see who knows everything but the effect.
    fn coherent_d_prime(&self) -> f64 {
        self.judgement.d_primes()[1]
    }

    /// One effect of the library whose d′ says how hard it is.
    fn graded_single(&self) -> bool {
        let kinds = [Stratum::Single, Stratum::Masked, Stratum::Absorbed, Stratum::LookAlike, Stratum::Undetectable];
        kinds.contains(&self.judgement.stratum) && self.judgement.truth.iter().all(|id| scalable(id))
    }

    fn overclaims(&self) -> bool {
        !self.judgement.overclaims.is_empty()
    }

    fn all_found(&self) -> bool {
        self.judgement.found.iter().all(|&found| found)
    }

    fn undetectable(&self) -> bool {
        self.planted() && self.coherent_d_prime() < UNDETECTABLE_D_PRIME && self.judgement.truth.iter().all(|id| scalable(id))
    }

    /// (before − after) / (before − oracle) on held-out data; none where there was nothing to remove.
    fn recovered(&self) -> Option<f64> {
        let level = |measures: &Measures| measures.loglik_per_sample.map(|likelihood| -likelihood);
        // The receiver scales each recording on its own, and a density has the unit of its samples.
        let scale = self.judgement.strength?.gain_db / 10.0 * 10f64.ln();
        let (before, after) = (level(&self.before)?, level(&self.after)?);
        let oracle = level(self.oracle.as_ref()?)? + scale;
        (before - oracle > LEAST_REMOVABLE).then(|| (before - after) / (before - oracle))
    }
}

fn points(cases: &[Case]) -> Vec<(f64, bool)> {
    cases
        .iter()
        .filter(|case| case.graded_single() && case.judgement.strength.is_some())
        .map(|case| (case.d_prime().max(1e-3).log10(), case.judgement.claims))
        .collect()
}

/// What went wrong with a case, in a line; none if nothing did.
fn failure(judgement: &Judgement) -> Option<String> {
    let [d_prime, coherent] = judgement.d_primes();
    let reason = if let Some(reason) = &judgement.failure {
        format!("no usable report: {reason}")
    } else if judgement.stratum == Stratum::Null {
        if !judgement.claims {
            return None;
        }
        format!("false alarm, named {:?}", judgement.named)
    } else if !judgement.overclaims.is_empty() {
        format!("confident wrong name {:?}", judgement.overclaims)
    } else if judgement.stratum == Stratum::Undetectable || coherent < UNDETECTABLE_D_PRIME {
        if !judgement.claims {
            return None;
        }
        format!("claims what nobody can see, named {:?}", judgement.named)
    } else if !judgement.claims && d_prime >= OBVIOUS_D_PRIME {
        "missed".into()
    } else if judgement.stratum == Stratum::Outside {
        if judgement.left_unnamed == Some(true) || d_prime < OBVIOUS_D_PRIME {
            return None;
        }
        format!("not left unnamed at its place, named {:?}", judgement.named)
    } else if judgement.claims && !judgement.found.iter().all(|&found| found) {
        format!("not named, but {:?}", judgement.named)
    } else if judgement.located == Some(false) {
        "named at a wrong place".into()
    } else {
        return None;
    };
    let strength = match judgement.strength {
        Some(_) => format!("d′ {d_prime:.1}, coherent {coherent:.1}"),
        None => "not measured".into(),
    };
    Some(format!(
        "`{}` ({}{}, tier {}, {}, {strength}): {reason}",
        judgement.case,
        judgement.stratum.name(),
        if judgement.structure.is_empty() { String::new() } else { format!(", {}", judgement.structure) },
        judgement.tier,
        judgement.truth.join(" + ")
    ))
}

impl Score {
    /// `results.md`, `score.json` and `psychometric.png` in a folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
        write_text(folder.join("results.md"), &shown(&self.markdown()))?;
        let value = serde_json::to_value(self).expect("plain data");
        write_text(folder.join("score.json"), &format!("{value:#}\n"))?;
        chart(&self.points, self.psychometric).save(&folder.join("psychometric.png"))
    }

    /// The tables, in Markdown: all rows, effects, structures, and every failure.
    pub fn markdown(&self) -> String {
        let mut text = format!(
            "## Concealed data\n\n{} cases, committed to as `{}`; answers committed to as `{}` before the truths were opened.\n\nd′ counts what survives unknown phases of the body and amplitudes of the room; the coherent d′ counts everything.\n\n{}",
            self.cases,
            self.challenge,
            self.answers,
            markdown(&self.rows)
        );
        let _ = write!(text, "\n![Detection against strength](psychometric.png)\n\n### By effect\n\n{}", self.by_effect());
        let structures: BTreeSet<&str> = self.judgements.iter().map(|judgement| judgement.structure.as_str()).collect();
        if structures.len() > 1 {
            let _ = write!(text, "\n### By structure\n\n{}", self.by_structure(&structures));
        }
        let _ = write!(text, "\n### Every failure ({})\n\n", self.failures.len());
        for failure in &self.failures {
            let _ = writeln!(text, "- {failure}");
        }
        text
    }

    /// How the cases of each structure fared.
    fn by_structure(&self, structures: &BTreeSet<&str>) -> String {
        let mut text = format!(
            "Planted: with d′ ≥ {OBVIOUS_D_PRIME}. Right: each effect named, look-alikes allowed, or left without a name where no name is known.\n\n\
             | structure | nulls | with a claim | planted | detected | right | confident wrong name |\n|---|---|---|---|---|---|---|\n"
        );
        for structure in structures {
            let of = |planted: bool| {
                let within = move |judgement: &&Judgement| {
                    judgement.structure == *structure && (judgement.stratum != Stratum::Null) == planted
                };
                self.judgements.iter().filter(within)
            };
            let strong = || of(true).filter(|judgement| judgement.d_primes()[0] >= OBVIOUS_D_PRIME);
            let is_right =
                |judgement: &&Judgement| judgement.left_unnamed.unwrap_or_else(|| judgement.found.iter().all(|&found| found));
            let _ = writeln!(
                text,
                "| {structure} | {} | {} | {} | {} | {} | {} |",
                of(false).count(),
                of(false).filter(|judgement| judgement.claims).count(),
                strong().count(),
                strong().filter(|judgement| judgement.claims).count(),
                strong().filter(is_right).count(),
                of(true).filter(|judgement| !judgement.overclaims.is_empty()).count(),
            );
        }
        text
    }

    /// How each single effect that could be detected fared.
    fn by_effect(&self) -> String {
        let mut counts: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
        for judgement in &self.judgements {
            let strong = judgement.d_primes()[0] >= OBVIOUS_D_PRIME;
            if let ([truth], true) = (&judgement.truth[..], strong) {
                let count = counts.entry(truth).or_default();
                count[0] += 1;
                count[1] += usize::from(judgement.claims);
                count[2] += usize::from(judgement.found[0] || judgement.left_unnamed == Some(true));
            }
        }
        let mut text =
            format!("Cases with d′ ≥ {OBVIOUS_D_PRIME}.\n\n| effect | cases | detected | right |\n|---|---|---|---|\n");
        for (effect, [n, detected, right]) in counts {
            let _ = writeln!(text, "| {effect} | {n} | {detected} | {right} |");
        }
        text
    }
}
