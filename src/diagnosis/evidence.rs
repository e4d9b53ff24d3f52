//! A recording as far as it is explained so far, and what every detector needs of it.

pub mod beat;
pub mod denoised;
pub mod power;
pub mod products;
mod shape;
mod still;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use hybridsim_fft::{Fft, FftDirection, FftPlanner};
use num_complex::Complex64;
use rayon::prelude::*;

use super::codes::{self, Component};
use super::course::Course;
#[cfg(test)]
use super::cube;
use super::cube::{Cube, Loaded, Split};
use super::finding::{Cells, Undo, Volume};
use super::prediction::BodyPrediction;
use super::statistics;
use super::tones::Tones;
use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{self, EffectInfo};
use crate::grid::Grid;
use crate::radar::{Radar, Sampling};
use crate::room::Room;
use power::PowerModel;
use products::Products;
pub use still::{MAY_MOVE, REACH_M};

/// Share of the strongest cell below which there is not even noise.
const EMPTIED: f64 = 1e-20;

/// Range of the farthest echo where no room is known.
const FARTHEST_M: f64 = 10.0;

/// What the detectors look at. Cheap products are computed once and shared.
#[derive(Clone)]
pub struct Evidence {
    /// Its frames are those of the cube.
    pub radar: Radar,
    pub room: Option<Room>,
    pub cube: Cube,
    pub split: Split,
    /// Radar time at which each frame begins.
    pub starts_s: Vec<f64>,
    pub body: Option<BodyPrediction>,
    /// Effects that may be named.
    pub library: Arc<[&'static EffectInfo]>,
    /// Ids that were accepted, oldest first.
    pub accepted: Vec<&'static str>,
    /// What was accepted without a name, oldest first.
    pub accepted_unnamed: Vec<Behaviour>,
    /// What of it undid a fixed law of the samples, oldest first.
    pub(super) inverses: Vec<(Undo, Volume)>,
    /// Regions that were taken out of the samples, oldest first.
    pub(super) regions: Vec<Arc<Tones>>,
    /// Cells of the maps that were taken out with them.
    pub(super) emptied: Vec<Cells>,
    /// Static returns that were subtracted, `[tx · rx, sample]`, if any.
    pub(super) subtracted: Option<Arc<[Complex64]>>,
    /// Ranges, m, between which something else than the body moves by no law that would take all of it out.
    pub(super) others_m: Vec<[f64; 2]>,
    /// Phases over time of what was accepted, oldest first.
    pub courses: Vec<Arc<Course>>,
    /// Lowest and highest number in the raw samples.
    pub extremes: [f64; 2],
    /// Of the raw samples; none where they are no whole numbers.
    pub codes: Option<Arc<Vec<Component>>>,
    pub(super) once: Once,
}

/// What is computed at most once, when it is first asked for.
#[derive(Clone, Default)]
pub(super) struct Once {
    pub(super) noise: OnceLock<Vec<f64>>,
    clutter: OnceLock<Vec<Complex64>>,
    maps: OnceLock<Grid<f32, 3>>,
    power: OnceLock<Option<Arc<PowerModel>>>,
    products: OnceLock<Products>,
    peak: OnceLock<f64>,
    pub(super) may_move: OnceLock<bool>,
}

impl Evidence {
    /// What a loaded recording says before anything is accepted; with a room and a body as far as they are known.
    pub fn new(loaded: Loaded, room: Option<Room>, body: Option<BodyPrediction>) -> Self {
        let Loaded { cube, radar, split, starts_s, extremes } = loaded;
        let codes = codes::count(&cube, &split, extremes).map(Arc::new);
        Self {
            radar,
            room,
            cube,
            split,
            starts_s,
            body,
            library: effects::library().into(),
            accepted: vec![],
            accepted_unnamed: vec![],
            inverses: vec![],
            regions: vec![],
            emptied: vec![],
            subtracted: None,
            others_m: vec![],
            courses: vec![],
            extremes,
            codes,
            once: Once::default(),
        }
    }

    /// The same after samples or prediction changed: nothing computed is kept.
    pub fn changed(self) -> Self {
        Self { once: Once::default(), ..self }
    }

    /// The effect of this id, of those that may be named.
    pub fn info(&self, id: &str) -> Option<&'static EffectInfo> {
        self.library.iter().find(|info| info.id == id).copied()
    }

    /// Whether an effect may be named that is not yet: the library has it, and nothing before was named so.
    pub fn may_name(&self, id: &str) -> bool {
        self.info(id).is_some() && !self.accepted.contains(&id)
    }

    /// Whether the receiver has no quadrature.
    pub fn is_real(&self) -> bool {
        self.radar.sampling == Sampling::Real
    }

    /// Range of the farthest echo.
    pub fn farthest_m(&self) -> f64 {
        self.room.as_ref().and_then(|room| room.farthest_m()).unwrap_or(FARTHEST_M)
    }

    /// Whether a cell was taken out of the samples: it says nothing of the noise.
    pub fn is_emptied(&self, doppler: usize, range: usize) -> bool {
        self.emptied.iter().any(|emptied| emptied(doppler, range))
    }

    /// Doppler bins that say how much noise a range has: beside those that hold what the clutter's mean could not remove.
    fn of_noise(&self, range: usize) -> impl Iterator<Item = usize> + '_ {
        let loops = self.cube.dims[3];
        let beside = move |doppler: &usize| (*doppler).min(loops - doppler) > 2 || loops < 8;
        (0..loops).filter(beside).filter(move |&doppler| !self.is_emptied(doppler, range))
    }

    /// Beat frequencies that mean something: all, or the positive half.
    pub fn range_bins(&self) -> usize {
        let samples = self.cube.dims[4];
        if self.is_real() { samples / 2 } else { samples }
    }

    /// Beat frequencies in which white noise is circular and has the same variance in each. Without quadrature, zero and half of the
    /// sample rate are their own images: there and in the windows' lobes beside them, an analytic signal holds less noise, and what it
    /// holds is mirrored over the velocity.
    pub fn noise_bins(&self) -> Range<usize> {
        let bins = self.range_bins();
        if self.is_real() { HANN_LOBE.min(bins)..bins.saturating_sub(1).max(HANN_LOBE.min(bins)) } else { 0..bins }
    }

    /// Mean over all chirps of the training frames, `[tx · rx, sample]`: static clutter.
    pub fn clutter(&self) -> &[Complex64] {
        self.once.clutter.get_or_init(|| self.cube.clutter(&self.split.training))
    }

    /// Variance of the noise in a complex sample, by channel (tx · rx); from the quieter cells of the range-Doppler
    /// maps, so that movers and lines do not count.
    pub fn noise(&self) -> &[f64] {
        self.once.noise.get_or_init(|| {
            let samples = self.cube.dims[4];
            (0..self.cube.channels())
                .into_par_iter()
                .map(|channel| {
                    let mut powers: Vec<f64> = self
                        .split
                        .training
                        .iter()
                        .flat_map(|&frame| {
                            let map = self.range_doppler(frame, channel);
                            let cells =
                                self.noise_bins().flat_map(|range| self.of_noise(range).map(move |doppler| (doppler, range)));
                            cells.map(|(doppler, range)| map[doppler * samples + range].norm_sqr()).collect::<Vec<_>>()
                        })
                        .collect();
                    // Frames without a signal say nothing of the noise.
                    let strongest = powers.iter().copied().fold(0.0, f64::max);
                    powers.retain(|power| *power > EMPTIED * strongest);
                    statistics::exponential_scale(&mut powers, 0.35)
                })
                .collect()
        })
    }

    /// Of [`Self::noise`], over the channels.
    pub fn mean_noise(&self) -> f64 {
        self.total_noise() / self.noise().len().max(1) as f64
    }

    /// Sum of [`Self::noise`] over the channels.
    pub fn total_noise(&self) -> f64 {
        self.noise().iter().sum()
    }

    /// Power that moving things are expected to have in a frame's cells, over the noise's variance and with the noise,
    /// `[doppler, range]`.
    pub fn expected(&self, frame: usize) -> Cow<'_, [f32]> {
        match self.power() {
            Some(model) => model.expected(frame).into(),
            None => vec![1.0; self.cube.dims[3] * self.cube.dims[4]].into(),
        }
    }

    /// The power model of the body, where there is one.
    pub fn power(&self) -> Option<&PowerModel> {
        self.once.power.get_or_init(|| PowerModel::new(self).map(Arc::new)).as_deref()
    }

    /// Products of the signal with itself where neither room nor body can be.
    pub fn products(&self) -> &Products {
        self.once.products.get_or_init(|| Products::new(self))
    }

    /// Largest magnitude of the signal without most of its noise: what levels are relative to.
    pub fn peak(&self) -> f64 {
        *self.once.peak.get_or_init(|| denoised::peak_beside(self, |_, _| Some(Complex64::ZERO)))
    }

    /// A channel of a frame without static clutter, `[loop · sample]`.
    pub fn moving(&self, frame: usize, channel: usize) -> Vec<Complex64> {
        let samples = self.cube.dims[4];
        let clutter = &self.clutter()[channel * samples..][..samples];
        let chirps = self.cube.channel(frame, channel).chunks_exact(samples);
        chirps.flat_map(|chirp| chirp.iter().zip(clutter).map(|(value, mean)| value - mean)).collect()
    }

    /// One frame and channel after the transforms with Hann windows of unit energy (white noise keeps its variance),
    /// static clutter over the training frames removed: `[doppler, range]`, velocities and ranges in FFT order.
    pub fn range_doppler(&self, frame: usize, channel: usize) -> Vec<Complex64> {
        transform(&self.moving(frame, channel), self.cube.dims[4])
    }

    /// Power of [`Self::range_doppler`] over the noise's variance, mean over the channels, `[frame, doppler, range]`.
    /// Noise that a filter (or undoing one) has shaped over the beat frequency is made flat.
    pub fn maps(&self) -> &Grid<f32, 3> {
        self.once.maps.get_or_init(|| {
            let mut maps = self.unshaped_maps();
            let samples = self.cube.dims[4];
            if let Some(shape) = shape::noise_shape(self, &maps) {
                maps.values_mut().par_chunks_exact_mut(samples).for_each(|row| {
                    row.iter_mut().zip(&shape).for_each(|(value, shape)| *value /= *shape);
                });
            }
            maps
        })
    }

    fn unshaped_maps(&self) -> Grid<f32, 3> {
        let [frames, _, _, loops, samples] = self.cube.dims;
        let (channels, noise) = (self.cube.channels(), self.noise().to_vec());
        let values = (0..frames)
            .into_par_iter()
            .flat_map_iter(|frame| {
                let mut sum = vec![0.0f32; loops * samples];
                for (channel, variance) in noise.iter().enumerate() {
                    let weight = 1.0 / (variance.max(f64::MIN_POSITIVE) * channels as f64);
                    let map = self.range_doppler(frame, channel);
                    sum.iter_mut().zip(map).for_each(|(sum, value)| *sum += (value.norm_sqr() * weight) as f32);
                }
                sum
            })
            .collect();
        Grid::new(["frame", "doppler", "range"], [frames, loops, samples], values)
    }
}

#[cfg(test)]
impl Evidence {
    /// The same with effects fewer in the library.
    pub fn lacking(mut self, ids: &[&str]) -> Self {
        self.library = self.library.iter().copied().filter(|info| !ids.contains(&info.id)).collect();
        self
    }

    /// What `signal` says of frame, channel, loop and sample, in white noise of variance 2 (the real part alone, where the radar has no
    /// quadrature): for tests.
    pub fn in_noise(radar: Radar, seed: u64, signal: impl Fn([usize; 4]) -> Complex64) -> Self {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let [_, tx, rx, loops, samples] = radar.dims();
        let places = (0..radar.dims().iter().product::<usize>()).map(|i| {
            let chirp = i / samples;
            [chirp / (loops * tx * rx), chirp / loops % (tx * rx), chirp % loops, i % samples]
        });
        let all: Vec<Complex64> = places.map(|place| signal(place) + Complex64::new(normal(), normal())).collect();
        let all = match radar.sampling {
            Sampling::Complex => all,
            Sampling::Real => cube::analytic(&all.iter().map(|value| value.re as f32).collect::<Vec<f32>>(), samples),
        };
        Self::new(Loaded::of_samples(radar, all, [-1e3, 1e3]), None, None)
    }
}

/// Bins to each side that a Hann window's main lobe fills.
pub const HANN_LOBE: usize = 2;

/// Periodic Hann window of unit energy.
pub fn hann(length: usize) -> Vec<f64> {
    let window: Vec<f64> = (0..length).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / length as f64).sin().powi(2)).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum::<f64>().sqrt();
    window.iter().map(|w| w / energy).collect()
}

/// Four-term Blackman–Harris window of unit energy: the body is up to 50 dB above the noise, and its side lobes must
/// not reach the static returns at other ranges.
pub fn blackman_harris(length: usize) -> Vec<f64> {
    let terms = [0.35875, -0.48829, 0.14128, -0.01168];
    let raw: Vec<f64> = (0..length)
        .map(|n| {
            let phase = std::f64::consts::TAU * (n as f64 + 0.5) / length as f64;
            terms.iter().enumerate().map(|(i, a)| a * (i as f64 * phase).cos()).sum()
        })
        .collect();
    let energy = raw.iter().map(|w: &f64| w * w).sum::<f64>().sqrt();
    raw.iter().map(|w| w / energy).collect()
}

/// Spectra of chirps under that window.
pub struct Tapered {
    taper: Vec<f64>,
    fft: Arc<dyn Fft<f64>>,
}

impl Tapered {
    /// The window and the transform for chirps of so many samples.
    pub fn new(samples: usize) -> Self {
        Self { taper: blackman_harris(samples), fft: FftPlanner::new().plan_fft_forward(samples) }
    }

    /// Of chirps one after the other, times `scale`.
    pub fn spectra(&self, chirps: &[Complex64], scale: f64) -> Vec<Complex64> {
        let mut spectra = chirps.to_vec();
        for chirp in spectra.chunks_exact_mut(self.taper.len()) {
            chirp.iter_mut().zip(&self.taper).for_each(|(value, weight)| *value *= weight * scale);
        }
        self.fft.process(&mut spectra);
        spectra
    }
}

/// DFT of one chirp, with a Hann window of unit energy.
pub fn spectrum(chirp: &[Complex64]) -> Vec<Complex64> {
    let mut windowed: Vec<Complex64> = chirp.iter().zip(hann(chirp.len())).map(|(value, weight)| value * weight).collect();
    FftPlanner::new().plan_fft_forward(chirp.len()).process(&mut windowed);
    windowed
}

/// A Doppler bin with its direction: from half of all on it counts from the end, below zero.
pub fn signed(doppler: f64, loops: usize) -> f64 {
    if 2.0 * doppler >= loops as f64 { doppler - loops as f64 } else { doppler }
}

/// Range-Doppler transform of `[loop, sample]` with Hann windows of unit energy: `[doppler, range]` in FFT order.
pub fn transform(signal: &[Complex64], samples: usize) -> Vec<Complex64> {
    transform_under(signal, &hann(signal.len() / samples), &hann(samples))
}

/// The same with windows over the loops and over the samples.
pub fn transform_under(signal: &[Complex64], slow: &[f64], fast: &[f64]) -> Vec<Complex64> {
    let samples = fast.len();
    let mut map: Vec<Complex64> =
        signal.iter().enumerate().map(|(i, value)| value * (slow[i / samples] * fast[i % samples])).collect();
    fft_2d(&mut map, samples, FftDirection::Forward);
    map
}

/// Both DFTs of `[loop, sample]` in place, not scaled: there and back multiplies by the number of samples.
pub fn fft_2d(map: &mut [Complex64], samples: usize, direction: FftDirection) {
    let loops = map.len() / samples;
    let mut planner = FftPlanner::new();
    planner.plan_fft(samples, direction).process(map);
    let doppler = planner.plan_fft(loops, direction);
    let mut column = vec![Complex64::ZERO; loops];
    for range in 0..samples {
        for (i, value) in column.iter_mut().enumerate() {
            *value = map[i * samples + range];
        }
        doppler.process(&mut column);
        for (i, value) in column.iter().enumerate() {
            map[i * samples + range] = *value;
        }
    }
}
