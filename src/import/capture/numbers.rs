//! Files of nothing but little-endian numbers of a stated type, whose axes and lengths are stated.

use std::path::Path;

use super::container::{Source, plain};
use super::layout::{Axis, Layout};
use super::stream::Words;
use super::word_kind;
use super::words::Lengths;
use crate::data::arrays::{Kind, Stored};
use crate::data::files;
use crate::error::{Error, Result};

/// The numbers of a file as an array. Frames are as many as there are, where the layout has an axis of them.
///
/// # Errors
/// Numbers that bear the mark of another type; less than a frame, or of a file that is one frame another length.
pub fn open(path: &Path, number: Stored, layout: &Layout, lengths: Lengths, notes: &mut Vec<String>) -> Result<Source> {
    let (_, bytes) = files::open(path)?;
    refuse_other(path, number, bytes)?;
    let mut shape = lengths.shape(layout)?;
    let block = shape.iter().try_fold(number.bytes as u64, |all, &length| all.checked_mul(length as u64)).unwrap_or(u64::MAX);
    let place = layout.place(Axis::Frame);
    let refuse = |expected: String| {
        Error::field(path, "samples", format!("{bytes} bytes"), expected)
            .with_hint("the radar's settings or --layout belong to another capture, or the file is cut off")
    };
    if bytes < block || place.is_none() && bytes != block {
        return Err(refuse(format!("{block} bytes, one frame of {shape:?} numbers of type {}", number.name())));
    }
    let (frames, rest) = (bytes / block, bytes % block);
    if let Some(place) = place {
        shape[place] = frames as usize;
    }
    if rest > 0 {
        if place != Some(0) {
            return Err(refuse(format!("whole frames of {block} bytes, as frames are not outermost")));
        }
        notes.push(format!("{rest} bytes after the last whole frame are left out: {frames} frames of {block} bytes each"));
    }
    plain(path, number, shape)
}

/// Refuses a file whose beginning bears the mark of numbers of another width.
fn refuse_other(path: &Path, number: Stored, bytes: u64) -> Result<()> {
    let words = (bytes / 2).min(word_kind::LOOKED_AT as u64);
    let begin = Words::of(vec![(path.into(), words)]).read(0, words as usize)?;
    let width = if number.kind == Kind::Complex { number.bytes / 2 } else { number.bytes };
    match word_kind::wider(&begin) {
        Some(kind) if kind != format!("<f{width}") => Err(Error::field(
            path,
            "samples",
            format!("numbers of type {kind}"),
            format!("{}, as --layout states", number.name()),
        )
        .with_hint("state the type that the file was written in at the end of --layout")),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;

    use super::super::{Capture, Stated, draft, open};
    use super::*;
    use crate::data::IfLayout;
    use crate::support::shared;

    const FRAMES: usize = 2;
    /// Samples, loops, receivers, transmitters.
    const DIMS: [usize; 4] = [8, 3, 2, 2];

    fn stated(layout: &str) -> Stated {
        let sets = [
            "start_frequency_hz=77e9".to_string(),
            "slope_hz_per_s=60e12".into(),
            "sample_rate_hz=4e6".into(),
            "chirp_period_s=60e-6".into(),
            "frame_period_s=0.1".into(),
            "tx_m=[[0.0, 0.0, 0.0], [0.004, 0.0, 0.0]]".into(),
            "rx_m=[[0.0, 0.0, 0.0], [0.002, 0.0, 0.0]]".into(),
            format!("samples_per_chirp={}", DIMS[0]),
            format!("loops_per_frame={}", DIMS[1]),
        ];
        let sets = sets.map(|set| format!("radar.{set}")).to_vec();
        Stated { layout: Some(Layout::parse(layout).unwrap()), sets, ..Stated::default() }
    }

    /// A number of its place, of either sign: `[frame, sample, loop, rx, tx, part]`.
    fn value([frame, sample, index, rx, tx, part]: [usize; 6]) -> f32 {
        let number = ((((frame * DIMS[0] + sample) * DIMS[1] + index) * DIMS[2] + rx) * DIMS[3] + tx) * 2 + part;
        if number.is_multiple_of(2) { 1.0 + number as f32 } else { -1.0 - number as f32 }
    }

    fn numbers(parts: usize) -> Vec<f32> {
        let [samples, loops, rx, tx] = DIMS;
        let count = FRAMES * samples * loops * rx * tx * parts;
        let place = |rank: usize| {
            let (rest, part) = (rank / parts, rank % parts);
            let (rest, at_tx) = (rest / tx, rest % tx);
            let (rest, at_rx) = (rest / rx, rest % rx);
            let (rest, index) = (rest / loops, rest % loops);
            [rest / samples, rest % samples, index, at_rx, at_tx, part]
        };
        (0..count).map(|rank| value(place(rank))).collect()
    }

    fn bytes(numbers: &[f32], width: usize) -> Vec<u8> {
        let number = |&number: &f32| match width {
            4 => number.to_le_bytes().to_vec(),
            _ => f64::from(number).to_le_bytes().to_vec(),
        };
        numbers.iter().flat_map(number).collect()
    }

    fn assert_read(mut capture: Capture, frames: std::ops::Range<usize>, parts: usize) {
        let [samples, loops, rx, tx] = DIMS;
        assert_eq!(capture.radar.dims(), [frames.len(), tx, rx, loops, samples]);
        assert_eq!(capture.layout, if parts == 2 { IfLayout::Complex } else { IfLayout::Real });
        for (at, frame) in frames.enumerate() {
            let found = (capture.frame)(at).unwrap();
            for rank in 0..tx * rx * loops * samples {
                let (rest, sample) = (rank / samples, rank % samples);
                let [at_tx, at_rx, index] = [rest / loops / rx, rest / loops % rx, rest % loops];
                let number = found.sample(at_tx, at_rx, index, sample);
                let wanted = [0, 1].map(|part| value([frame, sample, index, at_rx, at_tx, part]));
                assert_eq!(number.re, wanted[0]);
                assert!(parts == 1 || number.im == wanted[1]);
            }
        }
    }

    #[test]
    fn numbers_of_every_type_come_back_sample_by_sample() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.bin");
        for (word, parts, width) in [
            ("float32", 1, 4),
            ("float64", 1, 8),
            ("complex64", 2, 4),
            ("complex128", 2, 8),
            ("iq float32", 2, 4),
            ("iq float64", 2, 8),
        ] {
            let whole = bytes(&numbers(parts), width);
            fs::write(&path, &whole).unwrap();
            let all = format!("frame sample loop rx tx {word}");
            assert_read(open(std::slice::from_ref(&path), &stated(&all)).unwrap(), 0..FRAMES, parts);
            // A file for each frame.
            let files: Vec<PathBuf> = (0..FRAMES).map(|frame| folder.path().join(format!("frame_{frame}.bin"))).collect();
            for (file, part) in files.iter().zip(whole.chunks(whole.len() / FRAMES)) {
                fs::write(file, part).unwrap();
            }
            let each = format!("sample loop rx tx {word}");
            assert_read(open(&files, &stated(&each)).unwrap(), 0..FRAMES, parts);
            // Cut off: whole frames are kept, and what is left out is said.
            fs::write(&path, &whole[..whole.len() - 1]).unwrap();
            let cut = open(std::slice::from_ref(&path), &stated(&all)).unwrap();
            assert!(cut.notes.iter().any(|note| note.contains("after the last whole frame")), "{:?}", cut.notes);
            assert_read(cut, 0..1, parts);
            fs::write(&path, &whole[..whole.len() / FRAMES - 1]).unwrap();
            for layout in [&all, &each] {
                let error = refused(open(std::slice::from_ref(&path), &stated(layout)));
                assert!(error.contains(&format!("expected {} bytes, one frame of", whole.len() / FRAMES)), "{error}");
            }
        }
    }

    fn refused(found: Result<Capture>) -> String {
        let error = found.err().expect("it was accepted");
        assert!(error.hint().is_some(), "{error}");
        error.to_string()
    }

    /// The order of the axes is that of `handler/radarEyes_load.py` of shelta-zhao/mmwave-eyes. The content agrees: the last sample of a row
    /// goes on in the first of the next receiver, transmitter and loop. It also says that the stream was cut 66 words before a chirp
    /// begins, and so read out of step with I I Q Q; taken back into words and from there on, it is what it is stated to be.
    #[test]
    fn a_real_frame_of_doubles_is_read_and_its_stream_is_found_out_of_step() {
        let Some(source) = shared("fixtures/raw/ti_iwr6843_mmwave_eyes/frame_1.bin") else { return };
        let folder = tempfile::tempdir().unwrap();
        let [loops, tx, rx, samples] = [128, 3, 4, 128];
        let stated = |layout: &str, loops: usize| {
            let sets = [
                "start_frequency_hz=77e9".to_string(),
                // 0.125 m and 0.0387 m/s, as frame_1_radar_params.yaml beside it says.
                "slope_hz_per_s=46.85e12".into(),
                "sample_rate_hz=5e6".into(),
                "chirp_period_s=131.09e-6".into(),
                "frame_period_s=0.1".into(),
                format!("samples_per_chirp={samples}"),
                format!("loops_per_frame={loops}"),
            ];
            let sets = sets.map(|set| format!("radar.{set}")).to_vec();
            Stated { layout: Some(Layout::parse(layout).unwrap()), board: Some("AWR1843".into()), sets, ..Stated::default() }
        };
        let findings = |capture: Capture, name: &str| {
            draft(capture, &folder.path().join(name), Default::default(), &mut |_, _| ()).unwrap().findings
        };
        let mut capture = open(&[source], &stated("frame sample loop rx tx complex128", loops)).unwrap();
        assert_eq!(capture.radar.dims(), [1, tx, rx, loops, samples]);
        let frame = (capture.frame)(0).unwrap();
        assert_eq!(
            [0, 1].map(|tx| (frame.sample(tx, 0, 0, 0).re, frame.sample(tx, 0, 0, 0).im)),
            [(138.0, -782.0), (2109.0, -355.0)]
        );
        let refused = findings(capture, "doubles");
        let wrong: Vec<&str> = refused.iter().filter(|finding| finding.is_refusal()).map(|finding| finding.check).collect();
        assert_eq!(wrong, ["chirp_start"], "{refused:#?}");
        let mut words: Vec<i16> = vec![];
        for row in 0..loops * tx * rx {
            for pair in 0..samples / 2 {
                let [first, second] = [0, 1].map(|step| frame.sample(row / rx % tx, row % rx, row / rx / tx, 2 * pair + step));
                words.extend([first.re, second.re, first.im, second.im].map(|value| value as i16));
            }
        }
        let in_step = words[66..].iter().take((loops - 1) * tx * rx * 2 * samples);
        let path = folder.path().join("words.bin");
        fs::write(&path, in_step.flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
        let found = findings(open(&[path], &stated("frame loop tx rx sample iq lane", loops - 1)).unwrap(), "words");
        assert!(found.iter().all(|finding| finding.ok), "{found:#?}");
        for check in ["chirp_length", "chirp_start", "integrity_word_order", "integrity_lane_order"] {
            assert!(found.iter().any(|finding| finding.check == check && finding.decided), "{check}: {found:#?}");
        }
    }

    #[test]
    fn a_type_that_the_file_is_not_of_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("capture.bin");
        fs::write(&path, bytes(&numbers(2), 8)).unwrap();
        for word in ["float32", "complex64"] {
            let error = refused(open(std::slice::from_ref(&path), &stated(&format!("frame sample loop rx tx {word}"))));
            assert!(error.contains(&format!("`samples` is numbers of type <f8, expected {word}, as --layout states")), "{error}");
        }
        let error = refused(open(std::slice::from_ref(&path), &stated("frame sample loop rx tx iq complex128")));
        assert!(error.contains("an axis `iq` of length 2 and real numbers"), "{error}");
        // Without a type, 16-bit words are expected, and the hint says how to state another.
        let error = open(&[path], &stated("frame sample loop rx tx iq")).err().unwrap();
        assert!(error.to_string().contains("numbers of type <f8, expected 16-bit integers"), "{error}");
        assert!(error.hint().unwrap().contains("sample complex128\""), "{:?}", error.hint());
    }
}
