//! Data travels one way: a module imports only from those before it in the journey, and the recorder shares
//! nothing with the simulator but settings, errors and files.

#[path = "support/sources.rs"]
mod sources;

use std::path::Path;

use sources::{Module, Source, Sources};

/// The journey; modules on one floor do not import each other.
const FLOORS: [&[&str]; 31] = [
    &["error", "complex", "device", "grid", "text"],
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
const PHYSICS: [&str; 13] = [
    "bounds",
    "complex",
    "grid",
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

/// Circles that are still to be broken. None may be added; one that is gone must go here, too.
const CIRCLES: &[&str] = &[];

/// Of the crate itself.
fn sources() -> Sources {
    Sources::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

/// Every source file but `lib.rs`, with the module of the journey that it belongs to.
fn files(sources: &Sources) -> impl Iterator<Item = (&str, &Module, &Source)> {
    sources.files.iter().filter_map(|(module, source)| Some((module.first()?.as_str(), module, source)))
}

/// Modules of the journey that a file uses.
fn imports<'a>(sources: &'a Sources, module: &Module) -> impl Iterator<Item = &'a str> {
    sources.uses(module).into_iter().filter_map(|used| used.first().map(String::as_str))
}

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

/// A crate of a few files.
fn made(files: &[(&str, &str)]) -> (tempfile::TempDir, Sources) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let sources = Sources::read(folder.path());
    (folder, sources)
}

#[test]
fn uses_lead_through_groups_supers_reexports_and_macros_to_the_file_that_defines() {
    let (_folder, sources) = made(&[
        ("lib.rs", "mod a; mod b; #[cfg(test)] mod c;"),
        (
            "a.rs",
            "use crate::b::{Thing, deep::{self, Other}};\n#[cfg(test)]\nmod tests { use crate::c::X; }\nfn f() { deep::g(); }",
        ),
        ("b/mod.rs", "mod thing; pub mod deep; mod face; pub use thing::Thing; pub struct Own;"),
        ("b/thing.rs", "use super::Own; pub struct Thing;"),
        ("b/deep.rs", "pub fn g() { assert!(super::face::LOOKS, \"{}\", 1); }"),
        ("b/face.rs", "pub const LOOKS: bool = true;"),
        ("c.rs", "pub struct X;"),
    ]);
    let uses = |module: &str| -> Vec<String> {
        let module: Module = module.split('/').map(String::from).collect();
        sources.uses(&module).into_iter().map(|used| used.join("/")).collect()
    };
    assert_eq!(uses("a"), ["b/deep", "b/thing"]);
    assert_eq!(uses("b/thing"), ["b"]);
    assert_eq!(uses("b/deep"), ["b/face"]);
    assert!(!sources.files.contains_key(&vec!["c".to_string()]), "only tests compile it");
    let text = &sources.files[&vec!["a".to_string()]].text;
    assert!(text.contains("fn f()") && !text.contains("mod tests"), "{text}");
}

#[test]
fn a_circle_of_files_is_seen_and_what_a_folders_own_file_shares_is_none() {
    let (_folder, sources) = made(&[
        ("lib.rs", "mod a;"),
        ("a/mod.rs", "mod x; mod y; mod z; pub struct Shared; fn f() { x::f() }"),
        ("a/x.rs", "use super::{Shared, y::Y}; pub fn f() {}"),
        ("a/y/mod.rs", "mod inner; pub struct Y;"),
        ("a/y/inner.rs", "use crate::a::z;"),
        ("a/z.rs", "use super::x::f;"),
    ]);
    let circles = sources.circles();
    assert_eq!(circles.keys().collect::<Vec<_>>(), ["a: x, y, z"]);
    assert_eq!(circles["a: x, y, z"], ["a/x -> a/y", "a/y/inner -> a/z", "a/z -> a/x"]);
}

#[test]
fn modules_import_only_from_earlier_ones() {
    let (sources, mut wrong) = (sources(), Vec::new());
    for (own_name, module, source) in files(&sources) {
        let own = floor(own_name).unwrap_or_else(|| panic!("{} has no place in the journey", source.file.display()));
        for import in imports(&sources, module) {
            if import != own_name && floor(import).is_none_or(|theirs| theirs >= own) {
                wrong.push(format!("{} imports {import}", source.file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "against the journey's direction:\n{}", wrong.join("\n"));
}

/// Also inside a folder.
#[test]
fn files_import_only_downwards() {
    let circles = sources().circles();
    let new: Vec<String> = circles
        .iter()
        .filter(|(circle, _)| !CIRCLES.contains(&circle.as_str()))
        .map(|(circle, uses)| format!("{circle}\n    {}", uses.join("\n    ")))
        .collect();
    assert!(new.is_empty(), "files that use each other in a circle:\n{}", new.join("\n"));
    let gone: Vec<&&str> = CIRCLES.iter().filter(|circle| !circles.contains_key(**circle)).collect();
    assert!(gone.is_empty(), "no circles any more: {gone:?}");
}

#[test]
fn the_recorder_shares_no_physics_with_the_simulator() {
    let (sources, mut wrong) = (sources(), Vec::new());
    for (_, module, source) in files(&sources).filter(|(own, ..)| *own == "recorder") {
        if source.text.contains("burn") {
            wrong.push(format!("{} uses Burn", source.file.display()));
        }
        for import in imports(&sources, module).filter(|import| !RECORDER_MAY_IMPORT.contains(import)) {
            wrong.push(format!("{} imports {import}", source.file.display()));
        }
    }
    assert!(wrong.is_empty(), "the recorder must stay independent:\n{}", wrong.join("\n"));
}

#[test]
fn physics_knows_no_file_clock_or_terminal() {
    let (sources, mut wrong) = (sources(), Vec::new());
    for (_, _, source) in files(&sources).filter(|(own, ..)| PHYSICS.contains(own)) {
        for word in ["std::fs", "std::time", "println!", "eprintln!", "std::io", "indicatif"] {
            if source.text.contains(word) {
                wrong.push(format!("{} uses {word}", source.file.display()));
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
        "data/leftovers.rs",
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
    let (sources, mut wrong) = (sources(), Vec::new());
    for (_, _, source) in files(&sources) {
        let name = source.file.to_str().unwrap();
        if !OWN.contains(&name) && OPENING.iter().any(|word| opens(&source.text, word)) {
            wrong.push(format!("{name} opens files by itself: use data::files"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
