//! Chirps that begin elsewhere than is stated: a header before the first sample, samples that were cut off.
//!
//! Between one chirp and the next the signal breaks; within a chirp it goes on. A linear prediction (Burg 1975: forwards and backwards)
//! of the still chirps predicts what goes on, so its error is largest where chirps begin. Within a chirp that is as stated, noise
//! makes the error as large at one sample as at any other, and independently in every channel: that the same few samples come first
//! in several channels has a binomial law, Bonferroni over the samples. Errors across the stated beginning compete, and a
//! break within a few samples of it is taken for a transient. Where receivers lie one after the other and are read as interleaved, each
//! stated chirp holds a part of every receiver's: breaks lie at whole parts of a chirp, one for each receiver.
//!
//! What moves leaves a rest in the mean, the same one in all channels, which may break anywhere. But it breaks elsewhere in other frames,
//! and chirps begin where they do in all: so the same law must hold of even and of odd frames alone, for the place that was found.

use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::tails::log_binomial_tail;
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "chirp_start";
const EXPECTED: &str = "the first sample of a chirp first";
/// Samples from which the next one is predicted: what is left of the weaker returns is small against a break. A break spoils as
/// many predictions, of which any may be the worst.
const ORDER: usize = 4;
/// Share of a chirp at either end in which what begins or ends with it (a filter that settles, a ramp that is over) may break most.
const TRANSIENT: usize = 32;

pub(super) struct Start {
    schedule: Schedule,
    /// Sums of the chirps of even and of odd frames, `[tx, rx, sample]`, none where there was no such frame.
    sums: [Option<Vec<Complex64>>; 2],
}

impl Start {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, sums: [None, None] }
    }

    /// Where each channel of some chirps breaks most.
    fn breaks(&self, sum: &[Complex64]) -> Vec<usize> {
        let samples = self.schedule.samples;
        // The still stream goes on from channel to channel, and after the last one with the first.
        let at = |place: usize| sum[place % sum.len()];
        let first = |channel: usize| {
            let filter = prediction(&sum[channel * samples..][..samples]);
            let error = |place: usize| -> f64 {
                let place = sum.len() + channel * samples + place;
                filter.iter().enumerate().map(|(back, factor)| factor * at(place - back)).sum::<Complex64>().norm_sqr()
            };
            (0..samples).map(|sample| (sample, error(sample))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(sample, _)| sample)
        };
        (0..self.schedule.channels()).map(first).collect()
    }

    /// How many breaks are at a place or shortly after it.
    fn near(&self, breaks: &[usize], place: usize) -> usize {
        let samples = self.schedule.samples;
        breaks.iter().filter(|other| (*other + samples - place) % samples < ORDER).count()
    }

    /// Logarithm of the chance of so many at one place.
    fn log_p(&self, count: usize) -> f64 {
        log_binomial_tail(count, self.schedule.channels(), ORDER as f64 / self.schedule.samples as f64)
    }

    /// Whether even and odd frames break there, too, each alone.
    fn lasts(&self, place: usize) -> bool {
        let breaks_there = |sum: &Vec<Complex64>| self.log_p(self.near(&self.breaks(sum), place)) < ALARM.ln();
        self.sums.iter().flatten().all(breaks_there)
    }

    /// Whether a break shortly after a sample is one of those between the parts of a chirp, one for each receiver.
    fn is_part(&self, place: usize) -> bool {
        let Schedule { rx, samples, .. } = self.schedule;
        (1..rx).any(|part| (part * samples / rx).abs_diff(place) <= ORDER)
    }
}

/// Coefficients that predict a sample from the `ORDER` before it, by Burg's method.
fn prediction(chirp: &[Complex64]) -> Vec<Complex64> {
    let (mut forward, mut backward) = (chirp.to_vec(), chirp.to_vec());
    let mut filter = vec![Complex64::ONE];
    for order in 1..=ORDER {
        let pairs = || (order..chirp.len()).map(|n| (n, n - 1));
        let energy: f64 = pairs().map(|(n, m)| forward[n].norm_sqr() + backward[m].norm_sqr()).sum();
        let common: Complex64 = pairs().map(|(n, m)| forward[n] * backward[m].conj()).sum();
        let reflection = if energy > 0.0 { -2.0 * common / energy } else { Complex64::ZERO };
        let mirrored: Vec<Complex64> = filter.iter().rev().map(|value| value.conj()).collect();
        filter.push(Complex64::ZERO);
        filter.iter_mut().skip(1).zip(mirrored).for_each(|(value, mirror)| *value += reflection * mirror);
        for n in (order..chirp.len()).rev() {
            let (f, b) = (forward[n], backward[n - 1]);
            forward[n] = f + reflection * b;
            backward[n] = b + reflection.conj() * f;
        }
    }
    filter
}

impl Inspector for Start {
    fn see(&mut self, stream: &Stream) {
        let sum = self.sums[stream.frame % 2].get_or_insert_with(|| vec![Complex64::ZERO; self.schedule.period()]);
        for samples in stream.loops() {
            sum.iter_mut().zip(samples).for_each(|(sum, v)| *sum += Complex64::new(v.re.into(), v.im.into()));
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        let samples = self.schedule.samples;
        if samples < 4 * ORDER {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp is too short"));
        }
        let parts: Vec<&Vec<Complex64>> = self.sums.iter().flatten().collect();
        let sum: Vec<Complex64> = (0..self.schedule.period()).map(|place| parts.iter().map(|part| part[place]).sum()).collect();
        let breaks = self.breaks(&sum);
        let near = |place: usize| self.near(&breaks, place);
        // The stated beginning first: `max_by_key` takes the last of equals.
        let place = (0..samples).rev().max_by_key(|place| near(*place))?;
        let count = near(place);
        let log_p = (samples as f64).ln() + self.log_p(count);
        let found =
            format!("the signal breaks most at sample {place} or shortly after it in {count} of {} channels", breaks.len());
        if log_p >= ALARM.ln() {
            return Some(Finding::undecided(CHECK, EXPECTED, found));
        }
        let beside = (samples / TRANSIENT).max(2 * ORDER);
        if place < beside || place + beside >= samples {
            return Some(Finding::as_stated(CHECK, EXPECTED, found));
        }
        if !self.lasts(place) {
            return Some(Finding::undecided(CHECK, EXPECTED, format!("{found}, but not in even and in odd frames alone")));
        }
        let causes = if self.is_part(place) {
            "the receivers' samples lie one after the other and are not interleaved as stated, or a header lies before the first sample, or \
             samples were cut off"
        } else {
            "a header lies before the first sample, or samples were cut off"
        };
        let found = format!("{found}: chirps begin there; {causes}");
        Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    /// Chirps of 6 channels with five returns each, turned by so many samples of the stream.
    fn seen(turn: usize, noise: f64) -> Finding {
        let (channels, samples, loops) = (6, 64, 4);
        let schedule =
            Schedule { tx: channels / 2, rx: 2, loops, samples, is_real: false, is_falling: false, farthest_bin: None };
        let (phases, drawn) =
            (numbers(6, 5 * channels, 0.0, std::f64::consts::TAU), numbers(7, 2 * channels * samples * loops, -1.0, 1.0));
        let of_stream = |place: usize| -> Complex64 {
            let (channel, sample) = (place / samples % channels, place % samples);
            (0..5).map(|i| Complex64::from_polar(10.0, 0.17 * (i + 1) as f64 * sample as f64 + phases[5 * channel + i])).sum()
        };
        let mut values = vec![];
        for channel in 0..channels {
            for place in
                (0..loops).flat_map(|index| (0..samples).map(move |sample| (index * channels + channel) * samples + sample))
            {
                values.push(of_stream(place + turn) + noise * Complex64::new(drawn[2 * place], drawn[2 * place + 1]));
            }
        }
        let (re, im) = values.iter().map(|value| (value.re as f32, value.im as f32)).unzip();
        let mut inspector = Box::new(Start::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([channels / 2, 2, loops, samples], re, Some(im))));
        inspector.conclude().unwrap()
    }

    /// The rest of what moves: the same break in all channels, at another sample in every frame, and most of it in one.
    #[test]
    fn what_breaks_in_some_frames_alone_is_no_beginning() {
        let schedule = Schedule { tx: 1, rx: 4, loops: 2, samples: 64, is_real: true, is_falling: false, farthest_bin: None };
        let judged = |is_everywhere: bool| {
            let mut inspector = Box::new(Start::new(schedule));
            for frame in 0..4 {
                let drawn = numbers(11 + frame as u64, 4 * 2 * 64, -0.01, 0.01);
                let at = if is_everywhere { 38 } else { [38, 21, 45, 28][frame] };
                let strength = if frame == 0 { 9.0 } else { 3.0 };
                let value = |place: usize| drawn[place] + if place % 64 == at { strength } else { 0.0 };
                let re = (0..4 * 2 * 64).map(|place| value(place) as f32).collect();
                inspector.see(&Stream::of(schedule, frame, &IfFrame::new([1, 4, 2, 64], re, None)));
            }
            inspector.conclude().unwrap()
        };
        let moving = judged(false);
        assert!(moving.ok && !moving.decided && moving.found.contains("even and in odd frames"), "{moving:?}");
        assert!(judged(true).is_refusal(), "{:?}", judged(true));
    }

    #[test]
    fn a_break_between_parts_of_a_chirp_may_be_one_between_receivers() {
        let elsewhere = seen(44, 0.5);
        assert!(elsewhere.is_refusal() && !elsewhere.found.contains("receivers"), "{elsewhere:?}");
        let half = seen(32, 0.5);
        assert!(half.is_refusal() && half.found.contains("receivers' samples lie one after the other"), "{half:?}");
    }

    #[test]
    fn a_header_moves_the_break_and_noise_hides_it() {
        let stated = seen(0, 0.5);
        assert!(stated.ok && stated.decided, "{stated:?}");
        // 44 samples of a chirp were cut off: the next one begins 20 samples after the stated beginning.
        let moved = seen(44, 0.5);
        assert!(moved.is_refusal() && (17..=20).any(|place| moved.found.contains(&format!("at sample {place} "))), "{moved:?}");
        let hidden = seen(44, 1000.0);
        assert!(hidden.ok && !hidden.decided, "{hidden:?}");
    }
}
