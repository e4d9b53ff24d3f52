//! Transmitters that were not separated: chirps in the order of firing fill the tx axis one after the other; or chirps were taken to be
//! of transmitters in turn, and each transmitter had fired all of its loops before the next one.
//!
//! Two explanations with as many numbers are held against each other: every transmitter of the axis has its own mean chirp, or every
//! transmitter of the other order has. The likelihood ratio of Gaussian rests counts every chirp as one sample, as its samples may share
//! a cause. The other order must also explain most of what both together can, or else something that changes from loop to loop within
//! each transmitter does. Bonferroni over the orders.

use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_transmitters";
const EXPECTED: &str = "loops of one transmitter alike";

/// Another order of the chirps.
#[derive(Clone, Copy)]
enum Order {
    /// They fill the tx axis one after the other, though transmitters fired in turn.
    InTurn,
    /// They were taken in turn, though a transmitter had fired all of its loops before the next one did.
    InBlocks,
}

const ORDERS: [Order; 2] = [Order::InTurn, Order::InBlocks];

impl Order {
    /// The transmitter that fired a loop of a transmitter of the axis.
    fn fired(self, Schedule { tx, loops, .. }: Schedule, of: usize, index: usize) -> usize {
        match self {
            Self::InTurn => (of * loops + index) % tx,
            Self::InBlocks => (index * tx + of) / loops,
        }
    }

    fn text(self, tx: usize, db: f64) -> String {
        match self {
            Self::InTurn => format!(
                "loops of one transmitter alternate between {tx} kinds, and chirps in the order of firing leave {db:.1} dB less: the {tx} \
                 transmitters were not separated, the chirps lie in the order of firing"
            ),
            Self::InBlocks => format!(
                "loops of one transmitter are of {tx} kinds one after the other, and {tx} blocks of chirps leave {db:.1} dB less: each \
                 transmitter fired all of its loops before the next one did"
            ),
        }
    }
}

/// Chirps that share a mean.
#[derive(Clone)]
struct Group {
    sum: Vec<Complex64>,
    count: f64,
}

impl Group {
    fn add(&mut self, values: &[Complex64], count: f64) {
        self.count += count;
        self.sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }

    fn explained(&self) -> f64 {
        self.sum.iter().map(Complex64::norm_sqr).sum::<f64>() / self.count.max(1.0)
    }
}

pub(super) struct Transmitters {
    schedule: Schedule,
    /// Of each order, by transmitter of the axis and of the order: `[tx, tx of the order]`.
    groups: [Vec<Group>; ORDERS.len()],
    energy: f64,
    chirps: f64,
}

impl Transmitters {
    pub fn new(schedule: Schedule) -> Self {
        let empty = Group { sum: vec![Complex64::ZERO; schedule.rx * schedule.samples], count: 0.0 };
        let groups = ORDERS.map(|_| vec![empty.clone(); schedule.tx * schedule.tx]);
        Self { schedule, groups, energy: 0.0, chirps: 0.0 }
    }

    /// Energy that is left when groups of one transmitter share a mean: of the axis, of the other order, and of both.
    fn left(&self, groups: &[Group]) -> [f64; 3] {
        let tx = self.schedule.tx;
        let left_by = |label: fn(usize, usize) -> usize| {
            let mut merged: Vec<Option<Group>> = vec![None; groups.len()];
            for (index, group) in groups.iter().enumerate() {
                match &mut merged[label(index, tx)] {
                    Some(whole) => whole.add(&group.sum, group.count),
                    empty => *empty = Some(group.clone()),
                }
            }
            (self.energy - merged.iter().flatten().map(Group::explained).sum::<f64>()).max(f64::MIN_POSITIVE)
        };
        [left_by(|index, tx| index / tx), left_by(|index, tx| index % tx), left_by(|index, _| index)]
    }

    /// What the samples say of an order, if they are of that one rather than as stated.
    fn judge(&self, order: Order, groups: &[Group]) -> Option<Finding> {
        let [separated, other, both] = self.left(groups);
        let ratio = self.chirps * (separated / other).ln();
        let at_most = self.chirps * (separated / both).ln();
        let log_p = (ORDERS.len() as f64).ln() - ratio;
        (log_p < ALARM.ln() && 2.0 * ratio >= at_most).then(|| {
            let found = order.text(self.schedule.tx, 10.0 * (separated / other).log10());
            Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p)
        })
    }
}

impl Inspector for Transmitters {
    fn see(&mut self, stream: &Stream) {
        let tx = self.schedule.tx;
        if tx < 2 {
            return;
        }
        for (index, of, chirp) in stream.chirps() {
            let values: Vec<Complex64> = chirp.iter().map(|value| Complex64::new(value.re.into(), value.im.into())).collect();
            self.chirps += 1.0;
            self.energy += values.iter().map(Complex64::norm_sqr).sum::<f64>();
            for (order, groups) in ORDERS.into_iter().zip(&mut self.groups) {
                groups[of * tx + order.fired(self.schedule, of, index)].add(&values, 1.0);
            }
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let Schedule { tx, loops, .. } = self.schedule;
        if tx < 2 {
            return None;
        }
        if loops < 2 * tx {
            return Some(Finding::undecided(CHECK, EXPECTED, "too few loops"));
        }
        let found = ORDERS.into_iter().zip(&self.groups).filter_map(|(order, groups)| self.judge(order, groups));
        // Of an order, another one may explain a part.
        let likeliest = found.min_by(|a, b| a.p_value.partial_cmp(&b.p_value).unwrap_or(std::cmp::Ordering::Equal));
        Some(likeliest.unwrap_or_else(|| Finding::as_stated(CHECK, EXPECTED, "they are")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const SCHEDULE: Schedule =
        Schedule { tx: 3, rx: 1, loops: 12, samples: 16, is_real: true, is_falling: false, farthest_bin: None };

    /// Eight frames whose chirps were fired by `fired` (transmitter of the axis, loop), and beside them what else is there of a loop.
    fn seen(fired: impl Fn(usize, usize) -> usize, beside: impl Fn(usize) -> f64) -> Finding {
        let mut inspector = Box::new(Transmitters::new(SCHEDULE));
        for frame in 0..8 {
            let drawn = numbers(frame, 3 * 12 * 16, -0.1, 0.1);
            let value = |i: usize| {
                let (of, index, sample) = (i / (12 * 16), i / 16 % 12, i % 16);
                (0.4 * sample as f64 + 2.0 * fired(of, index) as f64).cos() + beside(index) + drawn[i]
            };
            let re = (0..drawn.len()).map(|i| value(i) as f32).collect();
            inspector.see(&Stream::of(SCHEDULE, frame as usize, &IfFrame::new([3, 1, 12, 16], re, None)));
        }
        inspector.conclude().unwrap()
    }

    #[test]
    fn either_order_of_firing_is_found_and_what_changes_within_frames_is_none() {
        let in_turn = seen(|of, index| (of * 12 + index) % 3, |_| 0.0);
        assert!(in_turn.is_refusal() && in_turn.found.contains("were not separated"), "{in_turn:?}");
        let in_blocks = seen(|of, index| (index * 3 + of) / 12, |_| 0.0);
        assert!(in_blocks.is_refusal() && in_blocks.found.contains("all of its loops before"), "{in_blocks:?}");
        // A receiver that settles, and one whose gain takes turns.
        let settling = seen(|of, _| of, |index| if index < 4 { 0.8 } else { 0.0 });
        assert!(settling.ok, "{settling:?}");
        let turning = seen(|of, _| of, |index| 0.8 * (index % 3) as f64);
        assert!(turning.ok, "{turning:?}");
    }
}
