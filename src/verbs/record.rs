//! Making a recording from settings.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{Notice, Notify, plausible};
use crate::{
    data::{Recording, atomic::AtomicFolder, hex},
    error::Result,
    plausibility::Sources,
    recorder::{self, RecorderConfig},
};

/// The recording of these settings, made if it is not there yet: its folder in `runs/recordings` is named after
/// their hash. `config_path`: where the settings were read, which relative paths start from.
///
/// # Errors
/// As [`make`].
pub fn recorded(config: &RecorderConfig, config_path: &Path, as_stated: bool, notify: &mut Notify<'_>) -> Result<PathBuf> {
    let text = toml::to_string(config).expect("settings are plain data");
    let digest = Sha256::digest(format!("{} {text}", env!("CARGO_PKG_VERSION")));
    let folder = Path::new("runs/recordings").join(hex(&digest[..6]));
    if !folder.is_dir() {
        make(config, config_path, &folder, as_stated, notify)?;
    }
    Ok(folder)
}

/// Records into `folder`, which appears when it is complete.
///
/// # Errors
/// Settings that describe no world, or one that cannot be; a folder that cannot be written.
pub fn make(
    config: &RecorderConfig,
    config_path: &Path,
    folder: &Path,
    as_stated: bool,
    notify: &mut Notify<'_>,
) -> Result<Recording> {
    // What cannot be written is said before anything is worked out.
    AtomicFolder::create(folder).map(drop)?;
    let settings_folder = config_path.parent().unwrap_or(Path::new(""));
    config.motion_notes(settings_folder)?.iter().for_each(|note| notify(Notice::Note(note)));
    let world = config.world(settings_folder)?;
    plausible::scene(
        Some(&world.radar),
        Some(&world.room),
        world.person.as_ref(),
        &Sources::one(config_path),
        as_stated,
        notify,
    )?;
    notify(Notice::Begun { what: "recording", steps: world.radar.frames });
    recorder::record_to(config, settings_folder, folder, &mut |done, _| notify(Notice::Done(done)))
}
