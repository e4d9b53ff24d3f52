//! `hybridsim reproduce`.

use std::{
    num::NonZero,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{Common, Out, devices, interrupt, progress::StageProgress, progress::notes, scores::LpipsArguments};
use crate::{
    error::Result,
    verbs::{
        Notice,
        reproduce::{Planned, Reproduce},
    },
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for the results [default: runs/ and the name of the config]")))]
pub(crate) struct Arguments {
    /// What to reproduce, such as configs/reproduce_smoke.toml
    config: PathBuf,
    /// List the stages, with what is done already, and do nothing
    #[arg(long)]
    plan: bool,
    /// Do only the stages whose names begin so, such as `figure` or `train/scene`, and what they need; may be repeated. The
    /// tables are written when all stages are done
    #[arg(long, value_name = "BEGINNING", conflicts_with = "plan")]
    stages: Vec<String>,
    /// Stages done side by side, each with its share of the cores; a small simulator's are done sooner so
    #[arg(long, value_name = "N", default_value_t = NonZero::<usize>::MIN)]
    jobs: NonZero<usize>,
    #[command(flatten)]
    lpips: LpipsArguments,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let out = match &arguments.out.out {
        Some(out) => out.clone(),
        None => Path::new("runs").join(arguments.config.file_stem().unwrap_or("reproduce".as_ref())),
    };
    let lpips = arguments.lpips.config();
    let planned = Planned::new(&Reproduce { config: &arguments.config, sets: &common.set, lpips, out: &out })?;
    if arguments.plan {
        return list(&planned);
    }
    let (devices, jobs) = (devices(&common.device)?, arguments.jobs.get());
    interrupt::kept(|| {
        let kept = "the stages that are done are kept, and of the one at work what it can go on from";
        format!("{kept}; go on with: {}", interrupt::typed())
    });
    let mut progress = StageProgress::new(common.quiet);
    let mut notify = |notice: Notice<'_>| match notice {
        Notice::Stage(event) => progress.show(event),
        other => notes(other),
    };
    match arguments.stages.as_slice() {
        [] => {
            planned.run(&command(arguments, common), &devices, jobs, common.as_stated, &mut notify)?;
            progress.finish();
            say!("results: {}", out.join("results.md").display());
        }
        beginnings => {
            let [done, of] = planned.run_some(beginnings, &devices, jobs, common.as_stated, &mut notify)?;
            progress.finish();
            say!("{done} of {of} stages are done: {}", out.display());
        }
    }
    Ok(())
}

/// What was typed, as far as it decides the numbers.
fn command(arguments: &Arguments, common: &Common) -> String {
    let sets: String = common.set.iter().map(|set| format!(" --set '{set}'")).collect();
    let lpips = arguments.lpips.typed();
    format!("hybridsim reproduce {}{sets}{lpips} --device {}", arguments.config.display(), common.device)
}

fn list(planned: &Planned) -> Result<()> {
    let mut text = String::new();
    let (mut done, mut total_s) = (0, 0.0);
    let stages = planned.stages()?;
    for stage in &stages {
        let state = match stage.seconds {
            Some(seconds) => {
                done += 1;
                total_s += seconds;
                format!("{seconds:9.1} s")
            }
            None => "       to do".into(),
        };
        text += &format!("{state}  {}\n", stage.folder);
    }
    text += &format!("{done} of {} stages are done, in {total_s:.0} s\n", stages.len());
    super::print(&text);
    Ok(())
}
