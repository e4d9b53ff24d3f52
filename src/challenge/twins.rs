//! The oracle: every planted case once more, noise and all, but without its effects.
//!
//! What the same diagnosis says of the twin before it explains anything is what a perfect one would be left with: same
//! likelihood, same held-out frames, same simulator. Truths are opened for this, so the answers must be committed.

use std::path::Path;

use super::answer::{Answers, RunConfig, diagnose};
use super::commitment::Commitment;
use super::config::Stratum;
use super::seal::record_twin;
use super::truth::Truth;
use crate::data::Scratch;
use crate::error::{Error, Result};

/// Diagnoses the twins that have no report yet; `progress` receives how many are done. Returns how many there are.
pub fn run(challenge: &Path, answers: &Path, out: &Path, config: &RunConfig, progress: &mut dyn FnMut(usize)) -> Result<usize> {
    if !Answers::read(answers)?.complete {
        return Err(Error::Usage {
            message: format!("{}: not all cases are answered, and the truths stay closed until they are", answers.display()),
            hint: Some("finish `hybridsim challenge run` first".into()),
        });
    }
    let commitments = Commitment::read_all(challenge)?;
    std::fs::create_dir_all(out).map_err(|source| Error::write(out, source))?;
    let mut done = 0;
    for (index, (name, leaf)) in commitments.iter().flat_map(|commitment| &commitment.leaves).enumerate() {
        let folder = out.join(name);
        if !config.shard.holds(index) || folder.join("report.json").is_file() || folder.join("failure.json").is_file() {
            continue;
        }
        let truth = Truth::open(challenge, name, leaf)?;
        // A null is its own twin, and what is outside the library is not to be explained.
        if matches!(truth.stratum, Stratum::Null | Stratum::Outside | Stratum::Undetectable) {
            continue;
        }
        if config.most.is_some_and(|most| done >= most) {
            break;
        }
        let workplace = Scratch::new()?;
        let case = workplace.path().join(name);
        record_twin(&truth.settings, &truth.structure, &case)?;
        diagnose(&case, &folder, config, &mut || progress(done))?;
        done += 1;
        progress(done);
    }
    Ok(done)
}
