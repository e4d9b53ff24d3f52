//! One receiver or transmitter whose gain changes from frame to frame while the others stay.
//!
//! The complex gain of the static returns, relative to that of the other channels, is estimated in every frame and in
//! groups of ranges without movers; and so is the gain of what a receiver observes of the body against what the others do. A gain
//! is the same at all ranges: each of two halves of all observations must show what the other one shows.

use std::iter::repeat;

use num_complex::Complex64;

use super::field::{INFORMATIVE_GAIN, most_have};
use super::frame_clutter::FrameClutter;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::folds;
use crate::diagnosis::detectors::geometry;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Curve, NINETY, Place, Volume};
use crate::diagnosis::statistics::{self, DECIBEL};
use crate::effects::Stage;

/// Fewest receivers or transmitters of which one can be identified as odd.
const FEWEST: usize = 3;
/// Fewest training frames from which a change is estimable.
const FEWEST_FRAMES: usize = 5;
/// Fewest degrees of freedom of what groups scatter.
const LEAST_FREEDOM: f64 = 8.0;
/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Correlation that the two halves of the ranges must have.
const SAME: f64 = 0.8;
/// Variance of a group's gain over that of independent bins: the window's noise bandwidth.
const NEIGHBOURS: f64 = 2.0;

/// Gains of one receiver or transmitter relative to the others.
struct Relative {
    members: Vec<usize>,
    /// `[frame, group]` with inverse variances; zero where nothing can be said.
    value: Vec<Complex64>,
    weight: Vec<f64>,
    groups: usize,
    /// Degrees of freedom of the groups' scatter, by which they are weighed, and that scatter over the noise.
    freedom: f64,
    excess: f64,
}

/// One gain per frame, from some groups.
struct Series {
    /// `[frame]`, about their mean.
    value: Vec<Complex64>,
    /// Inverse variance, by what the groups scatter.
    weight: Vec<f64>,
    /// Degrees of freedom of that scatter.
    freedom: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    Receiver(usize),
    Transmitter(usize),
}

/// At most one candidate: the receiver or transmitter that gains most. None with too few of both.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [_, transmitters, receivers, ..] = evidence.cube.dims;
    let mut units = vec![];
    if receivers >= FEWEST {
        units.extend((0..receivers).map(Axis::Receiver));
    }
    if transmitters >= FEWEST {
        units.extend((0..transmitters).map(Axis::Transmitter));
    }
    if units.is_empty() {
        return vec![];
    }
    let Some(clutter) = FrameClutter::new(evidence) else { return vec![] };
    let tried = units.len() as f64;
    // They concern receivers only.
    let of_body = if receivers >= FEWEST { geometry::gains(evidence) } else { None };
    let best = units
        .iter()
        .filter_map(|&unit| judged(evidence, &clutter, of_body.as_deref(), unit))
        .filter(|judged| judged.p_value < 0.01)
        .max_by(|a, b| a.nats.total_cmp(&b.nats));
    best.map(|judged| judged.candidate(evidence, tried)).into_iter().collect()
}

struct Judged {
    unit: Axis,
    members: Vec<usize>,
    series: Series,
    p_value: f64,
    /// Log-likelihood that held-out frames gain.
    nats: f64,
    /// Of the gains.
    variance: f64,
}

/// `of_body`: gains of what is observed of the body, `[rx][frame][group]`, with inverse variances.
fn judged(evidence: &Evidence, clutter: &FrameClutter, of_body: Option<&[Vec<Vec<[f64; 2]>>]>, unit: Axis) -> Option<Judged> {
    let training = &evidence.split.training;
    let mut relative = Relative::new(clutter, evidence.cube.dims[2], unit, training);
    if let (Axis::Receiver(rx), Some(of_body)) = (unit, of_body) {
        relative.add_body(&of_body[rx], training);
    }
    let all = relative.series(training, |_| true)?;
    // The nearer and the farther half of what the groups know.
    let known = |g: usize| training.iter().map(|&f| relative.weight[f * relative.groups + g]).sum::<f64>();
    let total: f64 = (0..relative.groups).map(known).sum();
    let mut sum = 0.0;
    let near: Vec<bool> = (0..relative.groups)
        .map(|g| {
            sum += known(g);
            sum - 0.5 * known(g) < 0.5 * total
        })
        .collect();
    let halves = [relative.series(training, |g| near[g])?, relative.series(training, |g| !near[g])?];
    if correlation(&halves, training) < SAME || !relative.is_of_most(training) {
        return None;
    }
    // What but one half has, such as slow parts of the body, the other one has by chance.
    let patterns = halves.each_ref().map(|half| half.likely(training));
    let p_value = chance(&halves[0], &patterns[1], training).max(chance(&halves[1], &patterns[0], training));
    // Gains drawn from one law in every frame. Few held-out frames may all have the same one: every frame is predicted by those of
    // the other folds.
    let seen = |frames: &[usize]| frames.iter().copied().filter(|&f| all.weight[f] > 0.0).collect::<Vec<usize>>();
    let nats = folds(evidence.cube.dims[0])
        .map(|[rest, fold]| Law::of(&all, &seen(&rest)).log_likelihood_gain(&all, &seen(&fold)))
        .sum();
    let variance = Law::of(&all, &seen(training)).variance;
    Some(Judged { unit, members: relative.members, series: all, p_value, nats, variance })
}

/// Of gains: where they are, and how much they vary.
struct Law {
    mean: Complex64,
    variance: f64,
}

impl Law {
    fn of(series: &Series, frames: &[usize]) -> Self {
        let count = frames.len().max(1) as f64;
        let mean = frames.iter().map(|&f| series.value[f]).sum::<Complex64>() / count;
        let square = frames.iter().map(|&f| (series.value[f] - mean).norm_sqr() - 1.0 / series.weight[f]).sum::<f64>() / count;
        Self { mean, variance: square.max(0.0) }
    }

    /// Log-likelihood that frames gain over gains that stay as they are.
    fn log_likelihood_gain(&self, series: &Series, frames: &[usize]) -> f64 {
        let of_frame = |&f: &usize| {
            let ratio = 1.0 + self.variance * series.weight[f];
            (series.value[f] - self.mean).norm_sqr() * series.weight[f] * (1.0 - 1.0 / ratio) - ratio.ln()
        };
        frames.iter().map(of_frame).sum()
    }
}

impl Series {
    /// What the gains most probably are, given their noise and the variance that they show: a frame that is hardly known says little of
    /// the pattern.
    fn likely(&self, frames: &[usize]) -> Vec<Complex64> {
        let known = || frames.iter().copied().filter(|&f| self.weight[f] > 0.0);
        let sum = |of: &dyn Fn(usize) -> f64| known().map(of).sum::<f64>();
        let (square, total) = (sum(&|f| self.weight[f] * self.value[f].norm_sqr()), sum(&|f| self.weight[f]));
        let variance = ((square - known().count() as f64) / total.max(f64::MIN_POSITIVE)).max(0.0);
        let shrunk = |(value, weight): (&Complex64, &f64)| value * statistics::kept(variance * weight);
        self.value.iter().zip(&self.weight).map(shrunk).collect()
    }
}

/// That one half has so much of the other's pattern: one number, whose error is what its own groups scatter.
fn chance(half: &Series, pattern: &[Complex64], frames: &[usize]) -> f64 {
    let [alike, square] = frames.iter().fold([0.0; 2], |[alike, square], &f| {
        let (own, wanted) = (half.value[f], pattern[f]);
        [alike + half.weight[f] * (own * wanted.conj()).re, square + half.weight[f] * wanted.norm_sqr()]
    });
    if square > 0.0 { statistics::student_tail(alike / (0.5 * square).sqrt(), half.freedom) } else { 1.0 }
}

/// Of two halves' gains over some frames, without what the noise adds to each: about one where both change alike.
fn correlation(halves: &[Series; 2], frames: &[usize]) -> f64 {
    let sums = frames.iter().filter(|&&f| halves.iter().all(|h| h.weight[f] > 0.0)).fold([0.0; 3], |sums, &f| {
        let ([a, b], noise) = ([halves[0].value[f], halves[1].value[f]], [0, 1].map(|half| 1.0 / halves[half].weight[f]));
        // As sure as the less sure half is of that frame.
        let weight = 1.0 / (noise[0] + noise[1]);
        let found = [(a * b.conj()).re, a.norm_sqr() - noise[0], b.norm_sqr() - noise[1]];
        std::array::from_fn(|i| sums[i] + weight * found[i])
    });
    if sums[1].min(sums[2]) > 0.0 { sums[0] / (sums[1] * sums[2]).sqrt() } else { 0.0 }
}

impl Relative {
    fn new(clutter: &FrameClutter, receivers: usize, unit: Axis, training: &[usize]) -> Self {
        let belongs = |channel: usize| match unit {
            Axis::Receiver(rx) => channel % receivers == rx,
            Axis::Transmitter(tx) => channel / receivers == tx,
        };
        let (members, others): (Vec<usize>, Vec<usize>) = (0..clutter.channels).partition(|&c| belongs(c));
        let width = (clutter.bins / 16).max(4 + GAP);
        let groups = clutter.bins / width;
        let power = |bin: usize| (0..clutter.channels).map(|c| clutter.mean[c * clutter.bins + bin].norm_sqr()).sum::<f64>();
        // What is lost in the noise teaches nothing, nor does what was changed.
        let is_strong = |bin: usize| power(bin) > 3.0 * clutter.channels as f64 && !clutter.touched[bin];
        let strong: Vec<bool> = (0..clutter.bins).map(is_strong).collect();
        let (mut value, mut weight) = (vec![], vec![]);
        for frame in 0..clutter.frames {
            for group in 0..groups {
                let bins: Vec<usize> =
                    (group * width..(group + 1) * width - GAP).filter(|&bin| strong[bin] && clutter.quiet(frame, bin)).collect();
                let gain = |channels: &[usize]| {
                    let (mut dot, mut own) = (Complex64::ZERO, 0.0);
                    for &channel in channels {
                        for &bin in &bins {
                            let mean = clutter.mean[channel * clutter.bins + bin];
                            dot += mean.conj() * clutter.deviation(frame, channel, bin);
                            own += mean.norm_sqr();
                        }
                    }
                    (dot / own.max(f64::MIN_POSITIVE), own)
                };
                let ((mine, my_own), (theirs, their_own)) = (gain(&members), gain(&others));
                let known = my_own > 0.0 && their_own > 0.0;
                value.push(if known { mine - theirs } else { Complex64::ZERO });
                weight.push(if known { 1.0 / (NEIGHBOURS * (1.0 / my_own + 1.0 / their_own)) } else { 0.0 });
            }
        }
        Self { members, value, weight, groups, freedom: 0.0, excess: 1.0 }.weighed(training)
    }

    /// Adds groups of what is observed of the body, `[frame][group]`: logarithmic gains, which may all be off by the same, with
    /// their inverse variances.
    fn add_body(&mut self, of_body: &[Vec<[f64; 2]>], training: &[usize]) {
        let groups = of_body.iter().map(Vec::len).max().unwrap_or(0);
        let of_frame = |gains: &Vec<[f64; 2]>| gains.iter().copied().chain(repeat([0.0; 2])).take(groups).collect::<Vec<_>>();
        let (value, weight) = of_body.iter().flat_map(of_frame).map(|[gain, weight]| (Complex64::from(gain), weight)).unzip();
        let body = Self { members: vec![], value, weight, groups, freedom: 0.0, excess: 1.0 }.weighed(training);
        // Real numbers have half of the freedom of complex ones, and their whole variance in half of it.
        let freedom = 0.5 * body.freedom;
        if freedom < FEWEST_FRAMES as f64 {
            return;
        }
        let cells = || training.iter().flat_map(|frame| frame * groups..(frame + 1) * groups);
        let all: f64 = cells().map(|i| body.weight[i]).sum();
        let middle = cells().map(|i| body.value[i] * body.weight[i]).sum::<Complex64>() / all.max(f64::MIN_POSITIVE);
        let (mut value, mut weight) = (vec![], vec![]);
        for frame in 0..of_body.len() {
            let (clutter, moving) = (frame * self.groups..(frame + 1) * self.groups, frame * groups..(frame + 1) * groups);
            value.extend_from_slice(&self.value[clutter.clone()]);
            value.extend(body.value[moving.clone()].iter().map(|gain| gain - middle));
            weight.extend_from_slice(&self.weight[clutter]);
            weight.extend(body.weight[moving].iter().map(|weight| 0.5 * weight));
        }
        (self.value, self.weight, self.groups) = (value, weight, self.groups + groups);
        self.freedom += freedom;
    }

    /// Whether most of the groups that would show the gains of the others have them: two strong things that move alike are no receiver.
    fn is_of_most(&self, training: &[usize]) -> bool {
        let gains = (0..self.groups).filter_map(|group| {
            let pattern = self.series(training, |other| other != group)?.likely(training);
            let [gain, most] = training.iter().fold([0.0; 2], |[gain, most], &frame| {
                let (value, weight) = (self.value[frame * self.groups + group], self.weight[frame * self.groups + group]);
                let along = 2.0 * (value * pattern[frame].conj()).re - pattern[frame].norm_sqr();
                [gain + weight * along, most + weight * pattern[frame].norm_sqr()]
            });
            (most * self.excess > INFORMATIVE_GAIN).then_some([gain, most])
        });
        most_have(&gains.collect::<Vec<_>>(), 0.5)
    }

    /// None where too few frames or groups are known.
    fn series(&self, training: &[usize], wanted: impl Fn(usize) -> bool) -> Option<Series> {
        if self.freedom < LEAST_FREEDOM {
            return None;
        }
        let cells = |frame: usize| {
            (0..self.groups).filter(|&g| wanted(g)).map(move |g| frame * self.groups + g).filter(|&i| self.weight[i] > 0.0)
        };
        let frames = self.value.len() / self.groups;
        let weight: Vec<f64> = (0..frames).map(|f| cells(f).map(|i| self.weight[i]).sum()).collect();
        let mut value: Vec<Complex64> = (0..frames)
            .map(|f| cells(f).map(|i| self.value[i] * self.weight[i]).sum::<Complex64>() / weight[f].max(f64::MIN_POSITIVE))
            .collect();
        let total: f64 = training.iter().map(|&f| weight[f]).sum();
        let mean = training.iter().map(|&f| value[f] * weight[f]).sum::<Complex64>() / total.max(f64::MIN_POSITIVE);
        if training.iter().filter(|&&f| weight[f] > 0.0).count() < FEWEST_FRAMES {
            return None;
        }
        value.iter_mut().for_each(|v| *v -= mean);
        Some(Series { value, weight, freedom: self.freedom })
    }

    /// Ranges that scatter about their frame's mean by more than the noise (the body's slow parts) make everything less sure.
    fn weighed(mut self, training: &[usize]) -> Self {
        let (mut within, mut freedom) = (0.0, 0.0);
        for &frame in training {
            let cells = || (frame * self.groups..(frame + 1) * self.groups).filter(|&i| self.weight[i] > 0.0);
            let weight: f64 = cells().map(|i| self.weight[i]).sum();
            let mean = cells().map(|i| self.value[i] * self.weight[i]).sum::<Complex64>() / weight.max(f64::MIN_POSITIVE);
            within += cells().map(|i| self.weight[i] * (self.value[i] - mean).norm_sqr()).sum::<f64>();
            freedom += (cells().count() as f64 - 1.0).max(0.0);
        }
        let excess = (within / f64::max(freedom, 1.0)).max(1.0);
        self.weight.iter_mut().for_each(|weight| *weight /= excess);
        (self.freedom, self.excess) = (2.0 * freedom, excess);
        self
    }
}

impl Axis {
    /// What it is and what the others are called, and its number.
    fn words(self) -> (&'static str, usize, &'static str) {
        match self {
            Self::Receiver(rx) => ("receiver", rx, "receivers"),
            Self::Transmitter(tx) => ("transmitter", tx, "transmitters"),
        }
    }
}

impl Judged {
    fn candidate(&self, evidence: &Evidence, tried: f64) -> Candidate {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let known = self.known();
        let decibel: Vec<f64> = known.iter().map(|&f| DECIBEL * (1.0 + self.series.value[f]).norm().max(1e-3).ln()).collect();
        let (what, index, others) = self.unit.words();
        let own: f64 =
            self.members.iter().flat_map(|&c| &evidence.clutter()[c * samples..][..samples]).map(|v| v.norm_sqr()).sum();
        let square: f64 = known.iter().map(|&f| self.series.value[f].norm_sqr()).sum();
        let place = Place {
            rx: matches!(self.unit, Axis::Receiver(_)).then(|| vec![index]),
            tx: matches!(self.unit, Axis::Transmitter(_)).then(|| vec![index]),
            ..Place::at(Stage::Receiver)
        };
        let p_value = statistics::corrected(self.p_value, tried).max(f64::MIN_POSITIVE);
        Candidate {
            statement: self.statement(&decibel),
            curve: Some(Curve::new(
                format!("Static returns in {what} {index} relative to the other {others}"),
                ["time, s", "gain, dB"],
                [("measured", known.iter().map(|&f| evidence.starts_s[f]).collect(), decibel)],
            )),
            energy: own * square * loops as f64,
            correction: self.correction(evidence),
            ..Candidate::new(Behaviour::SlowTimeGainOfOneChannel, place, p_value, self.nats)
        }
    }

    /// Frames in which its gain is.
    fn known(&self) -> Vec<usize> {
        (0..self.series.value.len()).filter(|&f| self.series.weight[f] > 0.0).collect()
    }

    fn statement(&self, decibel: &[f64]) -> String {
        let known = self.known();
        let degrees: Vec<f64> = known.iter().map(|&f| (1.0 + self.series.value[f]).arg().to_degrees()).collect();
        let span = |values: &[f64]| {
            let [low, high] = statistics::bounds(values.iter().copied());
            high - low
        };
        let error = known.iter().map(|&f| (0.5 / self.series.weight[f]).sqrt()).sum::<f64>() / known.len().max(1) as f64;
        let turn = span(&degrees);
        let phase = if turn > 6.0 * error.to_degrees() { format!(", and its phase by {turn:.1}°") } else { String::new() };
        let (what, index, others) = self.unit.words();
        format!(
            "The gain of {what} {index} changes from frame to frame, over {:.2} ± {:.2} dB{phase}, at all ranges alike, while \
             the other {others} stay.",
            span(decibel),
            NINETY * DECIBEL * error * std::f64::consts::SQRT_2
        )
    }

    /// Divides by the gains, but where next to nothing is left.
    fn correction(&self, evidence: &Evidence) -> Correction {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let of_frame = |f: usize| (self.series.weight[f] > 0.0).then(|| Complex64::ONE + self.series.value[f]);
        let gains: Vec<Option<Complex64>> =
            (0..self.series.value.len()).map(|f| of_frame(f).filter(|gain| gain.norm() > 0.05)).collect();
        let members = self.members.clone();
        // Of every frame, for all channels: the complex gain of one of them.
        let known = self.known();
        let coding_cost = 2.0 * statistics::learned(known.iter().map(|&f| self.variance * self.series.weight[f]));
        let size = loops * samples * evidence.cube.channels();
        Correction::inverse(Volume::BY_SAMPLE.with_coding_cost(coding_cost, size), move |cube| {
            cube.each_chirp(|[frame, channel, _], chirp| {
                if let Some(gain) = gains[frame].filter(|_| members.contains(&channel)) {
                    chirp.iter_mut().for_each(|value| *value /= gain);
                }
            });
        })
    }
}

#[cfg(test)]
#[path = "channels_tests.rs"]
mod tests;
