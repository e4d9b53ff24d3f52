//! How uneven static clutter is along range, beyond speckle.
//!
//! The power of a range cell is that of speckle, exponential, times a texture τ of mean one: a gamma law of shape ν (the compound model of
//! radar clutter; K. D. Ward, "Compound representation of high resolution sea clutter", Electronics Letters 17, 1981). The variance of the
//! logarithm of such a power is ψ'(1) + ψ'(ν), which the cells show. A floor of a few glints has a small ν, an even one a large one.

use num_complex::Complex64;
use statrs::distribution::{Continuous, Gamma};

/// Variance of the logarithm of an exponential variable, ψ'(1).
const OF_SPECKLE: f64 = std::f64::consts::PI * std::f64::consts::PI / 6.0;
/// Ranges to either side whose mean a logarithm is compared with.
const AROUND: usize = 10;
/// Shapes beyond this are none: the texture differs from one by a tenth.
const EVEN: f64 = 100.0;
/// Least shape: below it, nearly all power is in one cell of a hundred.
const LEAST: f64 = 0.1;
/// Steps of the integral over ln τ, between these.
const STEPS: usize = 400;
const LOG_TEXTURE: [f64; 2] = [-20.0, 6.0];

/// Values of the texture with their weights, which sum to one.
pub struct Texture(Vec<[f64; 2]>);

impl Texture {
    /// Of spectra `[channel][range]`, at the ranges that count.
    pub fn of(spectra: &[Vec<Complex64>], counts: impl Fn(usize) -> bool) -> Self {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for channel in spectra {
            let bins: Vec<usize> = (0..channel.len()).filter(|&bin| counts(bin) && channel[bin] != Complex64::ZERO).collect();
            let logs: Vec<f64> = bins.iter().map(|&bin| channel[bin].norm_sqr().ln()).collect();
            for (index, &bin) in bins.iter().enumerate() {
                let near = bins.iter().zip(&logs).filter(|(other, _)| other.abs_diff(bin) <= AROUND && **other != bin);
                let (sum, count) = near.fold((0.0, 0.0), |(sum, count), (_, log)| (sum + log, count + 1.0));
                if count > 0.0 {
                    // The mean of others has an error of its own.
                    squares += (logs[index] - sum / count).powi(2) / (1.0 + 1.0 / count);
                    freedom += 1.0;
                }
            }
        }
        let excess = if freedom > 0.0 { squares / freedom - OF_SPECKLE } else { 0.0 };
        // ψ'(ν) = 1/ν + 1/(2ν²) + …
        Self::of_shape(if excess > 0.0 { (1.0 + (1.0 + 2.0 * excess).sqrt()) / (2.0 * excess) } else { f64::INFINITY })
    }

    fn of_shape(shape: f64) -> Self {
        let law = Gamma::new(shape.max(LEAST), shape.max(LEAST)).ok().filter(|_| shape < EVEN);
        let Some(law) = law else { return Self(vec![[1.0, 1.0]]) };
        let [low, high] = LOG_TEXTURE;
        let log = |step: usize| low + (high - low) * (step as f64 + 0.5) / STEPS as f64;
        let values: Vec<[f64; 2]> = (0..STEPS).map(|step| log(step).exp()).map(|value| [value, value * law.pdf(value)]).collect();
        let sum: f64 = values.iter().map(|[_, weight]| weight).sum();
        Self(values.into_iter().map(|[value, weight]| [value, weight / sum]).collect())
    }

    /// Mean of what depends on the texture.
    pub fn mean_over(&self, of: impl Fn(f64) -> f64) -> f64 {
        self.0.iter().map(|[value, weight]| weight * of(*value)).sum()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Gamma as Drawn, StandardNormal};

    use super::*;

    /// Speckle times a texture of a shape.
    fn spectra(shape: Option<f64>) -> Vec<Vec<Complex64>> {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let speckle: Vec<Complex64> = (0..400).map(|_| Complex64::new(draw(), draw())).collect();
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let law = shape.map(|shape| Drawn::new(shape, 1.0 / shape).unwrap());
        vec![speckle.into_iter().map(|value| value * law.map_or(1.0, |law| law.sample(&mut random)).sqrt()).collect()]
    }

    #[test]
    fn even_clutter_is_speckle_and_glints_have_long_tails() {
        let tail = |ratio: f64| move |texture: f64| (-ratio / texture).exp();
        let even = Texture::of(&spectra(None), |_| true);
        assert!((even.mean_over(|texture| texture) - 1.0).abs() < 1e-2);
        assert!(even.mean_over(tail(20.0)) < 1e-6);
        let glints = Texture::of(&spectra(Some(0.4)), |_| true);
        // The mean of a gamma law of this shape, and its tail: E exp(−20/τ).
        assert!((glints.mean_over(|texture| texture) - 1.0).abs() < 2e-2);
        let at_twenty = glints.mean_over(tail(20.0));
        assert!((3e-4..1e-2).contains(&at_twenty), "{at_twenty}");
    }
}
