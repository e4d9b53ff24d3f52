//! A stream that moved: a packet was lost, and what came after it closed the gap.
//!
//! Static clutter repeats itself from loop to loop, so the stream of one loop equals that of the loops before it but for noise and
//! what moves; after a loss it equals them turned by the length of the gap. Both are held against each other where the static
//! returns stand out of the rest (weights by frequency, which a turn leaves as they are), with a free gain: a likelihood ratio of
//! Gaussian rests. All samples of a chirp count as one, as one thing that moves may be in all of them, so the ratio is that of so
//! many channels: it must exceed the number of loops and turns that were tried (Bonferroni), summed over loops in a row that agree
//! about the turn.
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
/// Least weight of a frequency's noise against the mean one: where the converter rounds everything to nothing, there is no less.
const LEAST_NOISE: f64 = 1e-6;

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
    still: Vec<Complex64>,
    noise: Vec<f64>,
    averaged: usize,
    /// Most that a loop left where it was expected, in units of the noise.
    usual: f64,
    /// Turn that the last loops agree about, since which frame and loop, and their likelihood ratio.
    run: (usize, [usize; 2], f64),
    /// Likelihood ratio at which each loss was believed.
    losses: Vec<Loss>,
    seen: usize,
}

impl Shift {
    pub fn new(schedule: Schedule) -> Self {
        let (mut planner, period) = (FftPlanner::new(), schedule.period());
        let fft = [planner.plan_fft_forward(period), planner.plan_fft_inverse(period)];
        let (still, noise) = (vec![Complex64::ZERO; period], vec![0.0; period]);
        Self { schedule, fft, still, noise, averaged: 0, usual: 0.0, run: (0, [0, 0], 0.0), losses: vec![], seen: 0 }
    }

    fn learn(&mut self, spectrum: &[Complex64], gain: Complex64) {
        self.averaged += 1;
        let weight = 1.0 / (self.averaged as f64).min(MEMORY);
        if self.averaged == 2 {
            // Of one difference, only the mean over all frequencies says anything.
            let rest: f64 = spectrum.iter().zip(&self.still).map(|(value, still)| (value - still).norm_sqr()).sum();
            self.noise.fill(rest / spectrum.len() as f64);
        }
        for ((value, still), noise) in spectrum.iter().zip(&mut self.still).zip(&mut self.noise) {
            if self.averaged > 2 {
                *noise += weight * ((value - gain * *still).norm_sqr() - *noise);
            }
            *still += weight * (value - *still);
        }
    }

    /// Gain of the mean loop in this one, the turn that fits best, and what is left without a turn and with it.
    fn best_turn(&self, spectrum: &[Complex64]) -> (Complex64, usize, [f64; 2]) {
        let floor = LEAST_NOISE * self.noise.iter().sum::<f64>() / self.noise.len() as f64;
        let weight = |noise: f64| 1.0 / (noise + floor).max(f64::MIN_POSITIVE);
        let (mut own, mut still) = (0.0, 0.0);
        let mut common: Vec<Complex64> = vec![Complex64::ZERO; spectrum.len()];
        for (((value, mean), &noise), common) in spectrum.iter().zip(&self.still).zip(&self.noise).zip(&mut common) {
            let weight = weight(noise);
            own += weight * value.norm_sqr();
            still += weight * mean.norm_sqr();
            *common = weight * value * mean.conj();
        }
        self.fft[1].process(&mut common);
        let explained = |turn: usize| common[turn].norm_sqr() / still.max(f64::MIN_POSITIVE);
        let best = (0..common.len()).max_by(|a, b| common[*a].norm_sqr().total_cmp(&common[*b].norm_sqr())).unwrap_or(0);
        let left = |turn: usize| (own - explained(turn)).max(f64::MIN_POSITIVE);
        (common[0] / still.max(f64::MIN_POSITIVE), best, [left(0), left(best)])
    }

    fn look(&mut self, frame: usize, index: usize, spectrum: &[Complex64]) {
        let (gain, turn, [aligned, turned]) = self.best_turn(spectrum);
        let is_loss = self.averaged >= LEARNED && turn != 0 && turned <= self.usual;
        if !is_loss {
            self.run = (0, [0, 0], 0.0);
            // Of fewer loops the noise is not known.
            if self.averaged >= LEARNED / 2 && (turn == 0 || self.averaged < LEARNED) {
                self.usual = self.usual.max(aligned);
            }
            self.learn(spectrum, gain);
            return;
        }
        if self.run.0 != turn {
            self.run = (turn, [frame, index], 0.0);
        }
        self.run.2 += self.schedule.channels() as f64 * (aligned / turned).ln();
        let [since, at] = self.run.1;
        // Two loops at least: one alone is not a stream.
        let log_p = ((self.seen * spectrum.len()) as f64).ln() - self.run.2;
        if log_p < ALARM.ln() && [since, at] != [frame, index] {
            self.losses.push(Loss { frame: since, index: at, turn, log_p });
            let step = -std::f64::consts::TAU * turn as f64 / spectrum.len() as f64;
            self.still.iter_mut().enumerate().for_each(|(k, value)| *value *= Complex64::cis(step * k as f64));
            self.run = (0, [0, 0], 0.0);
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
            return None;
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
