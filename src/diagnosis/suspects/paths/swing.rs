//! A thing that swings, too weak or too much among the body's returns to be seen in one frame: its frames together follow one
//! law. Every swing is tried on what tones explain of each frame (a bank), the best ones are fitted and judged by all frames.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::bank::{Gains, LEAST_BINS, LEVELS, Standing, Swing, Table, around, climb, laws, widths};
use super::beams::{Beams, Look};
use super::mover::{Mover, WIDEST_SWING_M, middle_s};
use super::pendulum::{Law, Pendulum, at};
use super::scene::Scene;
use super::track::{Sighting, Track};
use crate::diagnosis::cube::folds;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::{Candidate, Correction, Point};

/// Samples of all channels and frames that the bank is laid over, at most so many frames that last so long.
const MOST_SAMPLES: usize = 1 << 21;
const MOST_FRAMES: usize = 48;
const LONGEST_S: f64 = 10.0;
const FEWEST_FRAMES: usize = 8;
/// Degrees of freedom of the heavy tail of the body's powers about their mean.
const TAIL: f64 = 8.0;
/// And at most, where there is but noise.
const LONGEST_TAIL: f64 = 100.0;
/// Share of the body's power in a look times this: how likely it is that the look shows something that was not expected at all,
/// and by how much that exceeds what was.
const STRAY: f64 = 0.05;
const STRAY_POWER: f64 = 30.0;
/// Log-likelihood of a look from which on its say is bounded.
const MOST_NATS: f64 = 12.0;
/// Logarithm of the power over what is expected, mean over the frames, that the same swing has more at another range: side lobes are
/// weaker by more.
const STRONGER: f64 = 1.0;
/// Cells of the fine grid beside a swing's ranges where what stands still may be taken for it.
const BESIDE: i64 = 4;
/// Laws of all rates from which the one that stands out most is sought.
const SHARPENED: usize = 6;
/// Share of a swing's gain from which on something that stands still explains it.
const NEARLY: f64 = 0.6;
/// A body's point so close in Doppler and range (cells: a clock that is a little off moves a limb by as much) and
/// in direction is where the swing is (x over range).
const NEAR: [f64; 2] = [2.0, 1.5];
const SAME_DIRECTION: f64 = 0.35;
/// Share of the variance of a swing's ranges that those of the body leave, below which it goes where the body goes.
const PARALLEL: f64 = 0.3;
/// What chance does more often is no swing.
const LEAST_LIKELY: f64 = 1e-2;
/// Drop of the log-likelihood at the ends of a 90 % interval, and in standard deviations.
const DROP: f64 = 1.35;
const DEVIATIONS: f64 = 1.645;

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
    let judged = |guess: Swing| {
        let (swing, gain) = ground.fitted(guess, &training, length_s);
        (swing, gain, ground.gain(swing, &held_out))
    };
    let fits = guesses.iter().map(|guess| judged(*guess));
    let mut found = fits.max_by(|a, b| (a.1 + a.2).total_cmp(&(b.1 + b.2)))?;
    // Beside the body the side lobes of what swings within it say more than it says there itself.
    if let Some(stronger) = ground.stronger_elsewhere(found.0, &training) {
        found = Some(judged(stronger)).filter(|other| other.2 > 0.0).unwrap_or(found);
    }
    let (mut best, gain, again) = found;
    // A likelihood ratio is large by chance no more often than its inverse says: that of all frames, one of all that were tried.
    // Where something that stands still is not steady, it must be beaten.
    let ranges = table.places(scene, best.law).into_iter().map(|place| place.1);
    let ranges = ranges.clone().min()? - BESIDE..=ranges.max()? + BESIDE;
    // Where it stands out from what swings it is no side lobe of that.
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
        || best.law[1].hypot(best.law[2]) > WIDEST_SWING_M
    {
        return None;
    }
    best = ground.sharpened(best, &training, length_s);
    // A long recording tells the rate better than a part of it, which must not be off by a turn at once.
    let (every, mut count) = (&split.training, training.len());
    if count < every.len() {
        let all: Vec<usize> = (0..scene.frames()).collect();
        ground.beams.prepare(&all);
    }
    while count < every.len() {
        count = (2 * count).min(every.len());
        let longer = &every[..count];
        best = ground.closer(best, longer, middle_s(scene, longer[count - 1]) - start_s);
    }
    ground.beams.prepare(&split.held_out);
    let again = split.held_out_share() * ground.foretold(best, start_s);
    let deviations = ground.deviations(best, &every[..count], middle_s(scene, every[count - 1]) - start_s);
    // What may as well not swing at all, or is always in the cell of what stands still, only flickers.
    let swing_m = best.law[1].hypot(best.law[2]);
    let bins = TAU * best.law[3] * swing_m * scene.model.cells.doppler_per_mps;
    if DEVIATIONS * deviations[1] > swing_m || bins.max(swing_m * scene.model.cells.bins_per_m) < LEAST_BINS {
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
        id: named.then_some("moving_reflector"),
        gain: again,
        power: power / 2.25,
        sine_error: Some(deviations[3]),
        unlike: "its frames follow one swing, which nothing else around it does",
    };
    Some(Found { mover, tones: ground.tones(best) })
}

struct Ground<'a> {
    scene: &'a Scene<'a>,
    beams: Beams<'a>,
}

impl Ground<'_> {
    /// Independent looks that one amounts to, and degrees of freedom of its tail.
    fn freedom(&self, look: Look) -> (f64, f64) {
        let tx = self.scene.evidence.radar.tx_m.len() as f64;
        let looks = (look.body * look.body + (1.0 - look.body).powi(2) / tx).recip();
        (looks, (TAIL / (look.body * look.body)).min(LONGEST_TAIL))
    }

    /// Log-likelihood gained in a look by so much energy. Noise is another one for every transmitter and its level is known;
    /// the body's returns are nearly the same, and how strong they are is known less well. The mixture's powers follow an F law.
    fn gained(&self, look: Look) -> impl Fn(f64) -> f64 {
        let (looks, tail) = self.freedom(look);
        let constant = gamma_ratio(tail, looks) + (looks - 1.0) * (look.power / look.expected).max(1e-9).ln();
        let stray = STRAY * look.body;
        let strays = stray / STRAY_POWER * (1.0 + look.power / look.expected / STRAY_POWER).powi(-2);
        // Density of the power over what is expected without any more.
        let density = move |expected: f64| {
            let exponent = constant
                - looks * (expected / look.expected).ln()
                - (tail + looks) * (looks * (look.power / expected) / tail).ln_1p();
            (1.0 - stray) * exponent.exp() + strays
        };
        let without = density(look.expected).max(1e-300);
        move |more| bounded((density(look.expected + more) / without).max(1e-300).ln())
    }

    fn table(&self, frames: &[usize]) -> Table {
        let (rows, columns) = (self.beams.rows(), self.beams.columns());
        let of_frame = |&frame: &usize| -> (Vec<Vec<Gains>>, Vec<Vec<Gains>>) {
            let of_beam = |looks: Vec<Look>| {
                let gains = |cell: usize| {
                    let gained = self.gained(looks[cell]);
                    LEVELS.map(|level| gained(level.into()) as f32)
                };
                let cells: Vec<Gains> = (0..rows * columns).map(|cell| gains(cell % columns * rows + cell / columns)).collect();
                let around = around(&cells, rows);
                (cells, around)
            };
            self.beams.looks(frame).into_iter().map(of_beam).unzip()
        };
        let (cells, around) = frames.par_iter().map(of_frame).unzip();
        let times_s = frames.iter().map(|&frame| middle_s(self.scene, frame)).collect();
        Table { sines: self.beams.sines.clone(), rows: rows as i64, columns: columns as i64, times_s, cells, around }
    }

    fn place(&self, law: Law, frame: usize) -> (f64, f64) {
        let (range_m, velocity) = at(law, middle_s(self.scene, frame));
        self.scene.model.cells.place(range_m, velocity)
    }

    fn gain(&self, swing: Swing, frames: &[usize]) -> f64 {
        let power = swing.log_power.exp();
        let of_frame = |&frame: &usize| self.gain_at(frame, self.place(swing.law, frame), swing.sine, power);
        frames.par_iter().map(of_frame).sum()
    }

    fn gain_at(&self, frame: usize, place: (f64, f64), sine: f64, power: f64) -> f64 {
        self.beams.look(frame, place, sine).map_or(0.0, |look| self.gained(look)(power))
    }

    /// Mean logarithms over some frames of the power over what is expected there, and of the power.
    fn strength(&self, frames: &[usize], place: impl Fn(usize) -> (f64, f64), sine: f64) -> [f64; 2] {
        let looks: Vec<Look> = frames.iter().filter_map(|&frame| self.beams.look(frame, place(frame), sine)).collect();
        let mean = |of: &dyn Fn(&Look) -> f64| looks.iter().map(of).sum::<f64>() / frames.len() as f64;
        [mean(&|look| (look.power / look.expected).ln_1p()), mean(&|look| look.power.max(1e-9).ln())]
    }

    /// The same swing at another range, where it is the stronger by far in proportion to what is expected there: none where its
    /// own range is the best one.
    fn stronger_elsewhere(&self, swing: Swing, frames: &[usize]) -> Option<Swing> {
        let strength = |swing: Swing| self.strength(frames, |frame| self.place(swing.law, frame), swing.sine);
        let step_m = self.scene.range_m(1.0) / 2.0;
        let at = |step: usize| {
            let mut moved = swing;
            moved.law[0] = step as f64 * step_m;
            let [ratio, log_power] = strength(moved);
            (ratio, Swing { log_power, ..moved })
        };
        let own = strength(swing)[0];
        let ranges: Vec<(f64, Swing)> = (1..2 * self.scene.samples).into_par_iter().map(at).collect();
        let best = ranges.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 > own + STRONGER).then_some(best.1)
    }

    /// The best swing near a first guess, and its gain.
    fn fitted(&self, guess: Swing, frames: &[usize], length_s: f64) -> (Swing, f64) {
        let [mean, sine, cosine, rate] = widths(self.scene, guess.law, length_s);
        let widths = [0.5 * mean, 0.5 * sine, 0.5 * cosine, 0.5 * rate, 0.1, 0.5];
        let gain = |now: [f64; 6]| self.gain(swing(now), frames);
        let start = numbers(guess);
        let (found, gain) = climb(start, gain(start), &widths, gain, |a, b| a > b);
        (swing(found), gain)
    }

    /// Looks at a swing, one in every frame.
    fn looks(&self, swing: Swing, frames: &[usize]) -> Vec<Option<Look>> {
        frames.par_iter().map(|&frame| self.beams.look(frame, self.place(swing.law, frame), swing.sine)).collect()
    }

    /// How unlikely powers are where those of other looks are expected, whatever the tone's in each frame: where it is strong this
    /// tells its law, as gains that are bounded do not.
    fn contrast(&self, looks: &[Option<Look>], others: &[Option<Look>]) -> f64 {
        let of_frame = |(look, other): (&Option<Look>, &Option<Look>)| match (look, other) {
            (Some(look), Some(other)) => {
                let (looks, tail) = self.freedom(*other);
                (tail + looks) * (looks * (look.power / other.expected) / tail).ln_1p()
            }
            _ => 0.0,
        };
        looks.iter().zip(others).map(of_frame).sum()
    }

    /// The swing near another one that stands out most. What is expected is that at the other one: where little is, a tone's side
    /// lobes stand out more than the tone does where much is.
    fn closer(&self, near: Swing, frames: &[usize], length_s: f64) -> Swing {
        let [mean, sine, cosine, rate] = widths(self.scene, near.law, length_s);
        let there = self.looks(near, frames);
        let contrast = |now: [f64; 6]| self.contrast(&self.looks(swing(now), frames), &there);
        let start = numbers(near);
        let widths = [0.5 * mean, 0.5 * sine, 0.5 * cosine, 0.5 * rate, 0.1, 0.0];
        swing(climb(start, contrast(start), &widths, contrast, |a, b| a > b).0)
    }

    /// The swing about the same range that stands out most, of any rate.
    fn sharpened(&self, best: Swing, frames: &[usize], length_s: f64) -> Swing {
        let contrast = |swing: Swing| {
            let looks = self.looks(swing, frames);
            self.contrast(&looks, &looks)
        };
        let laws = laws(self.scene, best.law[0], length_s).into_iter().map(|law| Swing { law, ..best });
        let mut starts: Vec<(Swing, f64)> = laws.map(|swing| (swing, contrast(swing))).collect();
        starts.sort_by(|a, b| b.1.total_cmp(&a.1));
        starts.truncate(SHARPENED);
        let starts = starts.into_iter().map(|(start, _)| start).chain([best]);
        let closer = starts.map(|start| self.closer(self.closer(start, frames, length_s), frames, length_s));
        let found = closer.max_by(|&a, &b| contrast(a).total_cmp(&contrast(b))).unwrap_or(best);
        // How strong it is in all frames alike.
        let gain = |now: [f64; 6]| self.gain(swing(now), frames);
        let (found, gained) = climb(numbers(found), gain(numbers(found)), &[0.0, 0.0, 0.0, 0.0, 0.0, 0.5], gain, |a, b| a > b);
        if gained > NEARLY * self.gain(best, frames) { swing(found) } else { best }
    }

    /// What all frames gain, each foretold by those of the other folds: few held-out ones may all be among the body's returns.
    fn foretold(&self, best: Swing, start_s: f64) -> f64 {
        let frames = self.scene.frames();
        let length_s = middle_s(self.scene, frames - 1) - start_s;
        folds(frames).map(|[rest, held]| self.gain(self.fitted(best, &rest, length_s).0, &held)).sum()
    }

    /// Of mean, swing, rate and direction: half of where the likelihood has fallen to that of a 90 % interval's ends, the
    /// others fitted again.
    fn deviations(&self, best: Swing, frames: &[usize], length_s: f64) -> [f64; 4] {
        let swing_m = best.law[1].hypot(best.law[2]);
        let first = [0.1 * self.scene.range_m(1.0), 0.05 * swing_m, 0.01 / length_s, 0.01];
        let most = [2.0 * self.scene.range_m(1.0), swing_m, 0.5 / length_s, 0.5];
        let moved = |axis: usize, step: f64| -> Swing {
            let mut swing = best;
            match axis {
                0 => swing.law[0] += step,
                1 => [1, 2].into_iter().for_each(|part| swing.law[part] *= 1.0 + step / swing_m),
                2 => swing.law[3] += step,
                _ => swing.sine += step,
            }
            swing
        };
        let there = self.looks(best, frames);
        let most_likely = self.contrast(&there, &there);
        let profile = |axis: usize, step: f64| -> f64 {
            let start = moved(axis, step);
            let contrast = |now: [f64; 6]| {
                let mut free = swing(now);
                // The one that is asked for stays.
                match axis {
                    0 => free.law[0] = start.law[0],
                    1 => {
                        let scale = start.law[1].hypot(start.law[2]) / free.law[1].hypot(free.law[2]).max(1e-9);
                        (free.law[1], free.law[2]) = (free.law[1] * scale, free.law[2] * scale);
                    }
                    2 => free.law[3] = start.law[3],
                    _ => free.sine = start.sine,
                }
                self.contrast(&self.looks(free, frames), &there)
            };
            let [mean, sine, cosine, rate] = widths(self.scene, best.law, length_s).map(|width| 0.3 * width);
            let widths = [mean, sine, cosine, rate, 0.05, 0.0];
            climb(numbers(start), contrast(numbers(start)), &widths, contrast, |a, b| a > b).1
        };
        std::array::from_fn(|axis| {
            let side = |sign: f64| {
                let mut step = first[axis];
                while step < most[axis] && profile(axis, sign * step) > most_likely - DROP {
                    step *= 1.5;
                }
                step.min(most[axis])
            };
            side(-1.0).max(side(1.0)) / DEVIATIONS
        })
    }

    /// Whether some point of the body is where the swing is in the frames that show most of it, so that it may be a limb whose
    /// returns are stronger than expected; or the swing goes where the body goes, so that it may be the body seen in another way.
    fn moves_with_the_body(&self, swing: Swing) -> bool {
        let evidence = self.scene.evidence;
        let Some(body) = &evidence.body else { return false };
        let centre = evidence.radar.centre_m();
        let near = |&frame: &usize| {
            let (doppler, range) = self.place(swing.law, frame);
            body.frames[frame].iter().any(|point: &Point| {
                let (range_m, velocity) = range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps);
                let place = self.scene.model.cells.place(range_m, velocity);
                let sine = (point.position_m[0] - centre[0]) / range_m.max(1e-6);
                (place.0 - doppler).abs() < NEAR[0]
                    && (place.1 - range).abs() < NEAR[1]
                    && (sine - swing.sine).abs() < SAME_DIRECTION
            })
        };
        let shown = |frame: usize| self.gain_at(frame, self.place(swing.law, frame), swing.sine, swing.log_power.exp()).max(0.0);
        let shown: Vec<f64> = (0..self.scene.frames()).map(shown).collect();
        let with: f64 = (0..self.scene.frames()).filter(near).map(|frame| shown[frame]).sum();
        let all: f64 = shown.iter().sum();
        let ranges: Vec<[f64; 2]> = (0..self.scene.frames())
            .filter_map(|frame| {
                let (sum, weight) = self.beams.body(frame).iter().fold((0.0, 0.0), |(sum, weight), (point, power)| {
                    let range_m = range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps).0;
                    (sum + power * range_m, weight + power)
                });
                (weight > 0.0).then(|| [at(swing.law, middle_s(self.scene, frame)).0, sum / weight])
            })
            .collect();
        let spread = |values: &dyn Fn(&[f64; 2]) -> f64| -> f64 {
            let mean = ranges.iter().map(values).sum::<f64>() / ranges.len().max(1) as f64;
            ranges.iter().map(|range| (values(range) - mean).powi(2)).sum()
        };
        2.0 * with > all || spread(&|[swing, body]| swing - body) < PARALLEL * spread(&|[swing, _]| *swing)
    }

    /// Most probable amplitudes, given that they are as strong as fitted.
    fn tones(&self, swing: Swing) -> Vec<Tone> {
        let power = swing.log_power.exp();
        (0..self.scene.frames())
            .filter_map(|frame| {
                let place = self.place(swing.law, frame);
                let look = self.beams.look(frame, place, swing.sine)?;
                let sure = power / (power + look.expected);
                let amplitudes = self.beams.tone(frame, place, swing.sine)?.into_iter().map(|value| value * sure).collect();
                Some(Tone { frame, place, amplitudes })
            })
            .collect()
    }
}

/// A look that shows far more than expected may show something else: beyond a bound its say grows like a logarithm, so that one
/// frame beside the body cannot outvote all those within it.
fn bounded(nats: f64) -> f64 {
    if nats > MOST_NATS { MOST_NATS + (nats - MOST_NATS).ln_1p() } else { nats }
}

/// Logarithm of what makes the density of an F law's ratio (so many looks, a heavy tail) one.
fn gamma_ratio(tail: f64, looks: f64) -> f64 {
    use statrs::function::gamma::ln_gamma;
    ln_gamma(tail + looks) - ln_gamma(tail) - ln_gamma(looks) + looks * (looks / tail).ln()
}

fn numbers(Swing { law: [mean, sine, cosine, rate], sine: direction, log_power }: Swing) -> [f64; 6] {
    [mean, sine, cosine, rate, direction, log_power]
}

fn swing([mean, sine, cosine, rate, direction, log_power]: [f64; 6]) -> Swing {
    Swing { law: [mean, sine, cosine, rate], sine: direction.clamp(-1.0, 1.0), log_power }
}
