//! How many cases are diagnosed one after the other: what the steps of `hybridsim challenge` share.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use super::{Common, interrupt};
use crate::{
    challenge::answer::RunConfig,
    data::{Claim, Shard, program},
    error::{Error, Result},
    verbs::challenge,
};

/// How cases are diagnosed.
#[derive(Args)]
pub(super) struct How {
    /// Only part i of n, such as 2/8
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Stop after so many cases
    #[arg(long, value_name = "N")]
    most: Option<usize>,
    /// Longest time for one case, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    limit: u64,
    /// Another program that understands `diagnose RECORDING --out DIR --quiet` [default: this one]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
}

/// What a diagnosis does that says nothing of what is planted.
pub(super) const WITHOUT: [&str; 2] = ["diagnosis.epochs=0", "diagnosis.limits=false"];

impl How {
    pub(super) fn config(&self, common: &Common) -> Result<RunConfig> {
        let program = match &self.program {
            Some(program) => program.canonicalize().map_err(|source| Error::read(program, source))?,
            None => program::file()?,
        };
        let sets = common.set.iter().flat_map(|set| ["--set".to_string(), set.clone()]);
        Ok(RunConfig {
            program,
            through: vec![],
            arguments: ["--device".to_string(), common.device.clone()].into_iter().chain(sets).collect(),
            shard: self.shard.unwrap_or(Shard::ALL),
            most: self.most,
            limit: Duration::from_secs(self.limit),
        })
    }

    /// The same with settings that those of the user go before, and what may be taken as stated.
    pub(super) fn config_without(&self, sets: &[&str], common: &Common) -> Result<RunConfig> {
        let mut config = self.config(common)?;
        let sets = sets.iter().flat_map(|set| ["--set".to_string(), set.to_string()]);
        let as_stated = common.as_stated.then(|| "--as-stated".to_string());
        config.arguments.splice(0..0, sets.chain(as_stated));
        Ok(config)
    }
}

/// A folder that is filled by this process, or by one for each part, and what stays when that is interrupted.
pub(super) fn claimed(folder: &Path, shard: Shard, what: &'static str) -> Result<Claim> {
    let claim = challenge::filled(folder, shard)?;
    kept(what);
    Ok(claim)
}

/// What stays when a folder's filling is interrupted.
pub(super) fn kept(what: &'static str) {
    interrupt::kept(move || format!("the {what} are kept; go on with: {}", interrupt::typed()));
}
