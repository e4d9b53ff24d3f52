//! Codes that were read as other numbers than the converter sent: bytes exchanged, signed words taken for unsigned ones and the other way
//! round, words of 12 or 14 bits without their sign.
//!
//! What a converter sends is smooth against what its words are under a wrong reading, whose jumps reach over the whole range. The
//! roughness of a chirp is the mean square of its steps. Noise that fills all codes alike is as rough under every reading, so that each
//! chirp is an even chance at most; whatever is weaker or smoother is smoothest as it was sent. A sign test over the chirps in which a
//! reading is the smoothest of all, Bonferroni over the readings. Steps from or to the least and the largest code of a chirp do not count:
//! at its rails a converter says nothing.
//!
//! Offset binary codes of fewer bits than a word have no negative one, and their mean is half of a power of two. Both parts of a signal
//! that is as stated have an offset that is as likely any other within the codes' range: that both are as near to its half as they are has
//! the chance of the square of the distance over the half. The offset of a real signal is often that of its converter, and kept.

use super::stream::Stream;
use super::tails::log_binomial_tail;
use super::{ALARM, Finding, Inspector, Kind};

/// Another reading of a code.
struct Reading {
    check: &'static str,
    description: &'static str,
    /// Codes between these two can be read so.
    span: [i32; 2],
    read: fn(i32) -> i32,
}

const WORD: [i32; 2] = [i16::MIN as i32, i16::MAX as i32];

pub(super) const BYTE_ORDER: &str = "byte_order";
pub(super) const SIGN: &str = "number_format";

const READINGS: [Reading; 5] = [
    Reading {
        check: BYTE_ORDER,
        description: "the bytes of every word are exchanged",
        span: WORD,
        read: |code| i32::from((code as i16).swap_bytes()),
    },
    Reading {
        check: SIGN,
        description: "unsigned words (offset binary) were read as signed ones",
        span: WORD,
        read: |code| i32::from(code as i16 ^ i16::MIN),
    },
    Reading {
        check: SIGN,
        description: "signed words were read as unsigned ones",
        span: [0, 65535],
        read: |code| i32::from(code as u16 as i16),
    },
    Reading {
        check: SIGN,
        description: "signed words of 12 bits were read without their sign",
        span: [0, 4095],
        read: |code| code << 20 >> 20,
    },
    Reading {
        check: SIGN,
        description: "signed words of 14 bits were read without their sign",
        span: [0, 16383],
        read: |code| code << 18 >> 18,
    },
];

/// Fewest steps of a chirp that can be compared.
const FEWEST_STEPS: usize = 8;

pub(super) struct Numbers {
    check: &'static str,
    expected: &'static str,
    /// Chirps in which each reading is the smoothest of all, of those in which it differs from the stated one.
    smoothest: [[usize; 2]; READINGS.len()],
    /// Least and largest code, and all bits that occur.
    extremes: [i32; 2],
    bits: i32,
    /// Of all codes of either part, and how many.
    sums: [f64; 2],
    count: f64,
    is_real: bool,
    are_codes: bool,
}

/// Codes of which none is negative.
struct Offset {
    /// Half of the least power of two above them.
    half: f64,
    /// Of either part.
    means: [f64; 2],
}

impl Offset {
    /// Logarithm of the chance of both means as near to the half as the farther one; a code is the least distance.
    fn log_p(&self) -> f64 {
        let farther = self.means.iter().map(|mean| (mean - self.half).abs()).fold(1.0, f64::max);
        2.0 * (farther / self.half).min(1.0).ln()
    }
}

impl Numbers {
    /// `check`: [`BYTE_ORDER`] or [`SIGN`].
    pub fn new(check: &'static str) -> Self {
        let expected =
            if check == BYTE_ORDER { "the low byte of every word first" } else { "codes with the sign that is stated" };
        let smoothest = [[0; 2]; READINGS.len()];
        let extremes = [i32::MAX, i32::MIN];
        Self { check, expected, smoothest, extremes, bits: 0, sums: [0.0; 2], count: 0.0, is_real: true, are_codes: true }
    }

    fn offset(&self) -> Option<Offset> {
        let [low, high] = self.extremes;
        (low >= 0 && high > 0).then(|| {
            let half = f64::from((high.unsigned_abs() + 1).next_power_of_two() / 2);
            Offset { half, means: self.sums.map(|sum| sum / self.count) }
        })
    }

    fn chirp(&mut self, codes: &[i32]) {
        let (Some(&low), Some(&high)) = (codes.iter().min(), codes.iter().max()) else { return };
        self.extremes = [self.extremes[0].min(low), self.extremes[1].max(high)];
        self.bits = codes.iter().fold(self.bits, |bits, code| bits | code);
        let between = |code: &i32| *code > low && *code < high;
        let steps: Vec<&[i32]> = codes.windows(2).filter(|pair| pair.iter().all(between)).collect();
        if steps.len() < FEWEST_STEPS {
            return;
        }
        let roughness =
            |read: fn(i32) -> i32| steps.iter().map(|pair| f64::from(read(pair[1]) - read(pair[0])).powi(2)).sum::<f64>();
        let as_read = roughness(|code| code);
        let is_possible = |reading: &Reading| reading.span[0] <= low && high <= reading.span[1];
        let others =
            READINGS.each_ref().map(|reading| if is_possible(reading) { roughness(reading.read) } else { f64::INFINITY });
        let least = others.iter().copied().fold(as_read, f64::min);
        for (other, [smoothest, of]) in others.iter().zip(&mut self.smoothest) {
            *smoothest += usize::from(*other == least && least < as_read);
            *of += usize::from(*other != as_read && other.is_finite());
        }
    }
}

impl Inspector for Numbers {
    fn see(&mut self, stream: &Stream) {
        self.is_real = stream.schedule.is_real;
        let is_code = |value: f32| value.fract() == 0.0 && (i16::MIN.into()..=u16::MAX.into()).contains(&value);
        self.are_codes = self.are_codes && stream.values.iter().all(|value| is_code(value.re) && is_code(value.im));
        if !self.are_codes {
            return;
        }
        for value in &stream.values {
            self.sums = [self.sums[0] + f64::from(value.re), self.sums[1] + f64::from(value.im)];
        }
        self.count += stream.values.len() as f64;
        for chirp in stream.values.chunks_exact(stream.schedule.samples) {
            self.chirp(&chirp.iter().map(|value| value.re as i32).collect::<Vec<_>>());
            if !self.is_real {
                self.chirp(&chirp.iter().map(|value| value.im as i32).collect::<Vec<_>>());
            }
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let Self { check, expected, extremes: [low, high], .. } = *self;
        if !self.are_codes {
            return Some(Finding::undecided(check, expected, "the samples are no 16-bit codes"));
        }
        let is_possible = |reading: &Reading| reading.span[0] <= low && high <= reading.span[1];
        let own = READINGS
            .iter()
            .zip(self.smoothest)
            .filter(|(reading, [_, of])| reading.check == check && is_possible(reading) && *of > 0);
        let own: Vec<(&Reading, [usize; 2])> = own.collect();
        let log_p = |[smoothest, of]: [usize; 2]| (own.len() as f64).ln() + log_binomial_tail(smoothest, of, 0.5);
        let best = own.iter().min_by(|a, b| log_p(a.1).total_cmp(&log_p(b.1)));
        if let Some((reading, counts)) = best.filter(|(_, counts)| log_p(*counts) < ALARM.ln()) {
            let [smoothest, of] = counts;
            let found = format!("{}: read so, {smoothest} of {of} chirps are smoothest", reading.description);
            return Some(Finding::wrong(Kind::Misread, check, expected, found, log_p(*counts)));
        }
        let offset = self.offset().filter(|_| check == SIGN);
        if let Some(offset) = offset.as_ref().filter(|offset| !self.is_real && offset.log_p() < ALARM.ln()) {
            let Offset { half, means: [i, q] } = offset;
            let found = format!(
                "codes from {low} to {high}, none negative, with means of {i:.1} and {q:.1}: unsigned codes around {half} (offset binary)"
            );
            return Some(Finding::wrong(Kind::Misread, check, expected, found, offset.log_p()));
        }
        let Some((_, [smoothest, of])) = best else {
            return Some(Finding::undecided(check, expected, "every other reading is as smooth"));
        };
        let empty = self.bits.trailing_zeros();
        let aligned = if empty > 0 && empty < 16 { format!(", all multiples of {}", 1 << empty) } else { String::new() };
        let unsigned = offset.map_or(String::new(), |offset| {
            format!(
                ", none negative: unsigned codes are kept as they are, their mean of {:.0} as a static offset",
                offset.means[0]
            )
        });
        let found =
            format!("codes from {low} to {high}{aligned}{unsigned}; another reading is smoothest in {smoothest} of {of} chirps");
        Some(Finding::as_stated(check, expected, found))
    }
}

#[cfg(test)]
mod tests {
    use super::super::stream::Schedule;
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const SCHEDULE: Schedule =
        Schedule { tx: 1, rx: 2, loops: 8, samples: 32, is_real: true, is_falling: false, farthest_bin: None };

    /// A tone with noise, in codes, each of which `wrong` changes.
    fn seen(check: &'static str, amplitude: f64, wrong: fn(i32) -> i32) -> Finding {
        let noise = numbers(3, 2 * 8 * 32, -20.0, 20.0);
        let code = |(i, noise): (usize, &f64)| {
            wrong((amplitude * (0.3 * (i % 32) as f64 + i as f64 / 32.0).sin() + noise) as i32) as f32
        };
        let frame = IfFrame::new([1, 2, 8, 32], noise.iter().enumerate().map(code).collect(), None);
        let mut inspector = Box::new(Numbers::new(check));
        inspector.see(&Stream::of(SCHEDULE, 0, &frame));
        inspector.conclude().unwrap()
    }

    #[test]
    fn codes_as_they_were_sent_are_so() {
        for amplitude in [0.0, 50.0, 900.0, 30000.0] {
            for check in [BYTE_ORDER, SIGN] {
                let finding = seen(check, amplitude, |code| code);
                assert!(finding.ok && finding.decided, "{amplitude}: {finding:?}");
            }
        }
        let shifted = seen(SIGN, 900.0, |code| 16 * code);
        assert!(shifted.ok && shifted.found.contains("multiples of 16"), "{shifted:?}");
        // Unsigned codes around half of 12 bits, as they are stated to be.
        assert!(seen(SIGN, 900.0, |code| code + 2048).ok);
    }

    #[test]
    fn wrong_readings_are_named() {
        type Wrong = (&'static str, fn(i32) -> i32, &'static str);
        let wrong: [Wrong; 5] = [
            (BYTE_ORDER, |code| i32::from((code as i16).swap_bytes()), "bytes of every word are exchanged"),
            (SIGN, |code| i32::from(code as i16 ^ i16::MIN), "offset binary"),
            (SIGN, |code| i32::from(code as i16 as u16), "signed words were read as unsigned"),
            (SIGN, |code| code & 0xfff, "12 bits"),
            (SIGN, |code| (10 * code) & 0x3fff, "14 bits"),
        ];
        for (check, wrong, told) in wrong {
            let finding = seen(check, 700.0, wrong);
            assert!(finding.is_refusal() && finding.found.contains(told), "{told}: {finding:?}");
            assert!(finding.p_value.unwrap() < ALARM);
        }
    }

    /// I and Q of a tone with noise around an offset each.
    fn seen_around(offsets: [f64; 2]) -> Finding {
        let noise = numbers(3, 2 * 2 * 8 * 32, -20.0, 20.0);
        let part = |offset: f64, noise: &[f64], phase: f64| -> Vec<f32> {
            let code = |(i, noise): (usize, &f64)| {
                (offset + 700.0 * (std::f64::consts::TAU * 3.0 / 32.0 * (i % 32) as f64 + phase).sin() + noise).round() as f32
            };
            noise.iter().enumerate().map(code).collect()
        };
        let (first, second) = noise.split_at(noise.len() / 2);
        let frame = IfFrame::new([1, 2, 8, 32], part(offsets[0], first, 1.0), Some(part(offsets[1], second, 2.6)));
        let schedule = Schedule { is_real: false, ..SCHEDULE };
        let mut inspector = Box::new(Numbers::new(SIGN));
        inspector.see(&Stream::of(schedule, 0, &frame));
        inspector.conclude().unwrap()
    }

    #[test]
    fn both_parts_around_half_of_a_power_of_two_are_offset_binary_and_other_offsets_are_kept() {
        let middle = seen_around([0.0, 0.0]);
        assert!(middle.ok && middle.decided, "{middle:?}");
        for half in [2048.0, 8192.0] {
            let found = seen_around([half, half]);
            assert!(found.is_refusal() && found.found.contains(&format!("around {half} (offset binary)")), "{half}: {found:?}");
        }
        for offsets in [[2048.0, 0.0], [2048.0, 1200.0], [900.0, 3000.0], [1500.0, 1480.0]] {
            let found = seen_around(offsets);
            assert!(found.ok, "{offsets:?}: {found:?}");
        }
        assert!(seen_around([1500.0, 1480.0]).found.contains("none negative"));
        // Of a real signal it is its converter's.
        let real = seen(SIGN, 900.0, |code| code + 2048);
        assert!(real.ok && real.found.contains("none negative"), "{real:?}");
    }

    #[test]
    fn noise_over_all_codes_tells_nothing_and_is_not_accused() {
        let noise = numbers(5, 2 * 8 * 32, -32768.0, 32768.0);
        let frame = IfFrame::new([1, 2, 8, 32], noise.iter().map(|value| value.floor() as f32).collect(), None);
        for check in [BYTE_ORDER, SIGN] {
            let mut inspector = Box::new(Numbers::new(check));
            inspector.see(&Stream::of(SCHEDULE, 0, &frame));
            assert!(inspector.conclude().unwrap().ok);
        }
    }
}
