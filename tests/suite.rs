//! All integration tests in one program, which is linked once and keeps every core busy: `cargo test --test suite NAME` for those of one
//! file.

mod support;

mod align;
mod audits;
mod backends;
mod challenge;
mod cli;
mod configs;
mod diagnosis;
mod export;
mod hostile_input;
mod intake;
mod journey;
mod layers;
mod pages;
mod paper;
mod physics;
mod plausible;
mod pose;
mod real_captures;
mod real_input;
mod robustness;
mod rover;
mod salt;

/// A file that is not named above would never run.
#[test]
fn every_file_of_tests_runs() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let is_named = include_str!("suite.rs").lines().any(|line| line == format!("mod {name};"));
        assert!(is_named || name == "suite" || path.extension().is_none_or(|end| end != "rs"), "{}", path.display());
    }
}
