//! Fields of a vendor's JSON, with errors that name the file and the path of the field.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::data::files;
use crate::error::{Error, Result};

/// A value and the way to it.
#[derive(Clone)]
pub struct Json {
    file: PathBuf,
    path: String,
    value: Value,
}

impl Json {
    pub fn read(file: &Path) -> Result<Self> {
        let text = files::read_text(file)?;
        let value = serde_json::from_str(text.trim_start_matches('\u{feff}'))
            .map_err(|error| Error::Parse { path: file.into(), message: error.to_string() })?;
        Ok(Self { file: file.into(), path: String::new(), value })
    }

    pub fn file(&self) -> &Path {
        &self.file
    }

    fn step(&self, name: &str, value: &Value) -> Self {
        let path = if self.path.is_empty() { name.to_string() } else { format!("{}.{name}", self.path) };
        Self { file: self.file.clone(), path, value: value.clone() }
    }

    /// A field below, or `None`.
    pub fn find(&self, name: &str) -> Option<Self> {
        self.value.get(name).filter(|value| !value.is_null()).map(|value| self.step(name, value))
    }

    /// A field that must be there.
    pub fn get(&self, name: &str) -> Result<Self> {
        self.find(name).ok_or_else(|| {
            Error::field(&self.file, self.step(name, &Value::Null).path, "missing", "a value").with_hint(
                "nothing else says this: take the whole file as the radar's own program wrote it, or add the field to it",
            )
        })
    }

    pub fn items(&self) -> Result<Vec<Self>> {
        let items = self.value.as_array().ok_or_else(|| self.wrong("a list"))?;
        Ok(items
            .iter()
            .enumerate()
            .map(|(index, value)| Self { path: format!("{}[{index}]", self.path), ..self.step("", value) })
            .collect())
    }

    /// A number, or a text that is one (`"0xF"`).
    pub fn number(&self) -> Result<f64> {
        let number = match &self.value {
            Value::Number(number) => number.as_f64(),
            Value::String(text) => match text.trim().strip_prefix("0x").or_else(|| text.trim().strip_prefix("0X")) {
                Some(digits) => u64::from_str_radix(digits, 16).ok().map(|number| number as f64),
                None => text.trim().parse().ok(),
            },
            _ => None,
        };
        number.filter(|number: &f64| number.is_finite()).ok_or_else(|| self.wrong("a number"))
    }

    /// A number of at least zero, such as a time.
    pub fn amount(&self) -> Result<f64> {
        let number = self.number()?;
        if number >= 0.0 { Ok(number) } else { Err(self.wrong("a number of at least 0")) }
    }

    /// A whole number of at least zero.
    pub fn count(&self) -> Result<usize> {
        let number = self.number()?;
        if number >= 0.0 && number.fract() == 0.0 && number < 1e9 {
            Ok(number as usize)
        } else {
            Err(self.wrong("a whole number"))
        }
    }

    pub fn text(&self) -> Result<&str> {
        self.value.as_str().ok_or_else(|| self.wrong("a text"))
    }

    pub fn keys(&self) -> Vec<String> {
        self.value.as_object().map(|object| object.keys().cloned().collect()).unwrap_or_default()
    }

    pub fn wrong(&self, expected: &str) -> Error {
        let mut found = self.value.to_string();
        if found.chars().count() > 60 {
            found = found.chars().take(60).chain("…".chars()).collect();
        }
        Error::field(&self.file, &self.path, found, expected)
    }
}
