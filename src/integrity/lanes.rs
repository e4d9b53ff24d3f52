//! Two lanes exchanged: every second sample before its neighbour.
//!
//! Exchanged neighbours turn a tone of ω rad a sample into two, at ω and at ω + π (of real samples: at π − ω), and the share sin²ω of
//! its energy goes to the other one, which is in the other half of the band: the test of `exchange.rs` over these groups. Where
//! neither the samples as read nor the exchanged ones look exchanged, as where returns fill the whole band alike, nothing can be decided.

use num_complex::Complex64;

use super::exchange::{Halves, bins};
use super::still::Still;
use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_lane_order";
const EXPECTED: &str = "samples in the order in which they were taken";

pub(super) struct Lanes {
    schedule: Schedule,
    still: Still,
}

impl Lanes {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, still: Still::new(schedule) }
    }

    /// Bins of each group: in the half where near returns are, and in the other one.
    fn groups(&self) -> Vec<[[usize; 1]; 2]> {
        let Schedule { samples, is_real, is_falling, .. } = self.schedule;
        let half = samples / 2;
        if is_real {
            return bins(samples).map(|bin| [[bin], [half - bin]]).collect();
        }
        let rising = bins(samples).flat_map(|bin| [[[bin], [half + bin]], [[half - bin], [samples - bin]]]);
        rising.map(|[near, away]| if is_falling { [away, near] } else { [near, away] }).collect()
    }
}

fn exchanged(chirp: &[Complex64]) -> Vec<Complex64> {
    chirp.as_chunks::<2>().0.iter().flat_map(|[first, second]| [*second, *first]).collect()
}

impl Inspector for Lanes {
    fn see(&mut self, stream: &Stream) {
        self.still.see(stream);
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        // Neighbours of two chirps would be exchanged otherwise.
        if !samples.is_multiple_of(2) {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp of an odd number of samples"));
        }
        let chirps: Vec<Vec<Complex64>> = self.still.sum.chirps().map(exchanged).collect();
        let halves = Halves::of(&self.still, &chirps, samples, self.schedule.is_real, self.groups().into_iter());
        let shares = halves.text("neighbouring samples");
        let log_p = halves.log_p_as_they_are();
        if log_p < ALARM.ln() {
            let found = format!(
                "{shares}, in {} of {} groups of frequencies less: two lanes were exchanged",
                halves.less,
                halves.groups()
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p));
        }
        if halves.log_p_as_exchanged() < ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, shares));
        }
        Some(Finding::undecided(CHECK, EXPECTED, shares))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrity::exchange::scene::{SAMPLES, SCHEDULE, judged, stream, with_tones};

    /// Static returns of an amplitude at each bin; neighbours exchanged or not.
    fn seen(amplitude: impl Fn(usize) -> f64, is_real: bool, are_exchanged: bool) -> Finding {
        let schedule = Schedule { is_real, ..SCHEDULE };
        let sent = |chirp: &[Complex64]| if are_exchanged { exchanged(chirp) } else { chirp.to_vec() };
        judged(Box::new(Lanes::new(schedule)), &stream(schedule, amplitude, |value| value, sent))
    }

    /// A room, falling with range.
    fn room(bin: usize) -> f64 {
        if (2..SAMPLES / 2).contains(&bin) { 100.0 / (bin * bin) as f64 } else { 0.0 }
    }

    #[test]
    fn exchanged_lanes_are_found_and_right_ones_are_not_accused() {
        for is_real in [false, true] {
            let right = seen(room, is_real, false);
            assert!(right.ok && right.decided, "{is_real}: {right:?}");
            let wrong = seen(room, is_real, true);
            assert!(wrong.is_refusal(), "{is_real}: {wrong:?}");
        }
    }

    /// A wall behind an open yard, with and without leakage between the antennas: its side lobes, far above the noise, are no returns.
    #[test]
    fn one_or_two_strong_returns_decide_nothing_and_are_not_accused() {
        for tones in [&[[90.4, 15000.0]][..], &[[90.4, 15000.0], [2.3, 100.0]], &[[99.4, 15000.0]]] {
            for are_exchanged in [false, true] {
                let sent = |chirp: &[Complex64]| {
                    let right = with_tones(chirp, tones, |value| value);
                    if are_exchanged { exchanged(&right) } else { right }
                };
                let finding = judged(Box::new(Lanes::new(SCHEDULE)), &stream(SCHEDULE, |_| 0.0, |value| value, sent));
                assert!(finding.ok && !finding.decided, "{tones:?}, {are_exchanged}: {finding:?}");
            }
        }
    }

    /// Returns at all ranges from five eighths to seven eighths of the band, of which the exchange takes more than half to the near half:
    /// but the images that exchanged lanes would have made of them are not there.
    #[test]
    fn an_open_scene_with_far_returns_alone_is_not_accused() {
        let far = seen(|bin| if (80..112).contains(&bin) { 1000.0 } else { 0.0 }, false, false);
        assert!(far.ok && !far.decided, "{far:?}");
    }

    /// Noise alone; returns over the whole band alike; I and Q exchanged, so that near returns are in the far half.
    #[test]
    fn what_decides_nothing_is_not_accused() {
        let amplitudes: [fn(usize) -> f64; 3] =
            [|_| 0.0, |bin| if (2..126).contains(&bin) { 100.0 } else { 0.0 }, |bin| room((SAMPLES - bin) % SAMPLES)];
        for amplitude in amplitudes {
            let finding = seen(amplitude, false, false);
            assert!(finding.ok, "{finding:?}");
        }
    }
}
