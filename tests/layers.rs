//! Data travels one way: a module imports only from those before it in the journey, and the recorder shares
//! nothing with the simulator but settings, errors and files.

use std::path::{Path, PathBuf};

/// The journey; modules on one floor do not import each other.
const FLOORS: [&[&str]; 31] = [
    &["error", "complex", "text"],
    &["bounds"],
    &["radar", "room"],
    &["person"],
    &["data"],
    &["integrity"],
    &["import"],
    &["plausibility"],
    &["recorder"],
    &["site"],
    &["body"],
    &["features"],
    &["scatterers"],
    &["paths"],
    &["if_signal"],
    &["heatmap"],
    &["loss", "metrics"],
    &["lpips"],
    &["effects"],
    &["simulator"],
    &["training"],
    &["evaluation", "pictures"],
    &["baselines", "export"],
    &["diagnosis"],
    &["alignment"],
    &["recognition"],
    &["config"],
    &["challenge"],
    &["experiments", "catalogue"],
    &["verbs"],
    &["cli"],
];

/// What the recorder may know.
const RECORDER_MAY_IMPORT: [&str; 7] = ["error", "bounds", "radar", "room", "person", "data", "recorder"];

/// Physics modules know no file, clock or terminal.
const PHYSICS: [&str; 12] = [
    "bounds",
    "complex",
    "radar",
    "room",
    "body",
    "features",
    "scatterers",
    "paths",
    "if_signal",
    "heatmap",
    "loss",
    "simulator",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// (module, file, text without its tests and comments) of every source file but `lib.rs` and `main.rs`.
fn modules() -> Vec<(String, PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files
        .into_iter()
        .filter_map(|file| {
            let relative = file.strip_prefix(&root).unwrap().to_path_buf();
            let first = relative.components().next()?.as_os_str().to_str()?.trim_end_matches(".rs").to_string();
            if first == "lib" || first == "main" || relative.file_name()?.to_str()?.contains("test") {
                return None;
            }
            let text = std::fs::read_to_string(&file).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap().to_string();
            let text = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
            Some((first, relative, text))
        })
        .collect()
}

/// The crate's modules that a text names as `crate::module`.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for part in text.split("crate::").skip(1) {
        let names: Vec<String> = match part.strip_prefix('{') {
            Some(list) => {
                let mut depth = 1;
                let end = list
                    .char_indices()
                    .find(|(_, letter)| {
                        depth += match letter {
                            '{' => 1,
                            '}' => -1,
                            _ => 0,
                        };
                        depth == 0
                    })
                    .map_or(list.len(), |(index, _)| index);
                let mut depth = 0;
                list[..end]
                    .split(|letter| {
                        depth += match letter {
                            '{' => 1,
                            '}' => -1,
                            _ => 0,
                        };
                        letter == ',' && depth == 0
                    })
                    .map(|name| name.trim().to_string())
                    .collect()
            }
            None => vec![part.to_string()],
        };
        for name in names {
            let word: String = name.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
            // `crate::Error` and `crate::Result` are the error module's.
            let word = if word == "Error" || word == "Result" { "error".into() } else { word };
            if !word.is_empty() {
                found.push(word);
            }
        }
    }
    found
}

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

#[test]
fn imports_are_read_from_single_and_grouped_use_lines() {
    assert_eq!(imports("use crate::error::Result;"), ["error"]);
    assert_eq!(imports("use crate::{radar::{Radar, Check}, room::Room};"), ["radar", "room"]);
    assert_eq!(imports("let x = crate::Error::setting(1);"), ["error"]);
}

#[test]
fn modules_import_only_from_earlier_ones() {
    let mut wrong = Vec::new();
    for (module, file, text) in modules() {
        let own = floor(&module).unwrap_or_else(|| panic!("{} has no place in the journey", file.display()));
        for import in imports(&text) {
            let theirs = floor(&import);
            if import != module && theirs.is_none_or(|theirs| theirs >= own) {
                wrong.push(format!("{} imports {import}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "against the journey's direction:\n{}", wrong.join("\n"));
}

#[test]
fn the_recorder_shares_no_physics_with_the_simulator() {
    let mut wrong = Vec::new();
    for (module, file, text) in modules() {
        if module != "recorder" {
            continue;
        }
        if text.contains("burn") {
            wrong.push(format!("{} uses Burn", file.display()));
        }
        for import in imports(&text) {
            if !RECORDER_MAY_IMPORT.contains(&import.as_str()) {
                wrong.push(format!("{} imports {import}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "the recorder must stay independent:\n{}", wrong.join("\n"));
}

#[test]
fn physics_knows_no_file_clock_or_terminal() {
    let mut wrong = Vec::new();
    for (module, file, text) in modules() {
        if !PHYSICS.contains(&module.as_str()) {
            continue;
        }
        for word in ["std::fs", "std::time", "println!", "eprintln!", "std::io", "indicatif"] {
            if text.contains(word) {
                wrong.push(format!("{} uses {word}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Opening a pipe waits for ever and a device never ends: `data::files` looks first, and nothing else opens by name.
#[test]
fn files_of_others_are_opened_in_one_place() {
    const OPENING: [&str; 6] =
        ["File::open(", "fs::read(", "fs::read_to_string(", "fs::copy(", "and_then(fs::read)", "OpenOptions::"];
    /// What opens files that are its own, or that it has looked at.
    const OWN: [&str; 7] = [
        "data/files.rs",
        // Locks on what it made itself.
        "data/atomic/folder.rs",
        "data/atomic/leftovers.rs",
        "data/atomic/sync.rs",
        "data/scratch.rs",
        // A case, file by file, each looked at before; then the answer of its own process.
        "challenge/answer.rs",
        // The time of files that it has just written.
        "challenge/sealing.rs",
    ];
    // `IfFile::open` is another function.
    let opens = |text: &str, word: &str| {
        text.match_indices(word).any(|(at, _)| !text[..at].ends_with(|letter: char| letter.is_alphanumeric()))
    };
    let mut wrong = Vec::new();
    for (_, file, text) in modules() {
        let name = file.to_str().unwrap();
        if !OWN.contains(&name) && OPENING.iter().any(|word| opens(&text, word)) {
            wrong.push(format!("{name} opens files by itself: use data::files"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
