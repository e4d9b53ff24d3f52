//! Words in the wrong order: I I Q Q read as I Q I Q, or the other way round (each undoes the other).
//!
//! Read in the wrong order, a tone of ω rad a sample becomes four, at ±ω and ±(π − ω), and the share cos²ω / 2 of its energy leaves its
//! half of the spectrum. So in a group of these four, of which N lies in the far half and E in all, the far half holds at least
//! min(N, E / 2) after exchanging words that were right, but for what tones of one group have in common; that has either sign alike. If
//! it holds less, the words were wrong (the test of `exchange.rs`).
//!
//! Where that says neither, as static returns fill both halves, the phases decide: of tones A at ω and B at −ω the product X(ω)
//! X(−ω) is A B as it was sent, whose phase is any, and with words exchanged it has the part j cos ω ((1 − sin ω)|A|² + (1 + sin
//! ω)|B|²) / 4 besides (of tones at ±(π − ω) the same with the other sign). So its imaginary part, summed over the channels, over
//! the mean power at ±ω has one sign in nearly all groups: a sign test at an even chance, for either sign. An unbalanced receiver
//! adds as much as its image is, so that only more than [`IMAGE`] counts. Each test has its share of the alarm (weighted
//! Bonferroni). Where neither the words as read nor the exchanged ones look exchanged, as where
//! returns fill the whole band alike, nothing can be decided.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;

use super::exchange::{Halves, bins};
use super::still::{Still, transformed};
use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_word_order";
const EXPECTED: &str = "I and Q of one sample side by side";
/// Amplitude of the image of an unbalanced receiver, at most: 20 dB below, as of 1.5 dB and 6 degrees together. `iq_imbalance` of the
/// diagnosis finds much weaker ones.
const IMAGE: f64 = 0.1;
/// Shares of the alarm: of the test by power, and of those by phases of either sign, which are asked where the first says nothing.
const BY_POWER: f64 = 0.9;
const BY_PHASES: f64 = 0.05;

pub(super) struct Words {
    schedule: Schedule,
    still: Still,
}

impl Words {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, still: Still::new(schedule) }
    }
}

/// The middle two of every four words exchanged.
fn exchanged(chirp: &[Complex64]) -> Vec<Complex64> {
    let (pairs, rest) = chirp.as_chunks::<2>();
    let swapped = pairs.iter().flat_map(|[a, b]| [Complex64::new(a.re, b.re), Complex64::new(a.im, b.im)]);
    swapped.chain(rest.iter().copied()).collect()
}

/// Imaginary part of X(ω) X(−ω) over the mean power at ±ω, both summed over all channels, by frequency.
fn products<'a>(chirps: impl Iterator<Item = &'a [Complex64]>, samples: usize) -> Vec<f64> {
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let mut sums = vec![(0.0, 0.0); samples];
    for chirp in chirps {
        let values = transformed(&*fft, chirp);
        for bin in 1..samples {
            let (own, opposite) = (values[bin], values[samples - bin]);
            sums[bin].0 += (own * opposite).im;
            sums[bin].1 += 0.5 * (own.norm_sqr() + opposite.norm_sqr());
        }
    }
    sums.into_iter().map(|(product, power)| product / f64::max(power, f64::MIN_POSITIVE)).collect()
}

/// What the tests say: by power, and by the groups in which the words as they are, and the exchanged ones, have a phase that images of
/// exchanged words have, of either sign.
fn judged(halves: &Halves, as_they_are: [usize; 2], as_exchanged: [usize; 2]) -> Finding {
    let shares = halves.text("every second pair of words");
    let by_power = halves.log_p_as_they_are() - BY_POWER.ln();
    let by_phases = |count: usize| halves.log_p_of(count) - BY_PHASES.ln();
    let wrong = |count: usize, log_p: f64, what: &str| {
        let found = format!(
            "{shares}, in {count} of {} groups of frequencies {what}: I I Q Q was read as I Q I Q, or the other way round",
            halves.groups()
        );
        Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p)
    };
    if by_power < ALARM.ln() {
        return wrong(halves.less, by_power, "less");
    }
    if halves.log_p_as_exchanged() - BY_POWER.ln() < ALARM.ln() {
        return Finding::as_stated(CHECK, EXPECTED, shares);
    }
    let [in_step, in_step_exchanged] = [as_they_are, as_exchanged].map(|[up, down]| up.max(down));
    if by_phases(in_step) < ALARM.ln() {
        return wrong(in_step, by_phases(in_step), "a phase that images of exchanged words have");
    }
    if by_phases(in_step_exchanged) < ALARM.ln() {
        return Finding::as_stated(CHECK, EXPECTED, shares);
    }
    Finding::undecided(CHECK, EXPECTED, shares)
}

impl Inspector for Words {
    fn see(&mut self, stream: &Stream) {
        self.still.see(stream);
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        if self.schedule.is_real {
            return None;
        }
        // Words of two chirps would share a group otherwise.
        if !samples.is_multiple_of(2) {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp of an odd number of samples"));
        }
        let chirps: Vec<Vec<Complex64>> = self.still.sum.chirps().map(exchanged).collect();
        let half = samples / 2;
        let groups = bins(samples).map(|bin| {
            let halves = [[bin, half - bin], [samples - bin, half + bin]];
            if self.schedule.is_falling { [halves[1], halves[0]] } else { halves }
        });
        let halves = Halves::of(&self.still, &chirps, samples, true, groups);
        let in_step = |products: Vec<f64>| {
            let standing_out = || bins(samples).zip(&halves.stand_out).filter(|(_, stands_out)| **stands_out);
            let count = |is_so: fn(f64) -> bool| standing_out().filter(|(bin, _)| is_so(products[*bin])).count();
            [count(|product| product > IMAGE), count(|product| product < -IMAGE)]
        };
        let as_they_are = in_step(products(self.still.sum.chirps(), samples));
        let as_exchanged = in_step(products(chirps.iter().map(Vec::as_slice), samples));
        Some(judged(&halves, as_they_are, as_exchanged))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrity::exchange::scene::{self, SCHEDULE, stream, with_tones};

    /// Static returns of an amplitude at each bin through a receiver; words exchanged or not.
    fn seen(amplitude: impl Fn(usize) -> f64, receiver: impl Fn(Complex64) -> Complex64, are_exchanged: bool) -> Finding {
        let sent = |chirp: &[Complex64]| if are_exchanged { exchanged(chirp) } else { chirp.to_vec() };
        scene::judged(Box::new(Words::new(SCHEDULE)), &stream(SCHEDULE, amplitude, receiver, sent))
    }

    /// Near and, as strong, at the far end of the band.
    fn both_halves(bin: usize) -> f64 {
        if (2..30).contains(&bin) || (98..126).contains(&bin) { 100.0 } else { 0.0 }
    }

    /// A room, falling with range.
    fn room(bin: usize) -> f64 {
        if (2..60).contains(&bin) { 100.0 / bin as f64 } else { 0.0 }
    }

    #[test]
    fn the_order_of_the_words_is_decided_also_where_returns_fill_both_halves() {
        for amplitude in [room, both_halves] {
            let right = seen(amplitude, |value| value, false);
            assert!(right.ok && right.decided, "{right:?}");
            let wrong = seen(amplitude, |value| value, true);
            assert!(wrong.is_refusal() && wrong.kind == Kind::Misread, "{wrong:?}");
        }
    }

    /// Q 1 dB stronger than I and 5 degrees off: an image of 25 dB.
    #[test]
    fn an_unbalanced_receiver_is_not_accused() {
        fn unbalanced(value: Complex64) -> Complex64 {
            Complex64::new(value.re, 1.12 * (value.im + 0.087 * value.re))
        }
        type Receiver = fn(Complex64) -> Complex64;
        let receivers: [Receiver; 2] = [unbalanced, |value| unbalanced(value.conj()).conj()];
        for amplitude in [room, both_halves] {
            for receiver in receivers {
                let right = seen(amplitude, receiver, false);
                assert!(right.ok && right.decided, "{right:?}");
            }
        }
    }

    /// Leakage between the antennas through an unbalanced receiver: its side lobes, far above the noise, have phases in step.
    #[test]
    fn the_side_lobes_of_strong_leakage_are_not_accused() {
        let unbalanced = |value: Complex64| Complex64::new(value.re, 1.12 * (value.im + 0.087 * value.re));
        for bin in [1.3, 1.7] {
            let sent = |chirp: &[Complex64]| with_tones(chirp, &[[bin, 15000.0]], unbalanced);
            let finding = scene::judged(Box::new(Words::new(SCHEDULE)), &stream(SCHEDULE, |_| 0.0, |value| value, sent));
            assert!(finding.ok && !finding.decided, "{bin}: {finding:?}");
        }
    }

    #[test]
    fn noise_and_returns_over_the_whole_band_tell_nothing_and_are_not_accused() {
        let amplitudes: [fn(usize) -> f64; 2] = [|_| 0.0, |bin| if (2..126).contains(&bin) { 100.0 } else { 0.0 }];
        for amplitude in amplitudes {
            for are_exchanged in [false, true] {
                let finding = seen(amplitude, |value| value, are_exchanged);
                assert!(finding.ok && !finding.decided, "{finding:?}");
            }
        }
    }
}
