//! What an exchange of words or samples does to the halves of the band, of which the near one holds the stronger returns.
//!
//! An exchange turns a tone into several, in both halves: those frequencies are a group. So exchanging what was right leaves in the far
//! half of a group more than was there, or more than half of its energy; if it leaves less in nearly all groups, what was read had been
//! exchanged: a sign test at an even chance over the groups of the still chirps' mean spectrum.

use std::ops::Range;

use num_complex::Complex64;

use super::still::{Sum, spectrum};
use super::tails::log_binomial_tail;

/// Bins beside 0 and a quarter of the sampling rate where the window makes the tones of a group one.
const GUARD: usize = 3;

/// Of each group of frequencies, one bin: the others lie as far from the ends of the halves.
pub(super) fn bins(samples: usize) -> Range<usize> {
    GUARD..(samples / 4).saturating_sub(GUARD - 1)
}

/// The far halves of all groups before and after the exchange.
pub(super) struct Halves {
    pub groups: usize,
    /// Groups in which what was read looks exchanged, and those in which the exchanged does.
    pub as_they_are: usize,
    pub as_exchanged: usize,
    /// Shares of the energy in the far half, before and after.
    shares: [f64; 2],
}

impl Halves {
    /// `groups`: bins of the near half and of the far one.
    pub fn of<const K: usize>(
        still: &Sum,
        exchanged: &[Vec<Complex64>],
        samples: usize,
        groups: impl Iterator<Item = [[usize; K]; 2]>,
    ) -> Self {
        let before = spectrum(still.chirps(), samples);
        let after = spectrum(exchanged.iter().map(Vec::as_slice), samples);
        let mut halves = Self { groups: 0, as_they_are: 0, as_exchanged: 0, shares: [0.0; 2] };
        let mut all = 0.0;
        for [near, away] in groups {
            let sum = |power: &[f64], bins: [usize; K]| bins.into_iter().map(|bin| power[bin]).sum::<f64>();
            let (far, far_after) = (sum(&before, away), sum(&after, away));
            let whole = far + sum(&before, near);
            halves.groups += 1;
            halves.as_they_are += usize::from(far_after < far.min(0.5 * whole));
            halves.as_exchanged += usize::from(far < far_after.min(0.5 * whole));
            halves.shares = [halves.shares[0] + far, halves.shares[1] + far_after];
            all += whole;
        }
        halves.shares = halves.shares.map(|energy| energy / f64::max(all, f64::MIN_POSITIVE));
        halves
    }

    /// Logarithm of the chance of so many groups that look exchanged.
    pub fn log_p(&self, count: usize) -> f64 {
        log_binomial_tail(count, self.groups, 0.5)
    }

    /// `what` was exchanged.
    pub fn text(&self, what: &str) -> String {
        let [far, far_after] = self.shares.map(|share| 100.0 * share);
        format!("the far half of the spectrum holds {far:.1} % of the static energy, and {far_after:.1} % with {what} exchanged")
    }
}

/// A frame for tests of what exchanges.
#[cfg(test)]
pub(super) mod scene {
    use num_complex::Complex64;

    use crate::data::IfFrame;
    use crate::integrity::stream::{Schedule, Stream};
    use crate::support::numbers;

    const RX: usize = 4;
    const LOOPS: usize = 4;
    pub const SAMPLES: usize = 128;
    pub const SCHEDULE: Schedule =
        Schedule { tx: 1, rx: RX, loops: LOOPS, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };

    /// Static returns of an amplitude at each bin, of other phases in every channel, through a receiver under noise; `sent` orders the
    /// samples of a chirp.
    pub fn stream(
        schedule: Schedule,
        amplitude: impl Fn(usize) -> f64,
        receiver: impl Fn(Complex64) -> Complex64,
        sent: impl Fn(&[Complex64]) -> Vec<Complex64>,
    ) -> Stream {
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
                receiver((0..SAMPLES).map(tone).sum()) + Complex64::new(noise[2 * place], noise[2 * place + 1])
            };
            let values = sent(&(0..SAMPLES).map(value).collect::<Vec<_>>());
            re.extend(values.iter().map(|value| value.re as f32));
            im.extend(values.iter().map(|value| value.im as f32));
        }
        Stream::of(schedule, 0, &IfFrame::new([1, RX, LOOPS, SAMPLES], re, (!schedule.is_real).then_some(im)))
    }
}
