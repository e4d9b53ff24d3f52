//! Fitting the simulator to recordings: a run folder from a config.

use std::path::{Path, PathBuf};

use burn::tensor::Device;

use super::{Notice, Notify, claimed, found, notes, plausible, record, report::RunReport};
use crate::{
    config::Config,
    data::{atomic, files},
    error::{Error, Result},
    evaluation::Evaluation,
    training::{LoadedRecording, checkpoint::Progress, load_recordings, load_recordings_as_stated, refine},
};

/// What to begin, or to go on with.
pub enum Start<'a> {
    /// The experiment of a config file, changed by `--set key=value`. Without `out` the run is kept in `runs/<config>`, or the
    /// next `runs/<config>-N` that is free. `go_on`: a run of the same settings that is in `out` is continued.
    /// `diagnose`: with the effects that the diagnosis finds in the first recording ([`found::add`]).
    Config { path: &'a Path, sets: &'a [String], out: Option<&'a Path>, go_on: bool, diagnose: bool },
    /// A run folder that was interrupted; `sets` must be empty where it holds a checkpoint.
    Resume { run: &'a Path, sets: &'a [String] },
}

/// A run that is done.
pub struct Trained {
    pub folder: PathBuf,
    pub progress: Progress,
    /// Of the best checkpoint on the held-out frames, by recording folder.
    pub evaluations: Vec<(PathBuf, Evaluation)>,
}

/// Trains, and leaves a run folder: config.toml (resolved), metrics.json, pictures, report.html, report.md, and the checkpoints
/// `best` and `last`.
///
/// # Errors
/// A config, recordings or checkpoints that cannot be used; a run folder that holds a run, or that cannot be written.
pub fn train(start: &Start<'_>, devices: &[Device], as_stated: bool, notify: &mut Notify<'_>) -> Result<Trained> {
    let (config_path, run_folder, sets, begun) = match *start {
        Start::Resume { run, sets } => (run.join("config.toml"), run.to_path_buf(), sets, true),
        Start::Config { path, sets, out, go_on, .. } => {
            let folder = out.map_or_else(|| fresh_run_folder(path), Path::to_path_buf);
            (path.to_path_buf(), folder, sets, go_on)
        }
    };
    let (mut resumed, mut resume) = (None, None);
    if begun {
        // Before anything in it is looked at.
        resumed = Some(claimed(&run_folder)?);
        let last = run_folder.join("last");
        atomic::recover(&last)?;
        resume = Some(last).filter(|last| last.is_dir());
    }
    let by_config = matches!(start, Start::Config { .. });
    if resume.is_some() && !by_config && !sets.is_empty() {
        return Err(Error::Usage {
            message: "--set: a resumed run keeps the settings it was started with".into(),
            hint: Some("start a new run with other settings, or edit nothing and leave --set out".into()),
        });
    }
    let mut config = Config::read(&config_path, sets)?;
    if resume.is_none() {
        holds_no_run(&run_folder)?;
    }
    let _claim = resumed.map_or_else(|| claimed(&run_folder), Ok)?;
    has_recordings(&mut config, &config_path, as_stated, notify)?;
    if matches!(start, Start::Config { diagnose: true, .. }) {
        found::add(&mut config, &run_folder, resume.is_some(), &devices[0], as_stated, notify)?;
    }
    let config_toml = config.to_toml();
    if resume.is_some() && by_config {
        is_the_same(&run_folder.join("config.toml"), &config_toml)?;
    }
    atomic::write_text(run_folder.join("config.toml"), &config_toml)?;
    notify(Notice::Run { folder: &run_folder, epochs: config.training.epochs });

    let started = std::time::Instant::now();
    let load = if as_stated { load_recordings_as_stated } else { load_recordings };
    let recordings = load(&config.data.recordings, &config.simulator)?;
    recordings.iter().flat_map(notes::of).for_each(|note| notify(Notice::Note(&note)));
    let trainer = config.trainer(&recordings, &config_toml, &run_folder, devices)?;
    let outcome = trainer.run(resume.as_deref(), &mut |event| notify(Notice::Training(&event)))?;

    let evaluations = reported(&run_folder, &config, recordings, &outcome.progress, (&devices[0], started))?;
    Ok(Trained { folder: run_folder, progress: outcome.progress, evaluations })
}

/// Writes the report of a run that is over; what it scored.
fn reported(
    folder: &Path,
    config: &Config,
    recordings: Vec<LoadedRecording>,
    progress: &Progress,
    (device, started): (&Device, std::time::Instant),
) -> Result<Vec<(PathBuf, Evaluation)>> {
    let refined = refine::read(folder)?;
    let recordings =
        recordings.into_iter().map(|recording| Ok(refine::refined(recording, &refined)?.0)).collect::<Result<Vec<_>>>()?;
    let found = found::line(folder)?;
    let seconds = started.elapsed().as_secs_f64();
    let found = found.as_deref();
    RunReport { refined: &refined, found, folder, config, recordings: &recordings, progress, device, seconds }.write()
}

fn holds_no_run(folder: &Path) -> Result<()> {
    match folder.join("last").is_dir() {
        false => Ok(()),
        true => Err(Error::Usage {
            message: format!("{}: already holds a run", folder.display()),
            hint: Some("continue it with --resume, or choose another folder with --out".into()),
        }),
    }
}

/// Records where a config names no recordings, and finds those that it names.
fn has_recordings(config: &mut Config, config_path: &Path, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
    if config.data.recordings.is_empty() {
        let recorded = record::recorded(config.record(config_path)?, config_path, as_stated, notify)?;
        config.data.recordings = vec![recorded];
    }
    absolute(&mut config.data.recordings)?;
    absolute(config.training.start_from.as_mut_slice())?;
    for recording in &config.data.recordings {
        plausible::folder(recording, as_stated, notify)?;
    }
    Ok(())
}

/// Refuses to go on with a run of other settings.
fn is_the_same(file: &Path, settings: &str) -> Result<()> {
    let found = files::read_text(file)?;
    let mut pairs = found.lines().zip(settings.lines());
    let (was, is) = pairs.find(|(was, is)| was != is).unwrap_or(("of another length", "those given now"));
    match found == settings {
        true => Ok(()),
        false => Err(Error::field(file, "the settings", format!("`{was}`"), format!("`{is}`"))
            .with_hint("train in another folder, or remove this run")),
    }
}

/// `runs/<config>`, or the next `runs/<config>-N` that is free.
fn fresh_run_folder(config: &Path) -> PathBuf {
    let stem = config.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    std::iter::once(stem.clone())
        .chain((2..).map(|count| format!("{stem}-{count}")))
        .map(|name| Path::new("runs").join(name))
        .find(|folder| !folder.exists())
        .expect("one of endlessly many names is free")
}

/// The resolved config must find its recordings from wherever a later command runs.
fn absolute(paths: &mut [PathBuf]) -> Result<()> {
    for path in paths {
        *path = files::absolute(&*path)?;
    }
    Ok(())
}
