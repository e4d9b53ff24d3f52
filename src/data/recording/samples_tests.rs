//! Samples in every layout, order and number type, and those that are none.

use std::fs;

use super::tests::*;
use super::*;
use crate::data::arrays::{Values, write_npy};
use crate::radar::Sampling;

#[test]
fn samples_come_back_in_every_layout() {
    for layout in [IfLayout::Codes, IfLayout::Complex, IfLayout::RealCodes, IfLayout::Real] {
        let radar = small_radar(layout.sampling());
        let (_parent, folder) = written(&contents(&radar, layout));
        let recording = Recording::open(&folder).unwrap();
        assert_eq!((recording.layout(), recording.frames()), (layout, 2));
        for index in 0..2 {
            assert_eq!(recording.frame(index).unwrap(), frame_of(&radar, index), "{layout:?}");
        }
        assert_eq!(recording.frame(1).unwrap().sample(0, 1, 2, 3).re, 1000.0 + 23.0 - 7.0);
    }
}

#[test]
#[should_panic(expected = "a quadrature part for Real")]
fn a_quadrature_part_is_not_dropped_where_the_layout_has_none() {
    let radar = small_radar(Sampling::Real);
    let folder = tempfile::tempdir().unwrap();
    let frame = &mut |index| {
        let frame = frame_of(&radar, index);
        Ok(IfFrame { im: Some(frame.re.clone()), ..frame })
    };
    let _ = write_recording(folder.path().join("x"), &contents(&radar, IfLayout::Real), frame);
}

#[test]
fn samples_in_fortran_order_come_back_too() {
    let radar = small_radar(Sampling::Complex);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Codes));
    let path = folder.join("if.npy");
    let bytes = fs::read(&path).unwrap();
    let shape = IfLayout::Codes.shape(&radar);
    let data = &bytes[bytes.len() - 2 * shape.iter().product::<usize>()..];
    // The transpose of C order over the reversed shape is Fortran order over the shape.
    let codes: Vec<[u8; 2]> = data.as_chunks().0.to_vec();
    let mut stored = vec![[0; 2]; codes.len()];
    let position: Vec<usize> = crate::data::arrays::to_c_order((0..codes.len()).collect(), &shape);
    position.iter().zip(&codes).for_each(|(&position, &code)| stored[position] = code);
    let mut file = bytes[..bytes.len() - data.len()].to_vec();
    let flag = file.windows(5).position(|window| window == b"False").unwrap();
    file[flag..flag + 5].copy_from_slice(b"True ");
    file.extend(stored.concat());
    fs::write(&path, file).unwrap();
    let recording = Recording::open(&folder).unwrap();
    (0..2).for_each(|index| assert_eq!(recording.frame(index).unwrap(), frame_of(&radar, index)));
}

#[test]
fn a_receiver_of_the_other_kind_is_suspected() {
    let radar = small_radar(Sampling::Real);
    let (_parent, folder) = written(&contents(&radar, IfLayout::RealCodes));
    let toml = folder.join(SETTINGS_FILE);
    fs::write(&toml, fs::read_to_string(&toml).unwrap().replace("sampling = \"real\"\n", "")).unwrap();
    let hint = Recording::open(&folder).unwrap_err().hint().unwrap();
    assert_eq!(hint, "a receiver without quadrature needs radar.sampling = \"real\" in recording.toml");
    write_npy(folder.join("if.npy"), &[2, 1, 2, 3, 4], Values::F64(&[0.0; 48])).unwrap();
    assert_eq!(
        refused(&folder),
        "if.npy: `if` is float64 [2, 1, 2, 3, 4], expected float64 [frame = 2, tx = 1, rx = 2, loop = 3, sample = 4, iq = 2]"
    );
}

/// An `if.npy` with this type and these bytes.
fn write_raw(folder: &Path, descr: &str, shape: &[usize], bytes: &[u8]) {
    let mut file = crate::data::arrays::header_bytes(descr, shape);
    file.extend_from_slice(bytes);
    fs::write(folder.join("if.npy"), file).unwrap();
}

fn bytes_of<const N: usize>(values: &[f64], number: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| number(value)).collect()
}

#[test]
fn samples_of_every_real_and_complex_type_are_read() {
    let radar = small_radar(Sampling::Real);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Real));
    let whole: Vec<f64> = (0..48).map(f64::from).collect();
    let half = |value: f64| half::f16::from_f64(value).to_le_bytes();
    let types: [(&str, Vec<u8>); 12] = [
        ("|i1", bytes_of(&whole, |value| (value as i8).to_le_bytes())),
        ("<i2", bytes_of(&whole, |value| (value as i16).to_le_bytes())),
        (">i2", bytes_of(&whole, |value| (value as i16).to_be_bytes())),
        ("<i4", bytes_of(&whole, |value| (value as i32).to_le_bytes())),
        ("<i8", bytes_of(&whole, |value| (value as i64).to_le_bytes())),
        ("|u1", bytes_of(&whole, |value| (value as u8).to_le_bytes())),
        ("<u2", bytes_of(&whole, |value| (value as u16).to_le_bytes())),
        ("<u4", bytes_of(&whole, |value| (value as u32).to_le_bytes())),
        ("<u8", bytes_of(&whole, |value| (value as u64).to_le_bytes())),
        ("<f2", bytes_of(&whole, half)),
        ("<f4", bytes_of(&whole, |value| (value as f32).to_le_bytes())),
        ("<f8", bytes_of(&whole, f64::to_le_bytes)),
    ];
    for (descr, bytes) in &types {
        write_raw(&folder, descr, &[2, 1, 2, 3, 4], bytes);
        let recording = Recording::open(&folder).unwrap_or_else(|error| panic!("{descr}: {error}"));
        let wanted = if descr.contains('f') { IfLayout::Real } else { IfLayout::RealCodes };
        assert_eq!(recording.layout(), wanted, "{descr}");
        assert_eq!(recording.frame(1).unwrap().re, (24..48).map(|value| value as f32).collect::<Vec<_>>(), "{descr}");
    }
    let radar = small_radar(Sampling::Complex);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Codes));
    let pairs: Vec<f64> = (0..96).map(f64::from).collect();
    let pair_types =
        [("<c8", 5, bytes_of(&pairs, |value| (value as f32).to_le_bytes())), ("<c16", 5, bytes_of(&pairs, f64::to_le_bytes))];
    let interleaved = [
        ("<u2", 6, bytes_of(&pairs, |value| (value as u16).to_le_bytes())),
        ("<f2", 6, bytes_of(&pairs, half)),
        ("<f8", 6, bytes_of(&pairs, f64::to_le_bytes)),
    ];
    for (descr, axes, bytes) in pair_types.iter().chain(&interleaved) {
        write_raw(&folder, descr, &[2, 1, 2, 3, 4, 2][..*axes], bytes);
        let frame = Recording::open(&folder).unwrap_or_else(|error| panic!("{descr}: {error}")).frame(1).unwrap();
        assert_eq!((frame.sample(0, 0, 0, 1).re, frame.sample(0, 0, 0, 1).im), (50.0, 51.0), "{descr}");
    }
}

#[test]
fn what_cannot_be_a_sample_is_refused_with_what_can() {
    let radar = small_radar(Sampling::Real);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Real));
    write_raw(&folder, "|b1", &[2, 1, 2, 3, 4], &[0; 48]);
    assert_eq!(
        refused(&folder),
        "if.npy: `if` is bool [2, 1, 2, 3, 4], expected real numbers [frame = 2, tx = 1, rx = 2, loop = 3, sample = 4]"
    );
    write_raw(&folder, "<c16", &[2, 1, 2, 3, 4], &[0; 48 * 16]);
    assert!(refused(&folder).contains("is complex128 [2, 1, 2, 3, 4], expected real numbers"));
    assert!(Recording::open(&folder).unwrap_err().hint().unwrap().contains("radar.sampling = \"complex\""));
}

/// A frame that is longer than a block is put together whole.
#[test]
fn a_frame_of_several_blocks_comes_back() {
    let radar = Radar { samples_per_chirp: 1000, loops_per_frame: 301, ..small_radar(Sampling::Complex) };
    let (_parent, folder) = written(&contents(&radar, IfLayout::Complex));
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(recording.frame(1).unwrap(), frame_of(&radar, 1));
}

#[test]
fn samples_that_are_cut_off_or_not_finite_are_refused() {
    let radar = small_radar(Sampling::Real);
    let (_parent, folder) = written(&contents(&radar, IfLayout::Real));
    let path = folder.join("if.npy");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 10]).unwrap();
    assert_eq!(
        refused(&folder),
        "if.npy: `if` is 182 bytes of data, expected 192 bytes for the float32 [2, 1, 2, 3, 4] of its header"
    );
    fs::write(&path, "").unwrap();
    assert_eq!(refused(&folder), "if.npy: `if` is an empty file, expected a NumPy array (.npy)");
    let mut values = [0.0; 48];
    values[24 + 12 + 4 + 3] = f32::NAN;
    write_npy(&path, &[2, 1, 2, 3, 4], Values::F32(&values)).unwrap();
    let recording = Recording::open(&folder).unwrap();
    recording.frame(0).unwrap();
    let message = recording.frame(1).unwrap_err().to_string();
    assert!(
        message.ends_with("if.npy: `if` is NaN or infinite at frame 1, tx 0, rx 1, loop 1, sample 3, expected finite samples"),
        "{message}"
    );
    fs::remove_file(&path).unwrap();
    assert!(refused(&folder).starts_with("if.npy: cannot be read: "));
}

#[test]
fn codes_beyond_int16_are_brought_to_its_limits_and_counted() {
    let radar = Radar { frames: 1, ..small_radar(Sampling::Complex) };
    let parent = tempfile::tempdir().unwrap();
    let mut frame = frame_of(&radar, 0);
    frame.re[..4].copy_from_slice(&[40000.0, -40000.0, 0.5, -1.4]);
    let folder = parent.path().join("r");
    let recording = write_recording(&folder, &contents(&radar, IfLayout::Codes), &mut |_| Ok(frame.clone())).unwrap();
    assert_eq!(recording.notes, ["2 samples were beyond int16 and brought to its limits"]);
    assert_eq!(recording.frame(0).unwrap().re[..4], [32767.0, -32768.0, 1.0, -1.0]);
}
