//! Has every case diagnosed by a process of its own, which is shown a copy of the case and nothing else.
//!
//! Only `commitment*.json` and `cases/` are opened here, never `sealed/`: a challenge whose sealed folder was moved to
//! another machine is answered just the same. A process that crashes, takes too long or leaves a report that is none has
//! failed, and the failure stands; who wants it repeated removes its folder.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::commitment::{Commitment, canonical, hash_file, joint_root, left_out, sha256};
use super::report::Report;
use super::worker::Worker;
use crate::data::atomic::{AtomicFolder, write_text};
use crate::data::entries::entries;
use crate::data::files::read_json;
use crate::data::unfinished::wait_if_ending;
use crate::data::{Scratch, Shard, files};
use crate::error::{Error, Result};

/// In the folder that a case is diagnosed in: its copy, and what is answered. A report names the recording as it was given: not by a
/// path that is another one each time.
const COPY: &str = "recording";
const ANSWER: &str = "answer";

/// How the cases are to be diagnosed.
#[derive(Clone, Debug)]
pub struct RunConfig {
    /// Called as `PROGRAM diagnose CASE --out FOLDER --quiet`, then `arguments`, in a folder of its own that both paths start from.
    pub program: PathBuf,
    /// What is called in its place, where the program is a library: a command that answers by it.
    pub through: Vec<OsString>,
    pub arguments: Vec<String>,
    pub shard: Shard,
    /// Cases to diagnose now; those with an answer do not count.
    pub most: Option<usize>,
    /// Longest time for one case.
    pub limit: Duration,
}

impl RunConfig {
    /// The same without an effect of the library.
    fn without(&self, id: &str) -> Self {
        let mut config = self.clone();
        config.arguments.extend(["--set".into(), format!("diagnosis.left_out=[\"{id}\"]")]);
        config
    }
}

/// `answers.json`: to be published before the truths are opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    pub format: i64,
    /// Root of what was committed to.
    pub challenge: String,
    /// Of the program that diagnosed.
    pub program_sha256: String,
    /// Whether every case has an answer or a failure.
    pub complete: bool,
    /// Name of the case → SHA-256 of its report.
    pub reports: BTreeMap<String, String>,
    /// Name of the case → what went wrong.
    pub failures: BTreeMap<String, String>,
    /// Of all the above, as canonical JSON.
    pub sha256: String,
}

/// `failure.json`.
#[derive(Serialize, Deserialize)]
pub(super) struct Failure {
    pub reason: String,
}

impl Answers {
    fn digest(&self) -> String {
        let mut value = serde_json::to_value(self).expect("plain data");
        value.as_object_mut().expect("a struct").remove("sha256");
        sha256(canonical(&value))
    }

    /// Reads the answers and holds them against their own hash and the reports against theirs.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("answers.json");
        let answers: Self = read_json(&path)?;
        if answers.digest() != answers.sha256 {
            return Err(Error::field(&path, "sha256", "not the hash of the answers", "untouched answers"));
        }
        for (name, hash) in &answers.reports {
            if hash_file(&folder.join(name).join("report.json"))? != *hash {
                return Err(Error::Usage {
                    message: format!("case {name}: its report is not the one that was committed to"),
                    hint: Some("the answers were changed after the run; nothing is scored".into()),
                });
            }
        }
        Ok(answers)
    }
}

/// Diagnoses what has no answer yet and writes `answers.json`. `progress` receives how many are done, also while one is at work:
/// whoever unwinds from it ends that one.
pub fn run(challenge: &Path, out: &Path, config: &RunConfig, progress: &mut dyn FnMut(usize)) -> Result<Answers> {
    let commitments = Commitment::read_all(challenge)?;
    let names: Vec<&String> = commitments.iter().flat_map(|commitment| commitment.leaves.keys()).collect();
    let mine = names.iter().enumerate().filter(|(index, _)| config.shard.holds(*index)).map(|(_, name)| *name);
    each(mine, challenge, &commitments, out, config, progress)?;
    gather(&names, out, &commitments, &config.program)
}

/// Diagnoses those of some cases that have no answer yet.
pub(super) fn each<'a>(
    names: impl Iterator<Item = &'a String>,
    challenge: &Path,
    commitments: &[Commitment],
    out: &Path,
    config: &RunConfig,
    progress: &mut dyn FnMut(usize),
) -> Result<()> {
    fs::create_dir_all(out).map_err(|source| Error::write(out, source))?;
    let open = names.filter(|name| !answered(&out.join(name)));
    for (index, name) in open.take(config.most.unwrap_or(usize::MAX)).enumerate() {
        let of_case = left_out(commitments, name).map(|id| config.without(id));
        let case = challenge.join("cases").join(name);
        diagnose(&case, &out.join(name), of_case.as_ref().unwrap_or(config), &mut || progress(index))?;
        progress(index + 1);
    }
    Ok(())
}

/// Cases of this shard that have no answer yet.
pub fn waiting(challenge: &Path, out: &Path, config: &RunConfig) -> Result<usize> {
    let commitments = Commitment::read_all(challenge)?;
    let names = commitments.iter().flat_map(|commitment| commitment.leaves.keys());
    let open = names.enumerate().filter(|(index, name)| config.shard.holds(*index) && !answered(&out.join(name))).count();
    Ok(config.most.map_or(open, |most| open.min(most)))
}

pub(super) fn answered(folder: &Path) -> bool {
    folder.join("report.json").is_file() || folder.join("failure.json").is_file()
}

/// One case in a process of its own; whatever becomes of it is kept in `out`. `meanwhile` is called while it works.
pub fn diagnose(case: &Path, out: &Path, config: &RunConfig, meanwhile: &mut dyn FnMut()) -> Result<()> {
    let workplace = Scratch::new()?;
    let (copy, answer) = (workplace.path().join(COPY), workplace.path().join(ANSWER));
    fs::create_dir(&copy).map_err(|source| Error::write(&copy, source))?;
    for file in entries(case)? {
        files::require(&file)?;
        let name = file.file_name().expect("an entry of a folder");
        fs::copy(&file, copy.join(name)).map_err(|source| Error::read(&file, source))?;
    }
    let outcome = start(workplace.path(), config, meanwhile)
        .and_then(|()| Report::read(&answer.join("report.json")).map(drop).map_err(|error| format!("bad report: {error}")));
    // What failed because everything is ended has not failed.
    wait_if_ending();
    let folder = AtomicFolder::replacing(out)?;
    match outcome {
        Ok(()) => {
            for file in ["report.json", "report.html"].map(|file| (answer.join(file), folder.path().join(file))) {
                if file.0.is_file() {
                    fs::copy(&file.0, &file.1).map_err(|source| Error::write(&file.1, source))?;
                }
            }
        }
        Err(reason) => {
            let text = serde_json::to_string(&Failure { reason }).expect("a text");
            write_text(folder.path().join("failure.json"), &text)?;
        }
    }
    folder.finish()
}

/// Runs the program; the reason if it did not do its work.
fn start(workplace: &Path, config: &RunConfig, meanwhile: &mut dyn FnMut()) -> std::result::Result<(), String> {
    let complaints = workplace.join("stderr");
    let stderr = fs::File::create(&complaints).map_err(|error| error.to_string())?;
    let (called, before) = config.through.split_first().map_or((config.program.as_os_str(), &[][..]), |(one, more)| (one, more));
    let mut command = Command::new(called);
    command
        .args(before)
        .arg("diagnose")
        .arg(COPY)
        .arg("--out")
        .arg(ANSWER)
        .arg("--quiet")
        .args(&config.arguments)
        .current_dir(workplace)
        // Nothing that says where the challenge lies, and nothing left elsewhere.
        .env_remove("PWD")
        .env_remove("OLDPWD")
        .env("TMPDIR", workplace)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr);
    let mut worker = Worker::start(&mut command).map_err(|error| format!("{}: cannot be started: {error}", called.display()))?;
    match worker.wait(config.limit, meanwhile).map_err(|error| error.to_string())? {
        None => Err(format!("not done after {:.0} s", config.limit.as_secs_f64())),
        Some(status) if status.success() => Ok(()),
        Some(status) => Err(complaint(status, &complaints)),
    }
}

fn complaint(status: ExitStatus, stderr: &Path) -> String {
    let text = fs::read(stderr).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let last: String = text.lines().last().unwrap_or_default().chars().take(300).collect();
    format!("{status}: {last}")
}

/// Commits to all answers that there are.
pub(super) fn gather(names: &[&String], out: &Path, commitments: &[Commitment], program: &Path) -> Result<Answers> {
    let (mut reports, mut failures) = (BTreeMap::new(), BTreeMap::new());
    for &name in names {
        let folder = out.join(name);
        if folder.join("report.json").is_file() {
            reports.insert(name.clone(), hash_file(&folder.join("report.json"))?);
        } else if folder.join("failure.json").is_file() {
            failures.insert(name.clone(), read_json::<Failure>(&folder.join("failure.json"))?.reason);
        }
    }
    let mut answers = Answers {
        format: 1,
        challenge: joint_root(commitments),
        program_sha256: hash_file(program)?,
        complete: reports.len() + failures.len() == names.len(),
        reports,
        failures,
        sha256: String::new(),
    };
    answers.sha256 = answers.digest();
    let value: Value = serde_json::to_value(&answers).expect("plain data");
    write_text(out.join("answers.json"), &format!("{value:#}\n"))?;
    Ok(answers)
}
