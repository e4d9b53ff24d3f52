//! Words in the wrong order: I I Q Q read as I Q I Q, or the other way round (each undoes the other).
//!
//! Read in the wrong order, a tone of ω rad a sample becomes four, at ±ω and ±(π − ω), and the share cos²ω / 2 of its energy leaves its
//! half of the spectrum. So in a group of these four, of which N lies in the far half and E in all, the far half holds at least
//! min(N, E / 2) after exchanging words that were right, but for what tones of one group have in common; that has either sign alike. If
//! it holds less in nearly all groups, the words were wrong: a sign test over the groups of the still chirps' mean spectrum.
//!
//! Where that says neither, as static returns fill both halves, the phases decide: of tones A at ω and B at −ω the product X(ω)
//! X(−ω) is A B as it was sent, whose phase is any, and with words exchanged it has the part j cos ω ((1 − sin ω)|A|² + (1 + sin
//! ω)|B|²) / 4 besides (of tones at ±(π − ω) the same with the other sign). So its imaginary part, summed over the channels, over
//! the mean power at ±ω has one sign in nearly all groups: a sign test at an even chance, for either sign. An unbalanced receiver
//! adds as much as its image is, so that only more than [`IMAGE`] counts. Each test has its share of the alarm (weighted
//! Bonferroni). Where neither the words as read nor the exchanged ones look exchanged, as where
//! returns fill the whole band alike, nothing can be decided.

use num_complex::Complex64;
use rustfft::FftPlanner;

use super::still::{Sum, spectrum, transformed};
use super::stream::{Schedule, Stream};
use super::tails::log_binomial_tail;
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_word_order";
const EXPECTED: &str = "I and Q of one sample side by side";
/// Bins beside 0 and a quarter of the sampling rate where the window makes the tones of a group one.
pub(super) const GUARD: usize = 3;
/// Amplitude of the image of an unbalanced receiver, at most: 20 dB below, as of 1.5 dB and 6 degrees together. `iq_imbalance` of the
/// diagnosis finds much weaker ones.
const IMAGE: f64 = 0.1;
/// Shares of the alarm: of the test by power, and of those by phases of either sign, which are asked where the first says nothing.
const BY_POWER: f64 = 0.9;
const BY_PHASES: f64 = 0.05;

pub(super) struct Words {
    schedule: Schedule,
    sum: Sum,
}

impl Words {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, sum: Sum::new(schedule) }
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

/// What the tests say: the groups in which the words as they are, and the exchanged ones, look exchanged, by power and by phases of either
/// sign.
fn judged(groups: usize, as_they_are: [usize; 3], as_exchanged: [usize; 3], shares: String) -> Finding {
    let log_p = |count: usize, share: f64| log_binomial_tail(count, groups, 0.5) - share.ln();
    let wrong = |count: usize, share: f64, what: &str| {
        let found = format!(
            "{shares}, in {count} of {groups} groups of frequencies {what}: I I Q Q was read as I Q I Q, or the other way round"
        );
        Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p(count, share))
    };
    let [fewer, ..] = as_they_are;
    if log_p(fewer, BY_POWER) < ALARM.ln() {
        return wrong(fewer, BY_POWER, "less");
    }
    if log_p(as_exchanged[0], BY_POWER) < ALARM.ln() {
        return Finding::as_stated(CHECK, EXPECTED, shares);
    }
    let [in_step, in_step_exchanged] = [as_they_are, as_exchanged].map(|[_, up, down]| up.max(down));
    if log_p(in_step, BY_PHASES) < ALARM.ln() {
        return wrong(in_step, BY_PHASES, "a phase that images of exchanged words have");
    }
    if log_p(in_step_exchanged, BY_PHASES) < ALARM.ln() {
        return Finding::as_stated(CHECK, EXPECTED, shares);
    }
    Finding::undecided(CHECK, EXPECTED, shares)
}

/// Whether a group holds less in its far half once its words are exchanged, and less than half of its energy.
pub(super) fn looks_exchanged(away: f64, away_after: f64, whole: f64) -> bool {
    away_after < away.min(0.5 * whole)
}

impl Inspector for Words {
    fn see(&mut self, stream: &Stream) {
        stream.loops().for_each(|samples| self.sum.add(samples));
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        // Words of two chirps would share a group otherwise.
        if self.schedule.is_real || !samples.is_multiple_of(2) {
            return None;
        }
        let chirps: Vec<Vec<Complex64>> = self.sum.chirps().map(exchanged).collect();
        let as_read = spectrum(self.sum.chirps(), samples);
        let reordered = spectrum(chirps.iter().map(Vec::as_slice), samples);
        let product = products(self.sum.chirps(), samples);
        let exchanged_product = products(chirps.iter().map(Vec::as_slice), samples);
        // Groups in which the words as read and the exchanged ones look exchanged: by power; by phases, of either sign.
        let (mut groups, mut as_they_are, mut as_exchanged) = (0, [0; 3], [0; 3]);
        let (mut far, mut all, mut far_after) = (0.0, 0.0, 0.0);
        let half = samples / 2;
        for bin in GUARD..(half / 2).saturating_sub(GUARD - 1) {
            let mut halves = [[bin, half - bin], [samples - bin, half + bin]];
            if self.schedule.is_falling {
                halves.reverse();
            }
            let [near, away] = halves;
            let sum = |power: &[f64], bins: [usize; 2]| bins.into_iter().map(|bin| power[bin]).sum::<f64>();
            let (away_before, whole) = (sum(&as_read, away), sum(&as_read, near) + sum(&as_read, away));
            let away_after = sum(&reordered, away);
            groups += 1;
            let by_phases = |product: f64| [product > IMAGE, product < -IMAGE];
            let [up, down] = by_phases(product[bin]);
            let [other_up, other_down] = by_phases(exchanged_product[bin]);
            let of = [looks_exchanged(away_before, away_after, whole), up, down];
            let of_others = [looks_exchanged(away_after, away_before, whole), other_up, other_down];
            (0..3).for_each(|test| as_they_are[test] += usize::from(of[test]));
            (0..3).for_each(|test| as_exchanged[test] += usize::from(of_others[test]));
            (far, all, far_after) = (far + away_before, all + whole, far_after + away_after);
        }
        let shares = format!(
            "the far half of the spectrum holds {:.1} % of the still energy, and {:.1} % with every second pair of words exchanged",
            100.0 * far / f64::max(all, f64::MIN_POSITIVE),
            100.0 * far_after / f64::max(all, f64::MIN_POSITIVE)
        );
        Some(judged(groups, as_they_are, as_exchanged, shares))
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
    const SCHEDULE: Schedule =
        Schedule { tx: 1, rx: RX, loops: LOOPS, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };

    /// Static returns of an amplitude at each bin, of other phases in every channel, through a receiver; words exchanged or not.
    fn seen(amplitude: impl Fn(usize) -> f64, receiver: impl Fn(Complex64) -> Complex64, are_exchanged: bool) -> Finding {
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
            let values: Vec<Complex64> = (0..SAMPLES).map(value).collect();
            let values = if are_exchanged { exchanged(&values) } else { values };
            re.extend(values.iter().map(|value| value.re as f32));
            im.extend(values.iter().map(|value| value.im as f32));
        }
        let mut inspector = Box::new(Words::new(SCHEDULE));
        inspector.see(&Stream::of(SCHEDULE, 0, &IfFrame::new([1, RX, LOOPS, SAMPLES], re, Some(im))));
        inspector.conclude().unwrap()
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
