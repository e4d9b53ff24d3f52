use std::fs;
use std::path::PathBuf;

use num_complex::Complex;
use tempfile::TempDir;

use super::*;
use crate::data::test_support::names;

const POSE: Axes = &[("pose", None), ("xyz", Some(3))];

/// A `.npy` of version 1 with any text as its header.
fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn header(descr: &str, shape: &str) -> String {
    format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n")
}

/// The file, the message after its path, and the hint that reading these bytes as `axes` gives.
fn refused<T: Element + std::fmt::Debug>(bytes: &[u8], axes: Axes) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trans.npy");
    fs::write(&path, bytes).unwrap();
    let error = read_npy::<T>(&path, axes).unwrap_err();
    let message = error.to_string();
    let message = message.strip_prefix(&format!("{}: ", path.display())).expect("the message names the file");
    (message.to_string(), error.hint().unwrap_or_default())
}

fn temporary(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

#[test]
fn every_kind_of_number_comes_back_as_it_was_written() {
    let (folder, path) = temporary("a.npy");
    let axes: Axes = &[("row", None), ("column", Some(2))];
    let shape = [2, 2];
    write_npy(&path, &shape, Values::F64(&[1.0, -2.5, 1e300, 0.0])).unwrap();
    assert_eq!(read_npy::<f64>(&path, axes).unwrap(), Array { shape: vec![2, 2], values: vec![1.0, -2.5, 1e300, 0.0] });
    write_npy(&path, &shape, Values::F32(&[1.0, -2.5, 3.0, 0.1])).unwrap();
    assert_eq!(read_npy::<f32>(&path, axes).unwrap().values, [1.0, -2.5, 3.0, 0.1]);
    write_npy(&path, &shape, Values::I16(&[1, -2, i16::MIN, i16::MAX])).unwrap();
    assert_eq!(read_npy::<i16>(&path, axes).unwrap().values, [1, -2, i16::MIN, i16::MAX]);
    assert_eq!(read_npy::<f32>(&path, axes).unwrap().values, [1.0, -2.0, -32768.0, 32767.0]);
    write_npy(&path, &shape, Values::I32(&[1, -2, i32::MIN, 7])).unwrap();
    assert_eq!(read_npy::<i64>(&path, axes).unwrap().values, [1, -2, i64::from(i32::MIN), 7]);
    write_npy(&path, &shape, Values::I64(&[i64::MIN, -1, 0, 1])).unwrap();
    assert_eq!(read_npy::<i64>(&path, axes).unwrap().values, [i64::MIN, -1, 0, 1]);
    write_npy(&path, &shape, Values::U32(&[u32::MAX, 0, 1, 2])).unwrap();
    assert_eq!(read_npy::<i64>(&path, axes).unwrap().values, [i64::from(u32::MAX), 0, 1, 2]);
    let complex = [Complex::new(1.0, -1.0), Complex::new(0.5, 2.0), Complex::default(), Complex::new(-3.0, 0.0)];
    write_npy(&path, &shape, Values::Complex64(&complex)).unwrap();
    assert_eq!(read_npy::<Complex<f32>>(&path, axes).unwrap().values, complex);
    assert_eq!(names(folder.path()), ["a.npy"]);
}

#[test]
fn numpy_alignment_is_kept() {
    // NumPy starts the data at a multiple of 64 bytes; some readers map it into memory.
    assert_eq!(header_bytes("<i2", &[24, 1, 4, 64, 128, 2]).len() % 16, 0);
}

#[test]
fn fortran_order_and_big_endian_are_undone() {
    let (_folder, path) = temporary("a.npy");
    let text = "{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3), }\n";
    let stored = [1i16, 4, 2, 5, 3, 6];
    let data: Vec<u8> = stored.iter().flat_map(|value| value.to_be_bytes()).collect();
    fs::write(&path, npy(text, &data)).unwrap();
    let array = read_npy::<f64>(&path, &[("row", Some(2)), ("column", Some(3))]).unwrap();
    assert_eq!(array.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    // Three axes: value = 100 i + 10 j + k, stored with i the fastest.
    let mut stored = vec![];
    for k in 0..2 {
        for j in 0..3 {
            stored.extend((0..4).map(|i| 100 * i + 10 * j + k));
        }
    }
    let ordered = to_c_order(stored, &[4, 3, 2]);
    let wanted: Vec<i32> = (0..4).flat_map(|i| (0..3).flat_map(move |j| (0..2).map(move |k| 100 * i + 10 * j + k))).collect();
    assert_eq!(ordered, wanted);
}

#[test]
fn an_empty_file_is_named() {
    let (message, hint) = refused::<f64>(b"", POSE);
    assert_eq!(message, "`trans` is an empty file, expected a NumPy array (.npy)");
    assert_eq!(hint, "whatever wrote it did not finish; make it again");
}

#[test]
fn a_file_that_is_no_array_is_described() {
    let of = |bytes: &[u8]| refused::<f64>(bytes, POSE).0;
    assert_eq!(of(b"[radar]\nx = 1"), r#"`trans` is a text that starts with "[radar]\nx ", expected a NumPy array (.npy)"#);
    assert_eq!(of(b"PK\x03\x04........"), "`trans` is a zip archive (.npz?), expected a NumPy array (.npy)");
    assert_eq!(of(b"\x80\x02}q\x00(U\nv_t"), "`trans` is a Python pickle, expected a NumPy array (.npy)");
    assert_eq!(
        of(b"\xff\xd8\xff\xe0"),
        "`trans` is a file that starts with the bytes [ff, d8, ff, e0], expected a NumPy array (.npy)"
    );
    assert_eq!(of(b"\x93NUMPY\x01"), "`trans` is cut off after 7 bytes, expected a NumPy array (.npy)");
}

#[test]
fn a_truncated_file_says_how_much_is_missing() {
    let bytes = npy(&header("<f8", "(100, 3)"), &[0; 1000]);
    let (message, hint) = refused::<f64>(&bytes, POSE);
    assert_eq!(message, "`trans` is 1000 bytes of data, expected 2400 bytes for the float64 [100, 3] of its header");
    assert_eq!(hint, "the file is cut off, or its header is wrong; copy it again");
}

#[test]
fn a_header_that_announces_too_little_is_refused_too() {
    let (message, hint) = refused::<f64>(&npy(&header("<f8", "(1, 3)"), &[0; 48]), POSE);
    assert_eq!(message, "`trans` is 48 bytes of data, expected 24 bytes for the float64 [1, 3] of its header");
    assert_eq!(hint, "the header does not belong to this data");
}

#[test]
fn a_header_that_announces_the_impossible_allocates_nothing() {
    let (message, _) = refused::<f64>(&npy(&header("<f8", "(4611686018427387904, 3)"), &[0; 24]), POSE);
    assert_eq!(message, "`trans` is an array with more numbers than any file can hold, expected a header that fits the file");
    let (message, _) = refused::<f64>(&npy(&header("<f8", "(1000000000000, 3)"), &[0; 24]), POSE);
    assert_eq!(
        message,
        "`trans` is 24 bytes of data, expected 24000000000000 bytes for the float64 [1000000000000, 3] of its header"
    );
    // Version 2: a header of 4 GB.
    let (message, hint) = refused::<f64>(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'", POSE);
    assert_eq!(message, "`trans` is an array with a header of 4294967295 bytes in 20 bytes, expected a header that fits");
    assert_eq!(hint, "the file is cut off or damaged; copy it again");
}

#[test]
fn a_header_that_cannot_be_parsed_is_refused() {
    for text in ["{'descr': '<f8', 'fortran_order'", "", "[1, 2]", "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3), }"]
    {
        let (message, _) = refused::<f64>(&npy(text, &[0; 24]), POSE);
        assert!(message.starts_with("`trans` is an array with an unreadable header ("), "{message}");
    }
    let (message, _) = refused::<f64>(&npy(&"(".repeat(60_000), &[0; 24]), POSE);
    assert!(message.starts_with("`trans` is an array with an unreadable header (too many brackets)"), "{message}");
    let (message, _) = refused::<f64>(b"\x93NUMPY\x09\x00\x02\x00\x00\x00{}", POSE);
    assert!(message.contains("unsupported version: (9, 0)"), "{message}");
}

#[test]
fn another_shape_is_named_by_its_axis() {
    let (message, hint) = refused::<f64>(&npy(&header("<f4", "(2, 4)"), &[0; 32]), POSE);
    assert_eq!(message, "`trans` is float32 [2, 4], expected real numbers [pose, xyz = 3]");
    assert_eq!(hint, "xyz is 4 instead of 3");
    let (_, hint) = refused::<f64>(&npy(&header("<f4", "(6,)"), &[0; 24]), POSE);
    assert_eq!(hint, "it has 1 axes instead of 2");
}

#[test]
fn another_kind_of_number_is_named() {
    let (message, _) = refused::<i64>(&npy(&header("<f4", "(1, 3)"), &[0; 12]), POSE);
    assert_eq!(message, "`trans` is float32 [1, 3], expected integers [pose, xyz = 3]");
    let (message, _) = refused::<f64>(&npy(&header("<c8", "(1, 3)"), &[0; 24]), POSE);
    assert_eq!(message, "`trans` is complex64 [1, 3], expected real numbers [pose, xyz = 3]");
    let (message, hint) = refused::<f64>(&npy(&header("|O", "(1, 3)"), &[0; 24]), POSE);
    assert_eq!(message, "`trans` is a Python object (dtype '|O'), expected an array of plain numbers");
    assert_eq!(hint, "save its numbers as an array: numpy.save(FILE, numpy.stack(list(ARRAY)))");
    let (message, _) = refused::<f64>(&npy(&header("<U4", "()"), &[0; 16]), POSE);
    assert_eq!(message, "`trans` is text (dtype '<U4'), expected an array of plain numbers");
}

#[test]
fn a_value_that_is_not_finite_is_named_by_its_place() {
    let (_folder, path) = temporary("trans.npy");
    for (bad, name) in [(f64::NAN, "NaN"), (f64::INFINITY, "infinite")] {
        write_npy(&path, &[2, 3], Values::F64(&[0.0, 0.0, 0.0, 0.0, bad, 0.0])).unwrap();
        let message = read_npy::<f64>(&path, POSE).unwrap_err().to_string();
        assert_eq!(message, format!("{}: `trans` is {name} at pose 1, xyz 1, expected finite numbers", path.display()));
    }
}

#[test]
fn a_missing_file_and_a_folder_are_read_errors() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.npy");
    let error = read_npy::<f64>(&missing, POSE).unwrap_err();
    assert!(error.to_string().starts_with(&format!("{}: cannot be read: No such file", missing.display())), "{error}");
    assert!(error.hint().unwrap().starts_with("check the path"));
    assert!(matches!(read_npy::<f64>(folder.path(), POSE), Err(Error::Read { .. })));
    assert!(matches!(Npz::open(folder.path()), Err(Error::Read { .. })));
}

fn members(values: &[f64]) -> [Member<'_>; 2] {
    [
        Member { name: "trans", shape: vec![values.len() / 3, 3], values: Values::F64(values) },
        Member { name: "rate", shape: vec![], values: Values::F64(&[60.0]) },
    ]
}

#[test]
fn an_archive_comes_back_and_is_written_the_same_twice() {
    let (folder, path) = temporary("a.npz");
    let values: Vec<f64> = (0..300).map(f64::from).collect();
    write_npz(&path, &members(&values)).unwrap();
    let first = fs::read(&path).unwrap();
    write_npz(&path, &members(&values)).unwrap();
    assert_eq!(fs::read(&path).unwrap(), first);
    assert_eq!(names(folder.path()), ["a.npz"]);
    let mut npz = Npz::open(&path).unwrap();
    assert_eq!(npz.names(), ["rate", "trans"]);
    assert_eq!(npz.read::<f64>("trans", POSE).unwrap(), Array { shape: vec![100, 3], values });
    assert_eq!(npz.scalar("rate").unwrap(), 60.0);
    let error = npz.scalar("trans").unwrap_err();
    assert_eq!(error.to_string(), format!("{}: `trans` is an array [100, 3], expected a single number", path.display()));
    let error = npz.read::<f64>("poses", POSE).unwrap_err();
    assert_eq!(error.to_string(), format!("{}: `poses` is missing, expected real numbers [pose, xyz = 3]", path.display()));
    assert_eq!(error.hint().unwrap(), "the file holds: rate, trans");
}

#[test]
fn what_is_no_archive_is_described() {
    let (_folder, path) = temporary("body.npz");
    let of = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let message = Npz::open(&path).err().unwrap().to_string();
        message.strip_prefix(&format!("{}: ", path.display())).unwrap().to_string()
    };
    assert_eq!(of(b""), "this is an empty file, expected a NumPy archive (.npz)");
    assert_eq!(of(&npy("", b"")), "this is a single NumPy array (.npy), expected a NumPy archive (.npz)");
    assert_eq!(
        of(b"\x80\x02}q\x00(U\nv_t"),
        "this is a Python pickle; convert it with scripts/smpl_to_npz.py, expected a NumPy archive (.npz)"
    );
    let message = of(b"PK\x03\x04 and then nothing of the kind");
    assert!(message.starts_with("this is a damaged or cut-off archive ("), "{message}");
}

#[test]
fn no_prefix_of_an_archive_and_no_flipped_byte_is_taken_for_another_array() {
    let (_folder, path) = temporary("a.npz");
    let values: Vec<f64> = (0..30).map(|value| f64::from(value).sin()).collect();
    write_npz(&path, &members(&values)).unwrap();
    let whole = fs::read(&path).unwrap();
    let read = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        Npz::open(&path).and_then(|mut npz| npz.read::<f64>("trans", POSE))
    };
    for length in 0..whole.len() {
        assert!(read(&whole[..length]).is_err(), "{length} bytes of {}", whole.len());
    }
    for position in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[position] ^= 0x55;
        if let Ok(array) = read(&bytes) {
            assert_eq!(array.values, values, "byte {position} flipped");
        }
    }
}

#[test]
fn an_archive_that_claims_to_grow_beyond_reason_is_refused() {
    let (_folder, path) = temporary("a.npz");
    write_npz(&path, &members(&[1.0, 2.0, 3.0])).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    // The uncompressed size in the archive's directory: 24 bytes after an entry's signature.
    let entry = bytes.windows(4).position(|window| window == b"PK\x01\x02").unwrap();
    bytes[entry + 24..entry + 28].copy_from_slice(&0x7000_0000u32.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    let message = Npz::open(&path).and_then(|mut npz| npz.read::<f64>("trans", POSE)).unwrap_err().to_string();
    assert!(message.contains("`trans` is said to grow from ") && message.contains(" to 1879048192 bytes"), "{message}");
}

#[test]
fn a_small_archive_cannot_fill_the_memory() {
    let (_folder, path) = temporary("a.npz");
    // Half a megabyte of zeros is compressed to half a kilobyte, as rest poses are.
    write_npz(&path, &members(&vec![0.0; 60_000])).unwrap();
    Npz::open(&path).unwrap().read::<f64>("trans", POSE).unwrap();
    let zeros = vec![0.0; 12_000_000];
    write_npz(&path, &members(&zeros)).unwrap();
    let size = fs::metadata(&path).unwrap().len();
    assert!(size < 200_000);
    let error = Npz::open(&path).and_then(|mut npz| npz.read::<f64>("trans", POSE)).unwrap_err();
    let most = (1 << 26) + 100 * size;
    let wanted = format!("`trans` is 96000000 bytes once it is unpacked, expected at most {most} for so small an archive");
    assert_eq!(error.to_string(), format!("{}: {wanted}", path.display()));
    assert!(error.hint().unwrap().contains("numpy.savez"));
    // As small numbers they would need eight times their size.
    let kept = Member { name: "trans", shape: vec![4_000_000, 3], values: Values::I16(&vec![0; 12_000_000]) };
    write_npz(&path, &[kept]).unwrap();
    let error = Npz::open(&path).and_then(|mut npz| npz.read::<f64>("trans", POSE)).unwrap_err();
    assert!(error.to_string().contains("`trans` is 96000000 bytes once it is unpacked"), "{error}");
}

#[test]
fn all_that_one_archive_unpacks_counts() {
    let (_folder, path) = temporary("a.npz");
    let zeros = vec![0.0; 3_000_000];
    let names = ["a", "b", "c", "d"];
    let all: Vec<Member> =
        names.iter().map(|name| Member { name, shape: vec![1_000_000, 3], values: Values::F64(&zeros) }).collect();
    write_npz(&path, &all).unwrap();
    let mut npz = Npz::open(&path).unwrap();
    let read: Vec<bool> = names.iter().map(|name| npz.read::<f64>(name, POSE).is_ok()).collect();
    assert_eq!(read, [true, true, true, false], "24 MB each, 64 MiB and a hundred times the file in all");
}

#[test]
#[cfg(unix)]
fn an_array_that_is_a_device_is_not_read() {
    let message = read_npy::<f64>("/dev/zero", POSE).unwrap_err().to_string();
    assert_eq!(message, "/dev/zero: this is a device, expected a regular file");
    assert!(Npz::open("/dev/zero").is_err());
}
