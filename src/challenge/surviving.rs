//! What of an effect survives everything that nobody can know about the body and the room: the d′ of
//! docs/results.md, which a millimetre of mesh error and learned reflectivities cannot explain away.
//!
//! A scene is recorded several times with and without the effect, each time with another draw of the mesh's error, of what
//! the skin returns where, and of the thermal noise, and again without the person. Only what the effect does in *every* draw
//! counts: sums go over pairs of different draws (U-statistics), so that what merely becomes another random pattern, as the
//! return of a moved or delayed body does, counts nothing in the mean; how far so few draws scatter is estimated from the pairs,
//! and what is counted is what is sure. Counted are
//! - what is added where no body is, as the scenes without the person show it: static returns where they are stronger than
//!   any amplitude that the room is likely to have there, the rest in every cell of range and Doppler against the covariance
//!   that the channels have there with the person. It counts in full beside the body and little beneath it;
//! - the change of that covariance (power in the cell, phases between the channels), as much as the independent looks at it
//!   can show; one gain for all of the body's return is unknown.
//!
//! Not counted, though a recording shows it: what the body's phases have in common from frame to frame and from cell to
//! cell. Counted, though nobody can foresee it: what an effect drew at random, as the phases of an oscillator's noise.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::diagnosis::evidence::{spectrum, transform};

/// A return reaches two cells to either side: half the main lobe of a Hann window.
const REACH: usize = 2;
/// Cells per independent look: the noise bandwidth of two Hann windows, in bins.
const CELLS_PER_LOOK: f64 = 1.5 * 1.5;
/// Power over the room's own from which what is added to it is no longer taken for another amplitude of it.
const ABOVE_ROOM: f64 = 4.0;
/// Cells along Doppler and range beyond which what a draw shows is taken for independent.
const BLOCK: [usize; 2] = [8, 16];
/// Standard deviations below its estimate at which a number is sure, to 95 %.
const SURE: f64 = 1.645;

/// Samples of a recording.
pub struct Frames {
    /// Channels, loops, samples.
    pub dims: [usize; 3],
    /// `[frame][channel · loop · sample]`
    pub values: Vec<Vec<Complex64>>,
}

impl Frames {
    /// Number of frames.
    fn count(&self) -> usize {
        self.values.len()
    }
}

/// One draw of the mesh's error, the skin and the noise.
pub struct Draw {
    pub clean: Frames,
    /// What the effect adds to it.
    pub effect: Frames,
}

/// d′ that an effect surely has over several draws of the scene, and of the scene without the person. `noise`: variance of a
/// complex sample's noise.
pub fn d_prime(draws: &[Draw], empty: &[Draw], noise: f64) -> f64 {
    let clean: Vec<Parted> = draws.iter().map(|draw| Parted::new(&draw.clean)).collect();
    let effect: Vec<Parted> = draws.iter().map(|draw| Parted::new(&draw.effect)).collect();
    let beside: Vec<Parted> = empty.iter().map(|draw| Parted::new(&draw.effect)).collect();
    let room: Vec<Parted> = empty.iter().map(|draw| Parted::new(&draw.clean)).collect();
    let frames = &draws[0].clean;
    let mut moving = Moving::new(draws.len());
    for frame in 0..frames.count() {
        let maps = |of: &[Parted]| of.iter().map(|parted| parted.maps(frame)).collect();
        let maps = Maps { clean: maps(&clean), effect: maps(&effect), beside: maps(&beside) };
        moving.add(&maps, frames.dims, noise);
    }
    let chirps = (frames.count() * frames.dims[1]) as f64;
    let mut squared = static_squared([&room, &beside, &clean], noise / chirps);
    squared.add(moving.squared());
    squared.sure()
}

/// Frames, and static clutter in them.
struct Parted<'a> {
    frames: &'a Frames,
    /// The mean chirp, `[channel][sample]`.
    clutter: Vec<Vec<Complex64>>,
}

impl<'a> Parted<'a> {
    fn new(frames: &'a Frames) -> Self {
        let [channels, loops, samples] = frames.dims;
        let weight = 1.0 / (loops * frames.count()) as f64;
        let mut clutter = vec![vec![Complex64::ZERO; samples]; channels];
        for frame in &frames.values {
            for (index, value) in frame.iter().enumerate() {
                clutter[index / (loops * samples)][index % samples] += value * weight;
            }
        }
        Self { frames, clutter }
    }

    /// The maps of a frame without static clutter, `[channel][doppler · range]`.
    fn maps(&self, frame: usize) -> Vec<Vec<Complex64>> {
        let [_, loops, samples] = self.frames.dims;
        let channels = self.frames.values[frame].chunks_exact(loops * samples);
        channels
            .zip(&self.clutter)
            .map(|(channel, clutter)| {
                let moving: Vec<Complex64> = channel.iter().enumerate().map(|(i, value)| value - clutter[i % samples]).collect();
                transform(&moving, samples)
            })
            .collect()
    }
}

/// A square of d′, as few draws give it.
#[derive(Clone, Copy, Debug, Default)]
struct Squared {
    /// Its mean over the draws that could have been is the true one: it may come out below zero.
    value: f64,
    deviation: f64,
}

impl Squared {
    /// d′ is this or more: what turns one random pattern into another has no mean, but scatters as much as the pattern.
    fn sure(self) -> f64 {
        (self.value - SURE * self.deviation).max(0.0).sqrt()
    }

    fn add(&mut self, other: Self) {
        self.value += other.value;
        self.deviation = self.deviation.hypot(other.deviation);
    }
}

/// Products of what the draws show, summed over neighbouring cells: one for every pair of different draws.
#[derive(Clone)]
struct Pairs {
    products: Vec<f64>,
}

impl Pairs {
    fn new(draws: usize) -> Self {
        Self { products: vec![0.0; draws * draws.saturating_sub(1) / 2] }
    }

    /// Adds cells, each draw's values in turn.
    fn add(&mut self, shown: &[Vec<Complex64>], weight: f64) {
        let different = shown.iter().enumerate().flat_map(|(index, one)| shown[..index].iter().map(move |other| (one, other)));
        for (product, (one, other)) in self.products.iter_mut().zip(different) {
            *product += one.iter().zip(other).map(|(a, b)| (a * b.conj()).re).sum::<f64>() * weight;
        }
    }

    /// Mean over the pairs, and its deviation as they scatter: pairs of draws without anything in common are not correlated.
    fn squared(&self) -> Squared {
        let count = self.products.len() as f64;
        let value = self.products.iter().sum::<f64>() / count.max(1.0);
        let scatter = self.products.iter().map(|product| (product - value).powi(2)).sum::<f64>();
        Squared { value, deviation: (scatter / (count * (count - 1.0)).max(1.0)).sqrt() }
    }
}

/// Of the mean chirps: what stands out of any amplitudes that the room could have, and is no turn of all of it. `room`: without
/// the person, `effect`: what is added there, `scene`: with the person, whose mean is noise to it.
fn static_squared([room, effect, scene]: [&[Parted]; 3], floor: f64) -> Squared {
    let spectra = |of: &Parted| of.clutter.iter().map(|clutter| spectrum(clutter)).collect::<Vec<_>>();
    let [room, scene] = [room, scene].map(|of| of.iter().map(spectra).collect::<Vec<_>>());
    let effect: Vec<_> = effect.iter().zip(&room).map(|(effect, room)| unturned(room, spectra(effect))).collect();
    let bins = room[0][0].len();
    let count = (2 * REACH + 1) as f64;
    let mut squared = Squared::default();
    for channel in 0..room[0].len() {
        // Over the noise, in a return's width, mean over the draws.
        let power = |bin: usize, draws: usize, value: &dyn Fn(usize, usize) -> Complex64| -> f64 {
            let around = |draw: usize| (0..=2 * REACH).map(move |step| (draw, (bin + bins + step - REACH) % bins));
            let sum: f64 = (0..draws).flat_map(around).map(|(draw, at)| value(draw, at).norm_sqr()).sum();
            sum / draws as f64 - count * floor
        };
        for start in (0..bins).step_by(BLOCK[1]) {
            let mut pairs = Pairs::new(effect.len());
            for bin in start..(start + BLOCK[1]).min(bins) {
                let before = power(bin, room.len(), &|draw, at| room[draw][channel][at]);
                let after = power(bin, room.len(), &|draw, at| room[draw][channel][at] + effect[draw][channel][at]);
                // Only what is surely the room's.
                if after < ABOVE_ROOM * (before - 2.0 * floor * (count / room.len() as f64).sqrt()) {
                    continue;
                }
                let free = power(bin, scene.len(), &|draw, at| scene[draw][channel][at]);
                let shown: Vec<Vec<Complex64>> = effect.iter().map(|draw| vec![draw[channel][bin]]).collect();
                pairs.add(&shown, 2.0 / (floor + free.max(0.0)));
            }
            squared.add(pairs.squared());
        }
    }
    squared
}

/// What an effect adds beside a turn of all that is there, `[channel][bin]`: nobody knows the phase.
fn unturned(clean: &[Vec<Complex64>], effect: Vec<Vec<Complex64>>) -> Vec<Vec<Complex64>> {
    let pairs = || clean.iter().flatten().zip(effect.iter().flatten());
    let kept: Complex64 = pairs().map(|(x, e)| x.conj() * (x + e)).sum();
    if kept == Complex64::ZERO {
        return effect;
    }
    let back = kept.conj() / kept.norm();
    let of =
        |(clean, effect): (&Vec<Complex64>, &Vec<Complex64>)| clean.iter().zip(effect).map(|(x, e)| (x + e) * back - x).collect();
    clean.iter().zip(&effect).map(of).collect()
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
    squared: Squared,
    /// Of each draw's change of covariance, what one gain for the body's return would change: projection and its weight.
    along_gain: Vec<f64>,
    gain: f64,
}

impl Moving {
    fn new(draws: usize) -> Self {
        Self { squared: Squared::default(), along_gain: vec![0.0; draws], gain: 0.0 }
    }

    fn squared(self) -> Squared {
        let mut squared = self.squared;
        if self.gain > 0.0 {
            let mut along = Pairs::new(self.along_gain.len());
            let shown: Vec<Vec<Complex64>> = self.along_gain.iter().map(|&value| vec![value.into()]).collect();
            along.add(&shown, -1.0 / self.gain);
            squared.add(along.squared());
        }
        squared
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
        let across = samples.div_ceil(BLOCK[1]);
        let blocks = loops.div_ceil(BLOCK[0]) * across;
        let mut added = vec![Pairs::new(maps.beside.len()); blocks];
        let mut changed = vec![Pairs::new(clean.len()); blocks];
        for cell in 0..loops * samples {
            let block = cell / samples / BLOCK[0] * across + cell % samples / BLOCK[1];
            let (before, after) = (mean(&clean, cell), mean(&planted, cell));
            if let Some(whitener) = whitener(&before) {
                let shown = |map: &Vec<Vec<Complex64>>| {
                    let effect = DMatrix::from_fn(channels, 1, |channel, _| map[channel][cell]);
                    (&whitener * effect).as_slice().to_vec()
                };
                added[block].add(&maps.beside.iter().map(shown).collect::<Vec<_>>(), 2.0);
            }
            // Relative to the mean of before and after: a power that rises from nothing counts finitely.
            if let Some(whitener) = whitener(&((&before + after) * Complex64::from(0.5))) {
                let identity = DMatrix::<Complex64>::identity(channels, channels);
                let gain = identity - &whitener * whitener.adjoint() * Complex64::from(floor);
                let mut shown = vec![];
                for (draw, (clean, planted)) in clean.iter().zip(&planted).enumerate() {
                    let change = &whitener * (&planted[cell] - &clean[cell]) * whitener.adjoint();
                    let along = change.iter().zip(gain.iter()).map(|(a, b)| (a * b.conj()).re).sum::<f64>();
                    self.along_gain[draw] += along / CELLS_PER_LOOK;
                    shown.push(change.as_slice().to_vec());
                }
                changed[block].add(&shown, 1.0 / CELLS_PER_LOOK);
                self.gain += gain.iter().map(Complex64::norm_sqr).sum::<f64>() / CELLS_PER_LOOK;
            }
        }
        added.iter().chain(&changed).for_each(|pairs| self.squared.add(pairs.squared()));
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
#[path = "surviving_tests.rs"]
mod tests;
