//! `hybridsim train`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    Common, Out, devices, interrupt, plausible,
    progress::TrainingProgress,
    record,
    report::{self, RunReport},
};
use crate::{
    config::Config,
    data::{atomic, files},
    error::{Error, Result},
    training::{load_recordings, load_recordings_as_stated, refine},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// The experiment, such as configs/quickstart.toml; with --resume it may be left out
    #[arg(required_unless_present = "resume")]
    config: Option<PathBuf>,
    /// Continue a run folder that was interrupted
    #[arg(long, value_name = "RUN", conflicts_with_all = ["config", "out"])]
    resume: Option<PathBuf>,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    // Before anything in it is looked at.
    let resumed = arguments.resume.as_deref().map(super::claimed).transpose()?;
    let (config_path, run_folder, resume) = match (&arguments.resume, &arguments.config) {
        (Some(run), _) => {
            atomic::recover(run.join("last"))?;
            (run.join("config.toml"), run.clone(), Some(run.join("last")).filter(|last| last.is_dir()))
        }
        (None, Some(config)) => {
            let folder = match &arguments.out.out {
                Some(out) => out.clone(),
                None => report::fresh_run_folder(config),
            };
            (config.clone(), folder, None)
        }
        (None, None) => unreachable!("clap asks for one of them"),
    };
    if resume.is_some() && !common.set.is_empty() {
        return Err(Error::Usage {
            message: "--set: a resumed run keeps the settings it was started with".into(),
            hint: Some("start a new run with other settings, or edit nothing and leave --set out".into()),
        });
    }
    let mut config = Config::read(&config_path, &common.set)?;
    let devices = devices(&common.device)?;
    if resume.is_none() && run_folder.join("last").is_dir() {
        return Err(Error::Usage {
            message: format!("{}: already holds a run", run_folder.display()),
            hint: Some("continue it with --resume, or choose another folder with --out".into()),
        });
    }
    let _claim = resumed.map_or_else(|| super::claimed(&run_folder), Ok)?;
    if config.data.recordings.is_empty() {
        let recorded = record::recorded(config.record(&config_path)?, &config_path, common)?;
        config.data.recordings = vec![recorded];
    }
    absolute(&mut config.data.recordings)?;
    absolute(config.training.start_from.as_mut_slice())?;
    for recording in &config.data.recordings {
        plausible::folder(recording, common)?;
    }
    let config_toml = config.to_toml();
    atomic::write_text(run_folder.join("config.toml"), &config_toml)?;
    tell_how_to_go_on(&run_folder, config.training.epochs, common);

    let started = std::time::Instant::now();
    let load = if common.as_stated { load_recordings_as_stated } else { load_recordings };
    let recordings = load(&config.data.recordings, &config.simulator)?;
    recordings.iter().for_each(report::tell_notes);
    let trainer = config.trainer(&recordings, &config_toml, &run_folder, &devices)?;
    let mut progress = TrainingProgress::new(common.quiet);
    let outcome = trainer.run(resume.as_deref(), &mut |event| progress.show(&event))?;
    progress.finish();

    let refined = refine::read(&run_folder)?;
    let recordings =
        recordings.into_iter().map(|recording| Ok(refine::refined(recording, &refined)?.0)).collect::<Result<Vec<_>>>()?;
    let report = RunReport {
        refined: &refined,
        folder: &run_folder,
        config: &config,
        recordings: &recordings,
        progress: &outcome.progress,
        device: &devices[0],
        seconds: started.elapsed().as_secs_f64(),
    };
    report.write()
}

/// If it is interrupted: which epoch the checkpoint is of, and the command that goes on from it.
fn tell_how_to_go_on(run_folder: &Path, epochs: usize, common: &Common) {
    let (folder, device) = (run_folder.to_path_buf(), common.device.clone());
    let as_stated = if common.as_stated { " --as-stated" } else { "" };
    interrupt::kept(move || {
        let done = files::read_text(folder.join("last/checkpoint.toml"))
            .ok()
            .and_then(|text| text.parse::<toml::Table>().ok()?.get("progress")?.get("epochs_done")?.as_integer())
            .unwrap_or(0);
        let program = std::env::args().next().unwrap_or_else(|| "hybridsim".into());
        let words = [&program, "train", "--resume", &folder.to_string_lossy(), "--device", &device].map(interrupt::quoted);
        let kept = format!("{done} of {epochs} epochs are kept in {}", folder.display());
        format!("{kept}; go on with: {}{as_stated}", words.join(" "))
    });
}

/// The resolved config must find its recordings from wherever a later command runs.
fn absolute(paths: &mut [PathBuf]) -> Result<()> {
    for path in paths {
        *path = files::absolute(&*path)?;
    }
    Ok(())
}
