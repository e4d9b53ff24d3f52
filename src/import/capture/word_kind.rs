//! Files that hold wider numbers than the 16-bit words of a capture.
//!
//! Each kind leaves a mark in 16-bit words that a signal around zero does not: the upper word of a 32-bit integer that was a 16-bit
//! sample is its sign; the upper words of floating-point numbers hold the exponent, so that as integers all of them are between a
//! quarter and three quarters of full scale, and none is near zero (IEEE 754-2019, table 3.5).

/// Words that are looked at, of the beginning of a file; fewer say nothing.
pub const LOOKED_AT: usize = 1 << 16;
const FEWEST: usize = 1 << 12;
/// Floating-point numbers are between 2^-60 and 2^60: from attowatts to codes of any converter.
const EXPONENTS: u16 = 60;

/// What little-endian words are instead, if they are none: the type as NumPy writes it.
pub fn wider(words: &[i16]) -> Option<&'static str> {
    if words.len() < FEWEST {
        return None;
    }
    if all(words.as_chunks::<4>().0, |word| is_float(word[3], 4, 1023)) {
        return Some("<f8");
    }
    let pairs = words.as_chunks::<2>().0;
    if all(pairs, |word| is_float(word[1], 7, 127)) {
        return Some("<f4");
    }
    // All are the sign of the word before, and both signs are there.
    let negative = pairs.iter().filter(|word| word[1] == -1).count();
    (all(pairs, |word| word[1] == word[0] >> 15) && 0 < negative && negative < pairs.len()).then_some("<i4")
}

/// Whether it holds for every number that is not zero, of either sign, and at least half of them are not.
fn all<const N: usize>(numbers: &[[i16; N]], holds: impl Fn(&[i16; N]) -> bool) -> bool {
    let is_zero = |number: &[i16; N]| number[..N - 1].iter().all(|&word| word == 0) && number[N - 1] & i16::MAX == 0;
    let others = numbers.iter().filter(|number| !is_zero(number)).count();
    2 * others >= numbers.len() && numbers.iter().all(|number| is_zero(number) || holds(number))
}

/// Whether the upper word of a floating-point number has a sane exponent above its `shift` lowest bits.
fn is_float(upper: i16, shift: u32, bias: u16) -> bool {
    let exponent = (upper as u16 & 0x7fff) >> shift;
    exponent.abs_diff(bias) <= EXPONENTS
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tones, of 3 % to 90 % of full scale.
    fn codes(scale: f64) -> Vec<f64> {
        (0..LOOKED_AT).map(|n| (scale * ((0.37 * n as f64).sin() + 0.5 * (0.011 * n as f64).cos())).round()).collect()
    }

    fn as_words(bytes: Vec<u8>) -> Vec<i16> {
        bytes.as_chunks().0.iter().map(|&word| i16::from_le_bytes(word)).collect()
    }

    #[test]
    fn wider_numbers_are_told_from_words() {
        for scale in [3.0, 1e3, 2e4] {
            let codes = codes(scale);
            assert_eq!(wider(&codes.iter().map(|code| *code as i16).collect::<Vec<_>>()), None);
            assert_eq!(wider(&as_words(codes.iter().flat_map(|code| (*code as i32).to_le_bytes()).collect())), Some("<i4"));
            for unit in [1.0, 1.0 / 32768.0, 0.7] {
                assert_eq!(wider(&as_words(codes.iter().flat_map(|code| (unit * code).to_le_bytes()).collect())), Some("<f8"));
                let single = codes.iter().flat_map(|code| ((unit * code) as f32).to_le_bytes());
                assert_eq!(wider(&as_words(single.collect())), Some("<f4"));
            }
        }
    }

    #[test]
    fn what_is_quiet_or_has_a_silent_half_is_no_wider_number() {
        assert_eq!(wider(&[0; LOOKED_AT]), None);
        // A dead second part, and noise of one code.
        let codes = codes(1e3);
        assert_eq!(wider(&codes.iter().flat_map(|code| [*code as i16, 0]).collect::<Vec<_>>()), None);
        assert_eq!(wider(&(0..LOOKED_AT).map(|n| (n * n / 7 % 3) as i16 - 1).collect::<Vec<_>>()), None);
    }
}
