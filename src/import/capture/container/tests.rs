//! The same cube from every container, as the programs that people use wrote it (scripts/golden_containers.py).

use std::fs;
use std::path::{Path, PathBuf};

use super::{Source, open};
use crate::error::Result;

const SHAPE: [usize; 4] = [2, 3, 4, 8];

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/containers").join(name)
}

#[track_caller]
fn assert_cube(source: Result<Source>, name: &str) {
    let source = source.unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!((source.shape(), source.is_complex()), (&SHAPE[..], true), "{name}");
    let code = |n: usize| (3.0 * n as f32 - 200.0, 150.0 - 2.0 * n as f32);
    for frame in 0..2 {
        let (re, im) = source.numbers(Some(0), frame).unwrap();
        let found: Vec<(f32, f32)> = re.into_iter().zip(im.unwrap()).collect();
        assert_eq!(found, (frame * 96..(frame + 1) * 96).map(code).collect::<Vec<_>>(), "{name}, frame {frame}");
    }
    // The last axis as the frames: gathered in C order of the others.
    let (re, _) = source.numbers(Some(3), 5).unwrap();
    assert_eq!(re, (0..24).map(|row| code(8 * row + 5).0).collect::<Vec<_>>(), "{name}, last axis");
}

#[test]
fn every_container_gives_the_same_numbers() {
    for (name, variable) in [
        ("v6.mat", None),
        ("v7.mat", None),
        ("v73.mat", None),
        ("v73.mat", Some("cube")),
        ("h5py.h5", Some("radar/cube")),
        ("h5py.h5", Some("radar/re,radar/im")),
        ("parts.npz", Some("real, imag")),
        ("cube.npz", None),
        // In structures, by MATLAB's separator and by that of HDF5; the only array of four axes.
        ("structures_v6.mat", None),
        ("structures_v6.mat", Some("radar.data.cube")),
        ("structures_v7.mat", Some("radar/data/cube")),
        ("structures_v73.mat", Some("radar.data.cube")),
        ("structures_v73.mat", None),
    ] {
        assert_cube(open(&golden(name), variable, 4), name);
    }
    let pairs = open(&golden("v7.mat"), None, 5).unwrap();
    assert_eq!((pairs.shape(), pairs.is_complex(), pairs.holds_codes()), (&[2, 3, 4, 8, 2][..], false, true));
    assert_eq!(pairs.numbers(Some(0), 1).unwrap().0[..4], [88.0, -42.0, 91.0, -44.0]);
}

#[test]
fn arrays_of_structures_and_cells_are_counted_as_in_matlab() {
    for name in ["structures_v6.mat", "structures_v7.mat"] {
        for variable in ["frames(2).adc", "cells{2}"] {
            let source = open(&golden(name), Some(variable), 3).unwrap_or_else(|error| panic!("{name}, {variable}: {error}"));
            assert_eq!((source.shape(), source.is_complex()), (&SHAPE[1..], true));
            assert_eq!(source.numbers(None, 0).unwrap().0[..2], [88.0, 91.0], "{name}, {variable}");
        }
    }
}

/// What is not read is said by name, and what it is.
#[test]
fn what_is_no_array_is_named_for_what_it_is() {
    for (name, variable, found) in [
        ("structures_v6.mat", "note", "`note` is text, expected a numeric array"),
        ("structures_v7.mat", "radar.board", "`radar.board` is text, expected a numeric array"),
        ("structures_v7.mat", "radar.cube", "`radar.cube` is missing, expected a numeric array"),
        ("structures_v73.mat", "cells{1}", "`cells{1}` is below `cells`: cells or an array of structures (references), expected"),
    ] {
        let error = open(&golden(name), Some(variable), 4).err().unwrap();
        assert!(error.to_string().contains(found), "{error}");
        assert!(error.hint().unwrap().contains("cube [2, 3, 4, 8]"), "{:?}", error.hint());
    }
}

/// What h5py writes as its latest and as its earliest format: chunks by every kind of index, filters, byte orders.
#[test]
fn every_way_of_hdf5_gives_the_same_numbers() {
    for name in ["latest.h5", "earliest.h5"] {
        for variable in [
            "one_chunk",
            "fixed",
            "unfiltered",
            "growing",
            "growing_twice",
            "checked",
            "double",
            "big_endian",
            "scaled/re,scaled/im",
            "swapped/re,swapped/im",
        ] {
            assert_cube(open(&golden(name), Some(variable), 4), &format!("{name}, {variable}"));
        }
        let other = open(&golden(name), Some("lzf"), 4).err().unwrap();
        assert!(other.to_string().contains("compressed otherwise") && other.hint().unwrap().contains("h5repack"), "{other}");
    }
}

#[test]
fn an_array_that_is_not_there_or_not_alone_is_said_so() {
    let error = |name: &str, variable: Option<&str>, axes| open(&golden(name), variable, axes).err().unwrap();
    let missing = error("h5py.h5", Some("cube"), 4);
    assert!(missing.to_string().contains("`cube`") && missing.hint().unwrap().contains("radar/cube [2, 3, 4, 8]"), "{missing:?}");
    let several = error("h5py.h5", None, 4);
    assert!(
        several.to_string().contains("radar/im [2, 3, 4, 8]") && several.hint().unwrap().contains("--variable"),
        "{several:?}"
    );
    let none = error("v7.mat", None, 3);
    assert!(none.to_string().contains("rate [1, 1]") && none.to_string().contains("3 axes"), "{none}");
    let parts = error("v7.mat", Some("pairs,rate"), 4);
    assert!(parts.to_string().contains("two real arrays of one shape"), "{parts}");
}

/// Whatever is missing at the end, a file is read whole or refused: nothing panics, nothing is read that is not there. Every eleventh
/// length, which meets every part of the files.
#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, variable) in [
        ("v6.mat", "cube"),
        ("v7.mat", "cube"),
        ("structures_v6.mat", "radar.data.cube"),
        ("structures_v7.mat", "radar.data.cube"),
        ("v73.mat", "cube"),
        ("h5py.h5", "radar/cube"),
        ("latest.h5", "growing_twice"),
        ("cube.npz", "cube"),
        ("parts.npz", "real"),
    ] {
        let whole = fs::read(golden(name)).unwrap();
        let wanted = open(&golden(name), Some(variable), 4).unwrap().numbers(Some(0), 1).unwrap();
        let path = folder.path().join(name);
        for length in (0..whole.len()).step_by(11) {
            fs::write(&path, &whole[..length]).unwrap();
            if let Ok(source) = open(&path, Some(variable), 4) {
                assert_eq!(source.numbers(Some(0), 1).ok().as_ref(), Some(&wanted), "{name}, {length} bytes");
            }
        }
    }
}

/// One byte that is another: refused, or numbers of the same shape; nothing panics.
#[test]
fn a_file_that_is_damaged_anywhere_does_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    for (name, variable) in [
        ("v6.mat", "cube"),
        ("v7.mat", "cube"),
        ("structures_v6.mat", "radar.data.cube"),
        ("structures_v7.mat", "radar.data.cube"),
        ("v73.mat", "cube"),
        ("h5py.h5", "radar/cube"),
        ("latest.h5", "fixed"),
        ("cube.npz", "cube"),
    ] {
        let whole = fs::read(golden(name)).unwrap();
        let path = folder.path().join(name);
        for (place, flip) in (0..whole.len()).step_by(29).zip([0xff, 0x01, 0x80].into_iter().cycle()) {
            let mut bytes = whole.clone();
            bytes[place] ^= flip;
            fs::write(&path, &bytes).unwrap();
            if let Ok(source) = open(&path, Some(variable), 4) {
                let _ = source.numbers(Some(0), 1);
            }
        }
    }
}
