//! What of an effect survives everything that nobody can know about the body and the room: the d′ of rung E of the
//! capacity ladder (DIAGNOSIS.md, 0.6), which a millimetre of mesh error and learned reflectivities cannot explain away.
//!
//! The scene is recorded twice, with two draws of the mesh's error and of the noise, each without and with the effect.
//! What the effect does to both alike can be known; what it does to each in another way depends on phases that nobody
//! has. So everything here is a product of the two draws, in which the latter vanishes: another draw of the mesh's error
//! itself has a d′ of zero.
//!
//! - Whatever stands still may return any amplitude at any range in every channel.
//! - What moves is random in every frame, with the covariance between the channels that it has around a range-Doppler
//!   cell. The effect shows as a mean (the same difference in both draws) and as a change of the covariance; a mean far
//!   above the noise as both, which makes its d′ up to a fifth too large.
//! - The power of what moves around a cell is known but for a factor of e, and one gain for all of it is unknown.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::measure::Frames;
use crate::diagnosis::evidence::{spectrum, transform};

/// A return reaches two cells to either side: half the main lobe of a Hann window.
const REACH: std::ops::Range<usize> = 0..5;
/// Power that what stands still may have around a bin, over the power that it has: any amplitude.
const ANY_AMPLITUDE: f64 = 100.0;
/// Cells per independent power: the noise bandwidth of two Hann windows, in bins.
const CELLS_PER_POWER: f64 = 1.5 * 1.5;

/// d′ of an effect. `clean`: recordings of two draws, noise included; `effect`: the difference that it makes to each.
/// `noise`: variance of a complex sample's noise.
pub fn d_prime(clean: [&Frames; 2], effect: [&Frames; 2], noise: f64) -> f64 {
    let still = clean.map(Frames::mean_chirp);
    let still_effect = effect.map(Frames::mean_chirp);
    let chirps = (clean[0].count() * clean[0].dims[1]) as f64;
    let mut squared = standing(&still, &still_effect, noise / chirps);
    let mut gain = Gain::default();
    for frame in 0..clean[0].count() {
        let maps = |of: [&Frames; 2], still: &[Chirps; 2]| [0, 1].map(|draw| of[draw].maps_without(frame, &still[draw]));
        squared += moving(&maps(clean, &still), &maps(effect, &still_effect), clean[0].dims, noise, &mut gain);
    }
    (squared - gain.explained()).max(0.0).sqrt()
}

/// `[channel][sample]`
type Chirps = Vec<Vec<Complex64>>;
/// `[channel][doppler · range]`
type Maps = Vec<Vec<Complex64>>;

/// How much of the change of powers one gain explains: products of both draws' changes with it, and its square.
#[derive(Default)]
struct Gain {
    changes: [f64; 2],
    squared: f64,
}

impl Gain {
    fn explained(&self) -> f64 {
        if self.squared > 0.0 { self.changes[0] * self.changes[1] / self.squared } else { 0.0 }
    }
}

/// Of the mean chirps of both draws; `floor`: their noise.
fn standing(still: &[Chirps; 2], effect: &[Chirps; 2], floor: f64) -> f64 {
    let mut squared = 0.0;
    for channel in 0..still[0].len() {
        let [x, other] = [0, 1].map(|draw| spectrum(&still[draw][channel]));
        let [e, f] = [0, 1].map(|draw| spectrum(&effect[draw][channel]));
        let bins = x.len();
        for bin in 0..bins {
            let power = |of: &[Complex64]| REACH.map(|step| of[(bin + bins + step - 2) % bins].norm_sqr()).sum::<f64>();
            let free = (power(&x) + power(&other)) / 2.0 - REACH.len() as f64 * floor;
            squared += 2.0 * (e[bin].conj() * f[bin]).re / (floor + ANY_AMPLITUDE * free.max(0.0));
        }
    }
    squared
}

/// Of one frame's maps of both draws.
fn moving(x: &[Maps; 2], e: &[Maps; 2], dims: [usize; 3], floor: f64, gain: &mut Gain) -> f64 {
    let [channels, loops, samples] = dims;
    let identity = DMatrix::identity(channels, channels) * Complex64::from(floor);
    // An inverse of a covariance from few values is too large by this (the mean of an inverse Wishart matrix).
    let looks = 2.0 * (REACH.len() * REACH.len()) as f64 / CELLS_PER_POWER;
    let shrunk = ((looks - channels as f64) / looks).max(0.1);
    let mut squared = 0.0;
    for doppler in 0..loops {
        for range in 0..samples {
            let cell = doppler * samples + range;
            let around: Vec<usize> = REACH
                .flat_map(|d| REACH.map(move |r| [d, r]))
                .map(|[d, r]| (doppler + loops + d - 2) % loops * samples + (range + samples + r - 2) % samples)
                .collect();
            let covariance = |value: &dyn Fn(usize, usize) -> Complex64| -> DMatrix<Complex64> {
                let values = DMatrix::from_fn(channels, around.len(), |k, at| value(k, around[at]));
                &values * values.adjoint() / Complex64::from(around.len() as f64)
            };
            let before = [0, 1].map(|draw| covariance(&|k, at| x[draw][k][at]));
            let after = [0, 1].map(|draw| covariance(&|k, at| x[draw][k][at] + e[draw][k][at]));
            let mean = (&before[0] + &before[1]) / Complex64::from(2.0);
            // Halfway to the covariance with the effect: distances of powers saturate.
            let middle = (&mean + (&after[0] + &after[1]) / Complex64::from(2.0)) / Complex64::from(2.0);
            // What the draws' effects differ by is as random as the body.
            let unlike = covariance(&|k, at| e[0][k][at] - e[1][k][at]) / Complex64::from(2.0);
            let (Some(alone), Some(middle)) = ((&mean + unlike).cholesky(), middle.cholesky()) else { continue };
            let [here, there] = [0, 1].map(|draw| DMatrix::from_fn(channels, 1, |k, _| e[draw][k][cell]));
            squared += 2.0 * shrunk * (here.adjoint() * alone.solve(&there))[0].re;
            // Fisher's metric of covariances, less what an unknown power of the body explains
            let inverse = middle.inverse() * Complex64::from(shrunk);
            let returned = &inverse * (mean - &identity);
            let changed = [0, 1].map(|draw| &inverse * (&after[draw] - &before[draw]));
            let metric = |a: &DMatrix<Complex64>, b: &DMatrix<Complex64>| (a * b).trace().re / CELLS_PER_POWER;
            let known = metric(&returned, &returned);
            let along = [0, 1].map(|draw| metric(&changed[draw], &returned) / (1.0 + known));
            squared += metric(&changed[0], &changed[1]) - along[0] * along[1] * (1.0 + known);
            gain.changes[0] += along[0];
            gain.changes[1] += along[1];
            gain.squared += known / (1.0 + known);
        }
    }
    squared
}

/// The maps of a frame without what stands still.
impl Frames {
    fn mean_chirp(&self) -> Chirps {
        let [channels, loops, samples] = self.dims;
        let weight = 1.0 / (loops * self.count()) as f64;
        let mut mean = vec![vec![Complex64::ZERO; samples]; channels];
        for frame in &self.values {
            for (index, value) in frame.iter().enumerate() {
                mean[index / (loops * samples)][index % samples] += value * weight;
            }
        }
        mean
    }

    fn maps_without(&self, frame: usize, still: &Chirps) -> Maps {
        let [_, loops, samples] = self.dims;
        let channels = self.values[frame].chunks_exact(loops * samples);
        channels
            .zip(still)
            .map(|(channel, still)| {
                let moving: Vec<Complex64> = channel.iter().enumerate().map(|(i, value)| value - still[i % samples]).collect();
                transform(&moving, samples)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const DIMS: [usize; 3] = [2, 16, 32];
    const FRAMES: usize = 4;

    fn frames(value: impl Fn(usize, usize, usize, usize) -> Complex64) -> Frames {
        let [channels, loops, samples] = DIMS;
        let values = (0..FRAMES).map(|frame| {
            (0..channels * loops * samples)
                .map(|i| value(frame, i / (loops * samples), i / samples % loops, i % samples))
                .collect()
        });
        Frames { dims: DIMS, values: values.collect() }
    }

    fn tone(doppler: f64, range: f64, slow: usize, fast: usize) -> Complex64 {
        Complex64::cis(std::f64::consts::TAU * (doppler * slow as f64 / 16.0 + range * fast as f64 / 32.0))
    }

    fn noisy(of: &Frames, seed: u64) -> Frames {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let add = |frame: &Vec<Complex64>| frame.iter().map(|value| value + Complex64::new(normal(), normal())).collect();
        Frames { dims: of.dims, values: of.values.iter().map(add).collect() }
    }

    /// A body of many points with other phases in every draw, as the mesh's error gives them, and a wall.
    fn scene(draw: u64) -> impl Fn(usize, usize, usize, usize) -> Complex64 {
        let mut random = ChaCha8Rng::seed_from_u64(draw);
        let points: Vec<[f64; 3]> = (0..FRAMES * 6).map(|_| std::array::from_fn(|_| random.random_range(0.0..1.0))).collect();
        move |frame, _, slow, fast| {
            let point = |[doppler, range, phase]: &[f64; 3]| {
                tone(3.0 + 2.0 * doppler, 7.0 + 3.0 * range, slow, fast) * Complex64::cis(std::f64::consts::TAU * phase)
            };
            points[frame * 6..][..6].iter().map(point).sum::<Complex64>() * 30.0 + tone(0.0, 20.0, slow, fast) * 30.0
        }
    }

    /// Of an effect that answers to what is there without it.
    fn found(effect: impl Fn(u64, [usize; 4], Complex64) -> Complex64) -> f64 {
        let draws = [1, 2];
        let clean = draws.map(|draw| noisy(&frames(scene(draw)), 10 + draw));
        let effects = draws.map(|draw| {
            let scene = scene(draw);
            frames(|frame, channel, slow, fast| effect(draw, [frame, channel, slow, fast], scene(frame, channel, slow, fast)))
        });
        d_prime([&clean[0], &clean[1]], [&effects[0], &effects[1]], 2.0)
    }

    #[test]
    fn where_nothing_else_is_the_d_prime_is_the_coherent_one() {
        // 4096 samples of energy 0.01, noise of variance 2
        let wanted = (2.0 * 4096.0 * 0.01 / 2.0f64).sqrt();
        let found = found(|_, [_, _, slow, fast], _| tone(-5.0, 20.0, slow, fast) * 0.1);
        assert!((found / wanted - 1.0).abs() < 0.15, "{found} against {wanted}");
    }

    #[test]
    fn another_draw_of_the_meshs_error_is_nothing() {
        let other = [scene(5), scene(6)];
        let found = found(|draw, [frame, channel, slow, fast], value| {
            other[draw as usize - 1](frame, channel, slow, fast) - value
        });
        // √(2 · 4096 samples · 12 points of 900 / 2): who knew the phases would see thousands
        assert!(found < 12.0, "{found}");
    }

    #[test]
    fn what_only_changes_the_rooms_amplitudes_or_the_bodys_phases_is_hidden() {
        let wall = found(|_, [_, _, slow, fast], _| tone(0.0, 20.0, slow, fast) * 6.0);
        let turned = found(|_, [frame, _, slow, fast], value| {
            (value - tone(0.0, 20.0, slow, fast) * 30.0) * (Complex64::cis(0.4 * frame as f64) - 1.0)
        });
        assert!(wall < 8.0 && turned < 12.0, "{wall} and {turned}");
    }

    #[test]
    fn a_difference_between_the_channels_is_not_hidden() {
        let one = found(|_, [_, channel, ..], value| value * if channel == 0 { 0.1 } else { -0.1 });
        // About 60 cells in four frames, each of which can say that the covariance is another one, but not more.
        assert!(one > 15.0, "{one}");
    }

    #[test]
    fn power_of_unknown_phase_where_nothing_is_shows_as_power() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let phases: Vec<f64> = (0..3 * FRAMES).map(|_| random.random_range(0.0..6.3)).collect();
        let of = |amplitude: f64| {
            found(|draw, [frame, _, slow, fast], _| {
                tone(-5.0, 15.0, slow, fast) * Complex64::cis(phases[draw as usize * FRAMES + frame]) * amplitude
            })
        };
        let (weak, strong) = (of(0.02), of(1.0));
        assert!(weak < 3.0 && strong > 10.0, "{weak} and {strong}");
    }
}
