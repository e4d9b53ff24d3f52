//! `hybridsim diagnose`.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use burn::tensor::Device;
use clap::Args;

use super::{Common, device, plausible, progress::Progress};
use crate::{
    config::Config,
    data::{Recording, atomic, files},
    diagnosis::{
        self, Diagnosis,
        simulate::{Simulated, Start, before_and_after},
    },
    error::{Error, Result},
    training::checkpoint,
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording folder
    recording: PathBuf,
    /// A simulator trained on such recordings, to be held against them in place of one trained now
    #[arg(long, value_name = "DIR")]
    checkpoint: Option<PathBuf>,
    /// Settings: [diagnosis], [simulator] and [training] of a config file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Folder for report.html, report.json and, where a simulator was trained, its checkpoint with the effects
    #[arg(short, long, value_name = "DIR", default_value = "diagnosis")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let config = match &arguments.config {
        Some(path) => Config::read(path, &common.set)?,
        None => Config::defaults(&common.set)?,
    };
    // What would be refused after the diagnosis is refused before it; an earlier answer must not pass for this one's.
    let device = device(&common.device)?;
    if let Some(checkpoint) = &arguments.checkpoint {
        checkpoint::read_state(checkpoint)?;
    }
    let _claim = super::claimed(&arguments.out)?;
    for earlier in ["report.json", "report.html"].map(|name| arguments.out.join(name)) {
        if earlier.exists() {
            std::fs::remove_file(&earlier).map_err(|error| Error::write(&earlier, error))?;
        }
    }
    let recording = Recording::open(&arguments.recording)?;
    plausible::recording(&recording, common)?;
    let progress = Progress::new("diagnosing", config.diagnosis.most + 2 * config.diagnosis.epochs, common.quiet);
    let mut steps = 0;
    let mut tell = |text: &str| {
        steps += 1;
        progress.line(text);
        progress.set(steps);
    };
    let mut diagnosis = diagnosis::diagnose(&recording, &config.diagnosis, &mut tell)?;
    let simulated = simulate(arguments, &device, &config, &mut diagnosis, &mut tell)?;
    let html = diagnosis::html::html(&diagnosis, simulated.as_ref())?;
    progress.finish();
    write(&arguments.out, &diagnosis, &html)?;
    tell_result(&diagnosis, &arguments.out);
    Ok(())
}

/// The trained simulator, without and with what was found.
fn simulate(
    arguments: &Arguments,
    device: &Device,
    config: &Config,
    diagnosis: &mut Diagnosis,
    tell: &mut dyn FnMut(&str),
) -> Result<Option<Simulated>> {
    let (effects, keep) = (diagnosis.effects(), arguments.out.join("simulator"));
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
        checkpoint: arguments.checkpoint.as_deref(),
    };
    let simulated = before_and_after(&arguments.recording, &effects, &start, &keep, tell)?;
    diagnosis.report.simulator = simulated.as_ref().map(|simulated| simulated.fit);
    if simulated.is_some() {
        diagnosis.report.settings = config.diagnosis.fingerprint(&shaping(arguments, config, device)?);
    }
    if simulated.is_none() {
        let note =
            "no simulator was trained, and no checkpoint left: neither body nor room is known, or there are fewer than 4 frames";
        diagnosis.report.notes.push(note.into());
    }
    Ok(simulated)
}

/// What shapes a trained simulator beside the settings of the diagnosis.
fn shaping(arguments: &Arguments, config: &Config, device: &Device) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let text = |settings: std::result::Result<String, toml::ser::Error>| settings.expect("plain data").into_bytes();
    let mut shaping = vec![
        ("simulator", text(toml::to_string(&config.simulator))),
        ("training", text(toml::to_string(&config.training))),
        ("device", format!("{device:?}").into_bytes()),
    ];
    if let Some(checkpoint) = &arguments.checkpoint {
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

fn tell_result(diagnosis: &Diagnosis, out: &Path) {
    let mut text = format!("{}\n", diagnosis::html::lead(&diagnosis.report));
    for effect in &diagnosis.report.effects {
        let _ = writeln!(text, "  {:<24} {:>4.0} %  {}", effect.id, 100.0 * effect.probability, effect.statement);
    }
    for unexplained in &diagnosis.report.unexplained {
        let _ = writeln!(text, "  {:<24}         {}", "(no name)", unexplained.statement);
    }
    let _ = writeln!(text, "report: {}", out.join("report.html").display());
    super::tell(&text);
}
