//! The chirps that a `config.json` of Infineon's Radar SDK describes: `fmcw_single_shape`, or a sequence of elements that amounts to one.
//!
//! Source: Infineon Radar SDK. `fmcw_single_shape` and `mimo_mode` (with `tdm`, both transmitters send whatever `tx_antennas` says):
//! ifxAvian, DeviceConfig.h and the JSON reader. Sequences: `ifxradarsdk.fmcw.types`, `create_dict_from_sequence`; their simple kind is a
//! loop of frames around a loop of chirps around one chirp, or under `tdm_mimo` around one of each transmitter, equal but for `tx_mask`:
//! DeviceFmcwTypes.c, `ifx_fmcw_create_simple_sequence`. Either way a loop of chirps begins anew every repetition time, and the second
//! transmitter's chirp follows the first one's at once: RadarDeviceBase.cpp, `get_shape_set_from_config`.

use super::json::Json;
use crate::error::{Error, Result};

/// Chirps of one shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    pub start_hz: f64,
    pub end_hz: f64,
    pub rate_hz: f64,
    pub samples: usize,
    /// Of each transmitter in a frame.
    pub chirps: usize,
    /// From a transmitter's chirp to its next one.
    pub period_s: f64,
    pub frame_period_s: f64,
    /// Numbers of the antennas, from 1, those of transmitters in firing order.
    pub tx: Vec<usize>,
    pub rx: Vec<usize>,
}

impl Shape {
    /// # Errors
    /// A configuration of no shape, or of several.
    pub fn of(config: &Json) -> Result<Self> {
        let device = config.find("device_config").unwrap_or_else(|| config.clone());
        if let Some(sequence) = device.find("fmcw_sequence") {
            return of_sequence(&sequence);
        }
        let shape = device.find("fmcw_single_shape").unwrap_or(device);
        if shape.find("num_samples_per_chirp").is_none() {
            return Err(Error::field(
                config.file(),
                "device_config.fmcw_single_shape",
                format!("keys {:?}", shape.keys()),
                "one FMCW shape (num_samples_per_chirp, start_frequency_Hz, …), or `fmcw_sequence`",
            )
            .with_hint("take the config.json that the SDK wrote beside radar.npy; other devices and modes are not read"));
        }
        of_single(&shape)
    }
}

fn of_single(shape: &Json) -> Result<Shape> {
    let number = |key: &str| shape.get(key)?.number();
    // Earlier releases of the SDK wrote the ends of the band; their chirps rise.
    let either =
        |key: &str, earlier: &str| number(if shape.find(key).is_none() && shape.find(earlier).is_some() { earlier } else { key });
    let antennas = |key: &str| match shape.get(key)? {
        one if one.number().is_ok() => Ok(vec![antenna(&one)?]),
        several => several.items()?.iter().map(antenna).collect::<Result<Vec<usize>>>(),
    };
    let tx = if is_tdm(shape)? { vec![1, 2] } else { antennas("tx_antennas")? };
    if tx.len() > 1 && !is_tdm(shape)? {
        return Err(shape.get("tx_antennas")?.wrong("one transmitter, or mimo_mode \"tdm\""));
    }
    Ok(Shape {
        start_hz: either("start_frequency_Hz", "lower_frequency_Hz")?,
        end_hz: either("end_frequency_Hz", "upper_frequency_Hz")?,
        rate_hz: number("sample_rate_Hz")?,
        samples: shape.get("num_samples_per_chirp")?.count()?,
        chirps: shape.get("num_chirps_per_frame")?.count()?,
        period_s: number("chirp_repetition_time_s")?,
        frame_period_s: number("frame_repetition_time_s")?,
        tx,
        rx: antennas("rx_antennas")?,
    })
}

fn antenna(entry: &Json) -> Result<usize> {
    match entry.count()? {
        0 => Err(entry.wrong("antennas from 1 on")),
        antenna => Ok(antenna),
    }
}

/// Whether transmitters take turns; `mimo_mode` is a word, or its number in the SDK.
fn is_tdm(shape: &Json) -> Result<bool> {
    let Some(mode) = shape.find("mimo_mode") else { return Ok(false) };
    match (mode.text(), mode.number()) {
        (Ok("off"), _) | (_, Ok(0.0)) => Ok(false),
        (Ok("tdm"), _) | (_, Ok(1.0)) => Ok(true),
        _ => Err(mode.wrong("\"off\" or \"tdm\"")),
    }
}

const SIMPLE: &str = "the simple sequence: a loop of frames around a loop of chirps around one chirp, or one of each transmitter";

/// The elements of a sequence, which may also be one element by itself.
fn elements(sequence: &Json) -> Result<Vec<Json>> {
    if sequence.keys().is_empty() { sequence.items() } else { Ok(vec![sequence.clone()]) }
}

fn unread(element: &Json) -> Error {
    element.wrong(SIMPLE).with_hint("sequences of several shapes, loops beside each other and delays are not read")
}

/// The only element, a loop.
fn only_loop(sequence: &Json) -> Result<Json> {
    match &elements(sequence)?[..] {
        [only] => only.find("loop").ok_or_else(|| unread(only)),
        _ => Err(unread(sequence)),
    }
}

fn of_sequence(sequence: &Json) -> Result<Shape> {
    let frames = only_loop(sequence)?;
    let chirps = only_loop(&frames.get("sub_sequence")?)?;
    let inner = elements(&chirps.get("sub_sequence")?)?;
    let inner = inner.iter().map(|element| element.find("chirp").ok_or_else(|| unread(element))).collect::<Result<Vec<_>>>()?;
    let shapes = inner.iter().map(|chirp| of_chirp(chirp, &frames, &chirps)).collect::<Result<Vec<_>>>()?;
    let mut whole = shapes.first().cloned().ok_or_else(|| unread(&chirps))?;
    for (chirp, shape) in inner.iter().zip(&shapes) {
        if shape.tx.len() != 1 {
            return Err(chirp.get("tx_mask")?.wrong("one transmitter for every chirp"));
        }
        if (Shape { tx: vec![], ..shape.clone() }) != (Shape { tx: vec![], ..whole.clone() }) {
            return Err(unread(chirp));
        }
    }
    whole.tx = shapes.iter().flat_map(|shape| shape.tx.clone()).collect();
    match whole.tx.iter().enumerate().find(|(at, tx)| whole.tx[..*at].contains(tx)) {
        Some((at, _)) => Err(inner[at].get("tx_mask")?.wrong("each transmitter once in a loop of chirps")),
        None => Ok(whole),
    }
}

fn of_chirp(chirp: &Json, frames: &Json, chirps: &Json) -> Result<Shape> {
    let number = |key: &str| chirp.get(key)?.number();
    let mask = |key: &str| {
        let mask = chirp.get(key)?.count()?;
        Ok::<Vec<usize>, Error>((0..usize::BITS as usize).filter(|bit| mask >> bit & 1 == 1).map(|bit| bit + 1).collect())
    };
    Ok(Shape {
        start_hz: number("start_frequency_Hz")?,
        end_hz: number("end_frequency_Hz")?,
        rate_hz: number("sample_rate_Hz")?,
        samples: chirp.get("num_samples")?.count()?,
        chirps: chirps.get("num_repetitions")?.count()?,
        period_s: chirps.get("repetition_time_s")?.number()?,
        frame_period_s: frames.get("repetition_time_s")?.number()?,
        tx: mask("tx_mask")?,
        rx: mask("rx_mask")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(device: &str) -> Result<Shape> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.json");
        std::fs::write(&path, format!("{{\"device_config\": {{{device}}}}}")).unwrap();
        Shape::of(&Json::read(&path)?)
    }

    fn chirp(end: &str, tx_mask: u32) -> String {
        format!(
            r#"{{"chirp": {{"start_frequency_Hz": 58e9, "end_frequency_Hz": {end}, "sample_rate_Hz": 2e6, "num_samples": 64,
            "rx_mask": 5, "tx_mask": {tx_mask}, "tx_power_level": 31}}}}"#
        )
    }

    fn sequence(inner: &str) -> String {
        format!(
            r#""fmcw_sequence": [{{"loop": {{"num_repetitions": 0, "repetition_time_s": 0.05, "sub_sequence": [{{"loop":
            {{"num_repetitions": 32, "repetition_time_s": 0.0005, "sub_sequence": [{inner}]}}}}]}}}}]"#
        )
    }

    fn single(more: &str) -> String {
        format!(
            r#""fmcw_single_shape": {{"chirp_repetition_time_s": 0.0005, "frame_repetition_time_s": 0.05, "start_frequency_Hz": 58e9,
            "end_frequency_Hz": 62e9, "num_chirps_per_frame": 32, "num_samples_per_chirp": 64, "sample_rate_Hz": 2e6,
            "rx_antennas": [1, 3], {more}}}"#
        )
    }

    #[test]
    fn a_simple_sequence_is_a_single_shape() {
        let shape = read(&single(r#""tx_antennas": [1]"#)).unwrap();
        assert_eq!((shape.chirps, shape.samples, &shape.rx[..], &shape.tx[..]), (32, 64, &[1, 3][..], &[1][..]));
        assert_eq!(read(&sequence(&chirp("62e9", 1))).unwrap(), shape);
        // Two transmitters in turn.
        let two = read(&single(r#""tx_antennas": [1], "mimo_mode": "tdm""#)).unwrap();
        assert_eq!(two, Shape { tx: vec![1, 2], ..shape });
        assert_eq!(read(&sequence(&[chirp("62e9", 1), chirp("62e9", 2)].join(","))).unwrap(), two);
        assert_eq!(read(&single(r#""tx_antennas": [1, 2], "mimo_mode": 1"#)).unwrap(), two);
    }

    #[test]
    fn one_antenna_may_stand_without_a_list() {
        let shape = read(&single(r#""tx_antennas": 1"#).replace("[1, 3]", "3")).unwrap();
        assert_eq!((shape.tx, shape.rx), (vec![1], vec![3]));
        assert!(read(&single(r#""tx_antennas": [1]"#).replace("[1, 3]", "0")).is_err());
        assert!(read(&single(r#""tx_antennas": [1]"#).replace("[1, 3]", "true")).is_err());
    }

    #[test]
    fn the_band_of_an_earlier_release_is_that_of_its_chirps() {
        let now = single(r#""tx_antennas": [1]"#);
        let earlier = now.replace("start_frequency_Hz", "lower_frequency_Hz").replace("end_frequency_Hz", "upper_frequency_Hz");
        assert_eq!(read(&earlier).unwrap(), read(&now).unwrap());
        let error = read(&now.replace("start_frequency_Hz", "first_frequency_Hz")).unwrap_err().to_string();
        assert!(error.contains("start_frequency_Hz` is missing"), "{error}");
    }

    #[test]
    fn what_is_no_single_shape_is_refused_at_its_element() {
        let frames = "device_config.fmcw_sequence[0].loop";
        let inner = "sub_sequence[0].loop.sub_sequence";
        for (device, part) in [
            (sequence(&[chirp("62e9", 1), chirp("61e9", 1)].join(",")), format!("`{frames}.{inner}[1].chirp`")),
            (sequence(r#"{"delay": {"time_s": 1e-3}}"#), format!("`{frames}.{inner}[0]`")),
            (sequence(&[chirp("62e9", 1), chirp("62e9", 1)].join(",")), "each transmitter once".into()),
            (sequence(&chirp("62e9", 3)), "one transmitter for every chirp".into()),
            (r#""fmcw_sequence": []"#.into(), "the simple sequence".into()),
            (single(r#""tx_antennas": [1, 2]"#), "mimo_mode".into()),
            (single(r#""tx_antennas": [1], "mimo_mode": "bpm""#), "\"off\" or \"tdm\"".into()),
            (r#""fmcw_scene": {}"#.into(), "one FMCW shape".into()),
        ] {
            let error = read(&device).unwrap_err().to_string();
            assert!(error.contains(&part), "{part}: {error}");
        }
    }
}
