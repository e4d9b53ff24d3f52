//! All integration tests in one program, which is linked once and keeps every core busy: `cargo test --test suite NAME` for those of one
//! file.

use std::path::{Path, PathBuf};

#[path = "support/scenes.rs"]
mod scenes;
mod support;

mod align;
mod audits;
#[cfg_attr(not(any(feature = "ndarray", feature = "wgpu")), allow(dead_code, reason = "compares with another backend"))]
mod backends;
mod challenge;
mod cli;
mod configs;
mod diagnosis;
mod export;
mod hostile_input;
mod intake;
mod integrity;
mod journey;
mod layers;
mod pages;
mod paper;
mod physics;
mod plausible;
#[cfg_attr(not(any(feature = "ndarray", feature = "wgpu")), allow(dead_code, reason = "compares with another backend"))]
mod pose;
mod real_captures;
mod real_input;
mod robustness;
mod rover;
mod salt;

/// A file that is not named above, or by the file that its folder belongs to, would never run.
#[test]
fn every_file_of_tests_runs() {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let files = |folder: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten();
        entries.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
    };
    let assert_named = |file: &Path, by: &Path| {
        let wanted = format!("mod {};", file.file_stem().unwrap().to_str().unwrap());
        assert!(std::fs::read_to_string(by).unwrap().lines().any(|line| line == wanted), "{}", file.display());
    };
    let suite = tests.join("suite.rs");
    for file in files(&tests).into_iter().filter(|file| *file != suite) {
        assert_named(&file, &suite);
        files(&file.with_extension("")).iter().for_each(|part| assert_named(part, &file));
    }
}
