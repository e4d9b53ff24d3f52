//! `hybridsim challenge salt`.

use std::path::PathBuf;

use clap::Args;

use super::{
    Common,
    cases::{How, WITHOUT, claimed},
    progress::Progress,
};
use crate::{
    challenge::salt::{self, SaltConfig, dose, ground, plan},
    data::{Recording, Shard},
    error::Result,
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording folder; it is never changed
    recording: PathBuf,
    /// Folder for the copies, their truths, the answers and the results; a run that was killed goes on there
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Effects to plant, such as spur,iq_imbalance [default: all that samples alone can be given]
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    effects: Vec<String>,
    /// Strengths of each, from the weakest to the strongest
    #[arg(long, value_name = "N", default_value_t = SaltConfig::default().grades)]
    grades: usize,
    /// Copies of each strength
    #[arg(long, value_name = "N", default_value_t = SaltConfig::default().repeats)]
    repeats: usize,
    /// Secret text that everything is drawn from; a published secret of 64 digits is taken as it is [default: from the operating system]
    #[arg(long, value_name = "TEXT")]
    seed: Option<String>,
    #[command(flatten)]
    how: How,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let (out, how) = (&arguments.out, arguments.how.config_without(&WITHOUT, common)?);
    let config = SaltConfig { effects: arguments.effects.clone(), grades: arguments.grades, repeats: arguments.repeats };
    let recording = Recording::open(&arguments.recording)?;
    // What cannot be is said before anything is worked out.
    let plans = plan::plans(&config, &recording)?;
    let _claim = claimed(out, how.shard, "copies and answers")?;
    let ground = ground::ground(&recording)?;
    if how.shard.number == 1 {
        let progress = Progress::new("the recording itself", 1, common.quiet);
        let background = salt::background(&recording, &ground, out, &how);
        progress.finish();
        let names: Vec<String> = background?.effects.into_iter().map(|effect| effect.id).collect();
        say!("by itself the recording shows {}", if names.is_empty() { "no effect".into() } else { names.join(", ") });
    }
    let count = plans.1.iter().filter(|plan| how.shard.holds(plan.index)).count();
    let progress = Progress::new("salting", count, common.quiet);
    let seed = arguments.seed.as_deref();
    let sealed = salt::seal(&recording, &ground, &plans, seed, out, how.shard, &|done| progress.set(done));
    progress.finish();
    say!("committed to {} copies: root {}", count, sealed?.root);
    let progress = Progress::new("diagnosing", salt::waiting(out, &how)?, common.quiet);
    let answers = salt::answer(out, &how, &mut |done| progress.set(done));
    progress.finish();
    let answers = answers?;
    if !salt::is_complete(out, &answers)? {
        let parts = if how.shard == Shard::ALL { "" } else { ", and so do those of the other parts" };
        say!("{} copies are answered, not all: the same command goes on{parts}", answers.reports.len() + answers.failures.len());
        return Ok(());
    }
    let dose = dose::dose(&recording, out)?;
    dose.write(out)?;
    say!("{}", dose.markdown());
    say!("results: {}", out.join("results.md").display());
    Ok(())
}
