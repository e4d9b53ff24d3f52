//! Words in the wrong order: I I Q Q read as I Q I Q, or the other way round (each undoes the other).
//!
//! Read in the wrong order, a tone of ω rad a sample becomes four, at ±ω and ±(π − ω), and the share cos²ω / 2 of its energy leaves its
//! half of the spectrum. So in a group of these four, of which N lies in the far half and E in all, the far half holds at least
//! min(N, E / 2) after exchanging words that were right, but for what tones of one group have in common; that has either sign alike. If
//! it holds less in nearly all groups, the words were wrong: a sign test over the groups of the still chirps' mean spectrum. Where
//! still returns fill both halves alike, nothing can be told.

use num_complex::Complex64;
use rustfft::FftPlanner;

use super::stream::{Schedule, Stream};
use super::tails::log_binomial_tail;
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_word_order";
const EXPECTED: &str = "I and Q of one sample side by side";
/// Bins beside 0 and a quarter of the sampling rate where the window makes the tones of a group one.
const GUARD: usize = 3;

pub(super) struct Words {
    schedule: Schedule,
    /// Sum of all chirps, `[tx, rx, sample]`.
    sum: Vec<Complex64>,
    chirps: f64,
}

impl Words {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, sum: vec![Complex64::ZERO; schedule.period()], chirps: 0.0 }
    }
}

/// The middle two of every four words exchanged.
fn exchanged(chirp: &[Complex64]) -> Vec<Complex64> {
    let (pairs, rest) = chirp.as_chunks::<2>();
    let swapped = pairs.iter().flat_map(|[a, b]| [Complex64::new(a.re, b.re), Complex64::new(a.im, b.im)]);
    swapped.chain(rest.iter().copied()).collect()
}

/// Hann's.
fn window(n: usize, samples: usize) -> f64 {
    (std::f64::consts::PI * (n as f64 + 0.5) / samples as f64).sin().powi(2)
}

/// Power of a bin of `spectrum` where every sample has a noise of unit power.
pub(super) fn window_power(samples: usize) -> f64 {
    (0..samples).map(|n| window(n, samples).powi(2)).sum()
}

/// Power over all channels by frequency, under a Hann window, without the mean.
pub(super) fn spectrum<'a>(chirps: impl Iterator<Item = &'a [Complex64]>, samples: usize) -> Vec<f64> {
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let mut power = vec![0.0; samples];
    for chirp in chirps {
        let mean = chirp.iter().sum::<Complex64>() / samples as f64;
        let mut values: Vec<Complex64> = chirp.iter().enumerate().map(|(n, value)| (value - mean) * window(n, samples)).collect();
        fft.process(&mut values);
        power.iter_mut().zip(values).for_each(|(power, value)| *power += value.norm_sqr());
    }
    power
}

impl Inspector for Words {
    fn see(&mut self, stream: &Stream) {
        for samples in stream.loops() {
            self.chirps += 1.0;
            self.sum.iter_mut().zip(samples).for_each(|(sum, v)| *sum += Complex64::new(v.re.into(), v.im.into()));
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        // Words of two chirps would share a group otherwise.
        if self.schedule.is_real || !samples.is_multiple_of(2) {
            return None;
        }
        let chirps: Vec<Vec<Complex64>> = self.sum.chunks_exact(samples).map(exchanged).collect();
        let as_read = spectrum(self.sum.chunks_exact(samples), samples);
        let reordered = spectrum(chirps.iter().map(Vec::as_slice), samples);
        let (mut groups, mut fewer) = (0, 0);
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
            fewer += usize::from(away_after < away_before.min(0.5 * whole));
            (far, all, far_after) = (far + away_before, all + whole, far_after + away_after);
        }
        let log_p = log_binomial_tail(fewer, groups, 0.5);
        let shares = format!(
            "the far half of the spectrum holds {:.1} % of the still energy, and {:.1} % with every second pair of words exchanged",
            100.0 * far / f64::max(all, f64::MIN_POSITIVE),
            100.0 * far_after / f64::max(all, f64::MIN_POSITIVE)
        );
        if log_p >= ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, shares));
        }
        let found = format!(
            "{shares}, in {fewer} of {groups} groups of frequencies less: I I Q Q was read as I Q I Q, or the other way round"
        );
        Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
    }
}
