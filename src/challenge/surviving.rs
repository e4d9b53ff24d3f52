//! What of an effect survives everything that nobody can know about the body and the room: the d′ of rung E of the
//! capacity ladder (DIAGNOSIS.md, 0.6), which a millimetre of mesh error and learned reflectivities cannot explain away.
//!
//! A scene is recorded several times with and without the effect, each time with another draw of the mesh's error and of
//! the thermal noise, and again without the person. Only what the effect does in *every* draw counts: sums go over pairs
//! of different draws (U-statistics), so that what merely becomes another random pattern, as the return of a moved or
//! delayed body does, counts nothing in the mean. Counted are
//! - what is added where no body is, as the scenes without the person show it: what stands still against any amplitude of
//!   the room at any range in every channel, the rest in every cell of range and Doppler against the covariance that the
//!   channels have there with the person. It counts in full beside the body and little beneath it;
//! - the change of that covariance (power in the cell, phases between the channels), as much as the independent looks at it
//!   can show; one gain for all of the body's return is unknown.
//!
//! Not counted, though a recording shows it: what the body's phases have in common from frame to frame and from cell to
//! cell. Counted, though learned reflectivities may hide it: powers that change with range or with the part of the body.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::measure::Frames;
use crate::diagnosis::evidence::{spectrum, transform};

/// A return reaches two cells to either side: half the main lobe of a Hann window.
const REACH: usize = 2;
/// Cells per independent look: the noise bandwidth of two Hann windows, in bins.
const CELLS_PER_LOOK: f64 = 1.5 * 1.5;

/// One draw of the mesh's error and the noise.
pub struct Draw {
    pub clean: Frames,
    /// What the effect adds to it.
    pub effect: Frames,
}

/// d′ of an effect over several draws of the scene, and of the scene without the person. `noise`: variance of a complex
/// sample's noise.
pub fn d_prime(draws: &[Draw], empty: &[Draw], noise: f64) -> f64 {
    let clean: Vec<Parted> = draws.iter().map(|draw| Parted::new(&draw.clean)).collect();
    let effect: Vec<Parted> = draws.iter().map(|draw| Parted::new(&draw.effect)).collect();
    let beside: Vec<Parted> = empty.iter().map(|draw| Parted::new(&draw.effect)).collect();
    let frames = &draws[0].clean;
    let mut moving = Moving::new(draws.len());
    for frame in 0..frames.count() {
        let maps = |of: &[Parted]| of.iter().map(|parted| parted.maps(frame)).collect();
        let maps = Maps { clean: maps(&clean), effect: maps(&effect), beside: maps(&beside) };
        moving.add(&maps, frames.dims, noise);
    }
    let chirps = (frames.count() * frames.dims[1]) as f64;
    (standing(&clean, &beside, noise / chirps) + moving.squared()).max(0.0).sqrt()
}

/// Frames, and what stands still in them.
struct Parted<'a> {
    frames: &'a Frames,
    /// The mean chirp, `[channel][sample]`.
    still: Vec<Vec<Complex64>>,
}

impl<'a> Parted<'a> {
    fn new(frames: &'a Frames) -> Self {
        let [channels, loops, samples] = frames.dims;
        let weight = 1.0 / (loops * frames.count()) as f64;
        let mut still = vec![vec![Complex64::ZERO; samples]; channels];
        for frame in &frames.values {
            for (index, value) in frame.iter().enumerate() {
                still[index / (loops * samples)][index % samples] += value * weight;
            }
        }
        Self { frames, still }
    }

    /// The maps of a frame without what stands still, `[channel][doppler · range]`.
    fn maps(&self, frame: usize) -> Vec<Vec<Complex64>> {
        let [_, loops, samples] = self.frames.dims;
        let channels = self.frames.values[frame].chunks_exact(loops * samples);
        channels
            .zip(&self.still)
            .map(|(channel, still)| {
                let moving: Vec<Complex64> = channel.iter().enumerate().map(|(i, value)| value - still[i % samples]).collect();
                transform(&moving, samples)
            })
            .collect()
    }
}

/// Sum over all ordered pairs of different draws of the products of what they show, over the number of pairs.
#[derive(Clone, Default)]
struct Pairs {
    sum: Vec<Complex64>,
    own: f64,
    draws: usize,
}

impl Pairs {
    fn add(&mut self, shown: impl Iterator<Item = Complex64>) {
        let first = self.sum.is_empty();
        for (index, value) in shown.enumerate() {
            if first {
                self.sum.push(value);
            } else {
                self.sum[index] += value;
            }
            self.own += value.norm_sqr();
        }
        self.draws += 1;
    }

    fn mean(&self) -> f64 {
        let pairs = self.draws * self.draws.saturating_sub(1);
        (self.sum.iter().map(Complex64::norm_sqr).sum::<f64>() - self.own) / pairs.max(1) as f64
    }
}

/// Of the mean chirps.
fn standing(clean: &[Parted], effect: &[Parted], floor: f64) -> f64 {
    let mut squared = 0.0;
    for channel in 0..clean[0].still.len() {
        let spectra = |of: &[Parted]| of.iter().map(|draw| spectrum(&draw.still[channel])).collect::<Vec<_>>();
        let (clean, effect) = (spectra(clean), spectra(effect));
        let bins = clean[0].len();
        for bin in 0..bins {
            let around = || (0..=2 * REACH).map(|step| (bin + bins + step - REACH) % bins);
            let there: f64 = clean.iter().flat_map(|draw| around().map(|at| draw[at].norm_sqr())).sum();
            let free = there / clean.len() as f64 - (2 * REACH + 1) as f64 * floor;
            let mut pairs = Pairs::default();
            effect.iter().for_each(|draw| pairs.add(std::iter::once(draw[bin])));
            squared += 2.0 * pairs.mean() / (floor + free.max(0.0));
        }
    }
    squared
}

/// One frame, `[draw][channel][doppler · range]`.
struct Maps {
    clean: Vec<Vec<Vec<Complex64>>>,
    effect: Vec<Vec<Vec<Complex64>>>,
    /// Of the effect in the scene without the person.
    beside: Vec<Vec<Vec<Complex64>>>,
}

/// What the cells of all frames show.
struct Moving {
    squared: f64,
    /// Of each draw's change of covariance, what one gain for the body's return would change: projection and its weight.
    along_gain: Vec<f64>,
    gain: f64,
}

impl Moving {
    fn new(draws: usize) -> Self {
        Self { squared: 0.0, along_gain: vec![0.0; draws], gain: 0.0 }
    }

    fn squared(&self) -> f64 {
        let mut along = Pairs::default();
        self.along_gain.iter().for_each(|&value| along.add(std::iter::once(value.into())));
        self.squared - if self.gain > 0.0 { along.mean() / self.gain } else { 0.0 }
    }

    fn add(&mut self, maps: &Maps, dims: [usize; 3], floor: f64) {
        let [channels, loops, samples] = dims;
        let covariances = |value: &dyn Fn(usize, usize, usize) -> Complex64| -> Vec<Vec<DMatrix<Complex64>>> {
            let of_draw = |draw| covariance(channels, [loops, samples], &|channel, cell| value(draw, channel, cell));
            (0..maps.clean.len()).map(of_draw).collect()
        };
        let clean = covariances(&|draw, channel, cell| maps.clean[draw][channel][cell]);
        let planted = covariances(&|draw, channel, cell| maps.clean[draw][channel][cell] + maps.effect[draw][channel][cell]);
        let mean = |of: &[Vec<DMatrix<Complex64>>], cell: usize| {
            of.iter().map(|draw| &draw[cell]).sum::<DMatrix<Complex64>>() * Complex64::from(1.0 / of.len() as f64)
        };
        for cell in 0..loops * samples {
            let (before, after) = (mean(&clean, cell), mean(&planted, cell));
            if let Some(whitener) = whitener(&before) {
                let mut pairs = Pairs::default();
                for map in &maps.beside {
                    let effect = DMatrix::from_fn(channels, 1, |channel, _| map[channel][cell]);
                    pairs.add((&whitener * effect).iter().copied());
                }
                self.squared += 2.0 * pairs.mean();
            }
            // Relative to the mean of before and after: a power that rises from nothing counts finitely.
            if let Some(whitener) = whitener(&((&before + after) * Complex64::from(0.5))) {
                let identity = DMatrix::<Complex64>::identity(channels, channels);
                let gain = identity - &whitener * whitener.adjoint() * Complex64::from(floor);
                let mut pairs = Pairs::default();
                for (draw, (clean, planted)) in clean.iter().zip(&planted).enumerate() {
                    let change = &whitener * (&planted[cell] - &clean[cell]) * whitener.adjoint();
                    let along = change.iter().zip(gain.iter()).map(|(a, b)| (a * b.conj()).re).sum::<f64>();
                    self.along_gain[draw] += along / CELLS_PER_LOOK;
                    pairs.add(change.iter().copied());
                }
                self.squared += pairs.mean() / CELLS_PER_LOOK;
                self.gain += gain.iter().map(Complex64::norm_sqr).sum::<f64>() / CELLS_PER_LOOK;
            }
        }
    }
}

/// W with W C Wᴴ = 1; none for a covariance without noise.
fn whitener(covariance: &DMatrix<Complex64>) -> Option<DMatrix<Complex64>> {
    covariance.clone().cholesky()?.l().try_inverse()
}

/// The channels' covariance in and around every cell, `[doppler · range]`; both axes go round.
fn covariance(
    channels: usize,
    [loops, samples]: [usize; 2],
    value: &dyn Fn(usize, usize) -> Complex64,
) -> Vec<DMatrix<Complex64>> {
    let outer = |cell: usize| {
        let here = DMatrix::from_fn(channels, 1, |channel, _| value(channel, cell));
        &here * here.adjoint()
    };
    let own: Vec<DMatrix<Complex64>> = (0..loops * samples).map(outer).collect();
    let weight = Complex64::from(1.0 / (2 * REACH + 1) as f64);
    let along = |of: &[DMatrix<Complex64>], count: usize, at: &dyn Fn(usize, usize) -> usize| -> Vec<DMatrix<Complex64>> {
        (0..loops * samples)
            .map(|cell| (0..=2 * REACH).map(|step| &of[at(cell, count + step - REACH)]).sum::<DMatrix<Complex64>>() * weight)
            .collect()
    };
    let over_range = along(&own, samples, &|cell, step| cell / samples * samples + (cell % samples + step) % samples);
    along(&over_range, loops, &|cell, step| (cell / samples + step) % loops * samples + cell % samples)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const DIMS: [usize; 3] = [2, 16, 32];

    fn frames(count: usize, value: impl Fn(usize, usize, usize, usize) -> Complex64) -> Frames {
        let [channels, loops, samples] = DIMS;
        let values = (0..count).map(|frame| {
            (0..channels * loops * samples)
                .map(|i| value(frame, i / (loops * samples), i / samples % loops, i % samples))
                .collect()
        });
        Frames { dims: DIMS, values: values.collect() }
    }

    fn tone(doppler: f64, range: f64, slow: usize, fast: usize) -> Complex64 {
        Complex64::cis(std::f64::consts::TAU * (doppler * slow as f64 / 16.0 + range * fast as f64 / 32.0))
    }

    fn noisy(of: Frames, seed: u64) -> Frames {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let values = of
            .values
            .into_iter()
            .map(|frame| frame.into_iter().map(|value| value + Complex64::new(normal(), normal())).collect());
        Frames { dims: of.dims, values: values.collect() }
    }

    /// A body of several returns in each of many cells, every one of an unknown phase, and a wall.
    fn scene(seed: u64, body: f64, delay: f64) -> Frames {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let phases: Vec<f64> = (0..60).map(|_| std::f64::consts::TAU * random.random::<f64>()).collect();
        let person = |frame: usize, channel: usize, slow: usize, fast: usize| -> Complex64 {
            let part = |(i, phase): (usize, &f64)| {
                let place = i as f64 / 60.0;
                let turned = Complex64::cis(phase + 40.0 * place * frame as f64 + 2.0 * place * channel as f64);
                tone(2.0 + 5.0 * place, 6.0 + 8.0 * place + delay, slow, fast) * turned * body
            };
            phases.iter().enumerate().map(part).sum()
        };
        let wall = |slow: usize, fast: usize| tone(0.0, 20.0, slow, fast) * 30.0;
        noisy(frames(6, |frame, channel, slow, fast| person(frame, channel, slow, fast) + wall(slow, fast)), seed)
    }

    /// d′ and the coherent one of what `effect` makes of a scene, by seed, strength of the body, and the scene itself.
    fn both(effect: impl Fn(u64, f64, &Frames) -> Frames) -> [f64; 2] {
        let draws = |body: f64, seeds: std::ops::Range<u64>| -> Vec<Draw> {
            let draw = |seed| {
                let clean = scene(seed, body, 0.0);
                let effect = effect(seed, body, &clean);
                Draw { clean, effect }
            };
            seeds.map(draw).collect()
        };
        let (draws, empty) = (draws(6.0, 1..4), draws(0.0, 4..6));
        let coherent = draws[0].effect.values.iter().flatten().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        [d_prime(&draws, &empty, 2.0), coherent]
    }

    fn difference(a: &Frames, b: &Frames) -> Frames {
        let values = a.values.iter().zip(&b.values).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect());
        Frames { dims: a.dims, values: values.collect() }
    }

    #[test]
    fn where_nothing_else_is_the_d_prime_is_the_coherent_one() {
        let [found, coherent] = both(|_, _, clean| frames(clean.count(), |_, _, slow, fast| tone(-5.0, 25.0, slow, fast) * 0.1));
        assert!((found / coherent - 1.0).abs() < 0.15, "{found} against {coherent}");
    }

    #[test]
    fn another_draw_of_the_body_and_another_amplitude_of_the_room_are_no_effect() {
        let redrawn = both(|seed, body, clean| difference(&scene(seed + 100, body, 0.0), clean));
        let brighter = both(|_, _, clean| frames(clean.count(), |_, _, slow, fast| tone(0.0, 20.0, slow, fast) * 6.0));
        for [found, coherent] in [redrawn, brighter] {
            assert!(coherent > 200.0 && found < 8.0, "{coherent} and {found}");
        }
    }

    #[test]
    fn power_elsewhere_and_differences_between_channels_are_seen_under_any_phases() {
        let moved = both(|seed, body, clean| difference(&scene(seed + 100, body, 2.0), clean));
        let [channels, loops, samples] = DIMS;
        let turned = both(|_, _, clean| {
            let factor = |i: usize| if (i / (loops * samples)).is_multiple_of(channels) { 0.2 } else { -0.2 };
            let turn = |frame: &Vec<Complex64>| frame.iter().enumerate().map(|(i, value)| value * factor(i)).collect();
            Frames { dims: DIMS, values: clean.values.iter().map(turn).collect() }
        });
        for [found, _] in [moved, turned] {
            assert!(found > 15.0, "{found}");
        }
    }
}
