//! Products of the signal with itself, as non-linear receivers make them, measured where neither room nor body can be.
//!
//! The denoised signal's square, squared magnitude and cube are transformed like the signal itself; in empty cells one
//! complex number must relate a product to what was measured, everywhere.

use num_complex::Complex64;
use rayon::prelude::*;

use super::beat::empty_bins;
use super::denoised;
use super::{Evidence, spectrum, transform};
use crate::diagnosis::cube::{folds, mean_chirp};
use crate::diagnosis::statistics::{chi2_tail, corrected};

#[derive(Clone, Copy, Default)]
struct Sums {
    cross: Complex64,
    template: f64,
    found: f64,
    cells: usize,
}

/// A product of the signal with itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Product {
    /// s²
    Square,
    /// |s|²
    Magnitude,
    /// |s|² s
    Cube,
}

impl Product {
    /// The product of one sample.
    fn of(self, value: Complex64) -> Complex64 {
        match self {
            Self::Square => value * value,
            Self::Magnitude => value.norm_sqr().into(),
            Self::Cube => value * value.norm_sqr(),
        }
    }

    /// For factors that are shares of the peak sample.
    pub fn scale(self, peak: f64) -> f64 {
        if self == Self::Cube { 1.0 / (peak * peak) } else { 1.0 / peak }
    }
}

/// How much of a product is in the recording.
#[derive(Clone, Copy)]
pub struct Law {
    pub product: Product,
    pub kappa: Complex64,
    pub p_value: f64,
    /// Of frames that the others predict, all in turn.
    pub gain: f64,
    pub peak: f64,
}

/// A sample as it was before some laws acted on it.
pub fn without(laws: &[Law], found: Complex64) -> Complex64 {
    let distortion = |value: Complex64| -> Complex64 {
        laws.iter().map(|law| law.kappa * law.product.scale(law.peak) * law.product.of(value)).sum()
    };
    // The distortion of the undistorted sample.
    (0..STEPS).fold(found, |value, _| found - distortion(value))
}

/// A magnitude squared at least this large beside a square makes it no harmonic.
const BESIDE: f64 = 0.3;
/// Least log-likelihood gain on other frames for it, nats.
const LEAST_GAIN: f64 = 20.0;
/// Steps by which a distortion is undone: each leaves a part of the last in proportion to how strong the distortion is.
const STEPS: usize = 6;
/// Chance below which it is there.
const SURELY: f64 = 1e-6;

const PRODUCTS: [Product; 3] = [Product::Square, Product::Magnitude, Product::Cube];

/// What was found of each.
#[derive(Clone, Default)]
pub struct Products {
    square: Option<Law>,
    magnitude: Option<Law>,
    cube: Option<Law>,
}

impl Products {
    /// Nothing of a real recording, or where no cells are empty.
    pub fn new(evidence: &Evidence) -> Self {
        let empty = empty_bins(evidence);
        if evidence.is_real() || !empty.contains(&true) || evidence.peak() <= 0.0 {
            return Self::default();
        }
        let [square, magnitude, cube] = found(evidence, &empty);
        Self { square, magnitude, cube }
    }

    /// Square and magnitude squared, if the latter is there and nearly as large: no mere second harmonic and no second
    /// trip. An oscillator that the signal pulls does it, or mixers whose I and Q are bent each on its own. Then no static
    /// return, and no tone, is distinguishable from such a product.
    pub fn mixed(&self) -> Option<Vec<Law>> {
        let magnitude = self.magnitude.filter(|law| law.p_value < SURELY && law.gain > LEAST_GAIN)?;
        // A receiver that compresses leaves a little of it too.
        if self.cube.is_some_and(|cube| cube.gain > magnitude.gain) {
            return None;
        }
        let square = self.square.filter(|law| law.p_value < SURELY);
        let beside = square.is_none_or(|square| magnitude.kappa.norm() > BESIDE * square.kappa.norm());
        beside.then(|| square.into_iter().chain([magnitude]).collect())
    }
}

/// How much of the products of the signal is in the recording.
fn found(evidence: &Evidence, empty: &[bool]) -> [Option<Law>; 3] {
    let peak = evidence.peak();
    let of_frame = |frame| of_frame(evidence, frame, empty);
    let sums: Vec<[Sums; 3]> = (0..evidence.cube.dims[0]).into_par_iter().map(of_frame).collect();
    std::array::from_fn(|index| {
        let of_product: Vec<Sums> = sums.iter().map(|sums| sums[index]).collect();
        judged(PRODUCTS[index], &of_product, peak)
    })
}

/// None where it is not to be expected, or frames that it was not fitted to are worse with it. `sums`: by frame.
fn judged(product: Product, sums: &[Sums], peak: f64) -> Option<Law> {
    let whole = total(sums.iter());
    if whole.template <= 0.0 {
        return None;
    }
    let kappa = whole.cross / whole.template;
    let rest = (whole.found - kappa.norm_sqr() * whole.template) / whole.cells.max(1) as f64;
    // Windowed neighbours share their noise; other things in the cells count as more of it.
    let widening = 2.25 * rest.max(1.0);
    let variance = widening / whole.template;
    // Frames must agree on it as well as the noise lets expect.
    let scatter = jackknife(sums, &whole).max(variance.sqrt());
    let p_value = corrected(chi2_tail(2.0 * kappa.norm_sqr() / (scatter * scatter), 2.0), 2.0);
    // Every frame is predicted by those of the other folds.
    let of_fold = |parts: [Vec<usize>; 2]| {
        let [rest, fold] = parts.map(|frames| total(frames.into_iter().map(|frame| &sums[frame])));
        let kappa = rest.cross / rest.template.max(f64::MIN_POSITIVE);
        (2.0 * (kappa.conj() * fold.cross).re - kappa.norm_sqr() * fold.template) / widening
    };
    let gain: f64 = folds(sums.len()).map(of_fold).sum();
    // A receiver that expands instead of compressing, or turns phases more than amplitudes, is none.
    let possible = gain > 0.0 && !(product == Product::Cube && kappa.re > 0.0);
    possible.then_some(Law { product, kappa, p_value, gain, peak })
}

/// Templates are scaled by the peak sample, so that κ is a share of it.
fn of_frame(evidence: &Evidence, frame: usize, empty: &[bool]) -> [Sums; 3] {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let mut sums = [Sums::default(); 3];
    for channel in 0..evidence.cube.channels() {
        let noise = evidence.noise()[channel].max(1e-300);
        let clean = denoised::channel(evidence, frame, channel);
        let [found, clutter] = moving_and_clutter(evidence.cube.channel(frame, channel).to_vec(), samples);
        for (product, sums) in PRODUCTS.into_iter().zip(&mut sums) {
            let scale = product.scale(evidence.peak());
            let template = clean.iter().map(|value| product.of(*value) * scale).collect();
            let [expected, mean] = moving_and_clutter(template, samples);
            for range in (0..samples).filter(|&range| empty[range]) {
                for doppler in 1..loops {
                    sums.count(found[doppler * samples + range], expected[doppler * samples + range], noise);
                }
                // An offset or a leakage is near zero; static clutter elsewhere counts.
                if range > 8 && range + 8 < samples {
                    sums.count(clutter[range], mean[range], noise / loops as f64);
                }
            }
        }
    }
    sums
}

/// The map of what changes within a frame, `[doppler, range]`, and the spectrum of what does not, `[range]`.
fn moving_and_clutter(mut signal: Vec<Complex64>, samples: usize) -> [Vec<Complex64>; 2] {
    let clutter = mean_chirp(signal.chunks_exact(samples), samples);
    for chirp in signal.chunks_exact_mut(samples) {
        chirp.iter_mut().zip(&clutter).for_each(|(value, clutter)| *value -= clutter);
    }
    [transform(&signal, samples), spectrum(&clutter)]
}

impl Sums {
    fn count(&mut self, found: Complex64, expected: Complex64, noise: f64) {
        // Untracked movers far above what could be predicted are left out by a bound on their say.
        let bounded = found * (6.0 * (noise + 0.01 * expected.norm_sqr()).sqrt() / found.norm().max(1e-300)).min(1.0);
        self.cross += expected.conj() * bounded / noise;
        self.template += expected.norm_sqr() / noise;
        self.found += bounded.norm_sqr() / noise;
        self.cells += 1;
    }
}

fn total<'a>(sums: impl Iterator<Item = &'a Sums>) -> Sums {
    sums.fold(Sums::default(), |a, b| Sums {
        cross: a.cross + b.cross,
        template: a.template + b.template,
        found: a.found + b.found,
        cells: a.cells + b.cells,
    })
}

/// Scatter of κ among the frames.
fn jackknife(sums: &[Sums], whole: &Sums) -> f64 {
    let without = |sums: &Sums| (whole.cross - sums.cross) / (whole.template - sums.template);
    let spread: f64 = sums
        .iter()
        .filter(|sums| whole.template > sums.template)
        .map(|sums| (without(sums) - whole.cross / whole.template).norm_sqr())
        .sum();
    let count = sums.len() as f64;
    (spread * (count - 1.0) / count).sqrt()
}
