//! The library of effects as pages that people read: a page an effect, with the picture of its signature that the recorder makes.
//!
//! All words are those of [`EffectInfo`] and of the diagnosis; the recorder, which shares nothing with
//! the library, plants what the picture shows.

mod page;
mod signature;

use std::fmt::Write as _;
use std::path::Path;

use rayon::prelude::*;

use crate::data::atomic::write_text;
use crate::data::settings::nearest;
use crate::effects::{self, EffectInfo, Stage};
use crate::error::{Error, Result};
use signature::{Scene, Signature};

/// What begins every page: who changes it by hand loses the change.
const ORIGIN: &str = "<!-- Written by `hybridsim effects --out docs/effects`. -->\n";
/// The page that lists all.
const INDEX: &str = "index.md";

/// A stage in the words that people read.
fn heading(stage: Stage) -> &'static str {
    match stage {
        Stage::Timing => "Timing",
        Stage::Scene => "Scene",
        Stage::Body => "Body",
        Stage::Propagation => "Propagation",
        Stage::Waveform => "Chirp",
        Stage::Antenna => "Antennas",
        Stage::Receiver => "Receiver",
        Stage::Noise => "Noise",
    }
}

/// One line an effect, by stage.
pub fn table() -> String {
    let mut text = String::new();
    for (name, infos) in by_stage() {
        let _ = writeln!(text, "{name}");
        for info in infos {
            let _ = writeln!(text, "  {:<24} {}", info.id, info.title);
        }
    }
    text
}

/// The page of an effect in Markdown, without its picture.
///
/// # Errors
/// An id that the library does not have.
pub fn described(id: &str) -> Result<String> {
    let Some(info) = effects::info(id) else {
        return Err(Error::Usage {
            message: format!("{id}: the library has no such effect"),
            hint: nearest(id, effects::library().iter().map(|info| info.id))
                .map(|nearest| format!("did you mean {nearest}? `hybridsim effects` lists all")),
        });
    };
    Ok(page::markdown(info, None))
}

/// Writes a page an effect with its picture, and one that lists all. `done` is told after each.
///
/// # Errors
/// A folder that cannot be written.
pub fn write(folder: &Path, done: &(dyn Fn() + Sync)) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
    let scene = Scene::new()?;
    let without = scene.recorded()?;
    effects::library().par_iter().try_for_each(|info| {
        let signature = scene.signature(info)?;
        if let Some(signature) = &signature {
            signature.save(&without, &folder.join(format!("{}.png", info.id)))?;
        }
        write_text(folder.join(format!("{}.md", info.id)), &page::markdown(info, signature.as_ref()))?;
        done();
        Ok(())
    })?;
    write_text(folder.join(INDEX), &index())
}

fn by_stage() -> impl Iterator<Item = (&'static str, &'static [&'static EffectInfo])> {
    effects::library().chunk_by(|a, b| a.stage == b.stage).map(|infos| (heading(infos[0].stage), infos))
}

fn index() -> String {
    let mut text = format!(
        "{ORIGIN}\n# Effects\n\nThe library, in the order in which the signal meets it: what a recording may hold and the plain simulator leaves out.\n"
    );
    for (name, infos) in by_stage() {
        let _ = write!(text, "\n## {name}\n\n| id | what it is | look-alikes |\n|---|---|---|\n");
        for info in infos {
            let alike: Vec<String> = effects::look_alikes(info).map(|other| page::link(other.id)).collect();
            let _ = writeln!(text, "| {} | {} | {} |", page::link(info.id), info.title, alike.join(", "));
        }
    }
    text
}

#[cfg(test)]
mod tests;
