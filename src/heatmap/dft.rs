//! Range-Doppler inside the graph: two matrix products with constant DFT matrices.
//!
//! Burn's own FFT exists on some backends only and for powers of two only; products with matrices exist everywhere, take any
//! length (real captures have 85 loops) and carry gradients. The angles are formed from whole numbers, (n·k mod N)/N in
//! f64, so that the matrices are right to the last bit of the tensor's type.

use std::f64::consts::{LN_10, TAU};

use burn::tensor::{Tensor, TensorCreationOptions, TensorData};

use super::{HeatmapConfig, range_bins};
use crate::{complex::Complex, radar::Sampling};

/// ℱ_RD: windows, range DFT, Doppler DFT, with zero Doppler in the middle (row `loops / 2`).
#[derive(Clone, Debug)]
pub struct RangeDoppler {
    /// `[sample, range]`
    range: Complex<2>,
    /// `[doppler, loop]`
    doppler: Complex<2>,
    sampling: Sampling,
}

impl RangeDoppler {
    /// Built once for a radar. `options` is a device, or a device with a type: `(&device, DType::F64)`.
    pub fn new(
        loops: usize,
        samples: usize,
        sampling: Sampling,
        config: &HeatmapConfig,
        options: impl Into<TensorCreationOptions>,
    ) -> Self {
        let options = options.into();
        let bins = range_bins(samples, sampling);
        let mut range_window = config.range_window.weights(samples);
        if sampling == Sampling::Real {
            // half of a real tone's amplitude is at the negative frequency
            range_window.iter_mut().for_each(|weight| *weight *= 2.0);
        }
        let doppler_window = config.doppler_window.weights(loops);
        let centre = (loops / 2) as i64;
        let range = matrix([samples, bins], &options, |sample, bin| {
            (range_window[sample], whole_turns(sample as i64 * bin as i64, samples))
        });
        let doppler = matrix([loops, loops], &options, |row, index| {
            (doppler_window[index], whole_turns((row as i64 - centre) * index as i64, loops))
        });
        Self { range, doppler, sampling }
    }

    /// Rows of the maps.
    pub fn doppler_bins(&self) -> usize {
        self.doppler.dims()[0]
    }

    /// Columns of the maps.
    pub fn range_bins(&self) -> usize {
        self.range.dims()[1]
    }

    /// Power that tones of amplitude 1 put into every range cell, whatever their phase.
    ///
    /// # Shapes
    /// - `sweep_turns`: `[point, 1]`, turns across the window: beat frequencies in range bins
    /// - result: `[point, range]`; of a real-sampled radar without the images at negative frequencies
    ///
    /// # Gradient
    /// Flows to the sweep; smooth.
    pub fn range_response(&self, sweep_turns: Tensor<2>) -> Tensor<2> {
        let [samples, _] = self.range.dims();
        let grid: Vec<f64> = (0..samples).map(|sample| TAU * sample as f64 / samples as f64).collect();
        let options = (&sweep_turns.device().without_autodiff(), sweep_turns.dtype());
        let angle = sweep_turns * Tensor::<2>::from_data(TensorData::new(grid, [1, samples]), options);
        let power = Complex::new(angle.clone().cos(), angle.sin()).matmul(self.range.clone()).power();
        match self.sampling {
            Sampling::Complex => power,
            // The matrix doubles amplitudes, of which a complex tone already has the whole.
            Sampling::Real => power * 0.25,
        }
    }

    /// Power that points of amplitude 1 put into every Doppler cell, once their mean over the loops is removed.
    ///
    /// # Shapes
    /// - `phase_turns`: `[point, loop]`, turns
    /// - result: `[point, doppler]`
    ///
    /// # Gradient
    /// Flows to the phase; smooth.
    pub fn moving_response(&self, phase_turns: Tensor<2>) -> Tensor<2> {
        // The whole turns of a phase are no part of its sine; taken out first, f32 keeps the rest.
        let whole = phase_turns.clone().detach().round();
        let angle = (phase_turns - whole) * TAU;
        let phasor = Complex::new(angle.clone().cos(), angle.sin());
        let mean = phasor.clone().mean_dim(1);
        let transposed = Complex::new(self.doppler.re.clone().transpose(), self.doppler.im.clone().transpose());
        phasor.sub(mean).matmul(transposed).power()
    }

    /// Complex maps of every antenna and frame.
    ///
    /// # Shapes
    /// - `signal`: `[…, loop, sample]`; a real-sampled one is read from its real part alone
    /// - result: `[…, doppler, range]`
    ///
    /// # Gradient
    /// Flows to `signal`; linear.
    ///
    /// # Panics
    /// When the last two axes are not those of the radar.
    pub fn map<const D: usize>(&self, signal: Complex<D>) -> Complex<D> {
        let dims = signal.dims();
        let [loops, samples] = [dims[D - 2], dims[D - 1]];
        let expected = [self.doppler.dims()[1], self.range.dims()[0]];
        assert_eq!([loops, samples], expected, "range_doppler: signal {dims:?}, expected […, loop, sample] = {expected:?}");
        let profiles = self.profiles(signal);
        let dims = profiles.dims();
        let count: usize = dims[..D - 2].iter().product();
        let stacked = profiles.reshape([count, loops, dims[D - 1]]);
        self.doppler.clone().reshape([1, loops, loops]).matmul(stacked).reshape(dims)
    }

    /// Complex range profiles of every chirp.
    ///
    /// # Shapes
    /// - `signal`: `[…, loop, sample]`, any number of loops; a real-sampled one is read from its real part alone
    /// - result: `[…, loop, range]`
    ///
    /// # Gradient
    /// Flows to `signal`; linear.
    ///
    /// # Panics
    /// When the last axis is not that of the radar.
    pub fn profiles<const D: usize>(&self, signal: Complex<D>) -> Complex<D> {
        let mut dims = signal.dims();
        let [samples, bins] = self.range.dims();
        assert_eq!(dims[D - 1], samples, "range_doppler: signal {dims:?}, expected […, loop, sample] = […, {samples}]");
        let count: usize = dims[..D - 1].iter().product();
        let flat = [count, samples];
        // one large product, whatever the number of antennas and frames
        let profiles = match self.sampling {
            Sampling::Complex => signal.reshape(flat).matmul(self.range.clone()),
            Sampling::Real => {
                let real = signal.re.reshape(flat);
                Complex::new(real.clone().matmul(self.range.re.clone()), real.matmul(self.range.im.clone()))
            }
        };
        dims[D - 1] = bins;
        profiles.reshape(dims)
    }

    /// Amplitude of the strongest cell: the scale to which [`HeatmapConfig::floor_db`] refers. No gradient.
    pub fn peak_amplitude<const D: usize>(&self, signal: Complex<D>) -> f64 {
        self.map(signal.detach()).power().max().into_scalar::<f64>().sqrt()
    }
}

/// exp(−j 2π k/N) of a whole k, in turns, reduced before it meets a float.
fn whole_turns(k: i64, length: usize) -> f64 {
    -(k.rem_euclid(length as i64) as f64) / length as f64
}

fn matrix(dims: [usize; 2], options: &TensorCreationOptions, entry: impl Fn(usize, usize) -> (f64, f64)) -> Complex<2> {
    let [rows, columns] = dims;
    let mut parts = (Vec::with_capacity(rows * columns), Vec::with_capacity(rows * columns));
    for row in 0..rows {
        for column in 0..columns {
            let (weight, turns) = entry(row, column);
            let (sin, cos) = (TAU * turns).sin_cos();
            parts.0.push(weight * cos);
            parts.1.push(weight * sin);
        }
    }
    let tensor = |values: Vec<f64>| Tensor::<2>::from_data(TensorData::new(values, dims), options.clone());
    Complex::new(tensor(parts.0), tensor(parts.1))
}

/// 10 log₁₀(power + floor²), which is 20 log₁₀ of an amplitude that never falls below `floor_amplitude`.
///
/// # Gradient
/// Smooth everywhere, also where the power is zero: there the gradient towards the amplitude vanishes instead of growing
/// without bound.
pub fn power_db<const D: usize>(power: Tensor<D>, floor_amplitude: f64) -> Tensor<D> {
    // far below any signal, and still a normal f32
    let floor = (floor_amplitude * floor_amplitude).max(1e-36);
    (power + floor).log() * (10.0 / LN_10)
}

/// Static removal: every sample less its mean over the loops (the second last axis).
///
/// # Gradient
/// Flows to `signal`; linear.
pub fn remove_loop_mean<const D: usize>(signal: Complex<D>) -> Complex<D> {
    let [_, moving] = split_loop_mean(signal);
    moving
}

/// The mean over the loops (the second last axis, of which one place is left), and every sample less it.
///
/// # Gradient
/// Flows to `signal`; linear.
pub fn split_loop_mean<const D: usize>(signal: Complex<D>) -> [Complex<D>; 2] {
    let mean = signal.clone().mean_dim(D - 2);
    [mean.clone(), signal.sub(mean)]
}

/// Doppler spectrum of every frame: power summed over range, averaged over the antennas.
///
/// # Shapes
/// - `map`: `[frame, tx, rx, doppler, range]`
/// - result: `[frame, doppler]`, power
///
/// # Gradient
/// Flows to `map`; smooth.
pub fn time_doppler(map: Complex<5>) -> Tensor<2> {
    let [frames, transmitters, receivers, doppler, _] = map.dims();
    let power = map.power().sum_dim(4).reshape([frames, transmitters * receivers, doppler]);
    power.mean_dim(1).reshape([frames, doppler])
}

#[cfg(test)]
#[path = "dft_tests.rs"]
pub(crate) mod tests;
