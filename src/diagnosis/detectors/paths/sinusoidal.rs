//! A thing that moves sinusoidally, too weak or too much among the body's returns to be seen in one frame: its frames together
//! follow one law. Every sinusoidal motion is tried on what tones explain of each frame (a bank), the best ones are fitted and
//! judged by all frames.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::bank::{LEAST_BINS, SinusoidalMotion, StaticTarget, Table};
use super::beams::Beams;
use super::ground::{DEVIATIONS, Ground, STRONGER};
use super::mover::{LARGEST_EXCURSION_M, Mover, middle_s};
use super::oscillation::{Oscillation, at};
use super::scene::Scene;
use super::track::{Sighting, Track};
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::{Candidate, Correction, Point};
use crate::effects;

/// Samples of all channels and frames that the bank is laid over, at most so many frames that last so long.
const MOST_SAMPLES: usize = 1 << 21;
const MOST_FRAMES: usize = 48;
const LONGEST_S: f64 = 10.0;
const FEWEST_FRAMES: usize = 8;
/// Share of a motion's gain from which on a static return explains it.
const NEARLY: f64 = 0.6;
/// Cells of the fine grid beside a motion's ranges where a static return may be taken for it.
const BESIDE: i64 = 4;
/// A body's point so close in Doppler and range (cells: a clock that is a little off moves a limb by as much) and
/// in direction is where the motion is (x over range).
const NEAR: [f64; 2] = [2.0, 1.5];
const SAME_DIRECTION: f64 = 0.35;
/// Share of the variance of a motion's ranges that those of the body leave, below which it goes where the body goes.
const PARALLEL: f64 = 0.3;
/// What chance does more often is no motion.
const LEAST_LIKELY: f64 = 1e-2;

pub struct Found {
    pub mover: Mover,
    tones: Vec<Tone>,
}

/// What a frame shows of it.
#[derive(Clone)]
struct Tone {
    frame: usize,
    /// Doppler and range in cells.
    place: (f64, f64),
    amplitudes: Vec<Complex64>,
}

impl Found {
    pub fn candidate(&self, scene: &Scene, tried: f64) -> Candidate {
        let tones = self.tones.clone();
        let correction = Correction::samples(move |cube| {
            let dims = cube.dims;
            let turns = |cells: f64, length: usize| -> Vec<Complex64> {
                (0..length).map(|i| Complex64::cis(TAU * cells * i as f64 / length as f64)).collect()
            };
            for tone in &tones {
                let (slow, fast) = (turns(tone.place.0, dims[3]), turns(tone.place.1, dims[4]));
                for (channel, amplitude) in tone.amplitudes.iter().enumerate() {
                    for (chirp, turn) in cube.channel_mut(tone.frame, channel).chunks_exact_mut(dims[4]).zip(&slow) {
                        let amplitude = amplitude * turn;
                        chirp.iter_mut().zip(&fast).for_each(|(value, turn)| *value -= amplitude * turn);
                    }
                }
            }
        });
        Candidate { correction, ..self.mover.candidate(scene, tried) }
    }
}

/// None where nothing gains.
pub fn strongest(scene: &Scene) -> Option<Found> {
    let mut search = Search::new(scene)?;
    let table = search.ground.table(&search.training);
    let (guesses, tried) = table.bank(scene, search.length_s);
    let best = search.best(guesses)?;
    let p_value = search.p_value(best, &table, tried)?;
    if p_value > LEAST_LIKELY || excursion_m(best.motion) > LARGEST_EXCURSION_M {
        return None;
    }
    let (gain, motion) = search.predicted(best.motion)?;
    let deviations = search.deviations(motion);
    // What may as well not move at all, or is always in the cell of a static return, only fluctuates.
    let (excursion_m, cells) = (excursion_m(motion), &scene.model.cells);
    let bins = TAU * motion.law[3] * excursion_m * cells.doppler_per_mps;
    if DEVIATIONS * deviations[1] > excursion_m || bins.max(excursion_m * cells.bins_per_m) < LEAST_BINS {
        return None;
    }
    Some(search.found(motion, deviations, gain, p_value))
}

fn excursion_m(motion: SinusoidalMotion) -> f64 {
    motion.law[1].hypot(motion.law[2])
}

/// A motion with its log-likelihood gains.
#[derive(Clone, Copy)]
struct Judged {
    motion: SinusoidalMotion,
    training: f64,
    held_out: f64,
}

impl Judged {
    fn gain(&self) -> f64 {
        self.training + self.held_out
    }
}

/// A stretch of the recording that the bank is laid over.
struct Search<'a> {
    ground: Ground<'a>,
    training: Vec<usize>,
    held_out: Vec<usize>,
    start_s: f64,
    length_s: f64,
}

impl<'a> Search<'a> {
    /// None where too few frames are in the stretch.
    fn new(scene: &'a Scene<'a>) -> Option<Self> {
        let split = &scene.evidence.split;
        let start_s = middle_s(scene, *split.training.first()?);
        let in_span = |frame: &usize| middle_s(scene, *frame) - start_s < LONGEST_S;
        let most = MOST_FRAMES.min(MOST_SAMPLES / (scene.size() * scene.evidence.cube.channels()));
        let training: Vec<usize> = split.training.iter().copied().filter(in_span).take(most).collect();
        let last = *training.last()?;
        let length_s = middle_s(scene, last) - start_s;
        if length_s <= 0.0 || training.len() < FEWEST_FRAMES {
            return None;
        }
        let held_out: Vec<usize> = split.held_out.iter().copied().filter(|frame| *frame <= last + 1).collect();
        let mut ground = Ground { scene, beams: Beams::new(scene) };
        ground.beams.prepare(&training);
        ground.beams.prepare(&held_out);
        Some(Self { ground, training, held_out, start_s, length_s })
    }

    fn judged(&self, guess: SinusoidalMotion) -> Judged {
        let (motion, training) = self.ground.fitted(guess, &self.training, self.length_s);
        Judged { motion, training, held_out: self.ground.gain(motion, &self.held_out) }
    }

    fn best(&self, guesses: Vec<SinusoidalMotion>) -> Option<Judged> {
        let fits = guesses.into_iter().map(|guess| self.judged(guess));
        let best = fits.max_by(|a, b| a.gain().total_cmp(&b.gain()))?;
        // Beside the body the side lobes of what oscillates within it say more than it says there itself.
        let stronger = self.ground.stronger_elsewhere(best.motion, &self.training).map(|stronger| self.judged(stronger));
        Some(stronger.filter(|stronger| stronger.held_out > 0.0).unwrap_or(best))
    }

    /// A likelihood ratio is large by chance no more often than its inverse says: that of all frames, one of all that were tried.
    /// It must explain more than a static return that fluctuates. None where that return explains as much.
    fn p_value(&self, best: Judged, table: &Table, tried: f64) -> Option<f64> {
        let (of_static, chances) = self.of_static_target(best.motion, table)?;
        if best.held_out <= 0.0 || of_static > NEARLY * best.gain() {
            return None;
        }
        let nats = tried.ln() + (of_static - chances).max(0.0) - best.training - best.held_out;
        Some(nats.min(0.0).exp())
    }

    /// What a static return near a motion gains, and the logarithm of how many were tried.
    fn of_static_target(&self, motion: SinusoidalMotion, table: &Table) -> Option<(f64, f64)> {
        let ground = &self.ground;
        let ranges = table.places(ground.scene, motion.law).into_iter().map(|place| place.1);
        let ranges = ranges.clone().min()? - BESIDE..=ranges.max()? + BESIDE;
        // Where it is stronger than what oscillates it is no side lobe of that.
        let is_stronger = |target: &StaticTarget| {
            ground.strength(&self.training, |_| target.place, target.sine)[0] + STRONGER
                > ground.strength(&self.training, |frame| ground.place(motion.law, frame), motion.sine)[0]
        };
        let found = table.static_target(ranges).filter(|(target, _)| is_stronger(target));
        Some(found.map_or((0.0, 0.0), |(target, tried)| {
            let of_frame = |&frame: &usize| ground.gain_at(frame, target.place, target.sine, target.power);
            (target.gain + self.held_out.iter().map(of_frame).sum::<f64>(), tried.ln())
        }))
    }

    /// Of the whole recording, every part predicted by the others: the share of its gain that held-out frames have, and the motion.
    fn predicted(&mut self, best: SinusoidalMotion) -> Option<(f64, SinusoidalMotion)> {
        // Two laws: the one that its bounded gains favour, and the one that stands out most.
        let laws = [best, self.ground.sharpened(best, &self.training, self.length_s)];
        let laws = self.of_the_whole(laws);
        let split = &self.ground.scene.evidence.split;
        self.ground.beams.prepare(&split.held_out);
        let predicted = laws.map(|law| (split.held_out_share() * self.ground.predicted(law, self.start_s), law));
        predicted.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// A long recording gives a more precise rate than a part of it, which must not be off by a turn at once.
    fn of_the_whole(&mut self, mut laws: [SinusoidalMotion; 2]) -> [SinusoidalMotion; 2] {
        let scene = self.ground.scene;
        let (every, mut count) = (&scene.evidence.split.training, self.training.len());
        if count < every.len() {
            let all: Vec<usize> = (0..scene.frames()).collect();
            self.ground.beams.prepare(&all);
        }
        while count < every.len() {
            count = (2 * count).min(every.len());
            let (longer, length_s) = (&every[..count], middle_s(scene, every[count - 1]) - self.start_s);
            laws = [self.ground.fitted(laws[0], longer, length_s).0, self.ground.closer(laws[1], longer, length_s)];
        }
        laws
    }

    /// Of mean, excursion, rate and direction, from all training frames.
    fn deviations(&self, motion: SinusoidalMotion) -> [f64; 4] {
        self.ground.deviations(motion, &self.ground.scene.evidence.split.training, self.whole_s())
    }

    /// Between the first and the last training frame.
    fn whole_s(&self) -> f64 {
        let last = self.ground.scene.evidence.split.training.last();
        last.map_or(0.0, |&last| middle_s(self.ground.scene, last) - self.start_s)
    }

    fn found(&self, motion: SinusoidalMotion, deviations: [f64; 4], gain: f64, p_value: f64) -> Found {
        let scene = self.ground.scene;
        let [mean_m, sine_m, cosine_m, rate_hz] = motion.law;
        let [mean_error_m, excursion_error_m, rate_error_hz, sine_error] = deviations;
        // At the peak after two Hann windows.
        let power = motion.log_power.exp() / 2.25;
        let sightings = (0..scene.frames()).map(|frame| {
            let (range_m, velocity_mps) = at(motion.law, middle_s(scene, frame));
            Sighting { frame, range_m, velocity_mps, power, sine: Some(motion.sine) }
        });
        let deviations = [mean_error_m, excursion_error_m, rate_error_hz];
        // Less than a period is any smooth course (Rayleigh's resolution of a rate from none).
        let is_periodic = rate_hz * self.whole_s() >= 1.0;
        let oscillation = Oscillation { mean_m, sine_m, cosine_m, rate_hz, left: 0.0, deviations };
        let mover = Mover {
            track: Track { sightings: sightings.collect(), p_value },
            oscillation: is_periodic.then_some(oscillation),
            id: (is_periodic && !self.ground.moves_with_the_body(motion)).then_some(effects::moving_reflector::ID),
            gain,
            power,
            sine_error: Some(sine_error),
            unlike: if is_periodic {
                "its frames follow one sinusoidal motion, which nothing else around it does"
            } else {
                "its frames follow one course of less than a period, which nothing else around it does"
            },
        };
        Found { mover, tones: self.ground.tones(motion) }
    }
}

impl Ground<'_> {
    /// Whether some point of the body is where the motion is in the frames that show most of it, so that it may be a limb whose
    /// returns are stronger than expected; or the motion goes where the body goes, so that it may be the body seen in another way.
    fn moves_with_the_body(&self, motion: SinusoidalMotion) -> bool {
        let evidence = self.scene.evidence;
        let Some(body) = &evidence.body else { return false };
        let centre = evidence.radar.centre_m();
        let near = |&frame: &usize| {
            let (doppler, range) = self.place(motion.law, frame);
            body.frames[frame].iter().any(|point: &Point| {
                let (range_m, velocity) = range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps);
                let place = self.scene.model.cells.place(range_m, velocity);
                let sine = (point.position_m[0] - centre[0]) / range_m.max(1e-6);
                (place.0 - doppler).abs() < NEAR[0]
                    && (place.1 - range).abs() < NEAR[1]
                    && (sine - motion.sine).abs() < SAME_DIRECTION
            })
        };
        let shown =
            |frame: usize| self.gain_at(frame, self.place(motion.law, frame), motion.sine, motion.log_power.exp()).max(0.0);
        let shown: Vec<f64> = (0..self.scene.frames()).map(shown).collect();
        let with: f64 = (0..self.scene.frames()).filter(near).map(|frame| shown[frame]).sum();
        let all: f64 = shown.iter().sum();
        let ranges: Vec<[f64; 2]> = (0..self.scene.frames())
            .filter_map(|frame| {
                let (sum, weight) = self.beams.body(frame).iter().fold((0.0, 0.0), |(sum, weight), (point, power)| {
                    let range_m = range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps).0;
                    (sum + power * range_m, weight + power)
                });
                (weight > 0.0).then(|| [at(motion.law, middle_s(self.scene, frame)).0, sum / weight])
            })
            .collect();
        let spread = |values: &dyn Fn(&[f64; 2]) -> f64| -> f64 {
            let mean = ranges.iter().map(values).sum::<f64>() / ranges.len().max(1) as f64;
            ranges.iter().map(|range| (values(range) - mean).powi(2)).sum()
        };
        2.0 * with > all || spread(&|[motion, body]| motion - body) < PARALLEL * spread(&|[motion, _]| *motion)
    }

    /// Most probable amplitudes, given that they are as strong as fitted.
    fn tones(&self, motion: SinusoidalMotion) -> Vec<Tone> {
        let power = motion.log_power.exp();
        (0..self.scene.frames())
            .filter_map(|frame| {
                let place = self.place(motion.law, frame);
                let look = self.beams.look(frame, place, motion.sine)?;
                let sure = power / (power + look.expected);
                let amplitudes = self.beams.tone(frame, place, motion.sine)?.into_iter().map(|value| value * sure).collect();
                Some(Tone { frame, place, amplitudes })
            })
            .collect()
    }
}
