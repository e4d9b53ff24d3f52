//! Where everything starts: measured recordings, and what the diagnosis finds in one of them.

use std::path::Path;

use crate::data::{Recording, Shard, atomic};
use crate::diagnosis::{self, DiagnosisConfig};
use crate::error::Result;
use crate::site::{self, SiteConfig};

/// Records a site; recordings that an earlier attempt made are kept.
pub fn site(config: &SiteConfig, settings_folder: &Path, folder: &Path, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    site::record(config, settings_folder, folder, Shard::ALL, &mut |done, of, _| step(done, of)).map(drop)
}

/// What the diagnosis finds: for people and programs, and as settings of a simulator.
pub fn diagnose(recording: &Path, config: &DiagnosisConfig, folder: &Path, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    let recording = Recording::open(recording)?;
    let mut told = 0;
    let diagnosis = diagnosis::diagnose(&recording, config, &mut |_| {
        told += 1;
        step(told, config.most.max(told));
    })?;
    atomic::write_text(folder.join("report.html"), &diagnosis::html::html(&diagnosis, None)?)?;
    let json = |value: serde_json::Value| format!("{value:#}\n");
    let report = serde_json::to_value(&diagnosis.report).expect("plain data");
    atomic::write_text(folder.join("report.json"), &json(report))?;
    let effects = serde_json::to_value(diagnosis.effects()).expect("plain data");
    atomic::write_text(folder.join("effects.json"), &json(effects))
}
