//! From what TOML and serde say to what, where, and which key was meant.

use std::ops::Range;
use std::path::PathBuf;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Failure, Source};
use crate::error::Error;

/// What is no TOML, and where.
pub(super) fn of_syntax(error: &toml::de::Error, source: &Source) -> Error {
    match error.span() {
        Some(span) => parse_error(source, span, error.message()),
        None => Error::Parse { path: source.path.clone(), message: error.message().to_string() },
    }
}

/// What a failed read means; `sources` are the files that went in, the one that wins first.
pub(super) fn explain(failure: Failure, sources: &[Source], sets: &[String]) -> Error {
    let Failure { keys, message } = &failure;
    if let Some((key, known)) = unknown_key(message) {
        let nearest = nearest(&key, known.iter().map(String::as_str)).map(str::to_string);
        let path = file_of(keys, sources, sets).unwrap_or_else(|| "--set".into());
        let mut whole = keys.clone();
        // A table whose kind stands in it is read whole, before its keys are looked at.
        if whole.last() != Some(&key) {
            whole.push(key);
        }
        return Error::UnknownKey { path, key: whole.join("."), nearest, known };
    }
    match nearest_origin(keys, sources, sets) {
        Origin::Set => Error::Parse { path: "--set".into(), message: failure.to_string() },
        Origin::File { source, span } => parse_error(source, span, message),
        Origin::Nowhere => Error::Parse { path: sources[0].path.clone(), message: failure.to_string() },
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

/// From serde's "unknown field `x`, expected one of `a`, `b`" to the key and the known ones.
fn unknown_key(message: &str) -> Option<(String, Vec<String>)> {
    let (key, rest) = message.strip_prefix("unknown field `")?.split_once('`')?;
    let known = rest.split('`').skip(1).step_by(2).map(str::to_string).collect();
    Some((key.into(), known))
}

/// Likeness (one less the share of letters that differ) below which no other key was meant.
const LIKE: f64 = 0.5;

/// The most similar of the known keys; none where none is like it.
pub fn nearest<'a>(key: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |known: &str| strsim::normalized_damerau_levenshtein(key, known).max(strsim::jaro_winkler(key, known) - 0.1);
    let best = known.into_iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (strsim::normalized_damerau_levenshtein(key, best) >= LIKE).then_some(best)
}

/// The file that says something about a key, or about a table above it; `None` where `--set` does.
pub(super) fn file_of(keys: &[String], sources: &[Source], sets: &[String]) -> Option<PathBuf> {
    match nearest_origin(keys, sources, sets) {
        Origin::Set => None,
        Origin::File { source, .. } => Some(source.path.clone()),
        Origin::Nowhere => sources.first().map(|source| source.path.clone()),
    }
}

/// Who said something about a key.
enum Origin<'a> {
    Set,
    File { source: &'a Source, span: Range<usize> },
    Nowhere,
}

/// Who said something about a key, or about the innermost table above it of which anybody did.
fn nearest_origin<'a>(keys: &[String], sources: &'a [Source], sets: &[String]) -> Origin<'a> {
    let mut origins = (1..=keys.len()).rev().map(|length| origin(&keys[..length], sources, sets));
    origins.find(|origin| !matches!(origin, Origin::Nowhere)).unwrap_or(Origin::Nowhere)
}

fn origin<'a>(keys: &[String], sources: &'a [Source], sets: &[String]) -> Origin<'a> {
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
    let (_, value) = table.iter().find(|(name, _)| name.get_ref() == first)?;
    span_below(value, rest)
}

fn span_below(value: &Spanned<DeValue>, keys: &[String]) -> Option<Range<usize>> {
    match (keys, value.get_ref()) {
        ([], _) => Some(value.span()),
        (keys, DeValue::Table(below)) => value_span(below, keys),
        ([index, rest @ ..], DeValue::Array(items)) => span_below(items.get(index.parse::<usize>().ok()?)?, rest),
        _ => None,
    }
}
