//! From what TOML and serde say to what, where, and which key was meant.

use std::ops::Range;
use std::path::PathBuf;

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

use super::Source;
use crate::error::Error;

/// What a failed read means; `sources` are the files that went in, the one that wins first.
pub(super) fn explain(error: &toml::de::Error, sources: &[Source], sets: &[String]) -> Error {
    let keys = keys_of(error);
    if let Some((key, known)) = unknown_key(error.message()) {
        let nearest = nearest(&key, known.iter().map(String::as_str)).map(str::to_string);
        let whole = find_whole(&key, &keys, error, sources, sets);
        let path = match origin(&whole, sources, sets) {
            Origin::Set => "--set".into(),
            Origin::File { source, .. } => source.path.clone(),
            Origin::Nowhere => sources[0].path.clone(),
        };
        return Error::UnknownKey { path, key: whole.join("."), nearest };
    }
    // An error of one file knows its place; one of merged settings knows its key, and the place is looked up.
    if let (Some(span), [source, ..]) = (error.span(), sources) {
        return parse_error(source, span, error.message());
    }
    let message = match &keys[..] {
        [] => error.message().to_string(),
        keys => format!("`{}`: {}", keys.join("."), error.message()),
    };
    match origin(&keys, sources, sets) {
        Origin::Set => Error::Parse { path: "--set".into(), message },
        Origin::File { source, span } => parse_error(source, span, error.message()),
        Origin::Nowhere => Error::Parse { path: sources[0].path.clone(), message },
    }
}

fn parse_error(source: &Source, span: Range<usize>, message: &str) -> Error {
    let before = &source.text[..source.text.floor_char_boundary(span.start)];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    // TOML speaks of several things on several lines.
    let message = message.trim().replace('\n', ", ");
    Error::Parse { path: source.path.clone(), message: format!("line {line}, column {column}: {message}") }
}

/// The tables and the key that the error is about, where TOML says so: its text ends in "in `a.b.c`".
fn keys_of(error: &toml::de::Error) -> Vec<String> {
    let mut error = error.clone();
    // With the text at hand TOML prints an excerpt instead of the keys.
    error.set_input(None);
    let text = error.to_string();
    let keys = text.trim_end().rsplit_once("\nin `").and_then(|(_, keys)| keys.strip_suffix('`'));
    keys.map(|keys| keys.split('.').map(str::to_string).collect()).unwrap_or_default()
}

/// From serde's "unknown field `x`, expected one of `a`, `b`" to the key and the known ones.
fn unknown_key(message: &str) -> Option<(String, Vec<String>)> {
    let (key, rest) = message.strip_prefix("unknown field `")?.split_once('`')?;
    let known = rest.split('`').skip(1).step_by(2).map(str::to_string).collect();
    Some((key.into(), known))
}

/// The most similar of the known keys.
pub fn nearest<'a>(key: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |known: &str| strsim::normalized_damerau_levenshtein(key, known).max(strsim::jaro_winkler(key, known) - 0.1);
    known.into_iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
}

/// The unknown key with the tables it lies in.
fn find_whole(key: &str, keys: &[String], error: &toml::de::Error, sources: &[Source], sets: &[String]) -> Vec<String> {
    if keys.last().is_some_and(|last| last == key) {
        return keys.to_vec();
    }
    // A file's error has a place: whichever key lies there.
    if let (Some(span), [source, ..]) = (error.span(), sources)
        && let Ok(document) = DeTable::parse(&source.text)
        && let Some(path) = key_at(document.get_ref(), &span)
    {
        return path;
    }
    let mut whole = keys.to_vec();
    whole.push(key.to_string());
    if matches!(origin(&whole, sources, sets), Origin::Nowhere) {
        // Deeper than TOML said: take it where the settings have it.
        let mut found = vec![];
        let overrides =
            sets.iter().filter_map(|set| Some(set.split_once('=')?.0.trim().split('.').map(str::to_string).collect()));
        found.extend(overrides.filter(|path: &Vec<String>| path.iter().any(|part| part == key)));
        for source in sources {
            let table = toml::from_str::<Table>(&source.text).unwrap_or_default();
            paths_to(key, &Value::Table(table), &mut vec![], &mut found);
        }
        if let Some(path) = found.into_iter().find(|path| path.starts_with(keys)) {
            let end = path.iter().position(|part| part == key).map_or(path.len(), |position| position + 1);
            return path[..end].to_vec();
        }
    }
    whole
}

fn paths_to(key: &str, value: &Value, above: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    let Value::Table(table) = value else { return };
    for (name, value) in table {
        above.push(name.clone());
        if name == key {
            found.push(above.clone());
        }
        paths_to(key, value, above, found);
        above.pop();
    }
}

/// The path to the key that is written at `span`.
fn key_at(table: &DeTable, span: &Range<usize>) -> Option<Vec<String>> {
    table.iter().find_map(|(name, value)| {
        if name.span() == *span {
            return Some(vec![name.get_ref().to_string()]);
        }
        let below = match value.get_ref() {
            DeValue::Table(below) => key_at(below, span),
            DeValue::Array(items) => {
                items.iter().find_map(|item| item.get_ref().as_table().and_then(|below| key_at(below, span)))
            }
            _ => None,
        };
        below.map(|mut path| {
            path.insert(0, name.get_ref().to_string());
            path
        })
    })
}

/// The file that says something about a key, or about a table above it; `None` where `--set` does.
pub(super) fn file_of(keys: &[String], sources: &[Source], sets: &[String]) -> Option<PathBuf> {
    for length in (1..=keys.len()).rev() {
        match origin(&keys[..length], sources, sets) {
            Origin::Set => return None,
            Origin::File { source, .. } => return Some(source.path.clone()),
            Origin::Nowhere => {}
        }
    }
    sources.first().map(|source| source.path.clone())
}

/// Who said something about a key.
enum Origin<'a> {
    Set,
    File { source: &'a Source, span: Range<usize> },
    Nowhere,
}

fn origin<'a>(keys: &[String], sources: &'a [Source], sets: &[String]) -> Origin<'a> {
    if keys.is_empty() {
        return Origin::Nowhere;
    }
    let whole = keys.join(".");
    let names = |set: &String| {
        let rest = set.split_once('=').and_then(|(key, _)| key.trim().strip_prefix(whole.as_str()));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    if sets.iter().any(names) {
        return Origin::Set;
    }
    let found = sources.iter().find_map(|source| {
        let document = DeTable::parse(&source.text).ok()?;
        let span = value_span(document.get_ref(), keys)?;
        Some(Origin::File { source, span })
    });
    found.unwrap_or(Origin::Nowhere)
}

fn value_span(table: &DeTable, keys: &[String]) -> Option<Range<usize>> {
    let (first, rest) = keys.split_first()?;
    let (_, value): (_, &Spanned<DeValue>) = table.iter().find(|(name, _)| name.get_ref() == first)?;
    match (rest, value.get_ref()) {
        ([], _) => Some(value.span()),
        (rest, DeValue::Table(below)) => value_span(below, rest),
        _ => None,
    }
}
