//! What a diagnosis finds in a recording, as effects of the simulator that is trained on it.

use std::path::Path;

use burn::tensor::Device;

use super::{Notice, Notify, diagnose};
use crate::{
    config::Config,
    data::{atomic, files::read_json},
    diagnosis,
    effects::EffectSetting,
    error::{Error, Result},
};

/// In a run folder: the diagnosis' report, and `effects.json`, what the simulator was given.
const FOLDER: &str = "diagnosis";
const EFFECTS: &str = "effects.json";

/// Diagnoses the config's first recording into `RUN/diagnosis` and adds to the simulator's effects what was found, unless the config
/// has such an effect already. `again`: the run goes on, with what was found when it began.
///
/// # Errors
/// Whatever [`diagnose::diagnose`] refuses; a run that goes on and was begun without a diagnosis.
pub fn add(
    config: &mut Config,
    run_folder: &Path,
    again: bool,
    device: &Device,
    as_stated: bool,
    notify: &mut Notify<'_>,
) -> Result<()> {
    let out = run_folder.join(FOLDER);
    if !again {
        let [recording, others @ ..] = config.data.recordings.as_slice() else { unreachable!("recordings were found") };
        if !others.is_empty() {
            let note = format!("of {} recordings the first is diagnosed: {}", others.len() + 1, recording.display());
            notify(Notice::Note(&note));
        }
        let what = diagnose::Diagnose { recording, checkpoint: None, config, out: &out };
        let diagnosis = diagnose::diagnose(&what, device, as_stated, notify)?;
        notify(Notice::Line(&diagnosis::html::lead(&diagnosis.report)));
        let known = |effect: &EffectSetting| config.simulator.effects.iter().any(|known| known.id == effect.id);
        let found: Vec<EffectSetting> = diagnosis.effects().into_iter().filter(|effect| !known(effect)).collect();
        atomic::write_text(out.join(EFFECTS), &serde_json::to_string_pretty(&found).expect("plain data"))?;
    }
    let found = read(run_folder)?.ok_or_else(|| Error::Usage {
        message: format!("{}: this run was begun without a diagnosis", run_folder.display()),
        hint: Some("go on without --diagnose, or train in another folder".into()),
    })?;
    config.simulator.effects.extend(found);
    config.simulator.check()
}

/// What was added to a run's simulator; none where nothing was diagnosed.
///
/// # Errors
/// A file that is no list of effects.
pub fn read(run_folder: &Path) -> Result<Option<Vec<EffectSetting>>> {
    let path = run_folder.join(FOLDER).join(EFFECTS);
    if !path.exists() {
        return Ok(None);
    }
    read_json(path).map(Some)
}

/// The same for a report.
///
/// # Errors
/// A file that is no list of effects.
pub fn line(run_folder: &Path) -> Result<Option<String>> {
    Ok(read(run_folder)?.map(|found| {
        let ids: Vec<&str> = found.iter().map(|effect| effect.id.as_str()).collect();
        match ids.as_slice() {
            [] => "The diagnosis found no effect that the simulator could be given".into(),
            ids => format!("Trained with the effects that the diagnosis found: {}", ids.join(", ")),
        }
    }))
}
