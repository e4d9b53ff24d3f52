//! `hybridsim reproduce`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Common, Out, devices, interrupt, plausible, progress::StageProgress, scores::LpipsArguments};
use crate::{
    data::{atomic, files},
    error::{Error, Result},
    experiments::{self, Plan, ReproduceConfig, Store, report, results, stage::read_record, stage::stage_folder},
    lpips::Lpips,
};

#[derive(Args)]
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
    #[command(flatten)]
    lpips: LpipsArguments,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut config = ReproduceConfig::read(&arguments.config, &common.set)?;
    if let Some(lpips) = arguments.lpips.config() {
        config.comparison.lpips = Some(lpips);
    }
    let out = match &arguments.out.out {
        Some(out) => out.clone(),
        None => Path::new("runs").join(arguments.config.file_stem().unwrap_or("reproduce".as_ref())),
    };
    std::fs::create_dir_all(&out).map_err(|error| Error::write(&out, error))?;
    // Stages name each other's files.
    let out = files::absolute(&out)?;
    let plan = experiments::plan(&config, &out)?;
    if arguments.plan {
        list(&plan, &out);
        return Ok(());
    }
    let wanted = match arguments.stages.as_slice() {
        [] => None,
        beginnings => Some(plan.needed(beginnings)?),
    };
    let scene = config.second_scene.as_ref().map(|scene| &scene.site);
    for site in std::iter::once(&config.site).chain(&config.second_room).chain(scene) {
        plausible::site(site, common)?;
    }
    let devices = devices(&common.device)?;
    if let Some(lpips) = &config.comparison.lpips {
        // A file that is none is refused now, not after the trainings.
        Lpips::open(lpips, &devices[0])?;
    }
    // As Burn prints it, without the wrapping type.
    let name = format!("{:?}", devices[0]).trim_start_matches("Device<").trim_end_matches('>').to_lowercase();
    let store = Store::open(&out, name)?;
    interrupt::kept(|| {
        let kept = "the stages that are done are kept, and of the one at work what it can go on from";
        format!("{kept}; go on with: {}", interrupt::typed())
    });
    atomic::write_text(out.join("config.toml"), &config.to_toml())?;
    if let Some(wanted) = wanted {
        let mut progress = StageProgress::new(wanted.len(), common.quiet);
        experiments::run_some(&plan, &wanted, &store, &devices, &mut |event| progress.show(&event))?;
        progress.finish();
        let done = plan.stages.iter().filter(|stage| store.done(&stage.key).is_some()).count();
        say!("{done} of {} stages are done: {}", plan.stages.len(), out.display());
        return Ok(());
    }
    let mut progress = StageProgress::new(plan.stages.len(), common.quiet);
    let records = experiments::run(&plan, &store, &devices, &mut |event| progress.show(&event))?;
    progress.finish();
    let results = results::collect(&plan, &store, &records)?;
    report::write(&out, &config, &results, &command(arguments, common))?;
    say!("results: {}", out.join("results.md").display());
    Ok(())
}

/// What was typed, as far as it decides the numbers.
fn command(arguments: &Arguments, common: &Common) -> String {
    let sets: String = common.set.iter().map(|set| format!(" --set '{set}'")).collect();
    let lpips = arguments.lpips.typed();
    format!("hybridsim reproduce {}{sets}{lpips} --device {}", arguments.config.display(), common.device)
}

fn list(plan: &Plan, out: &Path) {
    let mut text = String::new();
    let (mut done, mut seconds) = (0, 0.0);
    for stage in &plan.stages {
        let state = match read_record(&stage_folder(out, &stage.key)) {
            Some(record) => {
                done += 1;
                seconds += record.seconds;
                format!("{:9.1} s", record.seconds)
            }
            None => "       to do".into(),
        };
        text += &format!("{state}  {}\n", stage.key.folder());
    }
    text += &format!("{done} of {} stages are done, in {seconds:.0} s\n", plan.stages.len());
    super::tell(&text);
}
