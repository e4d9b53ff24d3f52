//! `hybridsim record`.

use std::path::{Path, PathBuf};

use clap::Args;
use sha2::{Digest, Sha256};

use super::{Common, Out, progress::Progress};
use crate::{
    config::Config,
    error::{Error, Result},
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
    let folder = match &arguments.out.out {
        Some(out) => {
            if out.exists() {
                return Err(Error::Usage {
                    message: format!("{}: exists already", out.display()),
                    hint: Some("choose another folder with --out, or remove this one".into()),
                });
            }
            make(record, out, common.quiet)?;
            out.clone()
        }
        None => recorded(record, Path::new("runs/recordings"), common.quiet)?,
    };
    println!("recording: {}", folder.display());
    Ok(())
}

/// The recording of these settings, made if it is not there yet: its folder is named after their hash.
pub(crate) fn recorded(config: &RecorderConfig, parent: &Path, quiet: bool) -> Result<PathBuf> {
    let text = toml::to_string(config).expect("settings are plain data");
    let hash: String = Sha256::digest(format!("{} {text}", env!("CARGO_PKG_VERSION"))).iter().take(6).map(|byte| format!("{byte:02x}")).collect();
    let folder = parent.join(hash);
    if !folder.is_dir() {
        std::fs::create_dir_all(parent).map_err(|error| Error::write(parent, error))?;
        make(config, &folder, quiet)?;
    }
    Ok(folder)
}

fn make(config: &RecorderConfig, folder: &Path, quiet: bool) -> Result<()> {
    let progress = Progress::new("recording", config.frames(), quiet);
    recorder::record_to(config, folder, &mut |frame| progress.set(frame))?;
    progress.finish();
    Ok(())
}
