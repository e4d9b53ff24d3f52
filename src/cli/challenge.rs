//! `hybridsim challenge seal | run | twins | score | salt | calibrate`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{
    Common, calibrate,
    cases::{How, kept},
    progress::Shown,
    salt,
};
use crate::{
    data::Shard,
    error::Result,
    verbs::{Notify, challenge},
};

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(Subcommand)]
enum Step {
    /// Record cases with concealed effects, lock their truths away, and publish what commits to them
    Seal(Seal),
    /// Have every case diagnosed by a process that cannot see the truth
    Run(Run),
    /// Diagnose every scene once more without its effects, for what a perfect diagnosis would be left with
    Twins(Twins),
    /// Open the truths, verify them, and hold the reports against them
    Score(Score),
    /// Plant graded effects into a recording of yours, under a seal, and see what would be found in it
    Salt(salt::Arguments),
    /// Record nulls of your own radar, and make the table by which p-values of its recordings are calibrated
    Calibrate(calibrate::Arguments),
}

#[derive(Args)]
struct Seal {
    /// A config such as configs/challenge.toml
    config: PathBuf,
    /// Folder of the challenge
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Secret text that everything is drawn from; a published secret of 64 digits is taken as it is [default: from the operating system]
    #[arg(long, value_name = "TEXT")]
    seed: Option<String>,
    /// Only part i of n, such as 2/8
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

#[derive(Args)]
struct Run {
    /// Folder of the challenge; its sealed part need not be there
    challenge: PathBuf,
    /// Folder for the answers; a case that has one is skipped
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    how: How,
}

#[derive(Args)]
struct Twins {
    /// Folder of the challenge
    challenge: PathBuf,
    /// Folder of the answers, which must be complete: truths are opened
    answers: PathBuf,
    /// Folder for the twins' reports
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    how: How,
}

#[derive(Args)]
struct Score {
    /// Folder of the challenge
    challenge: PathBuf,
    /// Folder of the answers
    answers: PathBuf,
    /// Folder of the twins' reports; without it no recovered misfit is given
    #[arg(long, value_name = "DIR")]
    twins: Option<PathBuf>,
    /// Measure anew how strong the effects are: the truths hold what the program that sealed them measured
    #[arg(long)]
    measure: bool,
    /// Folder for results.md, score.json and psychometric.png [default: ANSWERS/score]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    match &arguments.step {
        Step::Seal(arguments) => seal(arguments, common),
        Step::Run(arguments) => answer(arguments, common),
        Step::Twins(arguments) => twins(arguments, common),
        Step::Score(arguments) => score(arguments, common),
        Step::Salt(arguments) => salt::run(arguments, common),
        Step::Calibrate(arguments) => calibrate::run(arguments, common),
    }
}

fn seal(arguments: &Seal, common: &Common) -> Result<()> {
    kept("cases that are sealed");
    let Seal { config, out, seed, shard } = arguments;
    let what = challenge::Seal { config, sets: &common.set, seed: seed.as_deref(), out };
    let commitment = shown(common, |notify| challenge::commit(&what, shard.unwrap_or(Shard::ALL), notify))?;
    say!("sealed {} cases in {}", commitment.cases, out.display());
    say!("publish before anybody diagnoses: root {}", commitment.root);
    Ok(())
}

/// Does a step and shows what it says.
fn shown<T>(common: &Common, step: impl FnOnce(&mut Notify<'_>) -> Result<T>) -> Result<T> {
    let mut shown = Shown::new(common.quiet);
    let done = step(&mut |notice| shown.show(notice));
    shown.finish();
    done
}

fn answer(arguments: &Run, common: &Common) -> Result<()> {
    let config = arguments.how.config(common)?;
    kept("answers");
    let answers = shown(common, |notify| challenge::run(&arguments.challenge, &arguments.out, &config, notify))?;
    say!("{} reports, {} failures in {}", answers.reports.len(), answers.failures.len(), arguments.out.display());
    if answers.complete {
        say!("publish before the truths are opened: {}", answers.sha256);
    } else {
        say!("not complete yet: the same command goes on");
    }
    Ok(())
}

fn twins(arguments: &Twins, common: &Common) -> Result<()> {
    let config = arguments.how.config(common)?;
    kept("reports of twins");
    let Twins { challenge, answers, out, .. } = arguments;
    let done = shown(common, |notify| challenge::twins(challenge, answers, out, &config, notify))?;
    say!("{done} twins diagnosed in {}", out.display());
    Ok(())
}

fn score(arguments: &Score, common: &Common) -> Result<()> {
    let Score { challenge, answers, twins, measure, out } = arguments;
    let out = out.clone().unwrap_or_else(|| answers.join("score"));
    let what = challenge::Scoring { challenge, answers, twins: twins.as_deref(), measure: *measure, out: &out };
    let scored = shown(common, |notify| challenge::score(&what, notify))?;
    say!("{}", scored.markdown());
    say!("results: {}", out.join("results.md").display());
    Ok(())
}
