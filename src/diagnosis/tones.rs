//! What moves in regions of ranges and Doppler frequencies, taken out of the samples of all of them at once.
//!
//! Tones of an interval of frequencies span a subspace `V` that is not orthogonal to a tone outside: `(1 − P_V) b` is `b` and a part
//! about −20 dB of it just beyond the interval's ends. Taking out one region after the other would so leave, of every strong mover, a
//! faint one beside each of the others. The projection on the sum of their subspaces leaves none; and it may be applied to what a
//! smaller one has left, as `(1 − P_{V+W})(1 − P_V) = 1 − P_{V+W}`. What tones have below the noise is left in the samples: the more
//! of a subspace is taken, the more it takes of what lies beside it.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use num_complex::Complex64;
use rayon::prelude::*;

use super::cube::Cube;

/// Bins (not whole numbers, ends included) that may be negative: an interval around the zero frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// From and to.
    pub range: [f64; 2],
    /// From and to.
    pub doppler: [f64; 2],
}

/// Norm of what other tones do not hold of one, below which they hold it.
const HELD: f64 = 1e-3;
/// Power over the noise that may be left of the strongest tone: hundreds of cells together do not show it.
const LEFT: f64 = 1e-3;
/// Bins beyond an interval's ends that its tones may leak into.
const MARGIN: f64 = 0.5;

/// Orthonormal basis, `[sample, vector]`, of all tones whose frequency lies in an interval of bins, and of what lies within about a bin
/// beyond: a tone at every half bin, less what the ones before hold of it (Gram and Schmidt).
pub fn tones(length: usize, [low, high]: [f64; 2]) -> DMatrix<Complex64> {
    let (low, high) = (low - MARGIN, high + MARGIN);
    let count = (((high - low) / 0.5).ceil() as usize + 1).min(2 * length);
    let mut basis: Vec<DVector<Complex64>> = vec![];
    for i in 0..count {
        let bin = low + (high - low) * i as f64 / (count - 1).max(1) as f64;
        let turn = std::f64::consts::TAU * bin / length as f64;
        let mut tone = DVector::from_fn(length, |n, _| Complex64::cis(turn * n as f64) / (length as f64).sqrt());
        // Twice for accuracy.
        for _ in 0..2 {
            for known in &basis {
                tone -= known * known.dotc(&tone);
            }
        }
        let norm = tone.norm();
        if norm > HELD {
            basis.push(tone.unscale(norm));
        }
    }
    DMatrix::from_columns(&basis)
}

/// The tones of a region, along both axes of so many consecutive frames as one.
#[derive(Debug)]
pub struct Tones {
    /// Loops and samples of a frame.
    pub shape: [usize; 2],
    /// Frames transformed as one.
    pub run: usize,
    region: Region,
    /// Of the strongest of them, over the noise.
    power: f64,
    bases: OnceLock<[DMatrix<Complex64>; 2]>,
}

impl Tones {
    /// `power`: of the strongest of them, over the noise. Nothing is computed before it is asked for.
    pub fn new(shape: [usize; 2], run: usize, region: Region, power: f64) -> Self {
        Self { shape, run, region, power: power.max(LEFT), bases: OnceLock::new() }
    }

    fn bases(&self) -> &[DMatrix<Complex64>; 2] {
        self.bases.get_or_init(|| {
            let [loops, samples] = self.shape;
            [tones(samples, self.region.range), tones(self.run * loops, self.region.doppler)]
        })
    }

    /// Share `ε` of the amplitude that is left, at which the power is [`LEFT`].
    fn ridge(&self) -> f64 {
        (LEFT / self.power).sqrt()
    }

    fn count(&self) -> usize {
        self.fast().ncols() * self.slow().ncols()
    }

    /// Orthonormal basis over the samples of a chirp, `[sample, vector]`.
    pub fn fast(&self) -> &DMatrix<Complex64> {
        &self.bases()[0]
    }

    /// Orthonormal basis over the loops of a run of frames, `[loop, vector]`.
    pub fn slow(&self) -> &DMatrix<Complex64> {
        &self.bases()[1]
    }
}

/// Ridge regression on the tones of some regions of one run, `V (VᴴV + E)⁻¹ Vᴴ` with bases `V`: what one region's tones hold less of than
/// `E`, beside the others', is left.
struct Joint<'a> {
    regions: Vec<&'a Tones>,
    gram: Cholesky<Complex64, Dyn>,
}

impl<'a> Joint<'a> {
    /// None where rounding leaves no positive matrix.
    fn new(regions: Vec<&'a Tones>) -> Option<Self> {
        let diagonal: Vec<Complex64> =
            regions.iter().flat_map(|tones| std::iter::repeat_n((1.0 + tones.ridge()).into(), tones.count())).collect();
        let mut gram = DMatrix::from_diagonal(&DVector::from_vec(diagonal));
        let mut row = 0;
        for (i, own) in regions.iter().enumerate() {
            let mut column = 0;
            for other in &regions[..i] {
                let block = (own.slow().adjoint() * other.slow()).kronecker(&(own.fast().adjoint() * other.fast()));
                // Of a Hermitian matrix the lower half is read.
                gram.view_mut((row, column), block.shape()).copy_from(&block);
                column += other.count();
            }
            row += own.count();
        }
        Some(Self { regions, gram: gram.cholesky()? })
    }

    /// Of `[loop, sample]`.
    fn within(&self, values: &[Complex64]) -> Vec<Complex64> {
        let samples = self.regions[0].shape[1];
        let signal = DMatrix::from_column_slice(samples, values.len() / samples, values);
        let shares = self.regions.iter().flat_map(|tones| {
            let share = tones.fast().adjoint() * &signal * tones.slow().conjugate();
            share.as_slice().to_vec()
        });
        let amounts = self.gram.solve(&DVector::from_vec(shares.collect()));
        let (mut sum, mut rest) = (DMatrix::zeros(samples, signal.ncols()), amounts.as_slice());
        for tones in &self.regions {
            let shape = (tones.fast().ncols(), tones.slow().ncols());
            let (own, others) = rest.split_at(shape.0 * shape.1);
            sum += tones.fast() * DMatrix::from_column_slice(shape.0, shape.1, own) * tones.slow().transpose();
            rest = others;
        }
        sum.data.into()
    }
}

/// Subtracts from every run of frames what deviates, within the regions, from static clutter over the training frames.
/// That is the mean of the cube at hand: other static returns may have been subtracted or may not. Regions of other runs than
/// the last one's were taken out before, and for themselves.
pub fn remove(cube: &mut Cube, training: &[usize], regions: &[Arc<Tones>]) {
    let Some(run) = regions.last().map(|tones| tones.run) else { return };
    let Some(joint) = Joint::new(regions.iter().filter(|tones| tones.run == run).map(Arc::as_ref).collect()) else { return };
    let [frames, _, _, loops, samples] = cube.dims;
    let channels = cube.channels();
    let clutter = cube.clutter(training);
    let parts: Vec<(usize, usize)> = (0..frames / run).flat_map(|part| (0..channels).map(move |c| (part, c))).collect();
    let found: Vec<Vec<Complex64>> = parts
        .par_iter()
        .map(|&(part, channel)| joint.within(&joined(cube, &clutter, part * run..(part + 1) * run, channel)))
        .collect();
    cube.each_chirp(|[frame, channel, index], chirp| {
        if let Some(part) = found.get(frame / run * channels + channel) {
            let start = (frame % run * loops + index) * samples;
            chirp.iter_mut().zip(&part[start..start + samples]).for_each(|(value, moving)| *value -= moving);
        }
    });
}

/// Consecutive frames of one channel as one, `[loop, sample]`, less static clutter, `[channel, sample]`.
pub fn joined(cube: &Cube, clutter: &[Complex64], frames: Range<usize>, channel: usize) -> Vec<Complex64> {
    let samples = cube.dims[4];
    let mean = &clutter[channel * samples..][..samples];
    frames
        .flat_map(|frame| cube.channel(frame, channel).chunks_exact(samples))
        .flat_map(|chirp| chirp.iter().zip(mean).map(|(value, mean)| value - mean))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: [usize; 2] = [16, 64];

    /// `[loop, sample]`, of one frame.
    fn tone(range: f64, doppler: f64) -> impl Iterator<Item = Complex64> {
        let [loops, samples] = SHAPE;
        (0..loops * samples).map(move |i| {
            let turns = range * (i % samples) as f64 / samples as f64 + doppler * (i / samples) as f64 / loops as f64;
            Complex64::cis(std::f64::consts::TAU * turns)
        })
    }

    /// Share of a frame's energy after regions were taken out, the first ones first. The second frame alone is for training: there is no
    /// static clutter.
    fn left(frame: impl Iterator<Item = Complex64>, regions: &[Region]) -> f64 {
        let [loops, samples] = SHAPE;
        let mut values: Vec<Complex64> = frame.collect();
        let before: f64 = values.iter().map(|v| v.norm_sqr()).sum();
        values.extend(vec![Complex64::ZERO; loops * samples]);
        let mut cube = Cube::new([2, 1, 1, loops, samples], values);
        let all: Vec<Arc<Tones>> = regions.iter().map(|&region| Arc::new(Tones::new(SHAPE, 1, region, 1e6))).collect();
        (1..=all.len()).for_each(|count| remove(&mut cube, &[1], &all[..count]));
        cube.samples.iter().map(|v| v.norm_sqr()).sum::<f64>() / before
    }

    #[test]
    fn a_tone_inside_goes_and_one_outside_stays() {
        let region = [Region { range: [9.0, 12.0], doppler: [-4.0, -2.0] }];
        assert!(left(tone(10.37, -2.81), &region) < 1e-4);
        // The basis holds tones between bins, whose side lobes reach far.
        assert!(left(tone(30.0, -3.0), &region) > 0.97);
        assert!(left(tone(10.0, 5.0), &region) > 0.9);
    }

    #[test]
    fn of_two_that_were_taken_out_nothing_is_left_beside_either() {
        let regions =
            [Region { range: [9.0, 12.0], doppler: [-4.0, -2.0] }, Region { range: [15.0, 18.0], doppler: [-5.0, -3.0] }];
        let both = tone(10.37, -2.81).zip(tone(16.6, -3.9)).map(|(a, b)| a + b);
        assert!(left(both, &regions) < 1e-5);
        // The first alone does leave the other one beside its own ends.
        assert!((left(tone(16.6, -3.9), &regions[..1]) - 1.0).abs() > 1e-3);
    }

    /// What two regions share is taken out once.
    #[test]
    fn regions_may_overlap() {
        let regions =
            [Region { range: [9.0, 12.0], doppler: [-4.0, -2.0] }, Region { range: [11.0, 14.0], doppler: [-4.5, -1.8] }];
        let both = tone(10.37, -2.81).zip(tone(13.2, -3.1)).map(|(a, b)| a + b);
        assert!(left(both, &regions) < 1e-4);
        assert!(left(tone(30.0, -3.0), &regions) > 0.9);
    }

    #[test]
    fn static_clutter_stays_whatever_was_known_of_it_before() {
        let (loops, samples) = (8, 32);
        let clutter = |i: usize| Complex64::cis(std::f64::consts::TAU * 4.3 * (i % samples) as f64 / samples as f64) * 1e3;
        let slow =
            |i: usize| Complex64::cis(std::f64::consts::TAU * 3.0 * (i / samples % (2 * loops)) as f64 / (2 * loops) as f64);
        let values: Vec<Complex64> = (0..4 * loops * samples).map(|i| clutter(i) + clutter(i) * 0.01 * slow(i)).collect();
        let mut cube = Cube::new([4, 1, 1, loops, samples], values);
        // The same mean over training frames as over all, because whole periods fit.
        let region = Region { range: [3.0, 6.0], doppler: [2.0, 4.0] };
        remove(&mut cube, &[0, 1], &[Arc::new(Tones::new([loops, samples], 2, region, 1e6))]);
        let worst = cube.samples.iter().enumerate().map(|(i, v)| (v - clutter(i)).norm()).fold(0.0, f64::max);
        assert!(worst < 0.5, "{worst} of a mover of 10 is left, or static returns of 1000 are gone");
    }
}
