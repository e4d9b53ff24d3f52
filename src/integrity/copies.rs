//! Chirps and frames that are there twice: a buffer that was read again.
//!
//! The law: noise makes a sample equal to that of the next chirp as often as it does between neighbouring chirps of this recording
//! (rule of succession), and a copy needs all samples of a chirp to be so. Without noise a static scene repeats itself, and nothing
//! is found.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher};

use num_complex::Complex32;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind, frames_listed, listed};

const CHECK: &str = "integrity_copies";
const EXPECTED: &str = "no chirp and no frame twice";

/// Frame, loop and transmitter of a chirp.
type Place = [usize; 3];

pub(super) struct Copies {
    schedule: Schedule,
    /// Of the chirps' samples. Two of a million chirps share a hash of 64 bits by chance once in 10⁷ recordings.
    seen: HashMap<u64, Place>,
    copies: Vec<[Place; 2]>,
    /// The chirp before, by transmitter, and how many samples were compared with it and equal.
    before: Vec<Vec<Complex32>>,
    compared: [usize; 2],
}

impl Copies {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, seen: HashMap::new(), copies: vec![], before: vec![vec![]; schedule.tx], compared: [0; 2] }
    }
}

fn hash(values: &[Complex32]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for value in values {
        hasher.write_u32(value.re.to_bits());
        hasher.write_u32(value.im.to_bits());
    }
    hasher.finish()
}

impl Inspector for Copies {
    fn see(&mut self, stream: &Stream) {
        for (index, tx, chirp) in stream.chirps() {
            // Of constant chirps, `runs` speaks.
            if chirp.iter().all(|value| *value == chirp[0]) {
                continue;
            }
            let equal = chirp.iter().zip(&self.before[tx]).filter(|(value, before)| value == before).count();
            self.compared = [self.compared[0] + equal, self.compared[1] + self.before[tx].len()];
            self.before[tx] = chirp.to_vec();
            let place = [stream.frame, index, tx];
            match self.seen.entry(hash(chirp)) {
                std::collections::hash_map::Entry::Occupied(first) => self.copies.push([place, *first.get()]),
                std::collections::hash_map::Entry::Vacant(slot) => {
                    slot.insert(place);
                }
            }
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let Schedule { tx, rx, loops, samples, .. } = self.schedule;
        let [equal, compared] = self.compared.map(|count| count as f64);
        let chirps = (self.seen.len() + self.copies.len()) as f64;
        let log_p = (rx * samples) as f64 * ((equal + 1.0) / (compared + 2.0)).ln() + (0.5 * chirps * chirps).max(1.0).ln();
        if self.copies.is_empty() || log_p >= ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, "none"));
        }
        let mut by_frame: Vec<(usize, Vec<[Place; 2]>)> = vec![];
        for copy in self.copies {
            match by_frame.last_mut() {
                Some((frame, copies)) if *frame == copy[0][0] => copies.push(copy),
                _ => by_frame.push((copy[0][0], vec![copy])),
            }
        }
        let is_whole =
            |copies: &[[Place; 2]]| copies.len() == loops * tx && copies.iter().all(|[_, of]| of[0] == copies[0][1][0]);
        let (whole, single): (Vec<_>, Vec<_>) = by_frame.iter().partition(|(_, copies)| is_whole(copies));
        let mut found = vec![];
        if let Some((frame, copies)) = whole.first() {
            let frames: Vec<usize> = whole.iter().map(|(frame, _)| *frame).collect();
            let repeats = if frames.len() == 1 { "repeats an earlier one" } else { "repeat earlier ones" };
            let of = copies[0][1][0];
            found.push(format!("{} {repeats} sample for sample (frame {frame} is frame {of})", frames_listed(&frames)));
        }
        if let Some((frame, copies)) = single.first() {
            let count: usize = single.iter().map(|(_, copies)| copies.len()).sum();
            let indices: Vec<usize> = copies.iter().map(|[copy, _]| copy[1]).collect();
            let of = copies[0][1];
            found.push(format!(
                "{count} chirps repeat earlier ones sample for sample, first in frame {frame}, loops {} (the first is loop {} of frame {})",
                listed(&indices),
                of[1],
                of[0]
            ));
        }
        let frames = by_frame.iter().map(|(frame, _)| *frame).collect();
        let again = by_frame.iter().flat_map(|(_, copies)| copies.iter().map(|[copy, _]| *copy));
        let chirps = again.flat_map(|[frame, index, tx]| (0..rx).map(move |rx| [frame, tx, rx, index])).collect();
        Some(Finding { frames, chirps, ..Finding::wrong(Kind::Lost, CHECK, EXPECTED, found.join("; "), log_p) })
    }
}
