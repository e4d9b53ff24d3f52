//! A stream that moved: a packet was lost, and what came after it closed the gap; or a buffer was read from
//! another place, and every chirp is turned in itself.
//!
//! Static clutter repeats itself from loop to loop, so the stream of one loop equals that of the loops before it but for noise and
//! what moves; after a loss it equals them turned by the length of the gap: as a whole, or each chirp by itself. Both are held against
//! each other where the static returns stand out of the rest (weights by frequency, which a turn leaves as they are), with a free
//! gain: a likelihood ratio of Gaussian rests. All samples of a chirp count as one, as one thing that moves may be in all of them, so
//! the ratio is that of so many channels: it must exceed the number of loops and turns that were tried (Bonferroni), summed over loops
//! in a row that agree about the turn. What moves is nearly the same in the next loop: where the energies of the rests of neighbours
//! are correlated by r, a loop counts as (1 − r)/(1 + r) of an independent one (Bartlett 1935). A turn that is true leaves rests that
//! are as little alike as those before it; one that only fits somebody who moves leaves the rest of him, loop by loop.
//!
//! A loss is sudden: a few loops before it all was in its place. Somebody who was near when the mean was learned comes to fit a turn
//! while he moves, mostly from one frame to the next; what no such loops went before counts once a frame.
//!
//! After a loss nothing else is new: the turned loop leaves no more than the loops before it did. A body that begins to move leaves
//! more at every turn, whichever is the best of them, and is learned as noise. Between loops that agree about a turn, one that fits it
//! best and leaves more says nothing: it is neither counted nor learned.

use num_complex::{Complex32, Complex64};

use super::mean_loop::{Fit, MeanLoop};
use super::stream::{Schedule, Stream};
use super::{ALARM, Finding, Inspector, Kind};

const CHECK: &str = "integrity_stream";
const EXPECTED: &str = "every loop's samples at the same places of the stream";
/// Loops that are averaged before anything is said.
const LEARNED: usize = 8;
/// Loops that a loss may last: what of it is in none of them, the first is in its place and the next ones are turned.
const SUDDEN: usize = LEARNED / 2;
/// Loops in a row that agree about a turn.
#[derive(Default)]
struct Run {
    turn: usize,
    /// Frame and loop of the first.
    since: [usize; 2],
    loops: usize,
    /// Since the last that was counted, loops that fit the turn best and leave more.
    skipped: usize,
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
        (self.loops, self.skipped) = (self.loops + 1, 0);
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

/// One way in which a stream can move.
struct Movement {
    schedule: Schedule,
    mean: MeanLoop,
    /// Most that a loop left where it was expected, in units of the noise.
    usual: f64,
    run: Run,
    /// Frame and loop that was last in its place.
    in_place: Option<[usize; 2]>,
    /// Likelihood ratio at which each loss was believed.
    losses: Vec<Loss>,
    seen: usize,
}

impl Movement {
    /// Of pieces of so many samples.
    fn new(schedule: Schedule, piece: usize) -> Self {
        let mean = MeanLoop::new(schedule.period(), piece);
        Self { schedule, mean, usual: 0.0, run: Run::default(), in_place: None, losses: vec![], seen: 0 }
    }

    /// A loop of which nothing speaks for a loss.
    fn learn(&mut self, at: [usize; 2], spectrum: &[Complex64], fit: &Fit) {
        self.run = Run::default();
        if fit.turn == 0 {
            self.in_place = Some(at);
        }
        // Of fewer loops the noise is not known.
        if self.mean.averaged >= LEARNED / 2 && (fit.turn == 0 || self.mean.averaged < LEARNED) {
            self.usual = self.usual.max(fit.left[0]);
        }
        self.mean.learn(spectrum, fit.gains[0]);
    }

    fn look(&mut self, at: [usize; 2], samples: &[Complex32], tried: usize) {
        self.seen += 1;
        let spectrum = self.mean.spectrum(samples);
        let fit = self.mean.fit(&spectrum);
        let is_turned = self.mean.averaged >= LEARNED && fit.turn != 0;
        if !is_turned || fit.left[1] > self.usual {
            // Amid such loops, one that holds something else as well says nothing for or against; many are what the scene is like.
            if !is_turned || self.run.turn != fit.turn || self.run.skipped >= LEARNED {
                self.learn(at, &spectrum, &fit);
            } else {
                self.run.skipped += 1;
            }
            return;
        }
        self.count(at, &spectrum, &fit);
        // Two loops at least: one alone is not a stream.
        if self.run.loops < 2 {
            return;
        }
        let log_p = ((self.seen * tried) as f64).ln() - self.run.evidence(self.mean.alike);
        if log_p < ALARM.ln() {
            let [frame, index] = self.run.since;
            self.losses.push(Loss { frame, index, turn: fit.turn, log_p });
            self.mean.turn(fit.turn);
            self.run = Run::default();
            self.in_place = Some(at);
        }
    }

    /// A loop that fits a turn as well as those before fitted their place.
    fn count(&mut self, at: [usize; 2], spectrum: &[Complex64], fit: &Fit) {
        let [frame, index] = at;
        if self.run.turn != fit.turn {
            let is_sudden = self.in_place.is_some_and(|[of, last]| of == frame && index - last <= SUDDEN);
            self.run = Run { turn: fit.turn, since: at, frame, is_sudden, ..Run::default() };
        }
        let turned = self.mean.turned(fit.turn);
        let rest: Vec<Complex64> = spectrum.iter().zip(turned).map(|(value, mean)| value - fit.gains[1] * mean).collect();
        if self.run.loops > 0 {
            self.run.alike += self.mean.correlation(&self.run.rest, &rest);
        }
        self.run.rest = rest;
        self.run.add(frame, self.schedule.channels() as f64 * (fit.left[0] / fit.left[1]).ln());
    }

    fn said(&self, loss: &Loss) -> String {
        let (piece, later) = (self.mean.turns(), loss.turn);
        let earlier = piece - later;
        let from = format!("from frame {}, loop {} on", loss.frame, loss.index);
        if piece == self.schedule.period() {
            return format!(
                "{from}, all samples come {earlier} places earlier in the stream than before (or {later} later; modulo the {piece} \
                 samples of a loop): part of it was lost and the rest moved up"
            );
        }
        format!(
            "{from}, the samples of every chirp are turned in it by {earlier} places towards its beginning (or {later} towards its end; \
             modulo its {piece} samples): its buffer was read from another place"
        )
    }
}

pub(super) struct Shift {
    /// Of the whole loop, and of each chirp by itself.
    movements: Vec<Movement>,
}

impl Shift {
    pub fn new(schedule: Schedule) -> Self {
        let mut pieces = vec![schedule.period(), schedule.samples];
        pieces.dedup();
        Self { movements: pieces.into_iter().map(|piece| Movement::new(schedule, piece)).collect() }
    }

    fn losses(&self) -> impl Iterator<Item = (&Movement, &Loss)> {
        self.movements.iter().flat_map(|movement| movement.losses.iter().map(move |loss| (movement, loss)))
    }
}

impl Inspector for Shift {
    fn see(&mut self, stream: &Stream) {
        let tried = self.movements.iter().map(|movement| movement.mean.turns()).sum();
        for (index, samples) in stream.loops().enumerate() {
            self.movements.iter_mut().for_each(|movement| movement.look([stream.frame, index], samples, tried));
        }
    }

    fn conclude(self: Box<Self>) -> Option<Finding> {
        if self.movements.iter().any(|movement| movement.seen < LEARNED) {
            return Some(Finding::undecided(CHECK, EXPECTED, "too few loops"));
        }
        let Some(likeliest) = self.losses().map(|(_, loss)| loss.log_p).reduce(f64::min) else {
            return Some(Finding::as_stated(CHECK, EXPECTED, "they are"));
        };
        let mut losses: Vec<(&Movement, &Loss)> = self.losses().collect();
        losses.sort_by_key(|(_, loss)| [loss.frame, loss.index]);
        let said: Vec<String> = losses.iter().map(|(movement, loss)| movement.said(loss)).collect();
        let mut frames: Vec<usize> = losses.iter().map(|(_, loss)| loss.frame).collect();
        frames.dedup();
        Some(Finding { frames, ..Finding::wrong(Kind::Misread, CHECK, EXPECTED, said.join("; "), likeliest) })
    }
}
