//! How well frames are explained that nothing was fitted on.

use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::cube::Cube;
use super::evidence::{Evidence, hann, transform};
use super::finding::{OfSample, Undo};
use super::statistics::log_sum;
use super::support::Support;

/// Of the held-out frames, in the samples as they were recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Misfit {
    /// Of the Gaussian and exponential laws of the cells, nats.
    pub loglik_per_sample: f64,
    /// Mean squared difference between measured and expected power, dB².
    pub db_mse: f64,
    /// The same as a peak signal-to-noise ratio over the span from the noise to the strongest cell.
    pub psnr_db: f64,
}

/// Below the noise nothing is compared: logarithms of small numbers would decide.
const FLOOR: f64 = 0.1;
/// Training frames that say how strong is on average what was taken out.
const MOST_TRAINING: usize = 16;

/// Share of the root mean square by which samples are moved for a derivative.
const STEP: f64 = 1e-4;
/// Below this a determinant is no inverse's.
const SINGULAR: f64 = 1e-6;

/// Sums over cells.
#[derive(Clone, Copy, Default)]
struct Sums {
    likelihood: f64,
    squares: f64,
    cells: usize,
    peak: f64,
}

impl Sums {
    fn and(self, other: Self) -> Self {
        Self {
            likelihood: self.likelihood + other.likelihood,
            squares: self.squares + other.squares,
            cells: self.cells + other.cells,
            peak: self.peak.max(other.peak),
        }
    }
}

impl Misfit {
    /// Static clutter is what of the training mean can come from the room; the moving part of a cell is expected to
    /// have the power that the same cell's neighbourhood predicts from body and noise.
    pub fn of(evidence: &Evidence) -> Self {
        Self::after(evidence, evidence)
    }

    /// The same with effects taken into account, as likelihood of the same samples as before: `explained` has them undone
    /// or foreseen. Undoing follows each frame's own samples, so what it took out of a held-out frame is no prediction of
    /// it. It counts as a random signal instead, whose power in a cell is predicted by what was taken out of the channels
    /// before it in the same frame, or on average of the training frames. These laws, that nothing was taken out, and that
    /// nothing is explained weigh the same at first; every frame and channel says which of them holds (Bayes).
    pub fn after(recording: &Evidence, explained: &Evidence) -> Self {
        let inverted = Inverted::new(recording, explained);
        let laws = Laws::new(recording, explained, inverted.as_ref());
        // In the order of the frames, whichever thread had which.
        let of_frames: Vec<Sums> = recording.split.held_out.par_iter().map(|&frame| laws.sums(frame)).collect();
        let sums = of_frames.into_iter().fold(Sums::default(), Sums::and);
        let cells = sums.cells.max(1) as f64;
        let (db_mse, span) = (sums.squares / cells, 10.0 * sums.peak.max(1.0).log10());
        Self {
            loglik_per_sample: sums.likelihood / cells,
            db_mse,
            psnr_db: 10.0 * (span * span / db_mse.max(f64::MIN_POSITIVE)).log10(),
        }
    }
}

/// The laws that a recording's cells are held against.
struct Laws<'a> {
    recording: &'a Evidence,
    explained: &'a Evidence,
    before: Baseline,
    /// None where nothing is explained.
    after: Option<Explained<'a>>,
    /// None where no law was inverted; with what the inverted recording is expected to be.
    inverted: Option<(&'a Inverted, Explained<'a>)>,
    /// Of a range-Doppler map, as far as ranges are seen.
    cells: Vec<usize>,
}

impl<'a> Laws<'a> {
    fn new(recording: &'a Evidence, explained: &'a Evidence, inverted: Option<&'a Inverted>) -> Self {
        let [_, _, _, loops, samples] = recording.cube.dims;
        let support = Support::new(&recording.radar, recording.room.as_ref());
        let bins = recording.range_bins();
        Self {
            recording,
            explained,
            before: Baseline::new(recording, &support, None, recording.noise()),
            after: (!std::ptr::eq(recording, explained)).then(|| Explained::new(recording, explained, &support)),
            inverted: inverted.map(|inverted| (inverted, Explained::new(&inverted.evidence, explained, &support))),
            cells: (0..loops).flat_map(|doppler| (0..bins).map(move |range| doppler * samples + range)).collect(),
        }
    }

    /// Of all channels of a frame.
    fn sums(&self, frame: usize) -> Sums {
        let expected = [self.recording.expected(frame), self.explained.expected(frame)];
        let here = self.after.as_ref().map(|after| after.powers(frame));
        let here_inverted = self.inverted.as_ref().map(|(_, after)| after.powers(frame));
        let of_channel = |channel: usize| {
            let measured = transform(self.recording.cube.channel(frame, channel), self.recording.cube.dims[4]);
            let more = self.after.iter().zip(&here).flat_map(|(after, here)| after.more(here, channel));
            let more: Vec<Vec<f32>> = more.collect();
            let mut laws = vec![self.before.law(channel, &expected[0], None)];
            if let Some(after) = &self.after {
                laws.extend(after.laws(channel, &expected[1], &more));
            }
            let mut each: Vec<f64> = laws.iter().map(|law| self.log_density(law, &measured)).collect();
            let of_laws = log_sum(each.iter().copied());
            let weights: Vec<f64> = each.iter().map(|value| (value - of_laws).exp()).collect();
            each.extend(here_inverted.iter().flat_map(|here| self.inverted_densities(frame, channel, &expected[1], here)));
            let sums = self.powers(&measured, &laws, &weights, self.before.variance[channel]);
            Sums { likelihood: log_sum(each.iter().copied()) - (each.len() as f64).ln(), ..sums }
        };
        (0..self.recording.cube.channels()).map(of_channel).fold(Sums::default(), Sums::and)
    }

    fn log_density(&self, law: &Law, measured: &[Complex64]) -> f64 {
        self.cells.iter().map(|&cell| law.log_density(cell, measured[cell])).sum()
    }

    /// Of a channel by the laws of the inverted recording, as densities of what was recorded.
    fn inverted_densities(&self, frame: usize, channel: usize, expected: &[f32], here: &[Vec<f32>]) -> Vec<f64> {
        let Some((inverted, after)) = &self.inverted else { return vec![] };
        let (samples, bins) = (self.recording.cube.dims[4], self.recording.range_bins());
        let became = transform(inverted.evidence.cube.channel(frame, channel), samples);
        let stretched = inverted.volume[frame * self.recording.cube.channels() + channel] * bins as f64 / samples as f64;
        let more = after.more(here, channel);
        after.laws(channel, expected, &more).map(|law| self.log_density(&law, &became) + stretched).collect()
    }

    /// Measured and expected powers of a channel, over the noise; `weights`: how likely each law is.
    fn powers(&self, measured: &[Complex64], laws: &[Law], weights: &[f64], noise: f64) -> Sums {
        let mut sums = Sums { cells: self.cells.len(), peak: 1.0, ..Sums::default() };
        for &cell in &self.cells {
            let wanted: f64 = laws.iter().zip(weights).map(|(law, weight)| weight * law.power(cell)).sum::<f64>();
            let (seen, wanted) = (measured[cell].norm_sqr() / noise, wanted / noise);
            sums.squares += (10.0 * (seen.max(FLOOR) / wanted.max(FLOOR)).log10()).powi(2);
            sums.peak = sums.peak.max(seen);
        }
        sums
    }
}

/// Static clutter, and the noise.
struct Baseline {
    /// `[channel][doppler · range]`
    clutter: Vec<Vec<Complex64>>,
    /// By channel.
    variance: Vec<f64>,
}

impl Baseline {
    /// `more`: static besides what can come from the room, `[channel · sample]`.
    fn new(evidence: &Evidence, support: &Support, more: Option<&[Complex64]>, noise: &[f64]) -> Self {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let of_channel = |channel: usize| {
            let of = channel * samples..(channel + 1) * samples;
            let mut chirp = support.project(&evidence.clutter()[of.clone()]);
            if let Some(more) = more {
                chirp.iter_mut().zip(&more[of]).for_each(|(room, more)| *room += more);
            }
            transform(&chirp.repeat(loops), samples)
        };
        let variance = noise.iter().map(|noise| noise.max(f64::MIN_POSITIVE)).collect();
        Self { clutter: (0..evidence.cube.channels()).into_par_iter().map(of_channel).collect(), variance }
    }

    fn law<'a>(&'a self, channel: usize, moving: &'a [f32], more: Option<&'a Vec<f32>>) -> Law<'a> {
        Law { clutter: &self.clutter[channel], variance: self.variance[channel], moving, more }
    }
}

/// The law of a channel's cells: a circular Gaussian about static clutter.
struct Law<'a> {
    clutter: &'a [Complex64],
    variance: f64,
    /// Of what moves and of noise, over the noise.
    moving: &'a [f32],
    more: Option<&'a Vec<f32>>,
}

impl Law<'_> {
    fn spread(&self, cell: usize) -> f64 {
        self.variance * (f64::from(self.moving[cell]).max(1.0) + self.more.map_or(0.0, |more| f64::from(more[cell])))
    }

    fn log_density(&self, cell: usize, measured: Complex64) -> f64 {
        let spread = self.spread(cell);
        -(measured - self.clutter[cell]).norm_sqr() / spread - (std::f64::consts::PI * spread).ln()
    }

    /// Expected.
    fn power(&self, cell: usize) -> f64 {
        self.clutter[cell].norm_sqr() + self.spread(cell)
    }
}

/// What frames are expected to be once they are explained.
struct Explained<'a> {
    baseline: Baseline,
    /// None where nothing was taken out.
    removed: Option<Removed<'a>>,
}

impl<'a> Explained<'a> {
    /// `recording`: as it was recorded, or with what is invertible inverted.
    fn new(recording: &'a Evidence, explained: &'a Evidence, support: &Support) -> Self {
        let quieter = recording.noise().iter().zip(explained.noise()).map(|(a, b)| a.min(*b));
        let removed = Removed::new(recording, explained, quieter.collect());
        let baseline = match &removed {
            Some(removed) => Baseline::new(explained, support, Some(&removed.clutter), &removed.noise),
            None => Baseline::new(explained, support, None, explained.noise()),
        };
        Self { baseline, removed }
    }

    /// Of all channels of a frame, as far as something was taken out.
    fn powers(&self, frame: usize) -> Vec<Vec<f32>> {
        self.removed.iter().flat_map(|removed| removed.powers(frame)).collect()
    }

    /// Of what was taken out of a channel.
    fn more(&self, here: &[Vec<f32>], channel: usize) -> Vec<Vec<f32>> {
        self.removed.iter().flat_map(|removed| removed.laws(here, channel)).collect()
    }

    fn laws<'b>(&'b self, channel: usize, moving: &'b [f32], more: &'b [Vec<f32>]) -> impl Iterator<Item = Law<'b>> {
        let alone = self.baseline.law(channel, moving, None);
        std::iter::once(alone).chain(more.iter().map(move |more| self.baseline.law(channel, moving, Some(more))))
    }
}

/// The recording after the inverses of fixed laws, and nothing else.
struct Inverted {
    evidence: Evidence,
    /// Logarithm of how volumes are stretched, `[frame · channel]`.
    volume: Vec<f64>,
}

impl Inverted {
    /// None where no law was inverted.
    fn new(recording: &Evidence, explained: &Evidence) -> Option<Self> {
        if explained.inverses.is_empty() {
            return None;
        }
        let mut evidence = recording.clone().changed();
        let [frames, .., loops, samples] = recording.cube.dims;
        let size = loops * samples;
        let mut volume = vec![0.0; frames * recording.cube.channels()];
        let through = through(&recording.cube);
        for (undo, kind) in &explained.inverses {
            let before = kind.by_sample.then(|| evidence.cube.clone());
            undo(&mut evidence.cube);
            if let Some(before) = before {
                let more = stretched(&before, &evidence.cube, undo);
                volume.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            }
            volume.iter_mut().for_each(|sum| *sum += kind.alike * size as f64);
            for &OfSample { index, nats } in kind.of_samples.iter().flat_map(|of| of.iter()) {
                volume[index / size] += nats * through(index);
            }
        }
        Some(Self { evidence, volume })
    }
}

/// How much the windows let through of the power of every sample of a cube, one on average.
fn through(cube: &Cube) -> impl Fn(usize) -> f64 + use<> {
    let [.., loops, samples] = cube.dims;
    let size = loops * samples;
    let (slow, fast) = (hann(loops), hann(samples));
    move |index| (slow[index % size / samples] * fast[index % samples]).powi(2) * size as f64
}

/// Of a change of every sample for itself, from one cube to the other: logarithm of its derivative's determinant, summed over the
/// samples of `[frame · channel]` as much as the windows let each of them through.
fn stretched(cube: &Cube, undone: &Cube, undo: &Undo) -> Vec<f64> {
    let [.., loops, samples] = cube.dims;
    let size = loops * samples;
    let through = through(cube);
    let rms = (cube.samples.iter().map(Complex64::norm_sqr).sum::<f64>() / cube.samples.len().max(1) as f64).sqrt();
    let step = (STEP * rms).max(f64::MIN_POSITIVE.sqrt());
    let moved = |by: Complex64| {
        let mut moved = cube.clone();
        moved.samples.iter_mut().for_each(|value| *value += by);
        undo(&mut moved);
        moved.samples
    };
    let (origin, [right, up]) = (&undone.samples, [Complex64::from(step), Complex64::new(0.0, step)].map(moved));
    let determinant = |index: usize| {
        let [a, b] = [&right, &up].map(|moved| (moved[index] - origin[index]) / step);
        (a.re * b.im - a.im * b.re).abs().max(SINGULAR).ln() * through(index)
    };
    (0..origin.len() / size).into_par_iter().map(|of| (of * size..(of + 1) * size).map(determinant).sum()).collect()
}

/// What the effects took out of the samples.
struct Removed<'a> {
    recording: &'a Evidence,
    explained: &'a Evidence,
    /// Variance by channel, of which powers are multiples.
    noise: Vec<f64>,
    /// Mean over the training frames, `[channel · sample]`.
    clutter: Vec<Complex64>,
    /// Mean power of the rest over the training frames, `[channel][doppler · range]`.
    usual: Vec<Vec<f32>>,
}

impl<'a> Removed<'a> {
    /// None where nothing was taken out.
    fn new(recording: &'a Evidence, explained: &'a Evidence, noise: Vec<f64>) -> Option<Self> {
        if std::ptr::eq(recording, explained) || recording.cube.samples == explained.cube.samples {
            return None;
        }
        let noise = noise.into_iter().map(|noise| noise.max(f64::MIN_POSITIVE)).collect();
        let clutter = recording.clutter().iter().zip(explained.clutter()).map(|(before, after)| before - after).collect();
        let mut removed = Self { recording, explained, noise, clutter, usual: vec![] };
        let training = &recording.split.training;
        let frames: Vec<usize> = training.iter().copied().step_by(training.len().div_ceil(MOST_TRAINING).max(1)).collect();
        let of_channel = |channel: usize| {
            let mut mean = vec![0.0f32; recording.cube.dims[3] * recording.cube.dims[4]];
            for &frame in &frames {
                mean.iter_mut().zip(removed.power(frame, channel)).for_each(|(sum, power)| *sum += power);
            }
            mean.iter_mut().for_each(|sum| *sum /= frames.len().max(1) as f32);
            mean
        };
        removed.usual = (0..recording.cube.channels()).into_par_iter().map(of_channel).collect();
        Some(removed)
    }

    /// Range-Doppler map of the power of what was taken out of a frame beyond the mean.
    fn power(&self, frame: usize, channel: usize) -> Vec<f32> {
        let samples = self.recording.cube.dims[4];
        let clutter = self.clutter[channel * samples..][..samples].iter().cycle();
        let (before, after) = (self.recording.cube.channel(frame, channel), self.explained.cube.channel(frame, channel));
        let moving: Vec<Complex64> =
            before.iter().zip(after).zip(clutter).map(|((before, after), clutter)| before - after - clutter).collect();
        transform(&moving, samples).iter().map(|value| (value.norm_sqr() / self.noise[channel]) as f32).collect()
    }

    /// Of all channels of a frame.
    fn powers(&self, frame: usize) -> Vec<Vec<f32>> {
        (0..self.recording.cube.channels()).map(|channel| self.power(frame, channel)).collect()
    }

    /// What may be expected of the removed power in a channel.
    fn laws(&self, here: &[Vec<f32>], channel: usize) -> Vec<Vec<f32>> {
        let mut laws = vec![self.usual[channel].clone()];
        let earlier = &here[..channel];
        if !earlier.is_empty() {
            let mean = |cell: usize| earlier.iter().map(|map| map[cell]).sum::<f32>() / earlier.len() as f32;
            laws.push((0..here[channel].len()).map(mean).collect());
        }
        laws
    }
}

#[cfg(test)]
#[path = "misfit_tests.rs"]
mod tests;
