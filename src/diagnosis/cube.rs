//! All samples of a recording in memory, and which of them are held out.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::data::Recording;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::radar::{Radar, Sampling};

/// IF samples, `[frame, tx, rx, loop, sample]`. Samples of a receiver without quadrature are made analytic: their
/// negative beat frequencies are zero and the positive ones doubled.
#[derive(Clone, Debug)]
pub struct Cube {
    /// Lengths of the five axes.
    pub dims: [usize; 5],
    /// The last axis fastest.
    pub samples: Vec<Complex64>,
}

/// What is fitted on and what is judged on, as frames of a [`Cube`].
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Ascending.
    pub training: Vec<usize>,
    /// Ascending.
    pub held_out: Vec<usize>,
    /// A recording with too few frames is cut into blocks of this many loops, which then take the place of frames.
    pub block_loops: Option<usize>,
}

/// A recording in memory, with the radar as its frames now are.
#[derive(Clone, Debug)]
pub struct Loaded {
    pub cube: Cube,
    pub radar: Radar,
    pub split: Split,
    /// Radar time at which each frame (or block of loops) begins.
    pub starts_s: Vec<f64>,
    /// Of the raw components, for the ADC's clipping level.
    pub extremes: [f64; 2],
}

/// Most frames that are looked at: memory and time stay bounded. Frames of fewer chirps than a block count as so much less.
const MOST_FRAMES: usize = 256;
/// Most samples in memory (16 bytes each).
const MOST_SAMPLES: usize = 40_000_000;
/// Fewest frames (or blocks of loops) that can be split.
const FEWEST_FRAMES: usize = 4;
/// Every so many-th frame is held out.
const HELD_OUT_EVERY: usize = 4;
/// Parts of the frames, each of which is predicted by the others.
const FOLDS: usize = 4;
/// At most one loop in so many is dropped by cutting into equal blocks.
const MOST_DROPPED: usize = 20;
/// Fewest loops in a block.
const FEWEST_LOOPS: usize = 8;

/// How many frames of a radar's recordings are looked at, at most.
pub fn most_frames(radar: &Radar) -> usize {
    let per_frame: usize = radar.dims()[1..].iter().product();
    let of_few = FEWEST_LOOPS * MOST_FRAMES / radar.loops_per_frame.max(1);
    MOST_FRAMES.max(of_few).min((MOST_SAMPLES / per_frame.max(1)).max(1))
}

impl Cube {
    /// Samples over axes of these lengths.
    ///
    /// # Panics
    /// When there are not as many samples as the axes have places.
    pub fn new(dims: [usize; 5], samples: Vec<Complex64>) -> Self {
        assert_eq!(samples.len(), dims.iter().product::<usize>(), "cube: {} samples for {dims:?}", samples.len());
        Self { dims, samples }
    }

    /// Transmitters times receivers.
    pub fn channels(&self) -> usize {
        self.dims[1] * self.dims[2]
    }

    /// Chirps of one channel in all frames.
    pub fn chirps(&self) -> f64 {
        (self.dims[0] * self.dims[3]) as f64
    }

    /// `[loop, sample]` of one frame and channel (tx · rx count + rx).
    pub fn channel(&self, frame: usize, channel: usize) -> &[Complex64] {
        let length = self.dims[3] * self.dims[4];
        let start = (frame * self.channels() + channel) * length;
        &self.samples[start..start + length]
    }

    /// As [`Self::channel`], to change in place.
    pub fn channel_mut(&mut self, frame: usize, channel: usize) -> &mut [Complex64] {
        let length = self.dims[3] * self.dims[4];
        let start = (frame * self.channels() + channel) * length;
        &mut self.samples[start..start + length]
    }

    /// A value of every frame and channel.
    pub fn by_channel<T: Send>(&self, value: impl Fn(usize, usize) -> T + Sync) -> Grid<T, 2> {
        let (frames, channels) = (self.dims[0], self.channels());
        let values = (0..frames * channels).into_par_iter().map(|i| value(i / channels, i % channels)).collect();
        Grid::new(["frame", "channel"], [frames, channels], values)
    }

    /// Changes every chirp; `f` gets frame, channel and loop.
    pub fn each_chirp(&mut self, f: impl Fn([usize; 3], &mut [Complex64]) + Sync) {
        let (loops, channels) = (self.dims[3], self.channels());
        self.samples.par_chunks_exact_mut(self.dims[4]).enumerate().for_each(|(chirp, samples)| {
            f([chirp / (loops * channels), chirp / loops % channels, chirp % loops], samples);
        });
    }

    /// Mean over all chirps of some frames, `[tx · rx, sample]`.
    pub fn clutter(&self, frames: &[usize]) -> Vec<Complex64> {
        let samples = self.dims[4];
        let chirps = |channel: usize| frames.iter().flat_map(move |&frame| self.channel(frame, channel).chunks_exact(samples));
        (0..self.channels()).flat_map(|channel| mean_chirp(chirps(channel), samples)).collect()
    }
}

/// Mean of some chirps; zero of none.
pub fn mean_chirp<'a>(chirps: impl Iterator<Item = &'a [Complex64]>, samples: usize) -> Vec<Complex64> {
    let (mut mean, mut count) = (vec![Complex64::ZERO; samples], 0.0f64);
    for chirp in chirps {
        mean.iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    mean.iter_mut().for_each(|value| *value /= count.max(1.0));
    mean
}

/// Frames of the others and of its own, fold by fold: where few held-out ones would say little, every part is predicted by the
/// rest. Every so many-th frame is in one.
pub fn folds(frames: usize) -> impl Iterator<Item = [Vec<usize>; 2]> {
    (0..FOLDS).map(move |fold| {
        let (own, others) = (0..frames).partition(|frame| frame % FOLDS == fold);
        [others, own]
    })
}

impl Split {
    fn new(frames: usize, block_loops: Option<usize>) -> Self {
        let (held_out, training) = (0..frames).partition(|frame| frame % HELD_OUT_EVERY == HELD_OUT_EVERY / 2);
        Self { training, held_out, block_loops }
    }

    /// Share of all frames that is held out.
    pub fn held_out_share(&self) -> f64 {
        let held_out = self.held_out.len() as f64;
        held_out / (self.training.len() as f64 + held_out).max(1.0)
    }
}

impl Loaded {
    /// Reads a recording: at most `most_frames` of its longest stretch of whole frames, in which slow time has no gaps.
    ///
    /// # Errors
    /// Samples that cannot be read; no whole frame; too few chirps to say anything.
    pub fn read(recording: &Recording, most_frames: usize) -> Result<Self> {
        let mut radar = recording.radar.clone();
        let stretch = recording.whole_stretch()?;
        radar.frames = stretch.len().min(most_frames);
        let (mut samples, mut extremes) = (Vec::new(), [f64::INFINITY, f64::NEG_INFINITY]);
        for index in 0..radar.frames {
            let frame = recording.frame(stretch.start + index)?;
            for &value in frame.re.iter().chain(frame.im.iter().flatten()) {
                extremes = [extremes[0].min(f64::from(value)), extremes[1].max(f64::from(value))];
            }
            match &frame.im {
                Some(im) => samples.extend(frame.re.iter().zip(im).map(|(&re, &im)| Complex64::new(re.into(), im.into()))),
                None => samples.extend(analytic(&frame.re, radar.samples_per_chirp)),
            }
        }
        let cube = Cube::new(radar.dims(), samples);
        let (cube, radar, block_loops) = if radar.frames >= FEWEST_FRAMES {
            (cube, radar, None)
        } else {
            let (cube, radar, loops) = in_blocks(&cube, &radar).ok_or_else(|| {
                Error::field(
                    recording.folder.join("recording.toml"),
                    "radar.frames",
                    format!("{} frames of {} loops", radar.frames, radar.loops_per_frame),
                    format!("{FEWEST_FRAMES} frames, or that many blocks of {FEWEST_LOOPS} loops"),
                )
                .with_hint("a part must be held out to judge by; record longer")
            })?;
            (cube, radar, Some(loops))
        };
        let starts_s = match block_loops {
            None => (0..radar.frames).map(|frame| radar.chirp_time_s(stretch.start + frame, 0, 0)).collect(),
            Some(loops) => {
                let whole = &recording.radar;
                let blocks = radar.frames / stretch.len().min(most_frames);
                let time_s = |block: usize| whole.chirp_time_s(stretch.start + block / blocks, 0, block % blocks * loops);
                (0..radar.frames).map(time_s).collect()
            }
        };
        Ok(Self { cube, split: Split::new(radar.frames, block_loops), radar, starts_s, extremes })
    }

    /// Frames as they are, from samples `[frame, tx, rx, loop, sample]`.
    #[cfg(test)]
    pub fn of_samples(radar: Radar, samples: Vec<Complex64>, extremes: [f64; 2]) -> Self {
        let starts_s = (0..radar.frames).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
        Self { cube: Cube::new(radar.dims(), samples), split: Split::new(radar.frames, None), radar, starts_s, extremes }
    }

    /// Whether the receiver has no quadrature.
    pub fn is_real(&self) -> bool {
        self.radar.sampling == Sampling::Real
    }
}

/// The analytic signal of real chirps.
pub(super) fn analytic(values: &[f32], samples: usize) -> Vec<Complex64> {
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
    let mut signal: Vec<Complex64> = values.iter().map(|&value| Complex64::from(f64::from(value))).collect();
    forward.process(&mut signal);
    for chirp in signal.chunks_exact_mut(samples) {
        for (bin, value) in chirp.iter_mut().enumerate() {
            // The zero and the Nyquist frequency are their own images.
            let factor = if bin == 0 || 2 * bin == samples {
                1.0
            } else if 2 * bin < samples {
                2.0
            } else {
                0.0
            };
            *value *= factor / samples as f64;
        }
    }
    inverse.process(&mut signal);
    signal
}

/// Few long frames as several short ones.
fn in_blocks(cube: &Cube, radar: &Radar) -> Option<(Cube, Radar, usize)> {
    let [frames, tx, rx, loops, samples] = cube.dims;
    // Long blocks resolve velocities; a few loops more or less do not matter.
    let most = loops / FEWEST_LOOPS;
    let blocks = (2..=most)
        .find(|blocks| blocks * frames >= FEWEST_FRAMES && loops % blocks * MOST_DROPPED <= loops)
        .or_else(|| (2..=most).find(|blocks| blocks * frames >= FEWEST_FRAMES))?;
    let short = loops / blocks;
    let mut samples_out = Vec::with_capacity(cube.samples.len());
    for frame in 0..frames {
        for block in 0..blocks {
            for channel in 0..cube.channels() {
                samples_out
                    .extend_from_slice(&cube.channel(frame, channel)[block * short * samples..(block + 1) * short * samples]);
            }
        }
    }
    let mut radar = radar.clone();
    radar.frame_period_s = short as f64 * radar.loop_period_s();
    radar.frames = frames * blocks;
    radar.loops_per_frame = short;
    Some((Cube::new([radar.frames, tx, rx, short, samples], samples_out), radar, short))
}

/// Mean chirps of the even and of the odd loops.
pub fn halves(channel: &[Complex64], samples: usize) -> [Vec<Complex64>; 2] {
    let mut sums = [vec![Complex64::ZERO; samples], vec![Complex64::ZERO; samples]];
    let mut counts = [0.0; 2];
    for (index, chirp) in channel.chunks_exact(samples).enumerate() {
        sums[index % 2].iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value);
        counts[index % 2] += 1.0;
    }
    for (sum, count) in sums.iter_mut().zip(counts) {
        sum.iter_mut().for_each(|value| *value /= count);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_few_chirps_are_looked_at_in_greater_number() {
        let most = |loops_per_frame: usize| most_frames(&Radar { loops_per_frame, ..Radar::small(1) });
        assert_eq!([1, 2, 7, 8, 64].map(most), [2048, 1024, 292, 256, 256]);
        let large = Radar { loops_per_frame: 255, samples_per_chirp: 4096, ..Radar::small(1) };
        assert!(most_frames(&large) * large.dims()[1..].iter().product::<usize>() <= MOST_SAMPLES);
    }

    #[test]
    fn a_single_long_frame_becomes_blocks_of_loops_in_order() {
        let mut radar = Radar::small(1);
        radar.loops_per_frame = 85;
        radar.samples_per_chirp = 2;
        let dims = radar.dims();
        let samples = (0..dims.iter().product::<usize>()).map(|i| Complex64::from(i as f64)).collect();
        let cube = Cube::new(dims, samples);
        let (blocks, short, loops) = in_blocks(&cube, &radar).unwrap();
        assert_eq!((short.frames, loops), (4, 21));
        assert_eq!(blocks.channel(1, 1)[0], cube.channel(0, 1)[21 * 2]);
        radar.loops_per_frame = 20;
        assert!(in_blocks(&Cube::new(radar.dims(), vec![Complex64::ZERO; radar.dims().iter().product()]), &radar).is_none());
    }

    #[test]
    fn an_analytic_cosine_has_no_negative_frequency() {
        let values: Vec<f32> = (0..32).map(|n| (std::f32::consts::TAU * 5.0 * n as f32 / 32.0).cos()).collect();
        for (n, value) in analytic(&values, 32).iter().enumerate() {
            assert!((value - Complex64::cis(std::f64::consts::TAU * 5.0 * n as f64 / 32.0)).norm() < 1e-5);
        }
    }
}
