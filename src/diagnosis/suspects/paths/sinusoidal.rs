//! A thing that moves sinusoidally, too weak or too much among the body's returns to be seen in one frame: its frames together
//! follow one law. Every sinusoidal motion is tried on what tones explain of each frame (a bank), the best ones are fitted and
//! judged by all frames.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;

use super::bank::{LEAST_BINS, SinusoidalMotion, Standing};
use super::beams::Beams;
use super::ground::{DEVIATIONS, Ground, STRONGER};
use super::mover::{LARGEST_EXCURSION_M, Mover, middle_s};
use super::pendulum::{Pendulum, at};
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
        let correction = Correction::Samples(Arc::new(move |cube| {
            let dims = cube.dims;
            let turns = |cells: f64, length: usize| -> Vec<Complex64> {
                (0..length).map(|i| Complex64::cis(TAU * cells * i as f64 / length as f64)).collect()
            };
            for tone in &tones {
                let (slow, fast) = (turns(tone.place.0, dims[3]), turns(tone.place.1, dims[4]));
                for (channel, amplitude) in tone.amplitudes.iter().enumerate() {
                    let start = (tone.frame * tone.amplitudes.len() + channel) * dims[3] * dims[4];
                    for (chirp, turn) in cube.samples[start..].chunks_exact_mut(dims[4]).zip(&slow) {
                        let amplitude = amplitude * turn;
                        chirp.iter_mut().zip(&fast).for_each(|(value, turn)| *value -= amplitude * turn);
                    }
                }
            }
        }));
        Candidate { correction, ..self.mover.candidate(scene, tried) }
    }
}

/// None where nothing gains.
pub fn strongest(scene: &Scene) -> Option<Found> {
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
    let table = ground.table(&training);
    let (guesses, tried) = table.bank(scene, length_s);
    let judged = |guess: SinusoidalMotion| {
        let (motion, gain) = ground.fitted(guess, &training, length_s);
        (motion, gain, ground.gain(motion, &held_out))
    };
    let fits = guesses.iter().map(|guess| judged(*guess));
    let mut found = fits.max_by(|a, b| (a.1 + a.2).total_cmp(&(b.1 + b.2)))?;
    // Beside the body the side lobes of what oscillates within it say more than it says there itself.
    if let Some(stronger) = ground.stronger_elsewhere(found.0, &training) {
        found = Some(judged(stronger)).filter(|other| other.2 > 0.0).unwrap_or(found);
    }
    let (best, gain, again) = found;
    // A likelihood ratio is large by chance no more often than its inverse says: that of all frames, one of all that were tried.
    // Where a static return is not steady, it must be beaten.
    let ranges = table.places(scene, best.law).into_iter().map(|place| place.1);
    let ranges = ranges.clone().min()? - BESIDE..=ranges.max()? + BESIDE;
    // Where it stands out from what oscillates it is no side lobe of that.
    let outstands = |standing: &Standing| {
        ground.strength(&training, |_| standing.place, standing.sine)[0] + STRONGER
            > ground.strength(&training, |frame| ground.place(best.law, frame), best.sine)[0]
    };
    let standing = table.standing(ranges).filter(|(standing, _)| outstands(standing)).map_or((0.0, 0.0), |(standing, tried)| {
        let of_frame = |&frame: &usize| ground.gain_at(frame, standing.place, standing.sine, standing.power);
        (standing.gain + held_out.iter().map(of_frame).sum::<f64>(), tried.ln())
    });
    let p_value = (tried.ln() + (standing.0 - standing.1).max(0.0) - gain - again).min(0.0).exp();
    if again <= 0.0
        || standing.0 > NEARLY * (gain + again)
        || p_value > LEAST_LIKELY
        || best.law[1].hypot(best.law[2]) > LARGEST_EXCURSION_M
    {
        return None;
    }
    // Two laws: the one that its bounded gains favour, and the one that stands out most.
    let mut laws = [best, ground.sharpened(best, &training, length_s)];
    // A long recording gives a more precise rate than a part of it, which must not be off by a turn at once.
    let (every, mut count) = (&split.training, training.len());
    if count < every.len() {
        let all: Vec<usize> = (0..scene.frames()).collect();
        ground.beams.prepare(&all);
    }
    while count < every.len() {
        count = (2 * count).min(every.len());
        let (longer, length_s) = (&every[..count], middle_s(scene, every[count - 1]) - start_s);
        laws = [ground.fitted(laws[0], longer, length_s).0, ground.closer(laws[1], longer, length_s)];
    }
    ground.beams.prepare(&split.held_out);
    let predicted = laws.map(|law| (split.held_out_share() * ground.predicted(law, start_s), law));
    let (again, best) = predicted.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let deviations = ground.deviations(best, &every[..count], middle_s(scene, every[count - 1]) - start_s);
    // What may as well not move at all, or is always in the cell of a static return, only fluctuates.
    let excursion_m = best.law[1].hypot(best.law[2]);
    let bins = TAU * best.law[3] * excursion_m * scene.model.cells.doppler_per_mps;
    if DEVIATIONS * deviations[1] > excursion_m || bins.max(excursion_m * scene.model.cells.bins_per_m) < LEAST_BINS {
        return None;
    }
    let named = !ground.moves_with_the_body(best);
    let [mean_m, sine_m, cosine_m, rate_hz] = best.law;
    let power = best.log_power.exp();
    let sightings = (0..scene.frames()).map(|frame| {
        let (range_m, velocity_mps) = at(best.law, middle_s(scene, frame));
        // At the peak after two Hann windows.
        Sighting { frame, range_m, velocity_mps, power: power / 2.25, sine: Some(best.sine) }
    });
    let mover = Mover {
        track: Track { sightings: sightings.collect(), p_value },
        pendulum: Some(Pendulum {
            mean_m,
            sine_m,
            cosine_m,
            rate_hz,
            left: 0.0,
            deviations: [deviations[0], deviations[1], deviations[2]],
        }),
        id: named.then_some(effects::moving_reflector::ID),
        gain: again,
        power: power / 2.25,
        sine_error: Some(deviations[3]),
        unlike: "its frames follow one sinusoidal motion, which nothing else around it does",
    };
    Some(Found { mover, tones: ground.tones(best) })
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
