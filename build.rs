//! Names the sources, so that a report can say which program made it: constants that decide are in them.

use std::path::{Path, PathBuf};

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("the sources").map(|e| e.expect("an entry").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

fn main() {
    let mut found = vec![PathBuf::from("Cargo.toml"), PathBuf::from("Cargo.lock")];
    files(Path::new("src"), &mut found);
    // FNV-1a (Fowler, Noll, Vo) over names and contents: it tells versions apart, it proves nothing.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for path in found {
        let name = path.to_string_lossy().replace('\\', "/");
        let contents = std::fs::read(&path).unwrap_or_default();
        for byte in name.bytes().chain(contents) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    println!("cargo::rustc-env=HYBRIDSIM_SOURCES={hash:016x}");
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rerun-if-changed=Cargo.toml");
    println!("cargo::rerun-if-changed=Cargo.lock");
}
