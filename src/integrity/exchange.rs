//! What an exchange of words or samples does to the halves of the band, of which the near one holds the stronger returns.
//!
//! An exchange turns a tone into several, in both halves: those frequencies are a group. Of what was right it leaves in the far half of a
//! group a sum |a + b e^jφ|², a of the far half and b of the near one, whose phase φ is any: its logarithm is that of the larger one of
//! a² and b² in the mean (Jensen's formula), at least that of half of what was there or of half of the group's energy. If it leaves less,
//! what was read had been exchanged: a Student test of these logarithms over the groups of the still chirps' mean spectrum.
//!
//! One return is in the main lobe of the window and in its side lobes. So only groups count in which something stands out of the noise
//! and of the side lobes of stronger returns (`side_lobes.rs`), and one or two returns decide nothing. Nothing need be near, as in an open
//! scene: but of a tone in one half alone the exchange makes images, and of one that was exchanged it takes them away. So what was read
//! had been exchanged only if the weaker halves of the groups lose energy by the exchange, and had not been only if they gain.

use std::ops::Range;

use num_complex::Complex64;

use super::side_lobes::standing_out;
use super::still::{Still, spectrum};
use super::tails::{log_binomial_tail, student_tail};

/// Bins beside 0 and a quarter of the sampling rate where the window makes the tones of a group one.
const GUARD: usize = 3;
/// A group counts above this many times the noise: of noise alone, e⁻²⁰ in one channel.
const RETURN: f64 = 20.0;
/// Two returns stand out in three bins of a Hann window each: fewer groups than these and one more decide nothing.
const FEWEST: usize = 2 * 3 + 1;

/// Of each group of frequencies, one bin: the others lie as far from the ends of the halves.
pub(super) fn bins(samples: usize) -> Range<usize> {
    GUARD..(samples / 4).saturating_sub(GUARD - 1)
}

/// The far halves of the groups that stand out, before and after the exchange.
pub(super) struct Halves {
    /// Of each group that was given, whether it stands out of the noise and of the side lobes of stronger returns.
    pub stand_out: Vec<bool>,
    /// In how many of these the exchange leaves less than was there.
    pub less: usize,
    /// Of each of these, by how much the exchange leaves less than was right before, and more than is right after it: logarithms.
    losses: Vec<f64>,
    gains: Vec<f64>,
    /// Shares of the energy in the far half, of all groups, before and after.
    shares: [f64; 2],
    /// Energy in the weaker half of each group, before and after.
    weaker: [f64; 2],
}

impl Halves {
    /// `groups`: bins of the near half and of the far one. `is_mirrored`: whether a group holds the frequencies of either sign.
    pub fn of<const K: usize>(
        still: &Still,
        exchanged: &[Vec<Complex64>],
        samples: usize,
        is_mirrored: bool,
        groups: impl Iterator<Item = [[usize; K]; 2]>,
    ) -> Self {
        let before = spectrum(still.sum.chirps(), samples);
        let after = spectrum(exchanged.iter().map(Vec::as_slice), samples);
        let least = if still.shows_noise() { RETURN * still.noise_of_bin() } else { 0.0 };
        let stands_out = standing_out(&before, is_mirrored);
        let (losses, gains, shares, weaker) = (vec![], vec![], [0.0; 2], [0.0; 2]);
        let mut halves = Self { stand_out: vec![], less: 0, losses, gains, shares, weaker };
        let mut all = 0.0;
        for [near, away] in groups {
            let sum = |power: &[f64], bins: [usize; K]| bins.into_iter().map(|bin| power[bin]).sum::<f64>();
            let [far, far_after] = [&before, &after].map(|power| sum(power, away));
            let [close, close_after] = [&before, &after].map(|power| sum(power, near));
            halves.shares = [halves.shares[0] + far, halves.shares[1] + far_after];
            all += far + close;
            let counts = near.iter().chain(&away).any(|&bin| stands_out[bin] && before[bin] >= least);
            halves.stand_out.push(counts);
            if counts {
                // What is right leaves at least half of this, in the mean of the logarithms.
                let half = 0.5 * (far + close);
                let loss =
                    |before: f64, after: f64| (0.5 * before.min(half).max(f64::MIN_POSITIVE) / after.max(f64::MIN_POSITIVE)).ln();
                halves.losses.push(loss(far, far_after));
                halves.gains.push(loss(far_after, far));
                halves.less += usize::from(far_after < far.min(half));
                halves.weaker = [halves.weaker[0] + far.min(close), halves.weaker[1] + far_after.min(close_after)];
            }
        }
        halves.shares = halves.shares.map(|energy| energy / f64::max(all, f64::MIN_POSITIVE));
        halves
    }

    /// How many groups stand out.
    pub fn groups(&self) -> usize {
        self.losses.len()
    }

    /// Logarithm of the chance of so many groups of one kind where either kind is as likely.
    pub fn log_p_of(&self, count: usize) -> f64 {
        log_binomial_tail(count, self.groups(), 0.5)
    }

    /// Logarithm of the chance that what was read looks exchanged so much where it was not.
    pub fn log_p_as_they_are(&self) -> f64 {
        log_p(&self.losses, self.weaker[1] < self.weaker[0])
    }

    /// The same of the exchanged.
    pub fn log_p_as_exchanged(&self) -> f64 {
        log_p(&self.gains, self.weaker[0] < self.weaker[1])
    }

    /// `what` was exchanged.
    pub fn text(&self, what: &str) -> String {
        let [far, far_after] = self.shares.map(|share| 100.0 * share);
        format!("the far half of the spectrum holds {far:.1} % of the static energy, and {far_after:.1} % with {what} exchanged")
    }
}

/// Of logarithms that are at most zero in the mean; `has_images`: whether what looks exchanged has the images of what is.
fn log_p(logarithms: &[f64], has_images: bool) -> f64 {
    if has_images && logarithms.len() >= FEWEST { student_tail(logarithms).ln() } else { 0.0 }
}

/// A frame for tests of what exchanges.
#[cfg(test)]
pub(super) mod scene {
    use num_complex::Complex64;

    use crate::data::IfFrame;
    use crate::integrity::stream::{Schedule, Stream};
    use crate::integrity::{Finding, Inspector};
    use crate::support::numbers;

    const RX: usize = 4;
    const LOOPS: usize = 4;
    pub const SAMPLES: usize = 128;
    pub const SCHEDULE: Schedule =
        Schedule { tx: 1, rx: RX, loops: LOOPS, samples: SAMPLES, is_real: false, is_falling: false, farthest_bin: None };

    /// What is found in one frame.
    pub fn judged(mut inspector: Box<dyn Inspector>, frame: &Stream) -> Finding {
        inspector.see(frame);
        inspector.conclude().unwrap()
    }

    /// A chirp and tones of a frequency in bins and of an amplitude, through a receiver.
    pub fn with_tones(chirp: &[Complex64], tones: &[[f64; 2]], receiver: impl Fn(Complex64) -> Complex64) -> Vec<Complex64> {
        let turn = std::f64::consts::TAU / SAMPLES as f64;
        let tone = |sample: usize, [bin, amplitude]: [f64; 2]| Complex64::from_polar(amplitude, turn * bin * sample as f64);
        let value = |sample: usize| receiver(tones.iter().map(|own| tone(sample, *own)).sum());
        chirp.iter().enumerate().map(|(sample, own)| own + value(sample)).collect()
    }

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
