//! Several files that are one stream of 16-bit words.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::{packets, word_kind};
use crate::data::files;
use crate::error::{Error, Result};

/// The files of one capture, end to end. Words are little-endian; a frame may begin in one file and end in the next.
pub struct Words {
    /// With their bytes; the last one may end in half a word.
    files: Vec<(PathBuf, u64)>,
}

impl Words {
    /// Holds every file's length.
    ///
    /// # Errors
    /// A file with half a word at its end that another one follows, of wider numbers, or of packets with their headers.
    pub fn open(paths: &[PathBuf]) -> Result<Self> {
        let files = paths.iter().enumerate().map(|(at, path)| {
            let metadata = std::fs::metadata(path).map_err(|source| Error::read(path, source))?;
            if !metadata.is_file() {
                return Err(Error::read(path, std::io::ErrorKind::InvalidInput.into()));
            }
            match metadata.len() {
                0 => Err(Error::field(path, "samples", "an empty file", "16-bit samples")
                    .with_hint("the capture did not start; record it again")),
                odd if odd % 2 == 1 && at + 1 < paths.len() => {
                    Err(Error::field(path, "samples", format!("{odd} bytes"), "whole 16-bit samples")
                        .with_hint("the file is cut off; copy it again"))
                }
                length => Ok((path.clone(), length)),
            }
        });
        let words = Self { files: files.collect::<Result<_>>()? };
        packets::refuse(words.first())?;
        words.refuse_wider()?;
        Ok(words)
    }

    /// Refuses numbers of more than 16 bits, which would be read as twice or four times as many words.
    fn refuse_wider(&self) -> Result<()> {
        let begin = self.read(0, self.len().min(word_kind::LOOKED_AT as u64) as usize)?;
        let Some(kind) = word_kind::wider(&begin) else { return Ok(()) };
        let as_array = format!("numpy.save(\"capture.npy\", numpy.fromfile(\"{}\", \"{kind}\"))", self.first().display());
        let typed = |complex: &str, real: &str| {
            format!(
                "state their type at the end of --layout, such as --layout \"frame loop tx rx sample {complex}\" ({real} where no number \
                 has an imaginary part or `iq` is an axis), and the radar with --config FILE.toml or --board and --set radar.KEY=VALUE"
            )
        };
        let hint = match kind {
            "<f8" => typed("complex128", "float64"),
            "<f4" => typed("complex64", "float32"),
            _ => format!("shape and keep them as an array, {as_array}, and import that with --layout"),
        };
        Err(Error::field(self.first(), "samples", format!("numbers of type {kind}"), "16-bit integers").with_hint(hint))
    }

    /// The first so many words of each file.
    pub fn of(files: Vec<(PathBuf, u64)>) -> Self {
        Self { files: files.into_iter().map(|(path, words)| (path, 2 * words)).collect() }
    }

    pub fn first(&self) -> &Path {
        &self.files[0].0
    }

    /// Every file and its bytes.
    pub fn lengths(&self) -> impl Iterator<Item = (&Path, u64)> {
        self.files.iter().map(|(path, bytes)| (path.as_path(), *bytes))
    }

    /// Bytes in all files together; half a word at the end counts, too.
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|(_, bytes)| bytes).sum()
    }

    /// Whole words in all files together.
    pub fn len(&self) -> u64 {
        self.bytes() / 2
    }

    /// `count` words from `start` on. Panics beyond the end: callers ask for whole frames only.
    pub fn read(&self, start: u64, count: usize) -> Result<Vec<i16>> {
        assert!(start + count as u64 <= self.len(), "words {start} to {} of {}", start + count as u64, self.len());
        let mut bytes = vec![0; 2 * count];
        let (mut skip, mut filled) = (start, 0);
        for (path, length) in &self.files {
            let words = length / 2;
            if skip >= words {
                skip -= words;
                continue;
            }
            let part = bytes.len().min(filled + 2 * (words - skip) as usize);
            let mut read = || {
                let mut file = files::regular(path)?;
                file.seek(SeekFrom::Start(2 * skip))?;
                file.read_exact(&mut bytes[filled..part])
            };
            read().map_err(|source| Error::read(path, source))?;
            (skip, filled) = (0, part);
            if filled == bytes.len() {
                break;
            }
        }
        Ok(bytes.as_chunks().0.iter().map(|&word| i16::from_le_bytes(word)).collect())
    }
}
