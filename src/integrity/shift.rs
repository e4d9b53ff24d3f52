//! A stream that moved: a packet was lost, and what came after it closed the gap.
//!
//! Static clutter repeats itself from loop to loop, so the stream of one loop equals that of the loops before it but for noise and
//! what moves; after a loss it equals them turned by the length of the gap. Both are held against each other where the static
//! returns stand out of the rest (weights by frequency, which a turn leaves as they are), with a free gain: a likelihood ratio of
//! Gaussian rests. All samples of a chirp count as one, as one thing that moves may be in all of them, so the ratio is that of so
//! many channels: it must exceed the number of loops and turns that were tried (Bonferroni), summed over loops in a row that agree
//! about the turn. What moves is nearly the same in the next loop: where the energies of the rests of neighbours are correlated by r,
//! a loop counts as (1 − r)/(1 + r) of an independent one (Bartlett 1935). A turn that is true leaves rests that are as little alike as
//! those before it; one that only fits somebody who moves leaves the rest of him, loop by loop.
//!
//! A loss is sudden: a few loops before it all was in its place. Somebody who was near when the mean was learned comes to fit a turn while
//! he moves, mostly from one frame to the next; what no such loops went before counts once a frame.
//!
//! After a loss nothing else is new: the turned loop leaves no more than the loops before it did. A body that begins to move leaves more
//! at every turn, whichever is the best of them, and is learned as noise.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::Complex64;

use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_stream";
const EXPECTED: &str = "every loop's samples at the same places of the stream";
/// Loops whose running mean the next one is held against: half of the weight is in that many. What moves averages out over them.
const MEMORY: f64 = 64.0;
/// Loops that are averaged before anything is said.
const LEARNED: usize = 8;
/// Loops that a loss may last: what of it is in none of them, the first is in its place and the next ones are turned.
const SUDDEN: usize = LEARNED / 2;
/// Least weight of a frequency's noise against the mean one: where the converter rounds everything to nothing, there is no less.
const LEAST_NOISE: f64 = 1e-6;

/// Loops in a row that agree about a turn.
#[derive(Default)]
struct Run {
    turn: usize,
    /// Frame and loop of the first.
    since: [usize; 2],
    loops: usize,
    /// Whether all was in its place a few loops before.
    is_sudden: bool,
    /// Sums over them: logarithm of the likelihood ratio, and correlation of each with the one before.
    ratio: f64,
    alike: f64,
    /// The same ratio of the loops of this frame, how many those are, and the mean ratios of the frames before.
    of_frame: [f64; 2],
    of_frames: f64,
    frame: usize,
    /// Of the last, less the turned mean.
    rest: Vec<Complex64>,
}

impl Run {
    fn add(&mut self, frame: usize, ratio: f64) {
        if self.frame != frame {
            self.of_frames += self.of_frame[0] / self.of_frame[1];
            (self.of_frame, self.frame) = ([0.0; 2], frame);
        }
        self.of_frame = [self.of_frame[0] + ratio, self.of_frame[1] + 1.0];
        self.ratio += ratio;
        self.loops += 1;
    }

    /// Logarithm of the likelihood ratio of what is independent, of two loops or more; `alike`: of loops in their places.
    fn evidence(&self, alike: f64) -> f64 {
        let alike = alike.max(self.alike / (self.loops - 1) as f64);
        let of_loops = self.ratio * (1.0 - alike) / (1.0 + alike);
        if self.is_sudden { of_loops } else { of_loops.min(self.of_frames + self.of_frame[0] / self.of_frame[1]) }
    }
}

struct Loss {
    frame: usize,
    index: usize,
    turn: usize,
    log_p: f64,
}

pub(super) struct Shift {
    schedule: Schedule,
    fft: [Arc<dyn Fft<f64>>; 2],
    /// Spectrum of the mean loop, and power of what differs from it.
    clutter: Vec<Complex64>,
    noise: Vec<f64>,
    /// Least of that power that counts.
    floor: f64,
    averaged: usize,
    /// Rest of the last loop that was averaged, and how far the energies of two such neighbours are correlated.
    rest: Vec<Complex64>,
    alike: f64,
    /// Most that a loop left where it was expected, in units of the noise.
    usual: f64,
    run: Run,
    /// Frame and loop that was last in its place.
    in_place: Option<[usize; 2]>,
    /// Likelihood ratio at which each loss was believed.
    losses: Vec<Loss>,
    seen: usize,
}

impl Shift {
    pub fn new(schedule: Schedule) -> Self {
        let (mut planner, period) = (FftPlanner::new(), schedule.period());
        let fft = [planner.plan_fft_forward(period), planner.plan_fft_inverse(period)];
        let (clutter, noise) = (vec![Complex64::ZERO; period], vec![0.0; period]);
        let (rest, losses, run) = (vec![], vec![], Run::default());
        let in_place = None;
        Self {
            schedule,
            fft,
            clutter,
            noise,
            floor: 0.0,
            averaged: 0,
            rest,
            alike: 0.0,
            usual: 0.0,
            run,
            in_place,
            losses,
            seen: 0,
        }
    }

    fn learn(&mut self, spectrum: &[Complex64], gain: Complex64) {
        self.averaged += 1;
        let weight = 1.0 / (self.averaged as f64).min(MEMORY);
        if self.averaged == 2 {
            // Of one difference, only the mean over all frequencies says anything.
            let rest: f64 = spectrum.iter().zip(&self.clutter).map(|(value, clutter)| (value - clutter).norm_sqr()).sum();
            self.noise.fill(rest / spectrum.len() as f64);
        }
        if self.averaged > 2 {
            let rest: Vec<Complex64> =
                spectrum.iter().zip(&self.clutter).map(|(value, clutter)| value - gain * clutter).collect();
            if !self.rest.is_empty() {
                self.alike += weight * (self.correlation(&self.rest, &rest) - self.alike);
            }
            self.noise.iter_mut().zip(&rest).for_each(|(noise, rest)| *noise += weight * (rest.norm_sqr() - *noise));
            self.rest = rest;
        }
        self.clutter.iter_mut().zip(spectrum).for_each(|(clutter, value)| *clutter += weight * (value - *clutter));
    }

    /// Of the energies of two loops' rests: the square of their coherence, as both are complex Gaussian.
    fn correlation(&self, a: &[Complex64], b: &[Complex64]) -> f64 {
        let (mut both, mut of_a, mut of_b) = (Complex64::ZERO, 0.0, 0.0);
        for ((a, b), &noise) in a.iter().zip(b).zip(&self.noise) {
            let weight = self.weight(noise);
            both += weight * a * b.conj();
            of_a += weight * a.norm_sqr();
            of_b += weight * b.norm_sqr();
        }
        both.norm_sqr() / (of_a * of_b).max(f64::MIN_POSITIVE)
    }

    /// The mean loop, turned.
    fn turned(&self, turn: usize) -> impl Iterator<Item = Complex64> + '_ {
        let step = -std::f64::consts::TAU * turn as f64 / self.clutter.len() as f64;
        self.clutter.iter().enumerate().map(move |(k, value)| value * Complex64::cis(step * k as f64))
    }

    /// Of a frequency with so much noise.
    fn weight(&self, noise: f64) -> f64 {
        1.0 / (noise + self.floor).max(f64::MIN_POSITIVE)
    }

    /// The turn of the mean loop that fits this one best, its gain without a turn and with it, and what is left of each.
    fn best_turn(&self, spectrum: &[Complex64]) -> (usize, [Complex64; 2], [f64; 2]) {
        let (mut own, mut clutter) = (0.0, 0.0);
        let mut common: Vec<Complex64> = vec![Complex64::ZERO; spectrum.len()];
        for (((value, mean), &noise), common) in spectrum.iter().zip(&self.clutter).zip(&self.noise).zip(&mut common) {
            let weight = self.weight(noise);
            own += weight * value.norm_sqr();
            clutter += weight * mean.norm_sqr();
            *common = weight * value * mean.conj();
        }
        self.fft[1].process(&mut common);
        let explained = |turn: usize| common[turn].norm_sqr() / clutter.max(f64::MIN_POSITIVE);
        let best = (0..common.len()).max_by(|a, b| common[*a].norm_sqr().total_cmp(&common[*b].norm_sqr())).unwrap_or(0);
        let left = |turn: usize| (own - explained(turn)).max(f64::MIN_POSITIVE);
        (best, [0, best].map(|turn| common[turn] / clutter.max(f64::MIN_POSITIVE)), [left(0), left(best)])
    }

    fn look(&mut self, frame: usize, index: usize, spectrum: &[Complex64]) {
        self.floor = LEAST_NOISE * self.noise.iter().sum::<f64>() / self.noise.len() as f64;
        let (turn, gains, [aligned, turned]) = self.best_turn(spectrum);
        let is_loss = self.averaged >= LEARNED && turn != 0 && turned <= self.usual;
        if !is_loss {
            self.run = Run::default();
            if turn == 0 {
                self.in_place = Some([frame, index]);
            }
            // Of fewer loops the noise is not known.
            if self.averaged >= LEARNED / 2 && (turn == 0 || self.averaged < LEARNED) {
                self.usual = self.usual.max(aligned);
            }
            self.learn(spectrum, gains[0]);
            return;
        }
        if self.run.turn != turn {
            let is_sudden = self.in_place.is_some_and(|[of, last]| of == frame && index - last <= SUDDEN);
            self.run = Run { turn, since: [frame, index], frame, is_sudden, ..Run::default() };
        }
        let rest: Vec<Complex64> = spectrum.iter().zip(self.turned(turn)).map(|(value, mean)| value - gains[1] * mean).collect();
        if self.run.loops > 0 {
            self.run.alike += self.correlation(&self.run.rest, &rest);
        }
        self.run.rest = rest;
        let ratio = self.schedule.channels() as f64 * (aligned / turned).ln();
        self.run.add(frame, ratio);
        // Two loops at least: one alone is not a stream.
        if self.run.loops < 2 {
            return;
        }
        let log_p = ((self.seen * spectrum.len()) as f64).ln() - self.run.evidence(self.alike);
        if log_p < ALARM.ln() {
            let [since, at] = self.run.since;
            self.losses.push(Loss { frame: since, index: at, turn, log_p });
            self.clutter = self.turned(turn).collect();
            self.run = Run::default();
            self.in_place = Some([frame, index]);
        }
    }
}

impl Inspector for Shift {
    fn see(&mut self, stream: &Stream) {
        for (index, samples) in stream.loops().enumerate() {
            let mut spectrum: Vec<Complex64> = samples.iter().map(|v| Complex64::new(v.re.into(), v.im.into())).collect();
            self.fft[0].process(&mut spectrum);
            self.seen += 1;
            self.look(stream.frame, index, &spectrum);
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.seen < LEARNED {
            return Some(Finding::undecided(CHECK, EXPECTED, "too few loops"));
        }
        let Some(likeliest) = self.losses.iter().map(|loss| loss.log_p).reduce(f64::min) else {
            return Some(Finding::as_stated(CHECK, EXPECTED, "they are"));
        };
        let period = self.schedule.period();
        let losses: Vec<String> = self
            .losses
            .iter()
            .map(|loss| {
                let missing = period - loss.turn;
                format!(
                    "from frame {}, loop {} on, all samples come {missing} places earlier in the stream than before (or {} later; modulo \
                     the {period} samples of a loop): part of it was lost and the rest moved up",
                    loss.frame, loss.index, loss.turn
                )
            })
            .collect();
        let frames = self.losses.iter().map(|loss| loss.frame).collect();
        Some(Finding { frames, ..Finding::wrong(Kind::Misread, CHECK, EXPECTED, losses.join("; "), likeliest) })
    }
}
