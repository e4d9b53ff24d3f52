//! Settings in TOML: read, inherited, overridden, and refused with the place of what is wrong.

mod errors;
mod numbers;
mod reader;

pub use errors::nearest;
pub use reader::Failure;

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::data::files;
use crate::error::{Error, Result};
use reader::read_table;

/// The key with which a config names its parent.
const EXTENDS: &str = "extends";

/// Reads one TOML file as it is.
pub fn read_toml<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let sources = [Source::read(path.as_ref())?];
    let table = sources[0].parse()?;
    numbers::refuse_impossible(&table, &sources, &[])?;
    read_table(table).map_err(|failure| errors::explain(failure, &sources, &[]))
}

/// Reads settings out of a text that is no file of the user's.
pub fn read_text<T: DeserializeOwned>(text: &str) -> std::result::Result<T, Failure> {
    read_table(text.parse().map_err(|error: toml::de::Error| Failure { keys: vec![], message: error.to_string() })?)
}

/// Reads a config: the file, over the parents it extends, under `sets`, each `a.b.c=value`.
pub fn read_settings<T: DeserializeOwned>(path: impl AsRef<Path>, sets: &[String]) -> Result<T> {
    let (table, sources) = resolve_with_sources(path.as_ref(), sets)?;
    numbers::refuse_impossible(&table, &sources, sets)?;
    read_table(table).map_err(|failure| errors::explain(failure, &sources, sets))
}

/// The config that `read_settings` would read, as a table without `extends`.
pub fn resolve(path: impl AsRef<Path>, sets: &[String]) -> Result<Table> {
    resolve_with_sources(path.as_ref(), sets).map(|(table, _)| table)
}

/// Reads settings that are already a table, under `sets`; `name` is what messages call them.
pub fn settings_from_table<T: DeserializeOwned>(mut table: Table, name: impl AsRef<Path>, sets: &[String]) -> Result<T> {
    apply_sets(&mut table, sets)?;
    let sources = [Source { path: name.as_ref().into(), text: String::new() }];
    numbers::refuse_impossible(&table, &sources, sets)?;
    read_table(table).map_err(|failure| errors::explain(failure, &sources, sets))
}

/// A file whose text went into the settings.
struct Source {
    path: PathBuf,
    text: String,
}

impl Source {
    fn read(path: &Path) -> Result<Self> {
        Ok(Self { path: path.into(), text: files::read_text(path)? })
    }

    fn parse(&self) -> Result<Table> {
        self.text.parse().map_err(|error| errors::of_syntax(&error, self))
    }
}

/// Sources: the file first, then its parent, and so on.
fn resolve_with_sources(path: &Path, sets: &[String]) -> Result<(Table, Vec<Source>)> {
    let mut sources: Vec<Source> = vec![];
    let mut tables = vec![];
    let mut seen: Vec<PathBuf> = vec![];
    let mut next = Some(path.to_path_buf());
    while let Some(path) = next {
        let source = Source::read(&path)?;
        let identity = fs::canonicalize(&path).map_err(|error| Error::read(&path, error))?;
        if seen.contains(&identity) {
            let chain: Vec<_> = sources.iter().map(|source| source.path.display().to_string()).collect();
            let message = format!("`{EXTENDS}` comes back to this file: {} -> {}", chain.join(" -> "), path.display());
            return Err(Error::Parse { path, message });
        }
        seen.push(identity);
        sources.push(source);
        let source = sources.last().expect("just pushed");
        let mut table = source.parse()?;
        next = match table.remove(EXTENDS) {
            None => None,
            Some(Value::String(parent)) => Some(path.parent().unwrap_or(Path::new("")).join(parent)),
            Some(other) => {
                return Err(Error::field(&path, EXTENDS, other.to_string(), "the name of another config, such as \"base.toml\""));
            }
        };
        tables.push(table);
    }
    let mut merged = tables.into_iter().rev().reduce(merge).unwrap_or_default();
    apply_sets(&mut merged, sets)?;
    Ok((merged, sources))
}

/// `child` over `parent`: tables are merged key by key, everything else is replaced whole.
pub fn merge(mut parent: Table, child: Table) -> Table {
    for (key, value) in child {
        let value = match (parent.remove(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => Value::Table(merge(below, above)),
            (_, value) => value,
        };
        parent.insert(key, value);
    }
    parent
}

/// Where a path of settings leads from the working folder: a file states it from its own folder, `--set` from the working folder.
///
/// # Errors
/// No working folder.
pub fn place_path(path: &mut PathBuf, key: &str, folder: &Path, sets: &[String]) -> Result<()> {
    let is_set = sets.iter().filter_map(|set| set.split_once('=')).any(|(set, _)| {
        let rest = key.strip_prefix(set.trim());
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    });
    *path = match is_set {
        true => std::path::absolute(&*path).map_err(|error| Error::read(&*path, error))?,
        false => folder.join(&*path),
    };
    Ok(())
}

/// Applies overrides in order, each `a.b.c=value`. A value that is no TOML is a string.
pub fn apply_sets(table: &mut Table, sets: &[String]) -> Result<()> {
    sets.iter().try_for_each(|set| apply_set(table, set))
}

fn apply_set(table: &mut Table, set: &str) -> Result<()> {
    let refuse = || Error::Usage {
        message: format!("`--set {set}` is no setting"),
        hint: Some("write --set key=value, such as --set training.epochs=10".into()),
    };
    let (key, text) = set.split_once('=').ok_or_else(refuse)?;
    let keys: Vec<&str> = key.trim().split('.').collect();
    if keys.iter().any(|key| key.is_empty()) {
        return Err(refuse());
    }
    let (last, tables) = keys.split_last().ok_or_else(refuse)?;
    let mut below = table;
    for (depth, key) in tables.iter().enumerate() {
        let entry = below.entry(*key).or_insert_with(|| Value::Table(Table::new()));
        let found = entry.to_string();
        below = entry
            .as_table_mut()
            .ok_or_else(|| Error::setting(keys[..=depth].join("."), found, format!("a table, as --set {set} has it")))?;
    }
    below.insert(last.to_string(), parse_value(text.trim()));
    Ok(())
}

fn parse_value(text: &str) -> Value {
    // One line, one key: a value cannot smuggle in others.
    let parsed = (!text.contains('\n')).then(|| toml::from_str::<Table>(&format!("value = {text}")).ok()).flatten();
    parsed.and_then(|mut table| table.remove("value")).unwrap_or_else(|| Value::String(text.into()))
}

#[cfg(test)]
mod tests;
