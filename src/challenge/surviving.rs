//! What of an effect survives everything that nobody can know about the body and the room: the d′ of rung E of the
//! capacity ladder (DIAGNOSIS.md, 0.6), which a millimetre of mesh error and learned reflectivities cannot explain away.
//!
//! Nuisances, each with the size that the recording itself has:
//! - whatever stands still may return any amplitude at any range in every channel;
//! - what moves is, in every frame, known only up to mixing: its return in a range-Doppler cell may be any combination of
//!   the returns that reach the cell, with weights of unit variance. What channels differ by is not mixed away;
//! - the power that moves in and around a cell is known, as it follows from where the surface is: a change of it counts
//!   as much as one exponentially distributed power can show.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::measure::Frames;
use crate::diagnosis::evidence::{spectrum, transform};

/// A neighbourhood whose mean power is below this many times the noise's holds no return.
const RETURN_OVER_NOISE: f64 = 4.0;
/// A return reaches two cells to either side: half the main lobe of a Hann window.
const REACH: std::ops::Range<usize> = 0..5;
/// Cells per independent power: the noise bandwidth of two Hann windows, in bins.
const CELLS_PER_POWER: f64 = 1.5 * 1.5;

/// d′ of an effect, the difference that it makes to a recording (`clean`, noise included).
/// `noise`: variance of a complex sample's noise.
pub fn d_prime(clean: &Frames, effect: &Frames, noise: f64) -> f64 {
    let (still, still_effect) = (clean.mean_chirp(), effect.mean_chirp());
    let (mut squared, mut ratios) = (standing(&still, &still_effect, clean, noise), vec![]);
    for frame in 0..clean.count() {
        let (x, e) = (clean.maps_without(frame, &still), effect.maps_without(frame, &still_effect));
        squared += moving(&x, &e, clean.dims, noise, &mut ratios);
    }
    // One gain for all of them is unknown.
    let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
    squared += ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / CELLS_PER_POWER;
    squared.max(0.0).sqrt()
}

/// Of the mean chirps, `[channel][sample]`.
fn standing(still: &[Vec<Complex64>], effect: &[Vec<Complex64>], clean: &Frames, noise: f64) -> f64 {
    let chirps = (clean.count() * clean.dims[1]) as f64;
    let floor = noise / chirps;
    let mut squared = 0.0;
    for (x, e) in still.iter().zip(effect) {
        let (x, e) = (spectrum(x), spectrum(e));
        let bins = x.len();
        for (bin, e) in e.iter().enumerate() {
            let free: f64 = REACH.map(|step| x[(bin + bins + step - 2) % bins].norm_sqr()).sum();
            squared += 2.0 * e.norm_sqr() / (floor + (free - REACH.len() as f64 * floor).max(0.0));
        }
    }
    squared
}

/// Of one frame's maps, `[channel][doppler · range]`; `ratios` takes the logarithms of the powers' changes.
fn moving(x: &[Vec<Complex64>], e: &[Vec<Complex64>], dims: [usize; 3], floor: f64, ratios: &mut Vec<f64>) -> f64 {
    let [channels, loops, samples] = dims;
    let mut squared = 0.0;
    for doppler in 0..loops {
        for range in 0..samples {
            let cell = doppler * samples + range;
            let around: Vec<usize> = REACH
                .flat_map(|d| REACH.map(move |r| [d, r]))
                .map(|[d, r]| (doppler + loops + d - 2) % loops * samples + (range + samples + r - 2) % samples)
                .collect();
            let power = |of: &dyn Fn(usize, usize) -> Complex64| -> f64 {
                around.iter().map(|&at| (0..channels).map(|k| of(k, at).norm_sqr()).sum::<f64>()).sum()
            };
            let before = power(&|k, at| x[k][at]);
            let background = floor * (channels * around.len()) as f64;
            let here = DVector::from_iterator(channels, e.iter().map(|map| map[cell]));
            if before < RETURN_OVER_NOISE * background {
                squared += 2.0 * here.norm_squared() / floor;
                continue;
            }
            let mixing = DMatrix::from_fn(channels, around.len(), |k, at| x[k][around[at]]);
            let covariance = &mixing * mixing.adjoint() + DMatrix::identity(channels, channels) * Complex64::from(floor);
            let whitened = covariance.cholesky().map(|factor| factor.solve(&here));
            squared += whitened.map_or(0.0, |whitened| 2.0 * here.dotc(&whitened).re);
            let after = power(&|k, at| x[k][at] + e[k][at]);
            ratios.push(((after + background) / (before + background)).ln());
        }
    }
    squared
}

/// The maps of a frame without what stands still.
impl Frames {
    fn mean_chirp(&self) -> Vec<Vec<Complex64>> {
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

    fn maps_without(&self, frame: usize, still: &[Vec<Complex64>]) -> Vec<Vec<Complex64>> {
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
    use rand::SeedableRng;
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

    #[test]
    fn where_nothing_else_is_the_d_prime_is_the_coherent_one() {
        let clean = noisy(frames(4, |_, _, slow, fast| tone(4.0, 8.0, slow, fast) * 30.0), 1);
        let effect = frames(4, |_, _, slow, fast| tone(-5.0, 20.0, slow, fast) * 0.3);
        // 4096 samples of energy 0.09, noise of variance 2
        let wanted = (2.0 * 4096.0 * 0.09 / 2.0f64).sqrt();
        let found = d_prime(&clean, &effect, 2.0);
        assert!((found / wanted - 1.0).abs() < 0.1, "{found} against {wanted}");
    }

    #[test]
    fn an_unknown_phase_of_the_body_and_an_amplitude_of_the_room_hide_what_only_changes_them() {
        let body =
            |frame: usize, slow: usize, fast: usize| tone(4.0, 8.0, slow, fast) * Complex64::cis(1.7 * frame as f64) * 30.0;
        let clean = noisy(frames(4, |frame, _, slow, fast| body(frame, slow, fast) + tone(0.0, 20.0, slow, fast) * 30.0), 2);
        let turned = frames(4, |frame, _, slow, fast| body(frame, slow, fast) * (Complex64::cis(0.4 * frame as f64) - 1.0));
        let wall = frames(4, |_, _, slow, fast| tone(0.0, 20.0, slow, fast) * 6.0);
        let coherent = |effect: &Frames| (effect.values.iter().flatten().map(Complex64::norm_sqr).sum::<f64>()).sqrt();
        for effect in [&turned, &wall] {
            let found = d_prime(&clean, effect, 2.0);
            assert!(coherent(effect) > 200.0 && found < 8.0, "{} and {found}", coherent(effect));
        }
        // and a difference between the channels is not hidden
        let one = frames(4, |frame, channel, slow, fast| body(frame, slow, fast) * if channel == 0 { 0.1 } else { -0.1 });
        assert!(d_prime(&clean, &one, 2.0) > 30.0);
    }
}
