//! A thing that swings among the body's returns: frame by frame it drowns in them, but its frames together follow one law.
//! Every swing is tried against what the body is expected to be (a bank of templates), then the best one is fitted.

use rayon::prelude::*;

use super::mover::{Mover, WIDEST_SWING_M, middle_s};
use super::pendulum::{Law, Pendulum, at};
use super::scene::{STILL_BINS, Scene};
use super::track::{Sighting, Track, sighting};
use crate::diagnosis::Point;
use crate::diagnosis::locate::CELLS_PER_VALUE;
use crate::diagnosis::prediction::range_and_velocity;

/// Powers over the noise at the peak that are tried.
const LEVELS: [f32; 8] = [4.0, 10.0, 25.0, 63.0, 160.0, 400.0, 1000.0, 4000.0];
/// Rates are tried up to this.
const FASTEST_HZ: f64 = 4.0;
/// Swings that are tried: the smallest, the ratio to the next, how many.
const SWINGS: (f64, f64, usize) = (0.02, 1.5, 8);
const PHASES: usize = 16;
/// Training frames that the bank is laid over, and how long they may last: rates are as fine as that is long.
const MOST_FRAMES: usize = 48;
const LONGEST_S: f64 = 10.0;
const FEWEST_FRAMES: usize = 8;
/// Degrees of freedom of the heavy tail of the body's powers about their mean.
const TAIL: f32 = 8.0;
/// And at most, where there is but noise.
const LONGEST_TAIL: f32 = 100.0;
/// Power over what else is expected from which on a frame shows the swing itself.
const PLAIN: f32 = 4.0;
/// Steps by which the fit closes in.
const STEPS: usize = 24;

/// Expected powers without a swing, `[frame][doppler · samples + range]`; infinite where nothing can be seen.
struct Ground<'a> {
    scene: &'a Scene<'a>,
    expected: Vec<Vec<f32>>,
}

/// None where nothing gains, or no frame shows what the law says.
pub fn strongest(scene: &Scene) -> Option<Mover> {
    let ground = Ground::new(scene);
    let every = &scene.evidence.split.training;
    let start_s = middle_s(scene, *every.first()?);
    let in_span = |frame: &usize| middle_s(scene, *frame) - start_s < LONGEST_S;
    let training: Vec<usize> = every.iter().copied().filter(in_span).take(MOST_FRAMES).collect();
    let length_s = middle_s(scene, *training.last()?) - start_s;
    if length_s <= 0.0 || training.len() < FEWEST_FRAMES {
        return None;
    }
    let table = ground.table(&training);
    let ranges: Vec<usize> = (0..scene.bins).filter(|&range| scene.visited[range]).collect();
    let step_hz = 0.1 / length_s;
    let rates: Vec<f64> = (4..(FASTEST_HZ / step_hz) as usize).map(|step| step as f64 * step_hz).collect();
    let times: Vec<f64> = training.iter().map(|&frame| middle_s(scene, frame)).collect();
    let bank = |&rate_hz: &f64| -> Tried {
        let omega = std::f64::consts::TAU * rate_hz;
        let mut tried = Tried::default();
        for swing_m in (0..SWINGS.2).map(|step| SWINGS.0 * SWINGS.1.powi(step as i32)) {
            if omega * swing_m * scene.model.cells.doppler_per_mps < (STILL_BINS + 1) as f64 {
                continue;
            }
            for phase in 0..PHASES {
                let (sine, cosine) = (std::f64::consts::TAU * phase as f64 / PHASES as f64).sin_cos();
                let law = [0.0, swing_m * sine, swing_m * cosine, rate_hz];
                let places: Vec<(i64, i64)> = times
                    .iter()
                    .map(|&time| {
                        let (range_m, velocity) = at(law, time);
                        let (doppler, range) = scene.model.cells.place(range_m, velocity);
                        (doppler.round() as i64, range.round() as i64)
                    })
                    .collect();
                for &range in &ranges {
                    tried.hear(table.gain(&places, range as i64), [scene.range_m(range as f64), law[1], law[2], rate_hz]);
                }
            }
        }
        tried
    };
    // In one order, so that sums round alike in every run.
    let tried: Vec<Tried> = rates.par_iter().map(bank).collect();
    let tried = tried.into_iter().fold(Tried::default(), Tried::and);
    let (_, law) = tried.best?;
    let (mut law, mut power) = ground.fitted(law, &LEVELS, length_s, &training);
    // A long recording tells the rate better than a part of it, which must not be off by a turn at once.
    let mut count = training.len();
    while count < every.len() {
        count = (2 * count).min(every.len());
        let longer = &every[..count];
        (law, power) = ground.fitted(law, &[power], middle_s(scene, longer[count - 1]) - start_s, longer);
    }
    let swing = law[1].hypot(law[2]);
    if swing > WIDEST_SWING_M {
        return None;
    }
    let held_out = ground.gain(law, power, &scene.evidence.split.held_out) / CELLS_PER_VALUE;
    // A likelihood ratio is large by chance no more often than its inverse says: that of the training frames, mean over all
    // that was tried, times that of the others, which had no part in choosing.
    let p_value = (-tried.mean_log() - held_out).min(0.0).exp();
    if held_out <= 0.0 {
        return None;
    }
    let sightings: Vec<Sighting> = (0..scene.frames()).filter_map(|frame| ground.sighting(law, frame)).collect();
    let length_s = middle_s(scene, *every.last()?) - start_s;
    let pendulum = Pendulum {
        mean_m: law[0],
        sine_m: law[1],
        cosine_m: law[2],
        rate_hz: law[3],
        left: 0.0,
        deviations: [0.2 * scene.range_m(1.0), 0.1 * swing, 0.05 / length_s],
    };
    (!sightings.is_empty()).then_some(Mover {
        track: Track { sightings, p_value },
        pendulum: Some(pendulum),
        id: (!ground.moves_with_the_body(law)).then_some("moving_reflector"),
        gain: held_out,
        power: f64::from(power),
        unlike: "its frames follow one swing, which the body's returns around it do not",
    })
}

/// What a bank of templates gained.
#[derive(Clone, Copy, Default)]
struct Tried {
    best: Option<(f32, Law)>,
    /// Of likelihood ratios.
    sum: f64,
    count: f64,
}

impl Tried {
    /// `gain`: in cells, several of which make a value.
    fn hear(&mut self, gain: f32, law: Law) {
        if self.best.is_none_or(|best| gain > best.0) {
            self.best = Some((gain, law));
        }
        self.sum += (f64::from(gain) / CELLS_PER_VALUE).min(500.0).exp();
        // The gain is that of the best level.
        self.count += LEVELS.len() as f64;
    }

    fn and(self, other: Self) -> Self {
        let best = match (self.best, other.best) {
            (Some(a), Some(b)) => Some(if b.0 > a.0 { b } else { a }),
            (a, b) => a.or(b),
        };
        Self { best, sum: self.sum + other.sum, count: self.count + other.count }
    }

    fn mean_log(&self) -> f64 {
        (self.sum / self.count.max(1.0)).max(f64::MIN_POSITIVE).ln()
    }
}

/// Log-likelihoods gained by a swing's power in a place, `[frame][doppler · bins + range]` for each level.
struct Table {
    frames: Vec<Vec<[f32; LEVELS.len()]>>,
    loops: i64,
    bins: i64,
}

impl Table {
    /// Of the level that explains most.
    fn gain(&self, places: &[(i64, i64)], range: i64) -> f32 {
        let mut sums = [0.0f32; LEVELS.len()];
        for (cells, &(doppler, step)) in self.frames.iter().zip(places) {
            let range = range + step;
            if (0..self.bins).contains(&range) {
                let cell = &cells[(doppler.rem_euclid(self.loops) * self.bins + range) as usize];
                sums.iter_mut().zip(cell).for_each(|(sum, gain)| *sum += gain);
            }
        }
        sums.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }
}

impl<'a> Ground<'a> {
    fn new(scene: &'a Scene<'a>) -> Self {
        let (loops, samples, bins) = (scene.loops, scene.samples, scene.bins);
        let of_frame = |frame: usize| -> Vec<f32> {
            let (body, support, base) = (scene.model.expected(frame), scene.model.support(frame), scene.base(frame));
            let loudest = |doppler: usize, range: usize| {
                let rows = [doppler, (doppler + 1) % loops, (doppler + loops - 1) % loops];
                let ranges = range.saturating_sub(1)..(range + 2).min(samples);
                rows.into_iter().flat_map(|row| ranges.clone().map(move |range| body[row * samples + range])).fold(1.0, f32::max)
            };
            (0..loops * samples)
                .map(|cell| {
                    let (doppler, range) = (cell / samples, cell % samples);
                    if range >= bins || doppler.min(loops - doppler) as i64 <= STILL_BINS {
                        f32::INFINITY
                    } else if support[cell] {
                        loudest(doppler, range)
                    } else {
                        base[cell].max(loudest(doppler, range))
                    }
                })
                .collect()
        };
        Self { scene, expected: (0..scene.frames()).into_par_iter().map(of_frame).collect() }
    }

    /// Of one cell. Noise is another one in every channel and its level is known; the body's returns are nearly the same in
    /// all, and how strong they are is known less well. The mixture's powers follow an F law.
    fn cell(&self, frame: usize, cell: usize, more: f32) -> f32 {
        let expected = self.expected[frame][cell];
        if expected.is_infinite() {
            return 0.0;
        }
        let power = self.scene.map(frame)[cell];
        let body = (expected - 1.0).max(0.0) / expected;
        let looks = (body * body + (1.0 - body).powi(2) / self.scene.channels as f32).recip();
        let tail = (TAIL / (body * body)).min(LONGEST_TAIL);
        let law = |expected: f32| -looks * expected.ln() - (tail + looks) * (looks * power / (tail * expected)).ln_1p();
        law(expected + more) - law(expected)
    }

    fn table(&self, frames: &[usize]) -> Table {
        /// Share of the peak beside it, for a place that is known to half a cell.
        const BESIDE: f32 = 0.3;
        let (loops, samples, bins) = (self.scene.loops, self.scene.samples, self.scene.bins);
        let of_frame = |&frame: &usize| {
            let mut cells = vec![[0.0; LEVELS.len()]; loops * bins];
            for (place, gains) in cells.iter_mut().enumerate() {
                let (doppler, range) = (place / bins, place % bins);
                for (level, gain) in LEVELS.into_iter().zip(gains) {
                    for (row, slow) in [(doppler, 1.0), ((doppler + 1) % loops, BESIDE), ((doppler + loops - 1) % loops, BESIDE)]
                    {
                        for near in range.saturating_sub(1)..(range + 2).min(bins) {
                            let fast = if near == range { 1.0 } else { BESIDE };
                            *gain += self.cell(frame, row * samples + near, level * slow * fast);
                        }
                    }
                }
            }
            cells
        };
        Table { frames: frames.par_iter().map(of_frame).collect(), loops: loops as i64, bins: bins as i64 }
    }

    fn gain(&self, law: Law, power: f32, frames: &[usize]) -> f64 {
        let of_frame = |&frame: &usize| -> f64 {
            let (range_m, velocity) = at(law, middle_s(self.scene, frame));
            let template = self.scene.model.template([(range_m, velocity, 1.0)].into_iter());
            let shown = template.iter().enumerate().filter(|(_, share)| **share > 0.01);
            shown.map(|(cell, share)| f64::from(self.cell(frame, cell, power * share))).sum()
        };
        frames.par_iter().map(of_frame).sum()
    }

    /// The best law and power near a first guess: one after another is moved as long as that helps, then by less.
    fn fitted(&self, law: Law, powers: &[f32], length_s: f64, frames: &[usize]) -> (Law, f32) {
        let cell_m = self.scene.range_m(1.0);
        let swing = law[1].hypot(law[2]);
        let mut width = [0.5 * cell_m, 0.25 * swing, 0.25 * swing, 0.05 / length_s, 0.5];
        let gain = |now: [f64; 5]| self.gain([now[0], now[1], now[2], now[3]], now[4].exp() as f32, frames);
        let start = |level: f32| [law[0], law[1], law[2], law[3], f64::from(level).ln()];
        let mut now = powers.iter().map(|&power| start(power)).max_by(|a, b| gain(*a).total_cmp(&gain(*b))).unwrap_or(start(1.0));
        let mut best = gain(now);
        for _ in 0..STEPS {
            let mut moved = false;
            for axis in 0..now.len() {
                for sign in [-1.0, 1.0] {
                    let mut other = now;
                    other[axis] += sign * width[axis];
                    let found = gain(other);
                    if found > best {
                        (now, best, moved) = (other, found, true);
                    }
                }
            }
            if !moved {
                width.iter_mut().for_each(|width| *width *= 0.6);
            }
        }
        ([now[0], now[1], now[2], now[3]], now[4].exp() as f32)
    }

    /// Whether some point of the body is at the swing's range and velocity in most frames in which it moves: then it may
    /// be a limb whose returns are stronger than expected.
    fn moves_with_the_body(&self, law: Law) -> bool {
        let Some(body) = &self.scene.evidence.body else { return false };
        let cells = &self.scene.model.cells;
        let (mut with, mut seen) = (0, 0);
        for frame in 0..self.scene.frames() {
            let (range_m, velocity) = at(law, middle_s(self.scene, frame));
            let (doppler, range) = cells.place(range_m, velocity);
            if doppler.abs() <= STILL_BINS as f64 {
                continue;
            }
            seen += 1;
            let near = |point: &Point| {
                let (range_m, velocity) = range_and_velocity(&self.scene.evidence.radar, point.position_m, point.velocity_mps);
                let place = cells.place(range_m, velocity);
                (place.0 - doppler).abs() < 1.0 && (place.1 - range).abs() < 1.0
            };
            with += usize::from(body.frames[frame].iter().any(near));
        }
        2 * with > seen
    }

    /// Where a frame shows the swing itself, plainly more than all else.
    fn sighting(&self, law: Law, frame: usize) -> Option<Sighting> {
        let (range_m, velocity) = at(law, middle_s(self.scene, frame));
        let (doppler, range) = self.scene.model.cells.place(range_m, velocity);
        let range = range.round();
        if !(0.0..self.scene.bins as f64).contains(&range) {
            return None;
        }
        let row = (doppler.round() as i64).rem_euclid(self.scene.loops as i64) as usize;
        let cell = row * self.scene.samples + range as usize;
        let plain = self.scene.map(frame)[cell] > PLAIN * self.expected[frame][cell];
        plain.then(|| Sighting { range_m, velocity_mps: velocity, ..sighting(self.scene, frame, cell) })
    }
}
