//! The loss: how unlikely the measured range-Doppler map is under the simulated one, or how far both are apart in decibels (ℒ of the
//! paper, sec. 3.4 and supplement 8).

mod likelihood;

use burn::tensor::{Tensor, TensorCreationOptions};
use serde::{Deserialize, Serialize};

use self::likelihood::{Cells, NoiseGains};
use crate::{
    complex::Complex,
    error::{Error, Result},
    heatmap::{HeatmapConfig, RangeDoppler, power_db, remove_loop_mean, split_loop_mean},
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
    Db,
    /// The amplitude over that of the recording's strongest cell: what the paper's supplement 8 argues against.
    Linear,
    /// The law of the measured power P. Of what moves: of a complex Gaussian cell, exponential where noise prevails and the ratio of two
    /// draws where the simulated return does (F with 2 and 2 degrees of freedom). Of static returns, a cell for each range: log-normal.
    /// It hardly weighs what is below the noise.
    #[default]
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

    /// A loss with its unit, with as many digits as tell two epochs apart.
    pub fn with_unit(self, loss: f64) -> String {
        let unit = self.unit();
        match self {
            Self::Db => format!("{loss:.2} {unit}"),
            Self::Linear => format!("{loss:.3e} {unit}"),
            Self::Likelihood => format!("{loss:.4} {unit}"),
        }
    }
}

/// Which maps are compared, and down to which level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LossConfig {
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
    noise: NoiseGains,
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
        if config.scale == Scale::Likelihood && config.clamp_db.is_some() {
            let expected = "no `clamp_db`: the law is that of all cells, with their noise";
            return Err(Error::setting("loss.scale", "likelihood", expected));
        }
        if !(peak_amplitude.is_finite() && peak_amplitude > 0.0) {
            return Err(Error::Usage {
                message: format!("the recording's strongest cell has amplitude {peak_amplitude}, nothing can be learned from it"),
                hint: Some("check that the recording holds a signal".into()),
            });
        }
        let options = options.into();
        Ok(Self {
            noise: NoiseGains::new(radar, heatmap, options.clone()),
            transform: RangeDoppler::new(radar.loops_per_frame, radar.samples_per_chirp, radar.sampling, heatmap, options),
            scale: config.scale,
            peak_amplitude,
            combine: config.combine,
            channels: if config.channels.is_empty() { (0..count).collect() } else { config.channels.clone() },
            static_removed: config.static_removed,
            floor_amplitude: heatmap.floor_amplitude(peak_amplitude),
            clamp_db: config.clamp_db.map(|clamp| 20.0 * peak_amplitude.log10() + clamp),
        })
    }

    /// The range-Doppler transform through which recordings and simulations are compared.
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
        let mut signal = self.chosen(signal);
        if self.static_removed {
            signal = remove_loop_mean(signal);
        }
        self.combined(self.transform.map(signal).power())
    }

    /// `[frame, channel, loop, sample]` of `[frame, tx, rx, loop, sample]`: the antenna pairs that count.
    fn chosen(&self, signal: Complex<5>) -> Complex<4> {
        let [frames, transmitters, receivers, loops, samples] = signal.dims();
        let count = transmitters * receivers;
        let signal = signal.reshape([frames, count, loops, samples]);
        if self.channels.len() == count {
            return signal;
        }
        Complex::cat(self.channels.iter().map(|&channel| signal.clone().narrow(1, channel, 1)).collect(), 1)
    }

    /// `[map, …]` of `[frame, channel, …]`.
    fn combined(&self, power: Tensor<4>) -> Tensor<3> {
        let [frames, channels, rows, range] = power.dims();
        match self.combine {
            Combine::Each => power.reshape([frames * channels, rows, range]),
            Combine::Mean => power.mean_dim(1).reshape([frames, rows, range]),
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

    /// Mean deviance of the measured power, nats a cell, over the cells of maps without static returns and over those of the static
    /// returns' range profile: its gradient is that of the negative log-likelihood.
    ///
    /// # Shapes
    /// - `clean`: `[frame, tx, rx, loop, sample]`, without noise
    /// - `variance`: `[1]`, of each component of the noise in a sample; `None` without noise
    /// - `measured`: `[frame, tx, rx, loop, sample]`, the recording's same frames, a constant of training
    ///
    /// # Gradient
    /// Flows to `clean` and to `variance`; smooth.
    pub fn deviance(&self, clean: Complex<5>, variance: Option<Tensor<1>>, measured: Complex<5>) -> Tensor<1> {
        let variance = variance.map(|variance| variance.reshape([1, 1, 1]));
        let moving_noise = variance.clone().map(|variance| variance * self.noise.moving.clone());
        let static_noise = variance.map(|variance| variance * likelihood::mean_logarithm(self.noise.static_profile));
        let measured = self.cells(measured, None, None);
        let simulated = self.cells(clean, moving_noise, static_noise);
        let share = simulated.share(self.floor_amplitude.powi(2));
        let moving = likelihood::moving_deviance(measured.moving_db - simulated.moving_db, share);
        let Some((measured, simulated)) = measured.static_db.zip(simulated.static_db) else { return moving.mean() };
        let cells = moving.dims().iter().product::<usize>() + measured.dims().iter().product::<usize>();
        (moving.sum() + likelihood::static_deviance(measured - simulated).sum()) / cells as f64
    }

    /// The cells of a signal, and the noise's power added to them.
    fn cells(&self, signal: Complex<5>, moving_noise: Option<Tensor<3>>, static_noise: Option<Tensor<3>>) -> Cells {
        let with = |power: Tensor<3>, noise: Option<Tensor<3>>| match noise {
            Some(noise) => power + noise,
            None => power,
        };
        let db = |power: Tensor<3>| power_db(power, self.floor_amplitude);
        let [at_rest, moving] = split_loop_mean(self.chosen(signal));
        let moving = self.combined(self.transform.map(moving).power());
        let mean = with(moving.clone(), moving_noise);
        let static_db =
            (!self.static_removed).then(|| db(with(self.combined(self.transform.profiles(at_rest).power()), static_noise)));
        Cells { moving_db: db(mean.clone()), moving: [moving, mean], static_db }
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
pub(crate) mod tests;
