//! The files that a DCA1000 splits a capture into: `NAME_Raw_0.bin`, `NAME_Raw_1.bin` and so on.

use std::path::{Path, PathBuf};

use crate::data::entries::entries;
use crate::error::{Error, Result};

/// `NAME_Raw_` and the number.
fn part(path: &Path) -> Option<(PathBuf, usize)> {
    let stem = path.file_stem()?.to_str()?;
    let end = stem.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let number = stem[end.len()..].parse().ok()?;
    (end.ends_with("Raw_") && path.extension().is_some_and(|kind| kind == "bin")).then(|| (path.with_file_name(end), number))
}

/// Numbered files of one capture in the order in which the card wrote them, however a shell sorts them; others as they are.
///
/// # Errors
/// A number that is missing or named twice.
pub fn in_order(sources: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut parts: Vec<(&PathBuf, PathBuf, usize)> =
        sources.iter().filter_map(|path| part(path).map(|(name, number)| (path, name, number))).collect();
    if sources.len() < 2 || parts.len() != sources.len() || parts.iter().any(|(_, name, _)| *name != parts[0].1) {
        return Ok(sources.to_vec());
    }
    parts.sort_by_key(|&(_, _, number)| number);
    if let Some(pair) = parts.windows(2).find(|pair| pair[1].2 != pair[0].2 + 1) {
        let found = format!("followed by {}", pair[1].0.display());
        let expected = format!("{}{}.bin", pair[0].1.display(), pair[0].2 + 1);
        return Err(Error::field(pair[0].0, "parts", found, expected)
            .with_hint("name every file of the capture once: frames go on from one to the next"));
    }
    Ok(parts.into_iter().map(|(path, ..)| path.clone()).collect())
}

/// The samples in a folder as mmWave Studio leaves it: the only `.bin` file, or the parts of one capture.
///
/// # Errors
/// Several captures.
pub fn in_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let is_samples = |path: &PathBuf| path.extension().is_some_and(|kind| kind == "bin");
    let found: Vec<PathBuf> = entries(folder)?.into_iter().filter(is_samples).collect();
    let names: Vec<Option<PathBuf>> = found.iter().map(|path| part(path).map(|(name, _)| name)).collect();
    if found.len() > 1 && names.iter().any(|name| name.is_none() || *name != names[0]) {
        let list: Vec<String> = found.iter().take(4).map(|path| path.display().to_string()).collect();
        return Err(Error::Usage {
            message: format!("{}: {} files of samples: {}", folder.display(), found.len(), list.join(", ")),
            hint: Some("name the file of one capture, or all parts of it (_Raw_0.bin, _Raw_1.bin and so on)".into()),
        });
    }
    in_order(&found)
}

/// That files are not all of their capture: others lie beside them, or the first ones are missing.
pub fn note_of_others(sources: &[PathBuf]) -> Option<String> {
    let (first, last) = (sources.first()?, sources.last()?);
    let ((name, number), (_, end)) = (part(first)?, part(last)?);
    let beside = |number: usize| PathBuf::from(format!("{}{number}.bin", name.display()));
    let before = number.checked_sub(1).map(beside);
    if let Some(other) = before.iter().chain([&beside(end + 1)]).find(|path| path.is_file()) {
        let read = sources.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
        return Some(format!("{} is of the same capture and was not named: only {read} is read", other.display()));
    }
    before.map(|before| {
        format!(
            "{} is not there, and the capture began before {}: whether its first word begins a frame is not known",
            before.display(),
            first.display()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn parts_are_joined_by_number_and_a_missing_one_is_named() {
        let shell = paths(&["a/x_Raw_0.bin", "a/x_Raw_1.bin", "a/x_Raw_10.bin", "a/x_Raw_2.bin"]);
        let error = in_order(&shell).unwrap_err().to_string();
        assert_eq!(error, "a/x_Raw_2.bin: `parts` is followed by a/x_Raw_10.bin, expected a/x_Raw_3.bin");
        let right = paths(&["a/x_Raw_9.bin", "a/x_Raw_10.bin"]);
        assert_eq!(in_order(&paths(&["a/x_Raw_10.bin", "a/x_Raw_9.bin"])).unwrap(), right);
        // Not numbered by the card: the user's order.
        let named = paths(&["b.bin", "a.bin"]);
        assert_eq!(in_order(&named).unwrap(), named);
    }

    #[test]
    fn a_folder_has_one_capture_or_is_asked_about() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["x_Raw_1.bin", "x_Raw_0.bin", "x.mmwave.json"] {
            std::fs::write(at(name), "ab").unwrap();
        }
        assert_eq!(in_folder(folder.path()).unwrap(), [at("x_Raw_0.bin"), at("x_Raw_1.bin")]);
        assert!(note_of_others(&[at("x_Raw_0.bin")]).unwrap().contains("x_Raw_1.bin is of the same capture"));
        assert!(note_of_others(&[at("x_Raw_1.bin")]).unwrap().contains("x_Raw_0.bin is of the same capture"));
        assert_eq!(note_of_others(&[at("x_Raw_0.bin"), at("x_Raw_1.bin")]), None);
        assert_eq!(note_of_others(&[at("z.bin")]), None);
        std::fs::write(at("y.bin"), "ab").unwrap();
        assert!(in_folder(folder.path()).unwrap_err().to_string().contains("3 files of samples"));
    }

    #[test]
    fn parts_without_the_first_one_are_said() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["x_Raw_1.bin", "x_Raw_2.bin"] {
            std::fs::write(at(name), "ab").unwrap();
        }
        let note = note_of_others(&in_folder(folder.path()).unwrap()).unwrap();
        assert!(note.starts_with(&format!("{} is not there", at("x_Raw_0.bin").display())), "{note}");
        std::fs::remove_file(at("x_Raw_2.bin")).unwrap();
        assert_eq!(note_of_others(&[at("x_Raw_1.bin")]).unwrap(), note);
    }
}
