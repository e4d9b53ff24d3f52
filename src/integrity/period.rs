//! Loops of another length than is stated: a description of another capture, another number of samples, receivers or transmitters.
//!
//! Static clutter repeats itself after one loop, so of all shifts of the stream along itself the one by a loop correlates most
//! (Cauchy and Schwarz). With a correlation r, a share 1 − r² of the energy is left, so ln((1 − r²) / (1 − r'²)) for every loop is the log
//! of a likelihood ratio of another length r'; it must exceed the number of lengths that were tried (Bonferroni). A loop counts once, as
//! all of its samples show one scene. Lengths near whole numbers of chirps are not tried: the receivers of one chirp share its phase, and
//! neighbouring chirps what moves. But another length must explain more than those up to twice as long do, too: chirps that take turns
//! make a loop of whole chirps (`transmitter_count`), and other lengths are the better the nearer they are to it. Where the stream does
//! not repeat itself after the stated loop either, as of noise and of what moves alone, nothing is decided.
//!
//! A tone beside the chirps repeats itself, too, after lengths of its own. Static clutter then still repeats after a stated loop T: what
//! repeats after T' and what repeats after T sum to y(t) = y(t − T') + y(t − T) − y(t − T' − T), and the stream is better predicted from
//! these three than from one, two and three times T' ago, which of a loop of that length would be three looks at the same.

use hybridsim_fft::FftPlanner;
use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "loop_length";
const EXPECTED: &str = "a loop of samples x rx x tx";
/// Frames that are looked at: the length is the same in all.
const FRAMES: usize = 4;
/// Fewest loops of a frame in which another length can repeat itself.
const FEWEST_LOOPS: usize = 4;
/// A stream that repeats itself exactly leaves nothing: less than this share is not told apart.
const LEAST_LEFT: f64 = 1e-6;
/// Lengths that are not tried, as a share of a chirp at either side of whole chirps.
const GUARD: usize = 8;

pub(super) struct Period {
    schedule: Schedule,
    /// Correlation by shift, summed over frames.
    squares: Vec<f64>,
    /// Values of the frames without their mean.
    frames: Vec<Vec<Complex64>>,
}

impl Period {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, squares: vec![], frames: vec![] }
    }

    /// Whether static clutter repeats itself after a stated loop beside what does so after another length.
    fn still_repeats(&self, other: usize) -> bool {
        let (loops, period) = (self.schedule.loops as f64, self.schedule.period());
        let first = (period + other).max(3 * other);
        let of_frame = |values: &Vec<Complex64>| {
            let shifts = [[other, period, other + period], [other, 2 * other, 3 * other]];
            let [with_stated, other_alone] = shifts.map(|shifts| left(values, first, shifts).max(LEAST_LEFT));
            loops * (1.0 - first as f64 / values.len() as f64) * (other_alone / with_stated).ln()
        };
        self.frames.iter().map(of_frame).sum::<f64>() > -ALARM.ln()
    }
}

/// Squared correlation of a stream with itself, by shift, up to a quarter of its length.
fn correlations(mut values: Vec<Complex64>) -> Vec<f64> {
    let length = values.len();
    let padded = (2 * length).next_power_of_two();
    let mut energy = vec![0.0];
    values.iter().for_each(|value| energy.push(energy[energy.len() - 1] + value.norm_sqr()));
    values.resize(padded, Complex64::ZERO);
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(padded).process(&mut values);
    values.iter_mut().for_each(|value| *value = value.norm_sqr().into());
    planner.plan_fft_inverse(padded).process(&mut values);
    let whole = energy[length];
    let square = |shift: usize| {
        let both = energy[length - shift] * (whole - energy[shift]);
        if both > 0.0 { (values[shift] / padded as f64).norm_sqr() / both } else { 0.0 }
    };
    (0..=length / 4).map(|shift| square(shift).min(1.0)).collect()
}

/// Share of the energy of a stream from a sample on that is left when it is predicted from itself three shifts ago (least squares).
fn left(values: &[Complex64], first: usize, shifts: [usize; 3]) -> f64 {
    let before = |i: usize, k: usize| values[i - shifts[k]];
    let (mut own, mut with, mut energy) = (Matrix3::<Complex64>::zeros(), Vector3::<Complex64>::zeros(), 0.0);
    for (i, value) in values.iter().enumerate().skip(first) {
        energy += value.norm_sqr();
        for k in 0..3 {
            with[k] += before(i, k).conj() * value;
            (0..3).for_each(|other| own[(k, other)] += before(i, k).conj() * before(i, other));
        }
    }
    // Shifts that show the same are one.
    let solved = own.svd(true, true).solve(&with, 1e-9 * own.norm()).unwrap_or_default();
    if energy > 0.0 { (1.0 - solved.dotc(&with).re / energy).max(0.0) } else { 1.0 }
}

/// Log-likelihood of a stream that repeats itself with the second of two squared correlations against the first.
pub(super) fn repeating(looks: f64, [stated, other]: [f64; 2]) -> f64 {
    let left = |square: f64| (1.0 - square).max(LEAST_LEFT);
    looks * (left(stated) / left(other)).ln()
}

impl Inspector for Period {
    fn see(&mut self, stream: &Stream) {
        if self.frames.len() == FRAMES || self.schedule.loops < FEWEST_LOOPS {
            return;
        }
        let values = stream.centred();
        let squares = correlations(values.clone());
        self.squares.resize(squares.len(), 0.0);
        self.squares.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        self.frames.push(values);
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.frames.is_empty() {
            return Some(Finding::undecided(CHECK, EXPECTED, "too few loops"));
        }
        let Schedule { samples, rx, loops, .. } = self.schedule;
        let period = self.schedule.period();
        let square = |shift: usize| self.squares[shift] / self.frames.len() as f64;
        let guard = samples.div_ceil(GUARD);
        let is_tried = |shift: &usize| (guard..=samples - guard).contains(&(shift % samples));
        let shifts: Vec<usize> = (rx * samples..self.squares.len()).filter(is_tried).collect();
        let Some(&best) = shifts.iter().max_by(|a, b| square(**a).total_cmp(&square(**b))) else {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp is too short"));
        };
        let looks = (loops * self.frames.len()) as f64;
        let tried = (shifts.len() as f64).ln();
        // Twice a length is as good as the length itself: the shortest peak is reported that is no worse than the best one.
        let is_peak = |shift: usize| square(shift) >= square(shift - 1).max(square((shift + 1).min(self.squares.len() - 1)));
        let is_as_good = |shift: usize| tried - repeating(looks, [square(shift), square(best)]) >= ALARM.ln();
        let best = shifts.iter().copied().find(|&shift| is_peak(shift) && is_as_good(shift)).unwrap_or(best);
        // Where the loop is as long as the best length, it is twice as long at the first whole chirps.
        let shorter = (rx..).map(|chirps| chirps * samples).take_while(|&shift| shift < (2 * best).min(self.squares.len()));
        let whole_chirps = shorter.map(square).fold(square(period), f64::max);
        let log_p = tried - repeating(looks, [whole_chirps, square(best)]);
        let found = format!(
            "shifted by the {period} samples of a loop, the stream correlates to {:.2} with itself",
            square(period).sqrt()
        );
        if log_p < ALARM.ln() && self.still_repeats(best) {
            let found = format!("{found}, beside something else that repeats itself after {best} samples");
            return Some(Finding::as_stated(CHECK, EXPECTED, found));
        }
        if log_p < ALARM.ln() {
            let found = format!(
                "{found}, shifted by {best} samples to {:.2}: the number of samples, receivers or transmitters is another capture's",
                square(best).sqrt()
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p));
        }
        // The same likelihood ratio against a stream that does not repeat itself at all.
        if -repeating(looks, [0.0, square(period)]) >= ALARM.ln() {
            return Some(Finding::undecided(CHECK, EXPECTED, found));
        }
        Some(Finding::as_stated(CHECK, EXPECTED, found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    /// A stream that repeats itself after so many samples, under noise, cut into loops of 2 x 2 x 32.
    fn seen(period: usize, noise: f64) -> Finding {
        let (still, drawn) = (numbers(4, period, -1.0, 1.0), numbers(5, 16 * 128, -1.0, 1.0));
        of(|i| still[i % period] + noise * drawn[i])
    }

    /// Of a stream in such loops.
    fn of(value: impl Fn(usize) -> f64) -> Finding {
        let values: Vec<f32> = (0..16 * 128).map(|i| value(i) as f32).collect();
        let schedule = Schedule { tx: 2, rx: 2, loops: 16, samples: 32, is_real: true, is_falling: false, farthest_bin: None };
        let mut arranged = vec![];
        for channel in 0..4 {
            (0..16).for_each(|index| arranged.extend(&values[(index * 4 + channel) * 32..][..32]));
        }
        let mut inspector = Box::new(Period::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([2, 2, 16, 32], arranged, None)));
        inspector.conclude().unwrap()
    }

    #[test]
    fn a_loop_of_another_length_is_found_and_the_stated_one_is_not_accused() {
        for noise in [0.1, 1.0, 30.0] {
            assert!(seen(128, noise).ok, "{noise}: {:?}", seen(128, noise));
        }
        let other = seen(140, 0.3);
        assert!(other.is_refusal() && other.found.contains("shifted by 140 samples"), "{other:?}");
        assert!(seen(140, 30.0).ok);
    }

    /// A correlation that noise alone has, too, says nothing of the stated loop.
    #[test]
    fn a_stream_that_does_not_repeat_itself_decides_nothing() {
        let noise = seen(128, 30.0);
        assert!(noise.ok && !noise.decided && noise.found.contains("correlates to 0."), "{noise:?}");
        assert!(seen(128, 0.1).decided);
    }

    /// A tone that turns on beside the chirps, stronger than static clutter that repeats itself.
    #[test]
    fn a_tone_beside_the_chirps_is_no_other_loop() {
        let (still, drawn) = (numbers(4, 128, -1.0, 1.0), numbers(5, 16 * 128, -1.0, 1.0));
        for amplitude in [3.0, 10.0] {
            let found = of(|i| still[i % 128] + amplitude * (0.213 * i as f64).sin() + 0.1 * drawn[i]);
            assert!(found.ok && found.found.contains("beside something else"), "{found:?}");
            let other = of(|i| still[i % 112] + 0.3 * (0.213 * i as f64).sin() + 0.1 * drawn[i]);
            assert!(!other.ok, "{other:?}");
        }
    }

    /// Tones that are slow against a chirp, in loops that take turns: a shift by a little more than a chirp is better than the stated loop,
    /// and that by the chirps of a whole round still better.
    #[test]
    fn a_loop_of_whole_chirps_is_left_to_the_count_of_transmitters() {
        let (phases, drawn) = (numbers(4, 24, 0.0, std::f64::consts::TAU), numbers(5, 16 * 128, -0.05, 0.05));
        let found = of(|i| (0.05 * (i % 32) as f64 + phases[i / 32 % 6]).sin() + drawn[i]);
        assert!(found.ok, "{found:?}");
    }
}
