//! Loops of another length than is stated: a description of another capture, another number of samples, receivers or transmitters.
//!
//! Static clutter repeats itself after one loop, so of all shifts of the stream along itself the one by a loop correlates most
//! (Cauchy and Schwarz). With a correlation r, a share 1 − r² of the energy is left, so ln((1 − r²) / (1 − r'²)) for every loop is the log
//! of a likelihood ratio of another length r'; it must exceed the number of lengths that were tried (Bonferroni). A loop counts once, as
//! all of its samples show one scene. Lengths near whole numbers of chirps are not tried: the receivers of one chirp share its phase, and
//! neighbouring chirps what moves. But another length must explain more than those up to twice as long do, too: chirps that take turns
//! make a loop of whole chirps (`transmitter_count`), and other lengths are the better the nearer they are to it.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "loop_length";
const EXPECTED: &str = "a loop of samples x rx x tx";
/// Frames that are looked at: the length is the same in all.
const FRAMES: usize = 4;
/// Fewest loops of a frame in which another length can repeat itself.
const FEWEST_LOOPS: usize = 4;
/// Lengths that are not tried, as a share of a chirp at either side of whole chirps.
const GUARD: usize = 8;

pub(super) struct Period {
    schedule: Schedule,
    /// Correlation by shift, summed over frames, and how many.
    squares: Vec<f64>,
    frames: usize,
}

impl Period {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, squares: vec![], frames: 0 }
    }
}

/// Squared correlation of a stream with itself, by shift, up to half of its length.
fn correlations(stream: &Stream) -> Vec<f64> {
    let length = stream.values.len();
    let padded = (2 * length).next_power_of_two();
    let mut values = stream.centred();
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
    (0..=length / 2).map(|shift| square(shift).min(1.0)).collect()
}

/// Log-likelihood of a stream that repeats itself with the second of two squared correlations against the first.
pub(super) fn repeating(looks: f64, [stated, other]: [f64; 2]) -> f64 {
    // A stream that repeats itself exactly leaves nothing: less than a millionth is not told apart.
    let left = |square: f64| (1.0 - square).max(1e-6);
    looks * (left(stated) / left(other)).ln()
}

impl Inspector for Period {
    fn see(&mut self, stream: &Stream) {
        if self.frames == FRAMES || self.schedule.loops < FEWEST_LOOPS {
            return;
        }
        self.frames += 1;
        self.squares.resize(stream.values.len() / 2 + 1, 0.0);
        self.squares.iter_mut().zip(correlations(stream)).for_each(|(sum, square)| *sum += square);
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.frames == 0 {
            return Some(Finding::undecided(CHECK, EXPECTED, "too few loops"));
        }
        let Schedule { samples, rx, loops, .. } = self.schedule;
        let period = self.schedule.period();
        let square = |shift: usize| self.squares[shift] / self.frames as f64;
        let guard = samples.div_ceil(GUARD);
        let is_tried = |shift: &usize| (guard..=samples - guard).contains(&(shift % samples));
        let shifts: Vec<usize> = (rx * samples..self.squares.len()).filter(is_tried).collect();
        let Some(&best) = shifts.iter().max_by(|a, b| square(**a).total_cmp(&square(**b))) else {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp is too short"));
        };
        let looks = (loops * self.frames) as f64;
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
        if log_p < ALARM.ln() {
            let found = format!(
                "{found}, shifted by {best} samples to {:.2}: the number of samples, receivers or transmitters is another capture's",
                square(best).sqrt()
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p));
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

    /// Tones that are slow against a chirp, in loops that take turns: a shift by a little more than a chirp is better than the stated loop,
    /// and that by the chirps of a whole round still better.
    #[test]
    fn a_loop_of_whole_chirps_is_left_to_the_count_of_transmitters() {
        let (phases, drawn) = (numbers(4, 24, 0.0, std::f64::consts::TAU), numbers(5, 16 * 128, -0.05, 0.05));
        let found = of(|i| (0.05 * (i % 32) as f64 + phases[i / 32 % 6]).sin() + drawn[i]);
        assert!(found.ok, "{found:?}");
    }
}
