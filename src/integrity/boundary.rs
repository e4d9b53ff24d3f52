//! Frames that begin elsewhere than is stated: another number of loops, or loops that were cut off at the beginning.
//!
//! Between frames more time passes than between loops, so what moves changes more. Within frames as stated, a step between loops is the
//! largest of its frame as often as any other one: that the same step is so in many frames has a binomial law, Bonferroni over the
//! steps. What begins with a frame (a receiver that settles) makes one step the largest, too, but changes as much from frame to frame;
//! so the step must also exceed that between frames, which a boundary that is as stated does not: a sign test over frames. A step is what
//! lasts: a burst of somebody else's radar in one loop, which may come as evenly as frames do, is none. Where frames begin at another
//! loop of each stated frame, they are of another length (`frame_length`), and the same sign test holds; where several were read as one or
//! one as several, the laws of `frame_parts` hold.

use num_complex::Complex32;
use statrs::statistics::{Data, OrderStatistics};

use super::frame_length::{OtherLength, other_length};
use super::frame_parts::{Next, Other, Step, counted, other_frames};
use super::stream::{Schedule, Stream};
use super::tails::{log_binomial_tail, log_same_place, most_frequent};
use super::{ALARM, Finding, Inspector, Kind};

pub(super) const CHECK: &str = "frame_boundary";
const EXPECTED: &str = "the first loop of a frame first";
/// Loops of a frame beside which no step is compared: a step needs two loops before it and two after it, or the steps at the ends, whose
/// differences share a loop, are the largest more often than the others.
const ENDS: usize = 2;
/// Fewest loops of a frame whose steps can be compared.
const FEWEST_LOOPS: usize = 2 * ENDS + 1;

/// The last frame that was seen.
struct Last {
    frame: usize,
    /// Two loops before its largest step, and its last two.
    before: [Vec<Complex32>; 2],
    end: [Vec<Complex32>; 2],
    /// Median of its steps.
    usual: f64,
}

pub(super) struct Boundary {
    schedule: Schedule,
    steps: Vec<Step>,
    last: Option<Last>,
}

impl Boundary {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, steps: vec![], last: None }
    }

    /// Frames of another length, where the steps say so.
    fn of_another_length(&self) -> Option<Finding> {
        let steps: Vec<(usize, usize)> = self.steps.iter().map(|step| (step.frame, step.place)).collect();
        let OtherLength { loops, at, of, log_p } = other_length(self.schedule.loops, &steps)?;
        let (larger, compared) = larger(at.iter().map(|&index| &self.steps[index]));
        let log_p = log_p.max(log_binomial_tail(larger, compared, 0.5));
        let found = format!(
            "in {} of {of} frames the scene changes most where frames of {loops} loops begin, in {larger} of {compared} more than to the \
             next frame: the number of loops is another",
            at.len()
        );
        (log_p < ALARM.ln()).then(|| Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
    }

    /// Frames that were read as parts of one, or as several.
    fn of_other_parts(&self) -> Option<Finding> {
        let Other { loops, text, log_p } = other_frames(self.schedule.loops, &self.steps)?;
        let found = format!("{text}, the number of loops is {loops}");
        (log_p < ALARM.ln()).then(|| Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
    }
}

/// How many steps are larger than those to the next frame, of how many.
fn larger<'a>(steps: impl Iterator<Item = &'a Step>) -> (usize, usize) {
    counted(steps, |size, next| size > next)
}

/// What lasts of a step: two loops before it and two after it, all in order.
fn step(loops: [&[Complex32]; 4]) -> f64 {
    let between = |before: &[Complex32], after: &[Complex32]| -> f64 {
        before.iter().zip(after).map(|(before, after)| f64::from((after - before).norm_sqr())).sum()
    };
    between(loops[1], loops[2]).min(between(loops[0], loops[3]))
}

impl Inspector for Boundary {
    fn see(&mut self, stream: &Stream) {
        if self.schedule.loops < FEWEST_LOOPS {
            return;
        }
        let loops: Vec<&[Complex32]> = stream.loops().collect();
        if let (Some(last), Some(before)) = (&self.last, self.steps.last_mut())
            && last.frame + 1 == stream.frame
        {
            let to_this = |from: &[Vec<Complex32>; 2]| step([&from[0], &from[1], loops[0], loops[1]]);
            let (size, all) = (to_this(&last.end), to_this(&last.before));
            let changed = before.size.max(size) - last.usual;
            let lasting = if changed > 0.0 { ((all - last.usual) / changed).min(1.0) } else { 0.0 };
            before.next = Some(Next { size, lasting });
        }
        let end = loops.len() - 1;
        let sizes: Vec<f64> = (1..end - 1).map(|at| step([at - 1, at, at + 1, at + 2].map(|index| loops[index]))).collect();
        let largest = sizes.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        self.last = largest.map(|(at, size)| {
            let place = at + 1;
            self.steps.push(Step { frame: stream.frame, place, size, next: None });
            let owned = |from: usize| [from, from + 1].map(|index| loops[index].to_vec());
            Last { frame: stream.frame, before: owned(place - 1), end: owned(end - 1), usual: Data::new(sizes).median() }
        });
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.steps.len() < 2 {
            let is_short = self.schedule.loops < FEWEST_LOOPS;
            let why = if is_short { "frames of so few loops show no boundary" } else { "one frame alone shows no boundary" };
            return Some(Finding::undecided(CHECK, EXPECTED, why));
        }
        let places: Vec<usize> = self.steps.iter().map(|step| step.place).collect();
        let (place, count) = most_frequent(&places)?;
        let (larger, compared) = larger(self.steps.iter().filter(|step| step.place == place));
        let log_p =
            log_same_place(count, places.len(), self.schedule.loops - 1 - ENDS).max(log_binomial_tail(larger, compared, 0.5));
        if log_p < ALARM.ln() {
            let found = format!(
                "in {count} of {} frames the scene changes most between the loops {place} and {}, in {larger} of {compared} more than to \
                 the next frame: frames begin there, or the number of loops is another",
                places.len(),
                place + 1
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p));
        }
        if let Some(found) = self.of_another_length().or_else(|| self.of_other_parts()) {
            return Some(found);
        }
        let (between, of) = counted(self.steps.iter(), |size, next| next > size);
        let found = format!("the scene changes more to the next frame than within it in {between} of {of} frames");
        if log_binomial_tail(between, of, 0.5) < ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, found));
        }
        Some(Finding::undecided(CHECK, EXPECTED, found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const LOOPS: usize = 8;

    /// Of so many frames of real samples of one channel, `value` by frame and by sample of all loops.
    fn judged([frames, loops, samples]: [usize; 3], value: impl Fn(usize, usize) -> f64) -> Finding {
        let schedule = Schedule { tx: 1, rx: 1, loops, samples, is_real: true, is_falling: false, farthest_bin: None };
        let mut inspector = Box::new(Boundary::new(schedule));
        for frame in 0..frames {
            let re = (0..loops * samples).map(|i| value(frame, i) as f32).collect();
            inspector.see(&Stream::of(schedule, frame, &IfFrame::new([1, 1, loops, samples], re, None)));
        }
        inspector.conclude().unwrap()
    }

    /// Something that moves a little from loop to loop and more from frame to frame; the stream begins so many loops late. `settling`:
    /// how much the first loop of a frame differs.
    fn seen(late: usize, settling: f64) -> Finding {
        seen_as(LOOPS, late, settling)
    }

    /// The same, cut into frames of so many loops.
    fn seen_as(stated: usize, late: usize, settling: f64) -> Finding {
        let drawn = numbers(8, 60 * LOOPS * 16, -0.05, 0.05);
        judged([48 * LOOPS / stated, stated, 16], |frame, i| {
            let (index, sample) = (frame * stated + i / 16 + late, i % 16);
            let time = index as f64 * 0.01 + (index / LOOPS) as f64 * 0.37;
            let first = if index % LOOPS == 0 { settling } else { 0.0 };
            (0.4 * sample as f64 + 6.0 * time).sin() + first + drawn[frame * stated * 16 + i]
        })
    }

    /// Boundaries at another loop of each frame, and none that comes most often.
    #[test]
    fn another_number_of_loops_is_found_and_named() {
        for stated in [LOOPS - 1, LOOPS + 1] {
            let found = seen_as(stated, 0, 0.0);
            assert!(found.is_refusal() && found.found.contains("where frames of 8 loops begin"), "{stated}: {found:?}");
        }
    }

    /// Boundaries in the middle of each frame, and at each second one's beginning.
    #[test]
    fn frames_read_as_one_or_in_parts_are_found() {
        let as_one = seen_as(2 * LOOPS, 0, 0.0);
        assert!(
            as_one.is_refusal() && as_one.found.contains("2 frames were read as one, the number of loops is 8"),
            "{as_one:?}"
        );
        // Of three, poses that never repeat.
        let (drawn, poses) = (numbers(4, 120 * LOOPS * 16, -0.05, 0.05), numbers(3, 120, 0.0, 6.3));
        let of_three = judged([40, 3 * LOOPS, 16], |frame, i| {
            let index = frame * 3 * LOOPS + i / 16;
            (0.4 * (i % 16) as f64 + poses[index / LOOPS] + 0.06 * (index % LOOPS) as f64).sin()
                + drawn[frame * 3 * LOOPS * 16 + i]
        });
        assert!(of_three.is_refusal() && of_three.found.contains("3 frames were read as one"), "{of_three:?}");
        // Frames of 16 loops, in two parts.
        let drawn = numbers(5, 300 * LOOPS * 16, -0.05, 0.05);
        let in_parts = judged([300, LOOPS, 16], |frame, i| {
            let time = (frame * LOOPS + i / 16) as f64 * 0.01 + (frame / 2) as f64 * 0.37;
            (0.4 * (i % 16) as f64 + 6.0 * time).sin() + drawn[frame * LOOPS * 16 + i]
        });
        assert!(in_parts.is_refusal() && in_parts.found.contains("frames of 16 loops were read in 2 parts"), "{in_parts:?}");
    }

    /// A receiver that changes in the middle of each frame and is again what it was when the next one begins.
    #[test]
    fn what_changes_within_each_frame_and_comes_back_is_no_boundary() {
        let drawn = numbers(6, 60 * 16 * 16, -0.05, 0.05);
        let found = judged([60, 16, 16], |frame, i| if i / 16 < 8 { 0.0 } else { 0.4 } + drawn[frame * 256 + i]);
        assert!(!found.is_refusal(), "{found:?}");
    }

    /// Bursts in one loop of each frame, a loop later in each, come as evenly as frames of another length begin. What stays so until the
    /// next of these loops is a boundary.
    #[test]
    fn bursts_of_another_radar_are_no_boundary() {
        let seen = |lasts: bool| {
            let drawn = numbers(9, 30 * 40 * 16, -0.05, 0.05);
            judged([30, 40, 16], |frame, i| {
                let (index, at) = (i / 16, frame + 5);
                let is_other = if lasts { (frame + usize::from(index >= at)) % 2 == 1 } else { index == at };
                drawn[frame * 640 + i] + if is_other { (0.7 * (i % 16) as f64).cos() } else { 0.0 }
            })
        };
        assert!(!seen(false).is_refusal(), "{:?}", seen(false));
        assert!(seen(true).is_refusal(), "{:?}", seen(true));
    }

    /// However many frames: all steps of noise are alike.
    #[test]
    fn noise_alone_has_no_boundary() {
        for seed in 0..4 {
            let drawn = numbers(seed, 2400 * 128, -1.0, 1.0);
            let found = judged([2400, 16, 8], |frame, i| drawn[frame * 128 + i]);
            assert!(!found.is_refusal(), "{seed}: {found:?}");
        }
    }

    #[test]
    fn one_frame_decides_nothing() {
        let drawn = numbers(8, LOOPS * 16, -1.0, 1.0);
        assert!(!judged([1, LOOPS, 16], |_, i| drawn[i]).decided);
    }

    #[test]
    fn frames_that_begin_late_are_found_and_what_settles_is_not_accused() {
        let stated = seen(0, 0.0);
        assert!(stated.ok && stated.decided, "{stated:?}");
        let late = seen(3, 0.0);
        assert!(late.is_refusal() && late.found.contains("between the loops 4 and 5"), "{late:?}");
        assert!(seen(0, 0.7).ok, "{:?}", seen(0, 0.7));
    }
}
