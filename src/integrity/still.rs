//! Static clutter in a stream: the sum of all its loops, and the noise that neighbouring loops differ by.

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::{Complex32, Complex64};

use super::stream::{Schedule, Stream};

/// The sum of all loops, `[tx, rx, sample]`.
pub(super) struct Sum {
    samples: usize,
    values: Vec<Complex64>,
}

impl Sum {
    pub fn new(schedule: Schedule) -> Self {
        Self { samples: schedule.samples, values: vec![Complex64::ZERO; schedule.period()] }
    }

    pub fn add(&mut self, samples: &[Complex32]) {
        self.values.iter_mut().zip(samples).for_each(|(sum, v)| *sum += Complex64::new(v.re.into(), v.im.into()));
    }

    /// Of each channel's chirps.
    pub fn chirps(&self) -> impl Iterator<Item = &[Complex64]> {
        self.values.chunks_exact(self.samples)
    }
}

/// The same with the noise that is in it.
pub(super) struct Still {
    pub sum: Sum,
    before: Vec<Complex32>,
    /// Sum of the squared differences of neighbouring loops, and how many loops and differences there were.
    noise: f64,
    loops: f64,
    differences: f64,
}

impl Still {
    pub fn new(schedule: Schedule) -> Self {
        Self { sum: Sum::new(schedule), before: vec![], noise: 0.0, loops: 0.0, differences: 0.0 }
    }

    pub fn see(&mut self, stream: &Stream) {
        for samples in stream.loops() {
            self.sum.add(samples);
            let differences = samples.iter().zip(&self.before).map(|(value, before)| f64::from((value - before).norm_sqr()));
            self.noise += differences.sum::<f64>();
            self.differences += f64::from(u8::from(!self.before.is_empty()));
            self.before = samples.to_vec();
            self.loops += 1.0;
        }
    }

    /// Whether there were two loops, so that their noise is known.
    pub fn shows_noise(&self) -> bool {
        self.differences > 0.0
    }

    /// Power of the noise, over all channels, in a bin of the sum's [`spectrum`]; a difference of loops has twice that of a loop.
    pub fn noise_of_bin(&self) -> f64 {
        let samples = self.sum.samples;
        let of_sample = self.noise / (2.0 * self.differences * samples as f64);
        let window_power: f64 = (0..samples).map(|n| window(n, samples).powi(2)).sum();
        self.loops * of_sample * window_power
    }
}

/// Hann's.
fn window(n: usize, samples: usize) -> f64 {
    (std::f64::consts::PI * (n as f64 + 0.5) / samples as f64).sin().powi(2)
}

/// The spectrum of a chirp under a Hann window, without its mean.
pub(super) fn transformed(fft: &dyn Fft<f64>, chirp: &[Complex64]) -> Vec<Complex64> {
    let mean = chirp.iter().sum::<Complex64>() / chirp.len() as f64;
    let mut values: Vec<Complex64> = chirp.iter().enumerate().map(|(n, v)| (v - mean) * window(n, chirp.len())).collect();
    fft.process(&mut values);
    values
}

/// Power over all channels by frequency, under a Hann window, without the mean.
pub(super) fn spectrum<'a>(chirps: impl Iterator<Item = &'a [Complex64]>, samples: usize) -> Vec<f64> {
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let mut power = vec![0.0; samples];
    for chirp in chirps {
        power.iter_mut().zip(transformed(&*fft, chirp)).for_each(|(power, value)| *power += value.norm_sqr());
    }
    power
}
