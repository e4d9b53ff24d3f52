//! Why a recording and the simulator disagree: the diagnosis, the simulator without and with what was found, and the report.

use std::path::Path;

use burn::tensor::Device;

use super::{Notice, Notify, claimed_for, plausible};
use crate::{
    config::Config,
    data::{Recording, atomic, files},
    diagnosis::{
        self, Diagnosis,
        calibration::Table,
        simulate::{Simulated, Start, before_and_after},
    },
    error::{Error, Result},
    training::checkpoint,
};

/// What is diagnosed, and how.
pub struct Diagnose<'a> {
    pub recording: &'a Path,
    /// A simulator trained on such recordings, to compare them with in place of one trained now.
    pub checkpoint: Option<&'a Path>,
    pub config: &'a Config,
    /// Folder for report.html, report.json and, where a simulator was trained, its checkpoint with the effects.
    pub out: &'a Path,
}

/// Diagnoses, trains, and writes the report.
///
/// # Errors
/// A recording or checkpoint that cannot be read, or cannot be meant; a folder that cannot be written.
pub fn diagnose(what: &Diagnose<'_>, device: &Device, as_stated: bool, notify: &mut Notify<'_>) -> Result<Diagnosis> {
    // What would be refused after the diagnosis is refused before it; an earlier answer must not pass for this one's.
    if let Some(checkpoint) = what.checkpoint {
        checkpoint::read_state(checkpoint)?;
    }
    let _claim = claimed_for(what.out, "report.json")?;
    for earlier in ["report.json", "report.html"].map(|name| what.out.join(name)) {
        if earlier.exists() {
            std::fs::remove_file(&earlier).map_err(|error| Error::write(&earlier, error))?;
        }
    }
    let recording = Recording::open(what.recording)?;
    plausible::recording(&recording, as_stated, notify)?;
    let settings = &what.config.diagnosis;
    notify(Notice::Begun { what: "diagnosing", steps: settings.most + 2 * settings.epochs });
    let mut steps = 0;
    let mut line = |text: &str| {
        steps += 1;
        notify(Notice::Line(text));
        notify(Notice::Done(steps));
    };
    let mut diagnosis = diagnosis::diagnose(&recording, settings, &mut line)?;
    let simulated = simulate(what, device, &mut diagnosis, &mut line)?;
    let html = diagnosis::html::html(&diagnosis, simulated.as_ref())?;
    line("writing the report");
    write(what.out, &diagnosis, &html)?;
    Ok(diagnosis)
}

/// The trained simulator, without and with what was found.
fn simulate(
    what: &Diagnose<'_>,
    device: &Device,
    diagnosis: &mut Diagnosis,
    line: &mut dyn FnMut(&str),
) -> Result<Option<Simulated>> {
    let (config, effects, keep) = (what.config, diagnosis.effects(), what.out.join("simulator"));
    // One with another recording's effects must not stay.
    if keep.exists() {
        std::fs::remove_dir_all(&keep).map_err(|error| Error::write(&keep, error))?;
    }
    if diagnosis.explanation.is_none() || config.diagnosis.epochs == 0 {
        return Ok(None);
    }
    let start = Start {
        simulator: &config.simulator,
        learning: &config.training,
        epochs: config.diagnosis.epochs,
        seed: config.diagnosis.seed,
        device,
        checkpoint: what.checkpoint,
    };
    let left_out = diagnosis.report.effects.iter().map(|effect| effect.id.as_str());
    let left_out: Vec<&str> = left_out.filter(|id| effects.iter().all(|setting| setting.id != *id)).collect();
    if !left_out.is_empty() {
        let note =
            format!("the simulator was trained without {}: its operator does not take what was found", left_out.join(", "));
        diagnosis.report.notes.push(note);
    }
    let simulated = before_and_after(what.recording, &effects, &start, &keep, line)?;
    diagnosis.report.simulator = simulated.as_ref().map(|simulated| simulated.fit);
    if simulated.is_some() {
        diagnosis.report.settings = config.diagnosis.fingerprint(&shaping(what, device)?);
    }
    if simulated.is_none() {
        let note =
            "no simulator was trained, and no checkpoint left: neither body nor room is known, or there are fewer than 4 frames";
        diagnosis.report.notes.push(note.into());
    }
    Ok(simulated)
}

/// What shapes a trained simulator beside the settings of the diagnosis.
fn shaping(what: &Diagnose<'_>, device: &Device) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let table = Table::named(&what.config.diagnosis)?;
    let text = |settings: std::result::Result<String, toml::ser::Error>| settings.expect("plain data").into_bytes();
    let mut shaping = vec![
        ("simulator", text(toml::to_string(&what.config.simulator))),
        ("training", text(toml::to_string(&what.config.training))),
        ("device", format!("{device:?}").into_bytes()),
    ];
    shaping.extend(table.iter().map(Table::shaping));
    if let Some(checkpoint) = what.checkpoint {
        let weights = checkpoint.join(checkpoint::WEIGHTS);
        shaping.push(("checkpoint", files::read(&weights)?));
    }
    Ok(shaping)
}

/// The page first: whoever finds report.json finds both.
fn write(out: &Path, diagnosis: &Diagnosis, html: &str) -> Result<()> {
    atomic::write_text(out.join("report.html"), html)?;
    atomic::write_text(out.join("report.json"), &serde_json::to_string_pretty(&diagnosis.report).expect("plain data"))
}
