//! Numbers that no setting can have, refused with their key before anything is made of them.

use toml::{Table, Value};

use super::Source;
use super::errors::file_of;
use crate::bounds;
use crate::error::{Error, Result};

/// Tables whose values are the user's own words: they are kept as text.
const FREE: [&str; 1] = ["labels"];

/// Largest whole number that is no seed: what is counted. What is allocated has a closer bound in its own `check`.
const MOST_COUNTED: f64 = 2_147_483_648.0;

/// Refuses the first number that is not finite or beyond the bound of its key's unit.
pub(super) fn refuse_impossible(table: &Table, sources: &[Source], sets: &[String]) -> Result<()> {
    let Some((keys, found, expected)) = first(&Value::Table(table.clone()), &mut vec![]) else { return Ok(()) };
    let key = keys.join(".");
    Err(match file_of(&keys, sources, sets) {
        Some(path) => Error::field(path, key, found, expected),
        None => Error::setting(key, found, expected),
    })
}

/// Keys of the number, how it is written, and what was expected.
fn first(value: &Value, keys: &mut Vec<String>) -> Option<(Vec<String>, String, String)> {
    let mut below = |key: String, value: &Value| {
        keys.push(key);
        let found = first(value, keys);
        keys.pop();
        found
    };
    match value {
        Value::Table(table) => {
            table.iter().filter(|(key, _)| !FREE.contains(&key.as_str())).find_map(|(key, value)| below(key.clone(), value))
        }
        Value::Array(items) => items.iter().enumerate().find_map(|(index, value)| below(index.to_string(), value)),
        Value::Float(number) => refused(keys, *number, None),
        Value::Integer(number) => refused(keys, *number as f64, Some(*number)),
        _ => None,
    }
}

fn refused(keys: &[String], number: f64, whole: Option<i64>) -> Option<(Vec<String>, String, String)> {
    // A number in a list has the unit of the list's key.
    let key = keys.iter().rev().find(|key| key.parse::<usize>().is_err())?;
    let counted = whole.is_some() && !key.ends_with("seed") && number.abs() > MOST_COUNTED;
    let expected =
        bounds::unit(key).refuses(number).or_else(|| counted.then(|| format!("a whole number of at most {MOST_COUNTED}")))?;
    let found = whole.map_or_else(|| number_text(number), |whole| whole.to_string());
    Some((keys.to_vec(), found, expected))
}

/// As people write it: `1e300`, not three hundred digits.
fn number_text(number: f64) -> String {
    if number.is_finite() { format!("{number:e}") } else { number.to_string() }
}
