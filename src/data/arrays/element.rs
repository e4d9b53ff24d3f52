//! The numbers an array may hold, and what they are read as.

use num_complex::Complex;

/// What kind of number an array holds, whatever its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Bool,
    Int,
    Unsigned,
    Float,
    Complex,
}

/// How one number lies in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    pub kind: Kind,
    pub bytes: usize,
    pub big_endian: bool,
}

impl Stored {
    /// NumPy's name, such as `int16`.
    pub fn name(self) -> String {
        let (word, bits) = match self.kind {
            Kind::Bool => return "bool".into(),
            Kind::Int => ("int", 8 * self.bytes),
            Kind::Unsigned => ("uint", 8 * self.bytes),
            Kind::Float => ("float", 8 * self.bytes),
            Kind::Complex => ("complex", 8 * self.bytes),
        };
        format!("{word}{bits}")
    }

    fn is_real(self) -> bool {
        match self.kind {
            Kind::Int | Kind::Unsigned => true,
            Kind::Float => matches!(self.bytes, 2 | 4 | 8),
            Kind::Bool | Kind::Complex => false,
        }
    }
}

/// A number that arrays can be read as.
pub trait Element: Copy + Send + Sync {
    /// What a reader expects, for messages.
    const EXPECTED: &'static str;

    /// Whether a stored number can be read as this one.
    fn accepts(stored: Stored) -> bool;

    /// Decodes an accepted kind of number; may reorder `bytes`.
    fn decode(stored: Stored, bytes: &mut [u8]) -> Vec<Self>;

    /// Whether the number is neither NaN nor infinite; true of numbers that cannot be.
    fn is_finite(self) -> bool {
        true
    }

    /// How a message names a number that is not finite.
    fn name_non_finite(self) -> &'static str {
        "NaN or infinite"
    }
}

/// Puts every number's bytes in little-endian order.
fn to_little_endian(stored: Stored, bytes: &mut [u8]) {
    if stored.big_endian {
        let width = if stored.kind == Kind::Complex { stored.bytes / 2 } else { stored.bytes };
        bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
    }
}

fn each<const N: usize, T>(bytes: &[u8], value: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|&chunk| value(chunk)).collect()
}

/// Decodes any accepted real number with a cast.
macro_rules! decode_as {
    ($target:ty, $stored:expr, $bytes:expr) => {{
        let bytes: &[u8] = $bytes;
        match ($stored.kind, $stored.bytes) {
            (Kind::Int, 1) => each(bytes, |b| i8::from_le_bytes(b) as $target),
            (Kind::Int, 2) => each(bytes, |b| i16::from_le_bytes(b) as $target),
            (Kind::Int, 4) => each(bytes, |b| i32::from_le_bytes(b) as $target),
            (Kind::Int, _) => each(bytes, |b| i64::from_le_bytes(b) as $target),
            (Kind::Bool, _) | (Kind::Unsigned, 1) => each(bytes, |b| u8::from_le_bytes(b) as $target),
            (Kind::Unsigned, 2) => each(bytes, |b| u16::from_le_bytes(b) as $target),
            (Kind::Unsigned, 4) => each(bytes, |b| u32::from_le_bytes(b) as $target),
            (Kind::Unsigned, _) => each(bytes, |b| u64::from_le_bytes(b) as $target),
            (_, 2) => each(bytes, |b| half::f16::from_le_bytes(b).to_f64() as $target),
            (_, 4) => each(bytes, |b| f32::from_le_bytes(b) as $target),
            _ => each(bytes, |b| f64::from_le_bytes(b) as $target),
        }
    }};
}

macro_rules! real_element {
    ($($target:ty)*) => {$(
        impl Element for $target {
            const EXPECTED: &'static str = "real numbers";

            fn accepts(stored: Stored) -> bool {
                stored.is_real()
            }

            fn decode(stored: Stored, bytes: &mut [u8]) -> Vec<Self> {
                to_little_endian(stored, bytes);
                decode_as!($target, stored, bytes)
            }

            fn is_finite(self) -> bool {
                self.is_finite()
            }

            fn name_non_finite(self) -> &'static str {
                if self.is_nan() { "NaN" } else { "infinite" }
            }
        }
    )*};
}

real_element!(f32 f64);

impl Element for i64 {
    const EXPECTED: &'static str = "integers";

    fn accepts(stored: Stored) -> bool {
        matches!(stored.kind, Kind::Int | Kind::Unsigned)
    }

    /// Unsigned numbers beyond the largest `i64` wrap, so that NumPy's all-ones "none" reads as −1.
    fn decode(stored: Stored, bytes: &mut [u8]) -> Vec<Self> {
        to_little_endian(stored, bytes);
        decode_as!(i64, stored, bytes)
    }
}

impl Element for i16 {
    const EXPECTED: &'static str = "int16";

    fn accepts(stored: Stored) -> bool {
        matches!((stored.kind, stored.bytes), (Kind::Int, 1 | 2) | (Kind::Unsigned, 1))
    }

    fn decode(stored: Stored, bytes: &mut [u8]) -> Vec<Self> {
        to_little_endian(stored, bytes);
        decode_as!(i16, stored, bytes)
    }
}

impl Element for bool {
    const EXPECTED: &'static str = "bool or uint8";

    fn accepts(stored: Stored) -> bool {
        stored.kind == Kind::Bool || (stored.kind, stored.bytes) == (Kind::Unsigned, 1)
    }

    fn decode(_: Stored, bytes: &mut [u8]) -> Vec<Self> {
        bytes.iter().map(|&byte| byte != 0).collect()
    }
}

impl Element for Complex<f32> {
    const EXPECTED: &'static str = "complex numbers";

    fn accepts(stored: Stored) -> bool {
        stored.kind == Kind::Complex && matches!(stored.bytes, 8 | 16)
    }

    fn decode(stored: Stored, bytes: &mut [u8]) -> Vec<Self> {
        to_little_endian(stored, bytes);
        let parts: Vec<f32> = match stored.bytes {
            8 => each(bytes, f32::from_le_bytes),
            _ => each(bytes, |b| f64::from_le_bytes(b) as f32),
        };
        parts.as_chunks().0.iter().map(|&[re, im]| Self::new(re, im)).collect()
    }

    fn is_finite(self) -> bool {
        self.re.is_finite() && self.im.is_finite()
    }
}
