//! `hybridsim compare`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    Common, Out, device,
    progress::Progress,
    scores::{self, LpipsArguments},
};
use crate::{
    data::{
        Recording,
        atomic::{self, AtomicFolder},
        entries::entries,
        files,
        recording::SETTINGS_FILE,
        settings::settings_from_table,
    },
    error::{Error, Result},
    evaluation::{self, ComparisonConfig},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for metrics.json and config.toml [default: nothing is written]")))]
pub(crate) struct Arguments {
    /// A measured recording, or a folder of them
    measured: PathBuf,
    /// What is to equal it: a simulated recording, or a folder of them under the same names
    simulated: PathBuf,
    #[command(flatten)]
    lpips: LpipsArguments,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let mut config: ComparisonConfig = settings_from_table(toml::Table::new(), "the defaults", &common.set)?;
    config.lpips = arguments.lpips.config().or(config.lpips);
    config.check()?;
    // what cannot be done is said before anything is
    let out = arguments.out.out.as_ref().map(AtomicFolder::create).transpose()?;
    let lpips = config.open_lpips(&device(&common.device)?)?;
    let pairs = pairs(&arguments.measured, &arguments.simulated)?;
    let open = |pair: &Pair| -> Result<[Recording; 2]> {
        let [measured, simulated] = [Recording::open(&pair.measured)?, Recording::open(&pair.simulated)?];
        evaluation::refuse_different(&measured, &simulated)?;
        Ok([measured, simulated])
    };
    pairs.iter().try_for_each(|pair| open(pair).map(drop))?;

    let progress = Progress::new("comparing", pairs.len(), common.quiet);
    let mut evaluations = Vec::new();
    for (index, pair) in pairs.iter().enumerate() {
        let [measured, simulated] = open(pair)?;
        let found = evaluation::compare(&measured, &simulated, &config.heatmap, &config.metrics, lpips.as_ref())?;
        evaluations.push((pair.name.clone(), found));
        progress.set(index + 1);
    }
    progress.finish();
    for (name, found) in &evaluations {
        say!("{name}");
        super::print(&scores::of_frames(found));
    }
    if let (true, Some(summary)) = (evaluations.len() > 1, scores::summary(&evaluations)) {
        say!("together");
        super::print(&scores::of_sequences(&summary));
    }
    if let Some(out) = out {
        atomic::write_text(out.path().join("metrics.json"), &scores::json(&evaluations))?;
        let config = toml::to_string_pretty(&config).expect("settings are plain data");
        atomic::write_text(out.path().join("config.toml"), &config)?;
        out.finish()?;
    }
    Ok(())
}

/// Two recording folders.
struct Pair {
    name: String,
    measured: PathBuf,
    simulated: PathBuf,
}

/// The recordings to compare: the two themselves, or all of the simulated folder with the measured ones of their names.
fn pairs(measured: &Path, simulated: &Path) -> Result<Vec<Pair>> {
    let is_recording = |folder: &Path| folder.is_file() || folder.join(SETTINGS_FILE).is_file();
    // `infer` and the baselines write theirs into a folder of results
    let recording_in = |folder: PathBuf| if is_recording(&folder) { folder } else { folder.join("recording") };
    if is_recording(measured) {
        let name = measured.display().to_string();
        return Ok(vec![Pair { name, measured: measured.into(), simulated: recording_in(simulated.into()) }]);
    }
    let list = |folder: &Path| -> Result<Vec<String>> {
        let folders = entries(folder)?.into_iter().filter(|path| path.is_dir() && is_recording(&recording_in(path.clone())));
        let name =
            |path: PathBuf| files::utf8(&path).map(|()| path.file_name().unwrap_or_default().to_string_lossy().into_owned());
        folders.map(name).collect()
    };
    let (wanted, names) = (list(measured)?, list(simulated)?);
    for (folder, names) in [(measured, &wanted), (simulated, &names)] {
        if names.is_empty() {
            return Err(Error::Usage {
                message: format!("{}: holds no recording", folder.display()),
                hint: Some("give two recording folders, or two folders of recordings under the same names".into()),
            });
        }
    }
    if let Some(name) = names.iter().find(|name| !wanted.contains(name)) {
        return Err(Error::Usage {
            message: format!("{}: no measured recording has this name", simulated.join(name).display()),
            hint: Some(format!("{} holds {} recordings, such as {}", measured.display(), wanted.len(), wanted[0])),
        });
    }
    if names.len() < wanted.len() {
        remark!(
            "note: {} of {} measured recordings have no simulation and are left out",
            wanted.len() - names.len(),
            wanted.len()
        );
    }
    Ok(names
        .into_iter()
        .map(|name| Pair { measured: recording_in(measured.join(&name)), simulated: recording_in(simulated.join(&name)), name })
        .collect())
}
