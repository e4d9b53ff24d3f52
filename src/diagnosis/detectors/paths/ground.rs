//! What a sinusoidal motion gains over the frames of a recording: fitted where its power in every frame is bounded in its say,
//! sharpened where it is strong.

use rayon::prelude::*;

use super::bank::{CELLS, Gains, LEVELS, SinusoidalMotion, Table, around, climb, laws, widths};
use super::beams::{Beams, Look};
use super::mover::middle_s;
use super::oscillation::{Law, at};
use super::scene::Scene;
use crate::diagnosis::cube::folds;
use crate::grid::Grid;

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
/// Logarithm of the power over what is expected, mean over the frames, that the same motion has more at another range: side lobes
/// are weaker by more.
pub const STRONGER: f64 = 1.0;
/// Laws of all rates from which the one that stands out most is sought.
const SHARPENED: usize = 6;
/// Drop of the log-likelihood at the ends of a 90 % interval, and in standard deviations.
const DROP: f64 = 1.35;
pub const DEVIATIONS: f64 = 1.645;

/// One recording's looks, of which the frames' are made as they are asked for.
pub struct Ground<'a> {
    pub scene: &'a Scene<'a>,
    pub beams: Beams<'a>,
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

    pub fn table(&self, frames: &[usize]) -> Table {
        let of_frame = |&frame: &usize| -> (Grid<Gains, 3>, Grid<Gains, 3>) {
            let looks = self.beams.looks(frame);
            let [beams, ranges, dopplers] = looks.shape();
            let cells = Grid::from_fn(CELLS, [beams, dopplers, ranges], |[beam, doppler, range]| {
                let gained = self.gained(looks[[beam, range, doppler]]);
                LEVELS.map(|level| gained(level.into()) as f32)
            });
            let around = around(&cells);
            (cells, around)
        };
        let (cells, around) = frames.par_iter().map(of_frame).unzip();
        let times_s = frames.iter().map(|&frame| middle_s(self.scene, frame)).collect();
        Table { sines: self.beams.sines.clone(), times_s, cells, around }
    }

    pub fn place(&self, law: Law, frame: usize) -> (f64, f64) {
        let (range_m, velocity) = at(law, middle_s(self.scene, frame));
        self.scene.model.cells.place(range_m, velocity)
    }

    pub fn gain(&self, motion: SinusoidalMotion, frames: &[usize]) -> f64 {
        let power = motion.log_power.exp();
        let of_frame = |&frame: &usize| self.gain_at(frame, self.place(motion.law, frame), motion.sine, power);
        // In the order of the frames, whichever thread had which.
        frames.par_iter().map(of_frame).collect::<Vec<f64>>().into_iter().sum()
    }

    pub fn gain_at(&self, frame: usize, place: (f64, f64), sine: f64, power: f64) -> f64 {
        self.beams.look(frame, place, sine).map_or(0.0, |look| self.gained(look)(power))
    }

    /// Mean logarithms over some frames of the power over what is expected there, and of the power.
    pub fn strength(&self, frames: &[usize], place: impl Fn(usize) -> (f64, f64), sine: f64) -> [f64; 2] {
        let looks: Vec<Look> = frames.iter().filter_map(|&frame| self.beams.look(frame, place(frame), sine)).collect();
        let mean = |of: &dyn Fn(&Look) -> f64| looks.iter().map(of).sum::<f64>() / frames.len() as f64;
        [mean(&|look| (look.power / look.expected).ln_1p()), mean(&|look| look.power.max(1e-9).ln())]
    }

    /// The same motion at another range, where it is the stronger by far in proportion to what is expected there: none where its
    /// own range is the best one.
    pub fn stronger_elsewhere(&self, motion: SinusoidalMotion, frames: &[usize]) -> Option<SinusoidalMotion> {
        let strength = |motion: SinusoidalMotion| self.strength(frames, |frame| self.place(motion.law, frame), motion.sine);
        let step_m = self.scene.range_m(1.0) / 2.0;
        let at = |step: usize| {
            let mut moved = motion;
            moved.law[0] = step as f64 * step_m;
            let [ratio, log_power] = strength(moved);
            (ratio, SinusoidalMotion { log_power, ..moved })
        };
        let own = strength(motion)[0];
        let ranges: Vec<(f64, SinusoidalMotion)> = (1..2 * self.scene.samples).into_par_iter().map(at).collect();
        let best = ranges.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 > own + STRONGER).then_some(best.1)
    }

    /// The best motion near a first guess, and its gain.
    pub fn fitted(&self, guess: SinusoidalMotion, frames: &[usize], length_s: f64) -> (SinusoidalMotion, f64) {
        let [mean, sine, cosine, rate] = widths(self.scene, guess.law, length_s);
        let widths = [0.5 * mean, 0.5 * sine, 0.5 * cosine, 0.5 * rate, 0.1, 0.5];
        let gain = |now: [f64; 6]| self.gain(motion(now), frames);
        let start = numbers(guess);
        let (found, gain) = climb(start, gain(start), &widths, gain, |a, b| a > b);
        (motion(found), gain)
    }

    /// Looks at a motion, one in every frame.
    fn looks(&self, motion: SinusoidalMotion, frames: &[usize]) -> Vec<Option<Look>> {
        frames.par_iter().map(|&frame| self.beams.look(frame, self.place(motion.law, frame), motion.sine)).collect()
    }

    /// How unlikely powers are where those of other looks are expected, whatever the tone's in each frame: where it is strong this
    /// determines its law, as log-likelihood gains that are bounded do not.
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

    /// The motion near another one that stands out most. What is expected is that at the other one: where little is, a tone's side
    /// lobes stand out more than the tone does where much is.
    pub fn closer(&self, near: SinusoidalMotion, frames: &[usize], length_s: f64) -> SinusoidalMotion {
        let [mean, sine, cosine, rate] = widths(self.scene, near.law, length_s);
        let there = self.looks(near, frames);
        let contrast = |now: [f64; 6]| self.contrast(&self.looks(motion(now), frames), &there);
        let start = numbers(near);
        let widths = [0.5 * mean, 0.5 * sine, 0.5 * cosine, 0.5 * rate, 0.1, 0.0];
        motion(climb(start, contrast(start), &widths, contrast, |a, b| a > b).0)
    }

    /// The motion about the same range that stands out most, of any rate.
    pub fn sharpened(&self, best: SinusoidalMotion, frames: &[usize], length_s: f64) -> SinusoidalMotion {
        let contrast = |motion: SinusoidalMotion| {
            let looks = self.looks(motion, frames);
            self.contrast(&looks, &looks)
        };
        let laws = laws(self.scene, best.law[0], length_s).into_iter().map(|law| SinusoidalMotion { law, ..best });
        let mut starts: Vec<(SinusoidalMotion, f64)> = laws.map(|motion| (motion, contrast(motion))).collect();
        starts.sort_by(|a, b| b.1.total_cmp(&a.1));
        starts.truncate(SHARPENED);
        let starts = starts.into_iter().map(|(start, _)| start).chain([best]);
        let closer = starts.map(|start| self.closer(self.closer(start, frames, length_s), frames, length_s));
        let closer = closer.map(|motion| (motion, contrast(motion)));
        let found = closer.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(best, |found| found.0);
        // How strong it is in all frames alike.
        let gain = |now: [f64; 6]| self.gain(motion(now), frames);
        motion(climb(numbers(found), gain(numbers(found)), &[0.0, 0.0, 0.0, 0.0, 0.0, 0.5], gain, |a, b| a > b).0)
    }

    /// What all frames gain, each predicted by those of the other folds: few held-out ones may all be among the body's returns.
    pub fn predicted(&self, best: SinusoidalMotion, start_s: f64) -> f64 {
        let frames = self.scene.frames();
        let length_s = middle_s(self.scene, frames - 1) - start_s;
        folds(frames).map(|[rest, held]| self.gain(self.fitted(best, &rest, length_s).0, &held)).sum()
    }

    /// Of mean, excursion, rate and direction: half of where the likelihood has fallen to that of a 90 % interval's ends, the
    /// others fitted again.
    pub fn deviations(&self, best: SinusoidalMotion, frames: &[usize], length_s: f64) -> [f64; 4] {
        let excursion_m = best.law[1].hypot(best.law[2]);
        let first = [0.1 * self.scene.range_m(1.0), 0.05 * excursion_m, 0.01 / length_s, 0.01];
        let most = [2.0 * self.scene.range_m(1.0), excursion_m, 0.5 / length_s, 0.5];
        let moved = |axis: usize, step: f64| -> SinusoidalMotion {
            let mut motion = best;
            match axis {
                0 => motion.law[0] += step,
                1 => [1, 2].into_iter().for_each(|part| motion.law[part] *= 1.0 + step / excursion_m),
                2 => motion.law[3] += step,
                _ => motion.sine += step,
            }
            motion
        };
        let there = self.looks(best, frames);
        let most_likely = self.contrast(&there, &there);
        let profile = |axis: usize, step: f64| -> f64 {
            let start = moved(axis, step);
            let contrast = |now: [f64; 6]| {
                let mut free = motion(now);
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

fn numbers(SinusoidalMotion { law: [mean, sine, cosine, rate], sine: direction, log_power }: SinusoidalMotion) -> [f64; 6] {
    [mean, sine, cosine, rate, direction, log_power]
}

fn motion([mean, sine, cosine, rate, direction, log_power]: [f64; 6]) -> SinusoidalMotion {
    SinusoidalMotion { law: [mean, sine, cosine, rate], sine: direction.clamp(-1.0, 1.0), log_power }
}
