//! `hybridsim record`.

use std::path::{Path, PathBuf};

use clap::Args;
use sha2::{Digest, Sha256};

use super::{Common, Out, plausible, progress::Progress};
use crate::{
    config::Config,
    data::{atomic::AtomicFolder, hex},
    error::Result,
    plausibility::Sources,
    recorder::{self, RecorderConfig},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A config with a [record] section
    config: PathBuf,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let config = Config::read(&arguments.config, &common.set)?;
    let record = config.record(&arguments.config)?;
    for note in record.motion_notes(arguments.config.parent().unwrap_or(Path::new("")))? {
        remark!("note: {note}");
    }
    let folder = match &arguments.out.out {
        Some(out) => {
            // What cannot be written is said before anything is worked out.
            AtomicFolder::create(out).map(drop)?;
            make(record, &arguments.config, out, common)?;
            out.clone()
        }
        None => recorded(record, &arguments.config, common)?,
    };
    say!("recording: {}", folder.display());
    Ok(())
}

/// The recording of these settings, made if it is not there yet: its folder in `runs/recordings` is named after
/// their hash. `config_path`: where the settings were read, which relative paths start from.
pub(crate) fn recorded(config: &RecorderConfig, config_path: &Path, common: &Common) -> Result<PathBuf> {
    let text = toml::to_string(config).expect("settings are plain data");
    let digest = Sha256::digest(format!("{} {text}", env!("CARGO_PKG_VERSION")));
    let folder = Path::new("runs/recordings").join(hex(&digest[..6]));
    if !folder.is_dir() {
        make(config, config_path, &folder, common)?;
    }
    Ok(folder)
}

fn make(config: &RecorderConfig, config_path: &Path, folder: &Path, common: &Common) -> Result<()> {
    let settings_folder = config_path.parent().unwrap_or(Path::new(""));
    let world = config.world(settings_folder)?;
    plausible::scene(Some(&world.radar), Some(&world.room), world.person.as_ref(), &Sources::one(config_path), common)?;
    let progress = Progress::new("recording", world.radar.frames, common.quiet);
    recorder::record_to(config, settings_folder, folder, &mut |done, _| progress.set(done))?;
    progress.finish();
    Ok(())
}
