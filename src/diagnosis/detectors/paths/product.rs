//! Products of the signal with itself: two returns one after the other, object to radar to object, and the second
//! harmonic of a receiver, which doubles the phase of every receiver where the second trip has that of one arrival.
//! Both lie at the sum of two ranges and two velocities; the measurement without its noise is the best template of either.

use num_complex::Complex64;
use rayon::prelude::*;

use super::factor::{Fit, fit, matches};
use super::scene::Scene;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::denoised;
use crate::diagnosis::evidence::transform;
use crate::diagnosis::statistics::{UNDECIDED, corrected};
use crate::diagnosis::{Candidate, Correction, Cube, Estimate, Place, Volume};
use crate::effects::{self, Stage};

/// What was measured holds the products already: so often they are taken out of their own template.
const ROUNDS: usize = 3;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// What arrives at the board is that of one channel, or the mean of all.
    Bounce(Option<usize>),
    Harmonic,
}

const KINDS: [Kind; 3] = [Kind::Bounce(None), Kind::Bounce(Some(0)), Kind::Harmonic];

impl Kind {
    fn id(self) -> &'static str {
        match self {
            Self::Bounce(_) => effects::object_radar_object::ID,
            Self::Harmonic => effects::second_harmonic::ID,
        }
    }

    /// `[channel][loop · sample]`
    fn product<T: AsRef<[Complex64]>>(self, channels: &[T]) -> Vec<Vec<Complex64>> {
        let channels = channels.iter().map(AsRef::as_ref);
        match self {
            Self::Harmonic => channels.map(|channel| channel.iter().map(|value| value * value).collect()).collect(),
            Self::Bounce(place) => {
                let all: Vec<&[Complex64]> = channels.clone().collect();
                let board = place.map_or_else(|| mean(&all), |place| all[place].to_vec());
                channels.map(|channel| channel.iter().zip(&board).map(|(a, b)| a * b).collect()).collect()
            }
        }
    }
}

fn mean(channels: &[&[Complex64]]) -> Vec<Complex64> {
    let mut sum = vec![Complex64::ZERO; channels[0].len()];
    let weight = 1.0 / channels.len() as f64;
    for channel in channels {
        sum.iter_mut().zip(*channel).for_each(|(sum, value)| *sum += value * weight);
    }
    sum
}

/// The better of the two, `tried` being the looks that its p-value is corrected for. None of real samples, nor where the receiver
/// bends the signal in other ways.
pub fn find(scene: &Scene, tried: f64) -> Option<Candidate> {
    // Where the receiver bends everything, or products of other kinds are there too, these two are not the cause.
    let bent = scene.evidence.accepted.contains(&effects::adc_saturation::ID)
        || scene.evidence.accepted_unnamed.contains(&Behaviour::Quadratic);
    if scene.evidence.is_real() || bent || scene.evidence.products().mixed().is_some() {
        return None;
    }
    let products = products(scene);
    let (best, others) = products.split_first()?;
    let p_value = corrected((-(best.fit.training + best.fit.held_out).max(0.0)).exp(), tried);
    if best.fit.held_out < super::LEAST_GAIN || p_value > 1e-3 {
        return None;
    }
    let close = others.iter().filter(|other| best.fit.held_out - other.fit.held_out < UNDECIDED);
    Some(best.candidate(scene, p_value, close.map(|other| other.kind.id()).collect()))
}

/// Of all kinds that are not known yet, the best first.
fn products(scene: &Scene) -> Vec<Product> {
    let clean: Vec<Vec<Vec<Complex64>>> = (0..scene.frames()).map(|frame| denoised::frame(scene.evidence, frame)).collect();
    let unknown = KINDS.into_iter().filter(|kind| !scene.evidence.accepted.contains(&kind.id()));
    let mut products: Vec<Product> = unknown.map(|kind| fitted(scene, &clean, kind)).collect();
    products.sort_by(|a, b| b.fit.held_out.total_cmp(&a.fit.held_out));
    products
}

/// A product with its factor, and the energy that it stands for.
struct Product {
    kind: Kind,
    fit: Fit,
    energy: f64,
}

impl Product {
    fn candidate(&self, scene: &Scene, p_value: f64, look_alikes: Vec<&'static str>) -> Candidate {
        let (kind, factor) = (self.kind, self.fit.factor);
        let (estimate, statement) = self.described(scene.evidence.peak());
        let (behaves_like, stage, volume) = match kind {
            // A product with what other receivers observe turns with them, and stretches nothing on average.
            Kind::Bounce(_) => (Behaviour::PathLike, Stage::Propagation, Volume::KEPT),
            Kind::Harmonic => (Behaviour::NonLinear, Stage::Receiver, Volume::BY_SAMPLE),
        };
        // The phase between receivers is observed; the library says whose it is.
        let id = scene.evidence.info(kind.id()).map(|info| info.id);
        let behaves_like = if id.is_some() { behaves_like } else { Behaviour::Quadratic };
        Candidate {
            id,
            estimates: id.map(|_| estimate).into_iter().collect(),
            look_alikes,
            statement,
            energy: self.energy,
            correction: Correction::inverse(volume, move |cube| remove(cube, kind, factor)),
            ..Candidate::new(behaves_like, Place::at(stage), p_value, self.fit.held_out)
        }
    }

    /// Its size and a statement. `peak`: the strongest sample's amplitude.
    fn described(&self, peak: f64) -> (Estimate, String) {
        let size = self.fit.factor.norm();
        let (value, deviation) = (size * peak, peak * self.fit.deviation.max(0.05 * size));
        let level_db = 20.0 * value.max(1e-12).log10();
        match self.kind {
            Kind::Bounce(_) => (
                Estimate::normal("coefficient", value, deviation),
                format!(
                    "Returns go out a second time: at the sum of two ranges and two velocities lies {level_db:.0} dB (of the peak \
                     sample) of their product, with the array phase of one arrival, not twice that phase."
                ),
            ),
            Kind::Harmonic => (
                Estimate::normal("level_db", level_db, denoised::PEAK_DB.hypot(8.7 * deviation / value.max(1e-12))),
                format!(
                    "everything has a second harmonic, at twice its beat frequency and velocity and with twice the phase of every \
                     receiver: {level_db:.1} dB at the strongest sample"
                ),
            ),
        }
    }
}

fn fitted(scene: &Scene, clean: &[Vec<Vec<Complex64>>], kind: Kind) -> Product {
    let mut products: Vec<Vec<Vec<Complex64>>> = clean.par_iter().map(|frame| kind.product(frame)).collect();
    let samples = scene.samples;
    let judge = |products: &[Vec<Vec<Complex64>>]| {
        // As in the measured maps, static clutter in all frames is left out.
        let clutter: Vec<Vec<Complex64>> = (0..products[0].len())
            .map(|channel| mean_chirp(products.iter().flat_map(|frame| frame[channel].chunks_exact(samples)), samples))
            .collect();
        let moving = |frame: usize, channel: usize| -> Vec<Complex64> {
            products[frame][channel].iter().enumerate().map(|(i, value)| value - clutter[channel][i % samples]).collect()
        };
        fit(scene, &matches(scene, |frame, channel| transform(&moving(frame, channel), samples)))
    };
    let mut found = judge(&products);
    for _ in 1..ROUNDS {
        if found.training < super::LEAST_GAIN {
            break;
        }
        let factor = found.factor;
        let without = |(frame, product): (&Vec<Vec<Complex64>>, &Vec<Vec<Complex64>>)| {
            let linear: Vec<Vec<Complex64>> =
                frame.iter().zip(product).map(|(s, p)| s.iter().zip(p).map(|(s, p)| s - factor * p).collect()).collect();
            kind.product(&linear)
        };
        let refined: Vec<Vec<Vec<Complex64>>> = clean.par_iter().zip(&products).map(without).collect();
        let refit = judge(&refined);
        if refit.training <= found.training {
            break;
        }
        (products, found) = (refined, refit);
    }
    let energy = products.iter().flatten().flatten().map(|value| (found.factor * value).norm_sqr()).sum();
    Product { kind, fit: found, energy }
}

/// Undoes it in two steps, which are enough for what is small.
fn remove(cube: &mut Cube, kind: Kind, factor: Complex64) {
    let (channels, size) = (cube.channels(), cube.dims[3] * cube.dims[4]);
    cube.samples.par_chunks_exact_mut(channels * size).for_each(|frame| {
        let found: Vec<Vec<Complex64>> = frame.chunks_exact(size).map(<[Complex64]>::to_vec).collect();
        let without = |product: Vec<Vec<Complex64>>| -> Vec<Vec<Complex64>> {
            found.iter().zip(product).map(|(s, p)| s.iter().zip(p).map(|(s, p)| s - factor * p).collect()).collect()
        };
        let linear = without(kind.product(&without(kind.product(&found))));
        frame.copy_from_slice(&linear.concat());
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_added_is_removed_and_the_two_kinds_differ() {
        let tone = |rate: f64, rx: f64| (0..64).map(move |n| Complex64::cis(rate * f64::from(n) + rx)).collect::<Vec<_>>();
        let signal: Vec<Vec<Complex64>> = [0.0, 1.0].map(|rx| tone(0.5, rx)).to_vec();
        assert_ne!(Kind::Bounce(Some(0)).product(&signal)[1], Kind::Harmonic.product(&signal)[1]);
        for kind in KINDS {
            let factor = Complex64::new(0.02, 0.01);
            let product = kind.product(&signal);
            let with: Vec<Complex64> =
                signal.iter().flatten().zip(product.iter().flatten()).map(|(s, p)| s + factor * p).collect();
            let mut cube = Cube::new([1, 1, 2, 2, 32], with);
            remove(&mut cube, kind, factor);
            let worst = cube.samples.iter().zip(signal.iter().flatten()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(worst < 1e-3, "{worst}");
        }
    }
}
