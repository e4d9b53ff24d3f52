//! Two lanes exchanged: every second sample before its neighbour.
//!
//! Exchanged neighbours turn a tone of ω rad a sample into two, at ω and at ω + π (of real samples: at π − ω), and the share sin²ω of
//! its energy goes to the other one, which is in the other half of the band. So in a group of these two, exchanging what was right
//! leaves in the far half more than was there, or more than half of the group. If it leaves less in nearly all groups, the lanes were
//! exchanged: the sign test of `integrity_word_order` over the groups of the still chirps' mean spectrum. Where neither the samples
//! as read nor the exchanged ones look exchanged, as where returns fill the whole band alike, nothing can be decided.

use num_complex::Complex64;

use super::still::{Sum, spectrum};
use super::stream::{Schedule, Stream};
use super::tails::log_binomial_tail;
use super::words::{GUARD, looks_exchanged};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_lane_order";
const EXPECTED: &str = "samples in the order in which they were taken";

pub(super) struct Lanes {
    schedule: Schedule,
    sum: Sum,
}

impl Lanes {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, sum: Sum::new(schedule) }
    }

    /// Bins of each group: in the half where near returns are, and in the other one.
    fn groups(&self) -> Vec<[usize; 2]> {
        let samples = self.schedule.samples;
        let half = samples / 2;
        let bins = GUARD..(half / 2).saturating_sub(GUARD - 1);
        let mut groups: Vec<[usize; 2]> = match self.schedule.is_real {
            true => bins.map(|bin| [bin, half - bin]).collect(),
            false => bins.flat_map(|bin| [[bin, half + bin], [half - bin, samples - bin]]).collect(),
        };
        if self.schedule.is_falling && !self.schedule.is_real {
            groups.iter_mut().for_each(|group| group.reverse());
        }
        groups
    }
}

fn exchanged(chirp: &[Complex64]) -> Vec<Complex64> {
    chirp.as_chunks::<2>().0.iter().flat_map(|[first, second]| [*second, *first]).collect()
}

impl Inspector for Lanes {
    fn see(&mut self, stream: &Stream) {
        stream.loops().for_each(|samples| self.sum.add(samples));
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        // Neighbours of two chirps would be exchanged otherwise.
        if !samples.is_multiple_of(2) {
            return None;
        }
        let chirps: Vec<Vec<Complex64>> = self.sum.chirps().map(exchanged).collect();
        let as_read = spectrum(self.sum.chirps(), samples);
        let reordered = spectrum(chirps.iter().map(Vec::as_slice), samples);
        let (mut as_they_are, mut as_exchanged) = (0, 0);
        let (mut all, mut far, mut far_after) = (0.0, 0.0, 0.0);
        let groups = self.groups();
        for [near, away] in &groups {
            let (whole, before, after) = (as_read[*near] + as_read[*away], as_read[*away], reordered[*away]);
            as_they_are += usize::from(looks_exchanged(before, after, whole));
            as_exchanged += usize::from(looks_exchanged(after, before, whole));
            (all, far, far_after) = (all + whole, far + before, far_after + after);
        }
        let share = |energy: f64| 100.0 * energy / f64::max(all, f64::MIN_POSITIVE);
        let shares = format!(
            "the far half of the spectrum holds {:.1} % of the still energy, and {:.1} % with neighbouring samples exchanged",
            share(far),
            share(far_after)
        );
        let log_p = |count: usize| log_binomial_tail(count, groups.len(), 0.5);
        if log_p(as_they_are) < ALARM.ln() {
            let found =
                format!("{shares}, in {as_they_are} of {} groups of frequencies less: two lanes were exchanged", groups.len());
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p(as_they_are)));
        }
        if log_p(as_exchanged) < ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, shares));
        }
        Some(Finding::undecided(CHECK, EXPECTED, shares))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const RX: usize = 4;
    const LOOPS: usize = 4;
    const SAMPLES: usize = 128;

    /// Static returns of an amplitude at each bin, of other phases in every channel; neighbours exchanged or not.
    fn seen(amplitude: impl Fn(usize) -> f64, is_real: bool, are_exchanged: bool) -> Finding {
        let schedule = Schedule { tx: 1, rx: RX, loops: LOOPS, samples: SAMPLES, is_real, is_falling: false, farthest_bin: None };
        let noise = numbers(9, 2 * RX * LOOPS * SAMPLES, -3.0, 3.0);
        let phases = numbers(10, RX * SAMPLES, 0.0, std::f64::consts::TAU);
        let (mut re, mut im) = (vec![], vec![]);
        for chirp in 0..RX * LOOPS {
            let value = |sample: usize| {
                let tone = |bin: usize| {
                    let phase = std::f64::consts::TAU * (bin * sample) as f64 / SAMPLES as f64;
                    Complex64::from_polar(amplitude(bin), phase + phases[chirp / LOOPS * SAMPLES + bin])
                };
                let place = chirp * SAMPLES + sample;
                (0..SAMPLES).map(tone).sum::<Complex64>() + Complex64::new(noise[2 * place], noise[2 * place + 1])
            };
            let values: Vec<Complex64> = (0..SAMPLES).map(value).collect();
            let values = if are_exchanged { exchanged(&values) } else { values };
            re.extend(values.iter().map(|value| value.re as f32));
            im.extend(values.iter().map(|value| value.im as f32));
        }
        let mut inspector = Box::new(Lanes::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([1, RX, LOOPS, SAMPLES], re, (!is_real).then_some(im))));
        inspector.conclude().unwrap()
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
