//! Runs of one value: packets filled with zeros, halves of frames that never came, a converter that stands still.
//!
//! The law: a sample repeats the one before it, at its place in the chirp and in its channel, as often as it does there in all chirps
//! (rule of succession), and a run is the product of its repeats. A receiver that is quiet at some place repeats itself there in every
//! chirp, and is no finding; a packet of zeros lies in few chirps.

use num_complex::Complex32;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind, frames_listed};

const CHECK: &str = "integrity_runs";
const EXPECTED: &str = "no run of one value that is as long as a packet";
/// Least payload of an Ethernet frame (IEEE 802.3, 3.2.7): no packet is smaller. A converter's word has two bytes.
const LEAST_BYTES: usize = 46;
const WORD_BYTES: usize = 2;
/// Runs that are kept: where there are more, the receiver repeats itself everywhere.
const MOST_RUNS: usize = 1 << 20;

#[derive(Clone, Copy)]
struct Run {
    start: usize,
    length: usize,
    value: Complex32,
}

pub(super) struct Runs {
    schedule: Schedule,
    /// Repeats at each place of a loop.
    repeats: Vec<usize>,
    current: Run,
    runs: Vec<Run>,
    /// Place of the next sample in the stream of all frames, and how many were seen: frames may be left out.
    place: usize,
    seen: usize,
    /// Least and largest component.
    extremes: [f32; 2],
}

impl Runs {
    pub fn new(schedule: Schedule) -> Self {
        let current = Run { start: 0, length: 0, value: Complex32::new(f32::NAN, f32::NAN) };
        let repeats = vec![0; schedule.period()];
        Self { schedule, repeats, current, runs: vec![], place: 0, seen: 0, extremes: [f32::INFINITY, f32::NEG_INFINITY] }
    }

    fn least(&self) -> usize {
        LEAST_BYTES.div_ceil(WORD_BYTES * if self.schedule.is_real { 1 } else { 2 })
    }

    fn close(&mut self) {
        if self.current.length >= self.least() && self.runs.len() < MOST_RUNS {
            self.runs.push(self.current);
        }
    }

    /// Whether the converter was at its rail: that is saturation, an effect with a name.
    fn is_clipped(&self, value: Complex32) -> bool {
        let components: &[f32] = if self.schedule.is_real { &[value.re] } else { &[value.re, value.im] };
        value != Complex32::ZERO && components.iter().any(|part| self.extremes.contains(part))
    }

    /// Logarithm of the chance of a run's repeats; `sums` are running sums of the places' logarithms.
    fn log_chance(&self, run: &Run, sums: &[f64]) -> f64 {
        let period = self.schedule.period();
        let up_to = |place: usize| (place / period) as f64 * sums[period] + sums[place % period];
        up_to(run.start + run.length) - up_to(run.start + 1)
    }
}

impl Inspector for Runs {
    fn see(&mut self, stream: &Stream) {
        let period = self.schedule.period();
        let begins = stream.frame * stream.values.len();
        if self.place != begins {
            self.close();
            self.current.length = 0;
            self.current.value = Complex32::new(f32::NAN, f32::NAN);
            self.place = begins;
        }
        for &value in &stream.values {
            let im = if self.schedule.is_real { value.re } else { value.im };
            self.extremes = [self.extremes[0].min(value.re).min(im), self.extremes[1].max(value.re).max(im)];
            if value == self.current.value {
                self.repeats[self.place % period] += 1;
                self.current.length += 1;
            } else {
                self.close();
                self.current = Run { start: self.place, length: 1, value };
            }
            (self.place, self.seen) = (self.place + 1, self.seen + 1);
        }
    }

    fn conclude(mut self: Box<Self>) -> Option<Finding> {
        self.close();
        let loops = (self.seen / self.schedule.period().max(1)) as f64;
        let mut sums = vec![0.0];
        for &count in &self.repeats {
            sums.push(sums[sums.len() - 1] + ((count as f64 + 1.0) / (loops + 2.0)).ln());
        }
        // A run may begin anywhere.
        let log_p = |run: &Run| self.log_chance(run, &sums) + (self.seen.max(1) as f64).ln();
        let bad: Vec<&Run> = self.runs.iter().filter(|run| !self.is_clipped(run.value) && log_p(run) < ALARM.ln()).collect();
        let Some(first) = bad.first() else {
            return Some(Finding::as_stated(CHECK, EXPECTED, "none"));
        };
        let frame_length = self.schedule.loops * self.schedule.period();
        let of = |run: &&Run| run.start / frame_length..=(run.start + run.length - 1) / frame_length;
        let mut frames: Vec<usize> = bad.iter().flat_map(of).collect();
        frames.dedup();
        let (short, long) = bad.iter().fold((usize::MAX, 0), |(low, high), run| (low.min(run.length), high.max(run.length)));
        let zeros = bad.iter().filter(|run| run.value == Complex32::ZERO).count();
        let what = match (zeros == bad.len(), zeros) {
            (true, _) => "exact zeros",
            (false, 0) => "a value that stands still",
            _ => "exact zeros and values that stand still",
        };
        let lengths = if short == long { short.to_string() } else { format!("{short} to {long}") };
        let runs = if bad.len() == 1 { "one run".into() } else { format!("{} runs", bad.len()) };
        let share = 100.0 * bad.iter().map(|run| run.length).sum::<usize>() as f64 / self.seen as f64;
        let found = format!(
            "{what} in {runs} of {lengths} samples ({share:.2} % of the stream), in {}; the first from {} on",
            frames_listed(&frames),
            self.schedule.spot(first.start)
        );
        let likeliest = bad.iter().map(|run| log_p(run)).fold(f64::INFINITY, f64::min);
        let mut chirps: Vec<[usize; 4]> =
            bad.iter().flat_map(|run| self.schedule.chirps(run.start..run.start + run.length)).collect();
        chirps.dedup();
        Some(Finding { frames, chirps, ..Finding::wrong(Kind::Lost, CHECK, EXPECTED, found, likeliest) })
    }
}
