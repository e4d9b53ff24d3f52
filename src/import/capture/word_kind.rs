//! Files that hold wider numbers than the 16-bit words of a capture.
//!
//! Each kind leaves a mark in 16-bit words. The upper word of a 32-bit integer that was a 16-bit sample is its sign. The upper word of a
//! floating-point number is its sign and its exponent (IEEE 754-2019, table 3.5), which stays within some octaves while the sign changes.
//! Words of a signal do neither: two's complement takes their upper bits from one end of the range to the other with every sign.

use crate::integrity::ALARM;

/// Words that are looked at, of the beginning of a file.
pub const LOOKED_AT: usize = 1 << 16;
/// A sine is below half of its peak a third of the time (arcsine law), and most signals longer. Words that bear the mark of exponents
/// never are: the smallest magnitudes of one sign share their upper bits with the largest ones of the other. So each change of sign passes
/// with a chance of 2/3 at most.
const PASSES: f64 = 2.0 / 3.0;

/// What little-endian words are instead, if they are none: the type as NumPy writes it.
pub fn wider(words: &[i16]) -> Option<&'static str> {
    let pairs: Vec<[i16; 2]> = words.as_chunks().0.to_vec();
    // Every second number alone, too: both halves of a double, of which the lower one is no number, would pass together.
    let halves = [0, 1].map(|first| pairs.iter().skip(first).step_by(2).copied().collect::<Vec<_>>());
    if is_float(&pairs, 7) && halves.iter().all(|half| is_float(half, 7)) {
        return Some("<f4");
    }
    if is_float(words.as_chunks::<4>().0, 4) {
        return Some("<f8");
    }
    (pairs.iter().all(|word| word[1] == word[0] >> 15) && changes(&pairs)).then_some("<i4")
}

/// Whether the sign changes so often that words of a signal do not bear a mark by chance. Zeros have none.
fn changes<const N: usize>(numbers: &[[i16; N]]) -> bool {
    let signs: Vec<bool> = numbers.iter().filter(|number| !is_zero(number)).map(|number| number[N - 1] < 0).collect();
    let changes = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
    changes as f64 * PASSES.ln() < ALARM.ln()
}

/// Of either sign.
fn is_zero<const N: usize>(number: &[i16; N]) -> bool {
    number[..N - 1].iter().all(|&word| word == 0) && number[N - 1] & i16::MAX == 0
}

/// Whether the upper words hold the exponents of a signal above their `shift` lowest bits.
///
/// A signal is in each small part of its range as often as in any other: one of n numbers is below the largest by a factor of 2^-m with a
/// chance of about n 2^-m, so that all exponents lie within log2(n / [`ALARM`]) octaves.
fn is_float<const N: usize>(numbers: &[[i16; N]], shift: u32) -> bool {
    let exponents = numbers.iter().filter(|number| !is_zero(number)).map(|number| (number[N - 1] & i16::MAX) >> shift);
    let (low, high) = exponents.fold((i16::MAX, 0), |(low, high), exponent| (low.min(exponent), high.max(exponent)));
    f64::from(high) - f64::from(low) <= (numbers.len() as f64 / ALARM).log2() && changes(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::numbers;

    /// Two tones, of 3 % to 90 % of full scale.
    fn codes(scale: f64) -> Vec<f64> {
        (0..LOOKED_AT).map(|n| (scale * ((0.37 * n as f64).sin() + 0.5 * (0.011 * n as f64).cos())).round()).collect()
    }

    fn as_words(bytes: Vec<u8>) -> Vec<i16> {
        bytes.as_chunks().0.iter().map(|&word| i16::from_le_bytes(word)).collect()
    }

    fn of_type(numbers: &[f64]) -> [Option<&'static str>; 4] {
        [
            wider(&numbers.iter().map(|value| *value as i16).collect::<Vec<_>>()),
            wider(&as_words(numbers.iter().flat_map(|value| (*value as i32).to_le_bytes()).collect())),
            wider(&as_words(numbers.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect())),
            wider(&as_words(numbers.iter().flat_map(|value| value.to_le_bytes()).collect())),
        ]
    }

    const KINDS: [Option<&str>; 4] = [None, Some("<i4"), Some("<f4"), Some("<f8")];

    #[test]
    fn wider_numbers_are_told_from_words() {
        for scale in [3.0, 1e3, 2e4] {
            let codes = codes(scale);
            assert_eq!(of_type(&codes), KINDS, "{scale}");
            // In any unit, and as short a file as has a few dozen changes of sign.
            for unit in [1.0 / 32768.0, 0.7, 1e-30, 1e30] {
                let scaled: Vec<f64> = codes.iter().map(|code| unit * code).collect();
                assert_eq!(of_type(&scaled)[2..], KINDS[2..], "{scale}, {unit}");
                assert_eq!(of_type(&scaled[..1 << 9])[2..], KINDS[2..], "{scale}, {unit}");
            }
        }
        // Without a zero, in few octaves.
        let square: Vec<f64> = (0..1000).map(|n| if n % 6 < 3 { 1.5 } else { -1.0 }).collect();
        assert_eq!(of_type(&square)[2..], KINDS[2..]);
    }

    #[test]
    fn what_is_quiet_has_a_silent_half_or_an_offset_is_no_wider_number() {
        assert_eq!(wider(&[0; LOOKED_AT]), None);
        // A dead second part, and noise of one code.
        let codes = codes(1e3);
        assert_eq!(wider(&codes.iter().flat_map(|code| [*code as i16, 0]).collect::<Vec<_>>()), None);
        assert_eq!(wider(&(0..LOOKED_AT).map(|n| (n * n / 7 % 3) as i16 - 1).collect::<Vec<_>>()), None);
        // Unsigned codes around half scale, offset binary, and noise up to full scale.
        for offset in [2048, 8192, 16384] {
            assert_eq!(wider(&codes.iter().map(|code| *code as i16 + offset).collect::<Vec<_>>()), None);
        }
        assert_eq!(wider(&codes.iter().map(|code| *code as i16 ^ i16::MIN).collect::<Vec<_>>()), None);
        assert_eq!(wider(&numbers(3, LOOKED_AT, -3e4, 3e4).iter().map(|code| *code as i16).collect::<Vec<_>>()), None);
    }
}
