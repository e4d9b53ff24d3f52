//! Noise whose power differs between beat frequencies: after a law with a knee, as 1/f noise has beside white noise, or after none.

use rayon::prelude::*;

use super::shares::Shares;
use super::support::UNLIKELY;
use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Curve, Estimate, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected, exponential_scale};
use crate::effects::{self, Stage};

/// Cells of a Hann-windowed map per independent one, with reserve for the quantile's inefficiency.
const SHARED: f64 = 4.0;
/// How well a real noise follows a law, as a logarithm's deviation.
const LAW: f64 = 0.05;
/// Bands of beat frequency that noise without a law is compared in.
const BANDS: usize = 8;

/// Over beat frequencies, the power that training frames have over the noise.
struct Powers {
    hertz: Vec<f64>,
    found: Vec<f64>,
    /// Between the transform's bins, Hz.
    step: f64,
    /// Independent cells at a beat frequency.
    count: f64,
}

/// A law's level and its shape over beat frequencies.
struct Fit {
    likelihood: f64,
    level: f64,
    shape: Vec<f64>,
}

impl Powers {
    fn fit(&self, knee: f64, power: f64) -> Fit {
        let Self { hertz, found, step, count } = self;
        // A Hann window mixes a cell with its neighbours.
        let of = |f: f64| 1.0 + (knee / f).powf(power);
        let shape: Vec<f64> = hertz.iter().map(|f| (of(f - step) + 4.0 * of(*f) + of(f + step)) / 6.0).collect();
        let level = found.iter().zip(&shape).map(|(p, s)| p / s).sum::<f64>() / hertz.len() as f64;
        let likelihood: f64 = found.iter().zip(&shape).map(|(p, s)| -(level * s).ln() - p / (level * s)).sum::<f64>() * count;
        Fit { likelihood, level, shape }
    }

    /// The best law with a knee, and its chance where there is none.
    fn law(&self, rate: f64) -> Option<(Top, f64)> {
        let white = self.fit(0.0, 1.0).likelihood;
        let likelihood =
            |[knee, power]: [f64; 2]| if knee < 0.5 * rate { self.fit(knee, power).likelihood } else { f64::NEG_INFINITY };
        let grid = (0..40).flat_map(|i| (1..=10).map(move |j| (i, j)));
        let grid = grid.map(|(i, j)| [0.05 * self.step * 1.22f64.powi(i), 0.25 * f64::from(j)]);
        let first = grid.max_by(|a, b| likelihood(*a).total_cmp(&likelihood(*b)))?;
        let top = climb(likelihood, first);
        let p_value = corrected(chi2_tail(2.0 * (top.height - white), 2.0), 20.0);
        Some((top, p_value))
    }

    /// Beat frequencies of a band.
    fn width(&self) -> usize {
        self.found.len().div_ceil(BANDS)
    }

    /// A level for each band, in the place of a law.
    fn banded(&self) -> Fit {
        let level = self.found.iter().sum::<f64>() / self.found.len() as f64;
        let bands = self.found.chunks(self.width());
        let of_band = |band: &[f64]| vec![band.iter().sum::<f64>() / band.len() as f64 / level; band.len()];
        let shape: Vec<f64> = bands.flat_map(of_band).collect();
        let likelihood = shape.iter().map(|s| -(level * s).ln() - 1.0).sum::<f64>() * self.count;
        Fit { likelihood, level, shape }
    }

    /// Chance that what noise of a shape has over it differs so much between bands, each of which may differ as a real noise does.
    fn chance_beyond(&self, shape: &[f64]) -> f64 {
        let flat = Self { found: self.found.iter().zip(shape).map(|(p, s)| p / s).collect(), hertz: vec![], ..*self };
        let (fit, all) = (flat.banded(), flat.found.len());
        let white = (-fit.level.ln() - 1.0) * all as f64 * self.count;
        let inflation = 1.0 + LAW * LAW * self.count * self.width() as f64;
        chi2_tail(2.0 * (fit.likelihood - white) / inflation, all.div_ceil(self.width()) as f64 - 1.0)
    }

    fn curve(&self, fit: &Fit) -> Curve {
        let Self { hertz, found, .. } = self;
        Curve::new(
            "Noise over beat frequency",
            ["beat frequency, Hz", "power over the median, dB"],
            [
                ("measured", hertz.clone(), found.iter().map(|p| 10.0 * p.max(1e-12).log10()).collect()),
                ("fitted", hertz.clone(), fit.shape.iter().map(|s| 10.0 * (fit.level * s).log10()).collect()),
            ],
        )
    }
}

/// `bins`: beat frequencies where nothing returns.
pub fn coloured(evidence: &Evidence, bins: &[usize]) -> Option<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let rate = evidence.radar.sample_rate_hz;
    let hertz: Vec<f64> = bins.iter().map(|&bin| bin.min(samples - bin) as f64 * rate / samples as f64).collect();
    let per_frame = (evidence.cube.channels() * (loops - 5)) as f64 / SHARED;
    let found = spectrum(evidence, &evidence.split.training, bins);
    let count = per_frame * evidence.split.training.len() as f64;
    let powers = Powers { hertz, found, step: rate / samples as f64, count };
    let white = powers.fit(0.0, 1.0).level;
    let evident = |fit: &Fit, p_value: f64| {
        let held = spectrum(evidence, &evidence.split.held_out, bins);
        let levels = held.iter().zip(&fit.shape).map(|(p, s)| (p, fit.level * s));
        // Of the held-out frames' log-likelihood, over noise that is level.
        let gain = levels.map(|(p, level)| white.ln() + p / white - level.ln() - p / level).sum::<f64>()
            * (per_frame * evidence.split.held_out.len() as f64);
        Evident { p_value, gain, energy: energy(evidence, &powers, fit) }
    };
    let is_there = |fit: &Fit, p_value: f64| p_value < UNLIKELY && is_everywhere(evidence, bins, fit);
    let law = evidence.info(effects::coloured_noise::ID).and_then(|_| powers.law(rate)).map(|(top, p_value)| {
        let fit = powers.fit(top.at[0], top.at[1]);
        (top, fit, p_value)
    });
    if let Some((top, fit, p_value)) = law
        && is_there(&fit, p_value)
        && powers.chance_beyond(&fit.shape) > UNLIKELY
    {
        return Some(named(&powers, &top, &fit, evident(&fit, p_value)));
    }
    let p_value = corrected(powers.chance_beyond(&vec![1.0; bins.len()]), 2.0);
    let fit = powers.banded();
    is_there(&fit, p_value).then(|| unnamed(&powers, &fit, evident(&fit, p_value)))
}

/// Whether most Doppler rows, most beat frequencies and most frames have a shape.
fn is_everywhere(evidence: &Evidence, bins: &[usize], fit: &Fit) -> bool {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let mean = fit.shape.iter().sum::<f64>() / fit.shape.len() as f64;
    let mut shares = Shares::new([samples, loops, frames]);
    for &frame in &evidence.split.training {
        for channel in 0..evidence.cube.channels() {
            let map = evidence.range_doppler(frame, channel);
            let level = evidence.noise()[channel].max(1e-300) * fit.level * mean;
            for (&bin, shape) in bins.iter().zip(&fit.shape) {
                let deviation = shape / mean - 1.0;
                for row in 3..loops - 2 {
                    let has = map[row * samples + bin].norm_sqr() / level - 1.0;
                    shares.add([bin, row, frame], deviation * has, deviation * deviation);
                }
            }
        }
    }
    shares.are_everywhere()
}

/// How sure a shape of the noise is, and how much it adds.
struct Evident {
    p_value: f64,
    gain: f64,
    energy: f64,
}

/// Beyond the noise's level.
fn energy(evidence: &Evidence, powers: &Powers, fit: &Fit) -> f64 {
    let excess = powers.found.iter().sum::<f64>() / powers.found.len() as f64 / fit.level - 1.0;
    let noise = evidence.mean_noise();
    excess.max(0.0) * fit.level * noise * evidence.cube.samples.len() as f64
}

fn named(powers: &Powers, top: &Top, fit: &Fit, evident: Evident) -> Candidate {
    let [knee, power] = top.at;
    let of = |name: &'static str, value: f64, deviation: f64| {
        let factor = (1.645 * deviation.hypot(LAW)).exp();
        Estimate { name, values: vec![value], ci90: vec![[value / factor, value * factor]] }
    };
    Candidate {
        id: Some(effects::coloured_noise::ID),
        estimates: vec![of("knee_hz", knee, top.deviations[0]), of("power", power, top.deviations[1])],
        statement: format!(
            "the noise rises towards low beat frequencies, by 3 dB at {:.0} kHz and with the power {power:.2} of the frequency below: \
             thermal noise would be level",
            knee * 1e-3
        ),
        ..unnamed(powers, fit, evident)
    }
}

fn unnamed(powers: &Powers, fit: &Fit, Evident { p_value, gain, energy }: Evident) -> Candidate {
    let (low, high) = fit.shape.iter().fold((f64::INFINITY, 0.0f64), |(low, high), &s| (low.min(s), high.max(s)));
    Candidate {
        statement: format!(
            "the noise's power differs by {:.1} dB between bands of beat frequency, where thermal noise would be level",
            10.0 * (high / low.max(1e-300)).log10()
        ),
        curve: Some(powers.curve(fit)),
        energy,
        ..Candidate::new(Behaviour::NoiseOverBeatFrequency, Place::at(Stage::Noise), p_value, gain)
    }
}

/// Power over beat frequency, `[bin]`.
fn spectrum(evidence: &Evidence, frames: &[usize], bins: &[usize]) -> Vec<f64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let mut powers: Vec<Vec<f64>> = vec![vec![]; bins.len()];
    for &frame in frames {
        for channel in 0..channels {
            let map = evidence.range_doppler(frame, channel);
            let noise = evidence.noise()[channel].max(1e-300);
            for (bin, powers) in bins.iter().zip(&mut powers) {
                powers.extend((3..loops - 2).map(|doppler| map[doppler * samples + bin].norm_sqr() / noise));
            }
        }
    }
    powers.par_iter_mut().map(|powers| exponential_scale(powers, 0.5)).collect()
}

/// The top of a likelihood of two positive parameters, with the deviations of their logarithms.
struct Top {
    at: [f64; 2],
    height: f64,
    deviations: [f64; 2],
}

/// From the best of a grid, by steps along both logarithms and their diagonals.
fn climb(likelihood: impl Fn([f64; 2]) -> f64, first: [f64; 2]) -> Top {
    const STEPS: [[f64; 2]; 8] =
        [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
    let moved = |at: [f64; 2], step: [f64; 2], width: f64| [0, 1].map(|i| at[i] * (width * step[i]).exp());
    let (mut at, mut height, mut width) = (first, likelihood(first), 0.2);
    while width > 1e-3 {
        let near = STEPS.map(|step| moved(at, step, width)).map(|next| (next, likelihood(next)));
        let (next, found) = near.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("some steps");
        if found > height { (at, height) = (next, found) } else { width *= 0.5 }
    }
    // Curvature, from second differences wide enough for the rounding.
    let wide = 0.02;
    let second = |a: [f64; 2], b: [f64; 2]| {
        (2.0 * height - likelihood(moved(at, a, wide)) - likelihood(moved(at, b, wide))) / (wide * wide)
    };
    let [aa, bb] = [second(STEPS[0], STEPS[1]), second(STEPS[2], STEPS[3])];
    let ab = 0.5 * (second(STEPS[4], STEPS[5]) - aa - bb);
    let determinant = aa * bb - ab * ab;
    let deviation = |other: f64| if determinant > 0.0 && other > 0.0 { (other / determinant).sqrt().min(1.0) } else { 1.0 };
    Top { at, height, deviations: [deviation(bb), deviation(aa)] }
}
