//! Fitting the simulator to recordings: a run folder from a config.

use std::path::{Path, PathBuf};

use burn::tensor::Device;

use super::{Notice, Notify, claimed, found, notes, plausible, record, report::RunReport};
use crate::{
    config::Config,
    data::{atomic, files, settings},
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
    if resume.is_some() {
        is_the_same(&run_folder.join("config.toml"), &config_toml)?;
    }
    // What is refused leaves no run behind.
    let started = std::time::Instant::now();
    let load = if as_stated { load_recordings_as_stated } else { load_recordings };
    let recordings = load(&config.data.recordings, &config.simulator)?;
    let trainer = config.trainer(&recordings, &config_toml, &run_folder, devices)?;
    atomic::write_text(run_folder.join("config.toml"), &config_toml)?;
    notify(Notice::Run { folder: &run_folder, epochs: config.training.epochs });
    recordings.iter().flat_map(notes::of).for_each(|note| notify(Notice::Note(&note)));
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
    if let Some(table) = &mut config.diagnosis.calibration {
        // A training may never read it: it need not be there.
        *table = std::path::absolute(&*table).map_err(|error| Error::read(&*table, error))?;
    }
    for recording in &config.data.recordings {
        plausible::folder(recording, as_stated, notify)?;
    }
    Ok(())
}

/// Refuses to go on with a run of other settings: those asked for now, or those that a newer version adds with a value of its own.
fn is_the_same(file: &Path, resolved: &str) -> Result<()> {
    let was = toml::Value::Table(settings::resolve(file, &[])?);
    let is = toml::Value::Table(resolved.parse().expect("written by a config"));
    let Some((key, was, is)) = first_difference("", Some(&was), Some(&is)) else { return Ok(()) };
    let shown = |value: Option<&toml::Value>| value.map_or("not set".into(), toml::Value::to_string);
    Err(Error::field(file, key, shown(was), format!("{}, which this run would go on with", shown(is)))
        .with_hint("train in another folder, or state in the file what the run was started with"))
}

type Differing<'a> = (String, Option<&'a toml::Value>, Option<&'a toml::Value>);

/// The first key, with its sections, whose value is not the same in both.
fn first_difference<'a>(key: &str, a: Option<&'a toml::Value>, b: Option<&'a toml::Value>) -> Option<Differing<'a>> {
    let (Some(toml::Value::Table(left)), Some(toml::Value::Table(right))) = (a, b) else {
        return (a != b).then(|| (key.to_string(), a, b));
    };
    let keys: std::collections::BTreeSet<&String> = left.keys().chain(right.keys()).collect();
    keys.into_iter().find_map(|name| {
        let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
        first_difference(&key, left.get(name), right.get(name))
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_goes_on_with_its_own_settings_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        let refused = |was: &str, is: &str| {
            std::fs::write(&file, was).unwrap();
            is_the_same(&file, is).err().map(|error| error.to_string())
        };
        let is = "seed = 1\n[training]\nepochs = 3\n[training.loss]\nscale = \"likelihood\"\n";
        assert_eq!(refused(is, is), None);
        let otherwise_written = "# mine\nseed = 1\ntraining = { epochs = 3, loss = { scale = \"likelihood\" } }";
        assert_eq!(refused(otherwise_written, is), None);
        let error = refused(&is.replace("epochs = 3", "epochs = 4"), is).unwrap();
        assert!(error.contains("`training.epochs`") && error.contains("is 4") && error.contains("expected 3"), "{error}");
        assert!(refused("seed = ", is).is_some_and(|error| error.contains("config.toml")));
        // Of a version that had no such setting.
        let error = refused("seed = 1\n[training]\nepochs = 3\n[training.loss]\n", is).unwrap();
        assert!(error.contains("`training.loss.scale`") && error.contains("not set"), "{error}");
    }
}
