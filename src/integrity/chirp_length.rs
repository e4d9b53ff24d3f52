//! Chirps of another length than is stated, by a whole factor, or as long as the loops are many: samples and loops exchanged, a description
//! of another capture.
//!
//! Within a chirp each sample is predicted by those before it (linear prediction, J. Makhoul, Proc. IEEE 63, 1975), across the start of
//! a chirp it is not. The squared error of the prediction is exponentially distributed around its mean: that of starts, or that within
//! chirps, for which the largest one within the stated chirp stands. A start inside a stated chirp, and a stated start that is none,
//! are likelihood ratios of these two laws, with one look for each start that differs: a static scene repeats all others.
//! Where chirps are longer than stated, so are loops: the stream then correlates more with itself after several loops than after one, a
//! likelihood ratio as in `loop_length`, which adds to the other one. Where the lengths have no common factor, the mean errors at the
//! starts of either length alone stand against each other. Bonferroni over the lengths.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::period::repeating;
use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "chirp_length";
const EXPECTED: &str = "a chirp of samples_per_chirp";
/// Frames that are looked at: the length is the same in all.
const FRAMES: usize = 4;
/// Samples that predict the next one, at most, and as a share of a chirp.
const ORDER: usize = 8;
const SHARE: usize = 16;
/// What repeats itself after several loops, a fan, correlates as longer loops do: the starts alone must say so at this level.
const ALONE: f64 = 0.05;
/// Largest factor that is tried, either way.
const MOST: usize = 8;

pub(super) struct ChirpLength {
    schedule: Schedule,
    /// Squared error of the prediction by chirp of the frame and by sample, summed over frames: `[chirp, sample]`.
    errors: Vec<f64>,
    /// Squared correlation of the stream with itself after so many loops, summed over frames.
    squares: [f64; MOST + 1],
    /// The same after a loop of chirps as long as the loops are many.
    exchanged: f64,
    frames: usize,
}

impl ChirpLength {
    pub fn new(schedule: Schedule) -> Self {
        Self { schedule, errors: vec![], squares: [0.0; MOST + 1], exchanged: 0.0, frames: 0 }
    }

    fn order(&self) -> usize {
        (self.schedule.samples / SHARE).clamp(2, ORDER)
    }

    fn chirps(&self) -> usize {
        self.schedule.loops * self.schedule.channels()
    }

    /// Mean error by sample, for each chirp modulo `length`; the first chirp of a frame has none before it and is left out.
    fn folded(&self, length: usize) -> Vec<(usize, Vec<f64>)> {
        let chirps: Vec<&[f64]> = self.errors.chunks_exact(self.schedule.samples).collect();
        let of_chirp = |first: usize| {
            let alike: Vec<&&[f64]> = chirps.iter().skip(first).step_by(length).collect();
            let mean = |sample: usize| alike.iter().map(|errors| errors[sample]).sum::<f64>() / alike.len() as f64;
            (first % length, (0..self.schedule.samples).map(mean).collect())
        };
        (1..chirps.len().min(length + 1)).map(of_chirp).collect()
    }

    /// Log-likelihood of starts inside stated chirps against none, where a stated chirp is `factor` chirps; of the errors by channel.
    fn of_shorter(&self, factor: usize, channels: &[(usize, Vec<f64>)]) -> f64 {
        let (samples, order) = (self.schedule.samples, self.order());
        let places: Vec<usize> = (1..factor).map(|part| part * samples / factor).collect();
        let is_near = |sample: usize| places.iter().any(|place| (*place..place + order).contains(&sample));
        let start = channels.iter().map(|(_, errors)| errors[0]).sum::<f64>() / channels.len() as f64;
        let of_channel = |(_, errors): &(usize, Vec<f64>)| {
            let inner = largest((order..samples).filter(|sample| !is_near(*sample)).map(|sample| errors[sample]));
            places.iter().map(|place| log_ratio(errors[*place], start, inner)).sum::<f64>()
        };
        channels.iter().map(of_channel).sum()
    }

    /// Log-likelihood of stated starts that are none, where `factor` stated chirps are a chirp.
    fn of_longer(&self, factor: usize) -> f64 {
        let order = self.order();
        let channels = self.schedule.channels();
        // The least common multiple: each stated chirp of a loop at each of its places within a chirp.
        let length = (1..factor).map(|loops| loops * channels).find(|length| length % factor == 0).unwrap_or(factor * channels);
        let folded = self.folded(length);
        let (starts, others): (Vec<_>, Vec<_>) = folded.iter().partition(|(chirp, _)| chirp % factor == 0);
        let start = starts.iter().map(|(_, errors)| errors[0]).sum::<f64>() / starts.len() as f64;
        let of_chirp = |errors: &Vec<f64>| -log_ratio(errors[0], start, largest(errors[order..].iter().copied()));
        let sum: f64 = others.iter().map(|(_, errors)| of_chirp(errors)).sum();
        // As many looks as channels, at most; those of other loops repeat them.
        let looks = sum * others.len().min(channels) as f64 / others.len() as f64;
        if looks > -ALONE.ln() { looks + self.of_longer_loops(factor) } else { looks.min(0.0) }
    }

    /// Log-likelihood of chirps as long as the loops are many, and of as many loops as chirps are long, against stated ones, of the starts
    /// that only one of them has; each channel of a loop counts once.
    fn of_exchanged(&self) -> f64 {
        let Schedule { samples: stated, loops: length, .. } = self.schedule;
        let order = self.order();
        // What begins or ends with a chirp breaks a few samples beside its start.
        let is_start = |place: usize, chirp: usize| place % chirp < order || place % chirp + order >= chirp;
        let channels = self.schedule.channels();
        let (mut starts, mut own) = (vec![(0.0, 0.0); channels], (0.0, 0.0));
        let mut inner = vec![(0.0, 0.0); length];
        for (place, error) in self.errors.iter().enumerate() {
            let sum = match [length, stated].map(|chirp| is_start(place, chirp)) {
                [true, true] => continue,
                [true, false] => &mut starts[(place + order) / length % channels],
                [false, true] => &mut own,
                [false, false] => &mut inner[place % length],
            };
            *sum = (sum.0 + error, sum.1 + 1.0);
        }
        let mean = |(sum, count): (f64, f64)| f64::max(sum / f64::max(count, 1.0), f64::MIN_POSITIVE);
        // Parts of longer chirps begin anew in some channels: three of four must.
        let mut starts: Vec<f64> = starts.into_iter().map(mean).collect();
        starts.sort_by(f64::total_cmp);
        let (other, own) = (starts[channels / 4], mean(own));
        // Each start against the other, whose mean is that of what goes on.
        let looks = channels as f64 * (other / own + own / other - 2.0);
        if other <= own {
            return -looks;
        }
        if other <= largest(inner.into_iter().map(mean)) {
            return 0.0;
        }
        let repeats = [self.squares[1], self.exchanged].map(|square| square / self.frames as f64);
        if looks > -ALONE.ln() { looks + repeating((stated * self.frames) as f64, repeats) } else { looks.min(0.0) }
    }

    fn of_longer_loops(&self, factor: usize) -> f64 {
        let looks = self.schedule.loops / factor * self.frames;
        repeating(looks as f64, [1, factor].map(|loops| self.squares[loops] / self.frames as f64))
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::MIN_POSITIVE, f64::max)
}

/// Of an exponentially distributed value with one mean against another, where the first is larger; else nothing.
fn log_ratio(value: f64, start: f64, inner: f64) -> f64 {
    let start = start.max(inner);
    value / inner - value / start - (start / inner).ln()
}

/// Weights of the samples before one, nearest first, that predict it best within chirps (least squares).
fn prediction(values: &[Complex64], samples: usize, order: usize) -> Option<Vec<Complex64>> {
    let (mut normal, mut right) = (DMatrix::<Complex64>::zeros(order, order), DVector::<Complex64>::zeros(order));
    for window in values.chunks_exact(samples).flat_map(|chirp| chirp.windows(order + 1)) {
        for row in 0..order {
            let own = window[order - 1 - row].conj();
            right[row] += own * window[order];
            for column in 0..order {
                normal[(row, column)] += own * window[order - 1 - column];
            }
        }
    }
    // Rounding alone: a tone is predicted by fewer samples.
    let floor = 1e-9 * normal.trace().re / order as f64;
    normal += DMatrix::identity(order, order) * Complex64::from(floor);
    normal.lu().solve(&right).map(|weights| weights.iter().copied().collect())
}

/// Squared correlation of values with themselves so many later.
fn correlation(values: &[Complex64], shift: usize) -> f64 {
    let pairs = || values.iter().zip(&values[shift..]);
    let (own, later) = pairs().fold((0.0, 0.0), |(own, later), (a, b)| (own + a.norm_sqr(), later + b.norm_sqr()));
    let both: Complex64 = pairs().map(|(a, b)| a.conj() * b).sum();
    if own * later > 0.0 { (both.norm_sqr() / (own * later)).min(1.0) } else { 0.0 }
}

impl Inspector for ChirpLength {
    fn see(&mut self, stream: &Stream) {
        let (samples, order) = (self.schedule.samples, self.order());
        if self.frames == FRAMES || samples <= 2 * order || self.chirps() < 2 {
            return;
        }
        let values = stream.centred();
        let Some(weights) = prediction(&values, samples, order) else { return };
        self.frames += 1;
        self.errors.resize(values.len(), 0.0);
        for (place, window) in values.windows(order + 1).enumerate() {
            let predicted: Complex64 =
                weights.iter().zip(window[..order].iter().rev()).map(|(weight, value)| weight * value).sum();
            self.errors[place + order] += (window[order] - predicted).norm_sqr();
        }
        for loops in 1..=MOST.min(self.schedule.loops - 1) {
            self.squares[loops] += correlation(&values, loops * self.schedule.period());
        }
        self.exchanged += correlation(&values, self.schedule.loops * self.schedule.channels());
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.frames == 0 {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp is too short, or there is one alone"));
        }
        let Schedule { samples, loops, .. } = self.schedule;
        let is_shorter = |factor: &usize| samples % factor == 0 && samples / factor > 2 * self.order();
        let channels = self.folded(self.schedule.channels());
        let shorter = (2..=MOST).filter(is_shorter).map(|factor| (samples / factor, self.of_shorter(factor, &channels)));
        let longer = (2..=MOST).filter(|factor| 2 * factor <= loops).map(|factor| (samples * factor, self.of_longer(factor)));
        // Whole factors are tried already.
        let is_other = loops > 2 * self.order() && !loops.is_multiple_of(samples) && !samples.is_multiple_of(loops);
        let exchanged = is_other.then(|| (loops, self.of_exchanged()));
        let tried: Vec<(usize, f64)> = shorter.chain(longer).chain(exchanged).collect();
        let Some(&(length, best)) = tried.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Some(Finding::undecided(CHECK, EXPECTED, "a chirp is too short"));
        };
        let log_p = (tried.len() as f64).ln() - best;
        if log_p < ALARM.ln() {
            let found = format!(
                "the signal begins anew every {length} samples, not every {samples}: the number of samples is another capture's, or samples \
                 and loops were exchanged"
            );
            return Some(Finding::wrong(Kind::Misread, CHECK, EXPECTED, found, log_p));
        }
        // No other length is as likely as the stated one, by as much.
        if best + (tried.len() as f64).ln() < ALARM.ln() {
            return Some(Finding::as_stated(CHECK, EXPECTED, format!("the signal begins anew every {samples} samples")));
        }
        Some(Finding::undecided(CHECK, EXPECTED, "the signal does not begin anew clearly enough, or in too few channels"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfFrame;
    use crate::support::numbers;

    const RX: usize = 4;

    /// A static room of tones under noise, other in every receiver, in chirps of `sent` samples, cut into those of `stated`.
    fn seen(sent: usize, stated: usize, noise: f64) -> Finding {
        seen_of(32 * 128, sent, stated, noise)
    }

    /// Of so many samples of each receiver.
    fn seen_of(all: usize, sent: usize, stated: usize, noise: f64) -> Finding {
        let phases = numbers(3, RX * 20, 0.0, std::f64::consts::TAU);
        let drawn = numbers(4, 2 * RX * all, -noise, noise);
        let value = |place: usize| {
            let (rx, sample) = (place / sent % RX, place % sent);
            let tone = |bin: usize| {
                let turns = (bin as f64 + 0.3) * sample as f64 / 128.0;
                Complex64::from_polar(1.0 / (1 + bin) as f64, std::f64::consts::TAU * turns + phases[rx * 20 + bin])
            };
            (0..20).map(tone).sum::<Complex64>() + Complex64::new(drawn[2 * place], drawn[2 * place + 1])
        };
        let loops = all / stated;
        let schedule = Schedule { tx: 1, rx: RX, loops, samples: stated, is_real: false, is_falling: false, farthest_bin: None };
        let (mut re, mut im) = (vec![], vec![]);
        for (rx, index) in (0..RX).flat_map(|rx| (0..loops).map(move |index| (rx, index))) {
            for place in (0..stated).map(|sample| (index * RX + rx) * stated + sample) {
                let value = value(place);
                re.push(value.re as f32);
                im.push(value.im as f32);
            }
        }
        let mut inspector = Box::new(ChirpLength::new(schedule));
        inspector.see(&Stream::of(schedule, 0, &IfFrame::new([1, RX, loops, stated], re, Some(im))));
        inspector.conclude().unwrap()
    }

    #[test]
    fn chirps_of_another_length_are_found_and_the_stated_ones_are_not_accused() {
        let stated = seen(128, 128, 0.05);
        assert!(stated.ok && stated.decided, "{stated:?}");
        for other in [32, 64, 256, 512] {
            let found = seen(128, other, 0.05);
            assert!(found.is_refusal() && found.found.contains("every 128 samples, not"), "{other}: {found:?}");
        }
    }

    #[test]
    fn samples_and_loops_exchanged_are_found_without_a_common_factor() {
        for loops in [48, 72, 81] {
            let found = seen_of(loops * 128, 128, loops, 0.05);
            assert!(found.is_refusal() && found.found.contains(&format!("every 128 samples, not every {loops}")), "{found:?}");
            let stated = seen_of(loops * 128, 128, 128, 0.05);
            assert!(stated.ok && stated.decided, "{loops}: {stated:?}");
        }
    }

    #[test]
    fn parts_of_the_chirps_that_were_sent_are_not_named() {
        for (stated, loops) in [(90, 16), (100, 32), (144, 64)] {
            let found = seen_of(stated * loops, 128, stated, 0.05);
            assert!(found.ok, "{stated} x {loops}: {found:?}");
        }
    }

    #[test]
    fn noise_decides_nothing() {
        for stated in [64, 128, 256] {
            let found = seen(128, stated, 100.0);
            assert!(found.ok && !found.decided, "{found:?}");
        }
    }
}
