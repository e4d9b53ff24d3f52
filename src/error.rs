//! Everything a user can cause, as a typed error with a message and a hint.
//!
//! A message says what is wrong, where, what was found and what was expected, in lower case and without
//! a full stop. What only a bug can cause is a panic that names the tensor and both shapes instead.

use std::path::{Path, PathBuf};

/// The result of whatever a user can make fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What a user can cause or mend; what only a bug can cause is a panic instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error("{}: cannot be read: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{}: cannot be written: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    /// Text that is not what its format says; `message` carries line and column.
    #[error("{}: {message}", path.display())]
    Parse { path: PathBuf, message: String },
    #[error("{}: unknown key `{key}`{}", path.display(), nearest.as_ref().map(|n| format!(", the nearest known one is `{n}`")).unwrap_or_default())]
    UnknownKey { path: PathBuf, key: String, nearest: Option<String>, known: Vec<String> },
    /// A field of a file that holds something else than it must.
    #[error("{}: `{field}` is {found}, expected {expected}", path.display())]
    Field { path: PathBuf, field: String, found: String, expected: String, hint: Option<String> },
    /// A setting, wherever it came from, that cannot work.
    #[error("`{key}` is {found}, expected {expected}")]
    Setting { key: String, found: String, expected: String, hint: Option<String> },
    /// A value became NaN or infinite; `stage` is the first one of the chain that broke.
    #[error("{stage} became NaN or infinite in step {step}")]
    NonFinite { stage: String, step: usize },
    #[error("no device `{name}` here, available: {available}")]
    Device { name: String, available: String },
    /// Another process holds the claim to a folder: who waits may have it.
    #[error("{}: {who}", folder.display())]
    Busy { folder: PathBuf, who: String },
    #[error("{message}")]
    Usage { message: String, hint: Option<String> },
}

impl Error {
    /// A file or folder that the operating system could not read.
    pub fn read(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Read { path: path.as_ref().into(), source }
    }

    /// A file or folder that the operating system could not write.
    pub fn write(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Write { path: path.as_ref().into(), source }
    }

    /// A field of a file that holds `found` in place of `expected`, without a hint.
    pub fn field(
        path: impl AsRef<Path>,
        field: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Field {
            path: path.as_ref().into(),
            field: field.into(),
            found: found.into(),
            expected: expected.into(),
            hint: None,
        }
    }

    /// A setting that is `found` in place of `expected`, without a hint.
    pub fn setting(key: impl Into<String>, found: impl ToString, expected: impl Into<String>) -> Self {
        Self::Setting { key: key.into(), found: found.to_string(), expected: expected.into(), hint: None }
    }

    /// The error of a setting as that of a field of the file that holds it; others stay as they are.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        match self {
            Self::Setting { key, found, expected, hint } => {
                Self::Field { path: path.as_ref().into(), field: key, found, expected, hint }
            }
            other => other,
        }
    }

    /// The same error with a hint, where its variant carries one.
    pub fn with_hint(mut self, text: impl Into<String>) -> Self {
        match &mut self {
            Self::Field { hint, .. } | Self::Setting { hint, .. } | Self::Usage { hint, .. } => *hint = Some(text.into()),
            _ => {}
        }
        self
    }

    /// What the user can do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Field { hint, .. } | Self::Setting { hint, .. } | Self::Usage { hint, .. } => hint.clone(),
            Self::Read { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                Some("check the path; paths inside a recording or a config are relative to its folder".into())
            }
            Self::Write { source, .. } if source.kind() == std::io::ErrorKind::StorageFull => {
                Some("free some space, or choose another folder with --out; nothing half-written was left".into())
            }
            Self::NonFinite { .. } => Some("lower training.learning_rate, or start again from the last checkpoint".into()),
            Self::Busy { .. } => Some("wait for it, or choose another folder with --out".into()),
            Self::UnknownKey { nearest: None, known, .. } if !known.is_empty() => {
                Some(format!("known here: {}", known.join(", ")))
            }
            Self::UnknownKey { .. } => Some("remove the key or correct its name".into()),
            _ => None,
        }
    }
}
