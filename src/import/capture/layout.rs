//! The order of an array's axes, as people write it: `frame loop rx sample iq`.

use std::str::FromStr;

use crate::data::arrays::{Kind, Stored};
use crate::error::{Error, Result};

/// An axis of an array of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    Frame,
    Tx,
    Rx,
    Loop,
    /// Chirps in the order in which they were sent: loops × transmitters.
    Chirp,
    /// Virtual antennas: transmitters × receivers.
    Antenna,
    Sample,
    /// Neighbouring samples that go out side by side, one on each lane: `sample` then counts groups of them.
    Lane,
    /// I and Q.
    Iq,
}

const NAMES: [(&str, Axis); 9] = [
    ("frame", Axis::Frame),
    ("tx", Axis::Tx),
    ("rx", Axis::Rx),
    ("loop", Axis::Loop),
    ("chirp", Axis::Chirp),
    ("antenna", Axis::Antenna),
    ("sample", Axis::Sample),
    ("lane", Axis::Lane),
    ("iq", Axis::Iq),
];

/// Types of the numbers of a file that does not say its type, as NumPy names them; little-endian.
const NUMBERS: [(&str, Kind, usize); 5] = [
    ("int16", Kind::Int, 2),
    ("float32", Kind::Float, 4),
    ("float64", Kind::Float, 8),
    ("complex64", Kind::Complex, 8),
    ("complex128", Kind::Complex, 16),
];

/// Axes, outer to inner, and the type of the numbers where it is stated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    pub axes: Vec<Axis>,
    pub number: Option<Stored>,
}

impl Layout {
    /// # Errors
    /// A word that is neither an axis nor a type, one named twice, no samples, or chirps beside loops or transmitters.
    pub fn parse(text: &str) -> Result<Self> {
        let known = NAMES.map(|(name, _)| name).join(", ");
        let types = NUMBERS.map(|(name, ..)| name).join(", ");
        let refuse = |message: String| Error::Usage {
            message: format!("--layout \"{text}\": {message}"),
            hint: Some(format!(
                "write the axes from the outermost to the innermost, such as \"frame loop rx sample\"; known are {known}; at the end, of a \
                 .bin that holds no 16-bit words, the type of its numbers: {types}"
            )),
        };
        let (mut axes, mut number) = (Vec::new(), None);
        for word in text.split([' ', ',']).filter(|word| !word.is_empty()) {
            let singular = word.to_lowercase();
            if number.is_some() {
                return Err(refuse(format!("`{word}` stands after the type of the numbers")));
            }
            if let Some(&(_, kind, bytes)) = NUMBERS.iter().find(|(name, ..)| *name == singular) {
                number = Some(Stored { kind, bytes, big_endian: false });
                continue;
            }
            let singular = singular.strip_suffix('s').filter(|_| singular != "s").unwrap_or(&singular);
            let (_, axis) =
                NAMES.iter().find(|(name, _)| *name == singular).ok_or_else(|| refuse(format!("`{word}` is no axis")))?;
            if axes.contains(axis) {
                return Err(refuse(format!("`{word}` stands twice")));
            }
            axes.push(*axis);
        }
        if !axes.contains(&Axis::Sample) {
            return Err(refuse("no axis of samples".into()));
        }
        let with = |axis: Axis, others: &[Axis]| axes.contains(&axis) && others.iter().any(|other| axes.contains(other));
        if with(Axis::Chirp, &[Axis::Loop, Axis::Tx]) {
            return Err(refuse("`chirp` is loops and transmitters together".into()));
        }
        if with(Axis::Antenna, &[Axis::Tx, Axis::Rx, Axis::Chirp]) {
            return Err(refuse("`antenna` is transmitters and receivers together".into()));
        }
        Ok(Self { axes, number })
    }

    /// `frame loop rx sample`; with the type of the numbers where it is stated.
    pub fn describe(&self) -> String {
        let name = |axis: &Axis| NAMES.iter().find(|(_, other)| other == axis).map_or("", |(name, _)| name);
        let axes = self.axes.iter().map(name).map(String::from);
        axes.chain(self.number.map(Stored::name)).collect::<Vec<_>>().join(" ")
    }

    /// The place of an axis.
    pub fn place(&self, axis: Axis) -> Option<usize> {
        self.axes.iter().position(|other| *other == axis)
    }
}

impl FromStr for Layout {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::parse(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_read_in_their_order() {
        let layout = Layout::parse("frames, chirps rx samples").unwrap();
        assert_eq!(layout.axes, [Axis::Frame, Axis::Chirp, Axis::Rx, Axis::Sample]);
        assert_eq!((layout.describe().as_str(), layout.number), ("frame chirp rx sample", None));
    }

    #[test]
    fn the_type_of_the_numbers_stands_at_the_end() {
        let layout = Layout::parse("frame sample loop rx tx complex128").unwrap();
        assert_eq!(layout.axes.len(), 5);
        assert_eq!(layout.number, Some(Stored { kind: Kind::Complex, bytes: 16, big_endian: false }));
        assert_eq!(layout.describe(), "frame sample loop rx tx complex128");
    }

    #[test]
    fn what_is_no_layout_is_refused() {
        for (text, part) in [
            ("frame aerial sample", "`aerial` is no axis"),
            ("frame antenna rx sample", "transmitters and receivers together"),
            ("frame rx rx sample", "stands twice"),
            ("frame rx", "no axis of samples"),
            ("chirp tx sample", "together"),
            ("frame float32 sample", "`sample` stands after the type"),
            ("frame sample float16", "`float16` is no axis"),
        ] {
            assert!(Layout::parse(text).unwrap_err().to_string().contains(part), "{text}");
        }
    }
}
