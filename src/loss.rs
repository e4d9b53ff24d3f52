//! The loss: how far two range-Doppler maps are apart in decibels (ℒ of the paper, sec. 3.4 and supplement 8), or how unlikely the
//! measured one is under the simulated one.

use std::f64::consts::LN_10;

use burn::tensor::{Tensor, TensorCreationOptions};
use serde::{Deserialize, Serialize};

use crate::{
    complex::Complex,
    error::{Error, Result},
    heatmap::{HeatmapConfig, RangeDoppler, power_db, remove_loop_mean},
    radar::Radar,
};

/// What becomes of several antennas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Combine {
    /// Every antenna's map is compared with its own.
    #[default]
    Each,
    /// The power is averaged over the antennas first, and one map compared: less speckle, less information.
    Mean,
}

/// What of a cell is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Decibels (the paper).
    #[default]
    Db,
    /// The amplitude over that of the recording's strongest cell: what the paper's supplement 8 argues against.
    Linear,
    /// The law of the measured power P: exponential with mean |s|² + N, the simulated power and the noise's, as of a complex Gaussian
    /// cell. Its deviance P/μ − ln(P/μ) − 1 (Itakura & Saito 1968) hardly weighs what is below the noise.
    Likelihood,
}

impl Scale {
    /// Of the loss.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Db => "dB²",
            Self::Linear => "squared shares of the strongest cell",
            Self::Likelihood => "nats a cell",
        }
    }
}

/// Which maps are compared, and down to which level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LossConfig {
    #[serde(skip_serializing_if = "is_db")]
    pub scale: Scale,
    pub combine: Combine,
    /// Antenna pairs that count, as `tx · receivers + rx`; empty for all.
    pub channels: Vec<usize>,
    /// Cells below this level count as having it, relative to the recording's strongest cell; none for no limit (the paper).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clamp_db: Option<f64>,
    /// Compare what is left after the mean over the loops is removed.
    pub static_removed: bool,
}

fn is_db(scale: &Scale) -> bool {
    *scale == Scale::Db
}

/// Mean squared difference of decibel maps, or of linear ones; built once for a recording.
#[derive(Clone, Debug)]
pub struct DbLoss {
    transform: RangeDoppler,
    scale: Scale,
    peak_amplitude: f64,
    combine: Combine,
    channels: Vec<usize>,
    static_removed: bool,
    floor_amplitude: f64,
    clamp_db: Option<f64>,
    /// Power of a cell for noise of variance 1 in each component of a sample.
    noise_gain: f64,
}

impl DbLoss {
    /// `peak_amplitude` is the recording's strongest cell ([`RangeDoppler::peak_amplitude`]); floors refer to it.
    /// `options`: a device, or a device with a type.
    pub fn new(
        radar: &Radar,
        heatmap: &HeatmapConfig,
        config: &LossConfig,
        peak_amplitude: f64,
        options: impl Into<TensorCreationOptions>,
    ) -> Result<Self> {
        let count = radar.tx_m.len() * radar.rx_m.len();
        if let Some(channel) = config.channels.iter().find(|&&channel| channel >= count) {
            return Err(Error::setting("loss.channels", channel, format!("0 to {}: one for each antenna pair", count - 1)));
        }
        let exact = config.scale == Scale::Likelihood;
        if exact && (config.static_removed || config.clamp_db.is_some()) {
            let expected = "neither `static_removed` nor `clamp_db`: the law is that of all cells, with their noise";
            return Err(Error::setting("loss.scale", "likelihood", expected));
        }
        if !(peak_amplitude.is_finite() && peak_amplitude > 0.0) {
            return Err(Error::Usage {
                message: format!("the recording's strongest cell has amplitude {peak_amplitude}, nothing can be learned from it"),
                hint: Some("check that the recording holds a signal".into()),
            });
        }
        Ok(Self {
            transform: RangeDoppler::new(radar.loops_per_frame, radar.samples_per_chirp, radar.sampling, heatmap, options),
            scale: config.scale,
            peak_amplitude,
            combine: config.combine,
            channels: if config.channels.is_empty() { (0..count).collect() } else { config.channels.clone() },
            static_removed: config.static_removed,
            floor_amplitude: heatmap.floor_amplitude(peak_amplitude),
            clamp_db: config.clamp_db.map(|clamp| 20.0 * peak_amplitude.log10() + clamp),
            noise_gain: heatmap.noise_gain(radar),
        })
    }

    pub fn transform(&self) -> &RangeDoppler {
        &self.transform
    }

    /// Whether the simulation is compared as it is before noise: the noise's power is then an argument of [`Self::deviance`].
    pub fn is_likelihood(&self) -> bool {
        self.scale == Scale::Likelihood
    }

    /// The maps that are compared, in decibels; with the linear scale, in amplitudes of the strongest cell.
    ///
    /// # Shapes
    /// - `signal`: `[frame, tx, rx, loop, sample]`; noise already added
    /// - result: `[map, doppler, range]`, a map for each frame and chosen antenna, or for each frame when they are averaged
    ///
    /// # Gradient
    /// Flows to `signal`; smooth except at `clamp_db`, below which it is zero.
    pub fn maps_db(&self, signal: Complex<5>) -> Tensor<3> {
        let power = self.power(signal);
        if self.scale == Scale::Linear {
            // The floor keeps the root's gradient finite where there is nothing; a clamp's level is a share of the peak, too.
            let amplitude = ((power + self.floor_amplitude.powi(2)).sqrt()) / self.peak_amplitude;
            return match self.clamp_db {
                Some(level) => amplitude.clamp_min(10f64.powf(level / 20.0) / self.peak_amplitude),
                None => amplitude,
            };
        }
        let db = power_db(power, self.floor_amplitude);
        match self.clamp_db {
            Some(level) => db.clamp_min(level),
            None => db,
        }
    }

    /// `[map, doppler, range]` of `[frame, tx, rx, loop, sample]`.
    fn power(&self, signal: Complex<5>) -> Tensor<3> {
        let [frames, transmitters, receivers, loops, samples] = signal.dims();
        let count = transmitters * receivers;
        let mut signal = signal.reshape([frames, count, loops, samples]);
        if self.channels.len() < count {
            let chosen = self.channels.iter().map(|&channel| signal.clone().narrow(1, channel, 1)).collect();
            signal = Complex::cat(chosen, 1);
        }
        if self.static_removed {
            signal = remove_loop_mean(signal);
        }
        let power = self.transform.map(signal).power();
        let [_, chosen, doppler, range] = power.dims();
        match self.combine {
            Combine::Each => power.reshape([frames * chosen, doppler, range]),
            Combine::Mean => power.mean_dim(1).reshape([frames, doppler, range]),
        }
    }

    /// ℒ: mean squared difference over all cells, dB²; with the linear scale, without a unit.
    ///
    /// # Shapes
    /// - `simulated`: `[frame, tx, rx, loop, sample]`, with the noise injected before
    /// - `measured_db`: [`Self::maps_db`] of the recording's same frames, a constant of training
    ///
    /// # Gradient
    /// Flows to `simulated`.
    pub fn loss(&self, simulated: Complex<5>, measured_db: Tensor<3>) -> Tensor<1> {
        mean_squared_db(self.maps_db(simulated), measured_db)
    }

    /// Mean deviance of the measured power under an exponential law with mean |simulated|² + noise, nats a cell: its gradient is that of
    /// the negative log-likelihood.
    ///
    /// # Shapes
    /// - `clean`: `[frame, tx, rx, loop, sample]`, without noise
    /// - `variance`: `[1]`, of each component of the noise in a sample; `None` without noise
    /// - `measured_db`: [`Self::maps_db`] of the recording's same frames, a constant of training
    ///
    /// # Gradient
    /// Flows to `clean` and to `variance`.
    pub fn deviance(&self, clean: Complex<5>, variance: Option<Tensor<1>>, measured_db: Tensor<3>) -> Tensor<1> {
        let mut power = self.power(clean);
        if let Some(variance) = variance {
            power = power + (variance * self.noise_gain).reshape([1, 1, 1]);
        }
        let ratio = (measured_db - power_db(power, self.floor_amplitude)) * (LN_10 / 10.0);
        (ratio.clone().exp() - ratio - 1.0).mean()
    }
}

/// Mean squared difference of two maps of decibels, dB².
///
/// # Panics
/// When their shapes differ.
pub fn mean_squared_db<const D: usize>(simulated_db: Tensor<D>, measured_db: Tensor<D>) -> Tensor<1> {
    assert_eq!(
        simulated_db.dims(),
        measured_db.dims(),
        "loss: simulated {:?}, measured {:?}",
        simulated_db.dims(),
        measured_db.dims()
    );
    let difference = simulated_db - measured_db;
    (difference.clone() * difference).mean()
}

#[cfg(test)]
pub(crate) mod tests {
    use burn::tensor::{DType, Device, TensorData};
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::heatmap::synthetic;

    const DIMS: [usize; 5] = [1, 2, 2, 4, 6];

    fn radar() -> Radar {
        let mut radar = Radar { loops_per_frame: 4, samples_per_chirp: 6, ..synthetic::radar() };
        radar.rx_m.truncate(2);
        radar
    }

    fn noise(seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..DIMS.iter().product()).map(|_| random.random::<f64>() - 0.5).collect()
    }

    fn tensor(values: Vec<f64>, device: &Device) -> Tensor<5> {
        Tensor::from_data(TensorData::new(values, DIMS), (device, DType::F64))
    }

    fn signal(seed: u64, device: &Device) -> Complex<5> {
        Complex::new(tensor(noise(seed), device), tensor(noise(seed + 100), device))
    }

    fn loss(config: &LossConfig, device: &Device) -> DbLoss {
        DbLoss::new(&radar(), &HeatmapConfig::default(), config, 0.2, (device, DType::F64)).unwrap()
    }

    #[test]
    fn a_signal_has_no_distance_to_itself_and_ten_times_its_amplitude_is_twenty_decibels_away() {
        let device = Device::flex();
        for combine in [Combine::Each, Combine::Mean] {
            let loss = loss(&LossConfig { combine, ..Default::default() }, &device);
            let measured = loss.maps_db(signal(1, &device));
            assert_eq!(loss.loss(signal(1, &device), measured.clone()).into_scalar::<f64>(), 0.0);
            let louder = loss.loss(signal(1, &device).scale_by(10.0), measured).into_scalar::<f64>();
            assert!((louder - 400.0).abs() < 1e-3, "{combine:?}: {louder}");
        }
    }

    #[test]
    fn a_linear_loss_hardly_sees_what_is_weak() {
        let device = Device::flex();
        // Half the amplitude, of everything or of what is far below the strongest cell: decibels weigh both alike.
        let lost = |scale: Scale, level: f64| {
            let loss = loss(&LossConfig { scale, ..Default::default() }, &device);
            let measured = loss.maps_db(signal(1, &device).scale_by(level));
            loss.loss(signal(1, &device).scale_by(0.5 * level), measured).into_scalar::<f64>()
        };
        let ratio = |scale: Scale| lost(scale, 0.01) / lost(scale, 1.0);
        assert!((ratio(Scale::Linear) - 1e-4).abs() < 1e-6, "{}", ratio(Scale::Linear));
        assert!((ratio(Scale::Db) - 1.0).abs() < 0.01, "{}", ratio(Scale::Db));
    }

    #[test]
    fn the_likelihood_finds_a_level_in_speckle_and_noise_where_decibels_do_not() {
        let device = Device::flex();
        let dims = [1, 1, 1, 64, 64];
        let radar = Radar { loops_per_frame: 64, samples_per_chirp: 64, tx_m: vec![[0.0; 3]], rx_m: vec![[0.0; 3]], ..radar() };
        let draw = |seed: u64, scale: f64| {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let values =
                (0..4096).map(|_| scale * rand_distr::Distribution::<f64>::sample(&rand_distr::StandardNormal, &mut random));
            let values: Vec<f64> = values.collect();
            Tensor::<5>::from_data(TensorData::new(values, dims), (&device, DType::F64))
        };
        // Signal and noise of equal power; the same law simulates a level that is not known.
        let measured = Complex::new(draw(1, 2f64.sqrt()), draw(2, 2f64.sqrt()));
        let best = |value: &dyn Fn(f64) -> f64| {
            let levels: Vec<f64> = (-60..=60).map(|step| f64::from(step) / 10.0).collect();
            levels.into_iter().min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap()
        };
        let silent = || Complex::new(draw(3, 0.0), draw(3, 0.0));
        let scale = |level_db: f64| 10f64.powf(level_db / 20.0);
        let of = |scale: Scale| {
            let config = LossConfig { scale, ..Default::default() };
            DbLoss::new(&radar, &HeatmapConfig::default(), &config, 100.0, (&device, DType::F64)).unwrap()
        };
        let exact = of(Scale::Likelihood);
        let maps = exact.maps_db(measured.clone());
        let variance =
            |level_db: f64| Tensor::<1>::from_data(TensorData::from([2.0 * scale(level_db).powi(2)]), (&device, DType::F64));
        let found = best(&|level| exact.deviance(silent(), Some(variance(level)), maps.clone()).into_scalar::<f64>());
        assert!(found.abs() < 0.2, "{found} dB");
        // The mean of the decibels of an exponential is 2.5 dB below those of its mean: Euler's constant in dB.
        let decibels = of(Scale::Db);
        let expected = decibels.maps_db(measured).mean().into_scalar::<f64>()
            - 10.0 * (2.0 * HeatmapConfig::default().noise_gain(&radar)).log10();
        assert!((expected + 2.5).abs() < 0.2, "{expected} dB");
    }

    #[test]
    fn the_likelihood_is_of_all_cells() {
        let config = LossConfig { scale: Scale::Likelihood, static_removed: true, ..Default::default() };
        let error = DbLoss::new(&radar(), &HeatmapConfig::default(), &config, 1.0, &Device::flex()).unwrap_err();
        assert!(error.to_string().contains("static_removed"), "{error}");
    }

    #[test]
    fn antennas_are_chosen_and_averaged_as_the_settings_say() {
        let device = Device::flex();
        let dims = |config: LossConfig| loss(&config, &device).maps_db(signal(1, &device)).dims();
        assert_eq!(dims(LossConfig::default()), [4, 4, 6]);
        assert_eq!(dims(LossConfig { channels: vec![3, 0], ..Default::default() }), [2, 4, 6]);
        assert_eq!(dims(LossConfig { combine: Combine::Mean, ..Default::default() }), [1, 4, 6]);
        let all = loss(&LossConfig::default(), &device).maps_db(signal(1, &device));
        let last = loss(&LossConfig { channels: vec![3], ..Default::default() }, &device).maps_db(signal(1, &device));
        assert_eq!((all.narrow(0, 3, 1) - last).abs().max().into_scalar::<f64>(), 0.0);
        let error = DbLoss::new(
            &radar(),
            &HeatmapConfig::default(),
            &LossConfig { channels: vec![4], ..Default::default() },
            1.0,
            &device,
        );
        assert_eq!(error.unwrap_err().to_string(), "`loss.channels` is 4, expected 0 to 3: one for each antenna pair");
    }

    pub(crate) fn gradients_agree_with_central_differences_for_every_setting() {
        let device = Device::flex().autodiff();
        let settings = [
            LossConfig::default(),
            LossConfig { combine: Combine::Mean, channels: vec![1, 2], ..Default::default() },
            LossConfig { clamp_db: Some(-15.0), static_removed: true, ..Default::default() },
            LossConfig { scale: Scale::Linear, ..Default::default() },
            LossConfig { scale: Scale::Likelihood, ..Default::default() },
        ];
        for config in settings {
            let loss = loss(&config, &device);
            let measured = loss.maps_db(signal(2, &device)).detach();
            let start = noise(1);
            let value = |re: Tensor<5>| {
                let simulated = Complex::new(re.clone(), tensor(noise(101), &device));
                // The noise's level may follow the signal.
                let variance = (re.clone() * re).mean() * 0.1;
                match loss.is_likelihood() {
                    true => loss.deviance(simulated, Some(variance), measured.clone()),
                    false => loss.loss(simulated, measured.clone()),
                }
            };
            let tracked = tensor(start.clone(), &device).require_grad();
            let gradients = value(tracked.clone()).backward();
            let found: Vec<f64> = tracked.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
            let step = 1e-6;
            for index in (0..start.len()).step_by(5) {
                let moved = |by: f64| {
                    let mut values = start.clone();
                    values[index] += by;
                    value(tensor(values, &device)).into_scalar::<f64>()
                };
                let wanted = (moved(step) - moved(-step)) / (2.0 * step);
                crate::support::compared(&[wanted]);
                let difference = (found[index] - wanted).abs();
                assert!(difference < 1e-5 * (1.0 + wanted.abs()), "{config:?} {index}: found {}, wanted {wanted}", found[index]);
            }
        }
    }

    #[test]
    fn a_clamped_cell_does_not_pull_and_silence_gives_no_nan() {
        let device = Device::flex().autodiff();
        let loss = loss(&LossConfig { clamp_db: Some(-40.0), ..Default::default() }, &device);
        let quiet = |scale: f64| tensor(noise(1), &device) * scale;
        let measured = loss.maps_db(Complex::new(quiet(1e-9), quiet(0.0))).detach();
        for scale in [0.0, 1e-8] {
            let tracked = quiet(scale).detach().require_grad();
            let value = loss.loss(Complex::new(tracked.clone(), quiet(0.0)), measured.clone());
            let gradients = value.backward();
            assert_eq!(value.into_scalar::<f64>(), 0.0);
            let gradient: Vec<f64> = tracked.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
            assert!(gradient.iter().all(|g| *g == 0.0), "{gradient:?}");
        }
    }

    #[test]
    fn a_silent_recording_is_refused() {
        let error = DbLoss::new(&radar(), &HeatmapConfig::default(), &LossConfig::default(), 0.0, &Device::flex()).unwrap_err();
        assert!(error.to_string().contains("strongest cell has amplitude 0"), "{error}");
        assert!(error.hint().is_some());
    }
}
