//! Transmitters that were not separated: chirps in the order of firing fill the tx axis one after the other.
//!
//! Two explanations with as many numbers are held against each other: every transmitter of the axis has its own mean chirp, or every
//! place in the firing order has. The likelihood ratio of Gaussian rests counts every chirp as one sample, as its samples may share
//! a cause. The firing order must also explain most of what both together can, or else something that changes from loop to loop within
//! each transmitter does.

use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_transmitters";
const EXPECTED: &str = "loops of one transmitter alike";

/// Chirps that share a mean.
#[derive(Clone)]
struct Group {
    sum: Vec<Complex64>,
    count: f64,
}

pub(super) struct Transmitters {
    schedule: Schedule,
    /// By transmitter of the axis and remainder of the loop: `[tx, loop mod tx count]`.
    groups: Vec<Group>,
    energy: f64,
    chirps: f64,
}

impl Transmitters {
    pub fn new(schedule: Schedule) -> Self {
        let empty = Group { sum: vec![Complex64::ZERO; schedule.rx * schedule.samples], count: 0.0 };
        Self { schedule, groups: vec![empty; schedule.tx * schedule.tx], energy: 0.0, chirps: 0.0 }
    }

    /// Energy that is left when groups with one label share a mean.
    fn left(&self, label: impl Fn(usize, usize) -> usize) -> f64 {
        let transmitters = self.schedule.tx;
        let mut merged: Vec<Option<Group>> = vec![None; transmitters * transmitters];
        for (index, group) in self.groups.iter().enumerate() {
            match &mut merged[label(index / transmitters, index % transmitters)] {
                Some(whole) => {
                    whole.count += group.count;
                    whole.sum.iter_mut().zip(&group.sum).for_each(|(sum, value)| *sum += value);
                }
                empty => *empty = Some(group.clone()),
            }
        }
        let explained = |group: &Group| group.sum.iter().map(Complex64::norm_sqr).sum::<f64>() / group.count.max(1.0);
        (self.energy - merged.iter().flatten().map(explained).sum::<f64>()).max(f64::MIN_POSITIVE)
    }
}

impl Inspector for Transmitters {
    fn see(&mut self, stream: &Stream) {
        let transmitters = self.schedule.tx;
        for (index, tx, chirp) in stream.chirps() {
            let group = &mut self.groups[tx * transmitters + index % transmitters];
            group.count += 1.0;
            self.chirps += 1.0;
            for (sum, value) in group.sum.iter_mut().zip(chirp) {
                let value = Complex64::new(value.re.into(), value.im.into());
                *sum += value;
                self.energy += value.norm_sqr();
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
        let separated = self.left(|of, _| of);
        let unseparated = self.left(|of, remainder| (of * loops + remainder) % tx);
        let both = self.left(|of, remainder| of * tx + remainder);
        let ratio = self.chirps * (separated / unseparated).ln();
        let at_most = self.chirps * (separated / both).ln();
        let log_p = -ratio;
        if log_p >= ALARM.ln() || 2.0 * ratio < at_most {
            return Some(Finding::as_stated(CHECK, EXPECTED, "they are"));
        }
        let found = format!(
            "loops of one transmitter alternate between {tx} kinds, and chirps in the order of firing leave {:.1} dB less: the {tx} \
             transmitters were not separated, the chirps lie in the order of firing",
            10.0 * (separated / unseparated).log10()
        );
        Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
    }
}
