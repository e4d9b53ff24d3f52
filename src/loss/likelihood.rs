//! How unlikely measured cells are under simulated ones: what moves by the law of speckle, what stands still by the law of a
//! known return.
//!
//! The mean of a frame over its loops holds the static returns, the rest what moves; the two are uncorrelated in white noise.
//!
//! - *Moving*: many points a wavelength apart and more share a cell, their phases are not known. Its power P is exponential
//!   with mean μ = |s|² + N, the simulated power and the noise's: a complex Gaussian cell. The deviance is P/μ − ln(P/μ) − 1
//!   (Itakura & Saito 1968).
//! - *Static*: a wall's power is the same in every frame, and the simulation's error is a factor of it (reflectivity, spreading,
//!   the receiver's response). ln P is normal about ln(|s|² + N/e^γ), with the variance π²/6 that the logarithm of an exponential
//!   has; without a return both moments are those of noise alone. Under the exponential law the pull on a cell that is simulated
//!   far too strong does not grow with the error, so that walls that are not there stay for long.

use std::f64::consts::{LN_10, PI, TAU};

use burn::tensor::{Tensor, TensorCreationOptions, TensorData};

use crate::{heatmap::HeatmapConfig, radar::Radar};

/// Euler's γ: the logarithm of an exponential of mean 1 has the mean −γ.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Cells that are compared: powers of maps and of range profiles.
pub(super) struct Cells {
    /// Of what is left without the mean over the loops, `[map, doppler, range]`, dB.
    pub moving_db: Tensor<3>,
    /// Of the mean over the loops, `[map, 1, range]`, dB; none where static returns do not count.
    pub static_db: Option<Tensor<3>>,
}

/// Power of cells for noise of variance 1 in each component of a sample.
#[derive(Clone, Debug)]
pub(super) struct NoiseGains {
    /// `[1, doppler, 1]`: the mean takes most from the rows about zero Doppler.
    pub moving: Tensor<3>,
    pub static_profile: f64,
}

impl NoiseGains {
    pub(super) fn new(radar: &Radar, heatmap: &HeatmapConfig, options: impl Into<TensorCreationOptions>) -> Self {
        let loops = radar.loops_per_frame;
        let weights = heatmap.doppler_window.weights(loops);
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        let over_range = heatmap.noise_gain(radar) / squares;
        let centre = (loops / 2) as f64;
        let rows: Vec<f64> = (0..loops)
            .map(|row| {
                let turns = (row as f64 - centre) / loops as f64;
                let (sin, cos) = weights.iter().enumerate().fold((0.0, 0.0), |(sin, cos), (index, weight)| {
                    let (s, c) = (TAU * turns * index as f64).sin_cos();
                    (sin + weight * s, cos + weight * c)
                });
                // Weights w less the mean of w e^{jφ}: Σ|w|² − |Σ w e^{jφ}|² / L; rounding must not make it negative.
                over_range * (squares - (sin * sin + cos * cos) / loops as f64).max(0.0)
            })
            .collect();
        let moving = Tensor::from_data(TensorData::new(rows, [1, loops, 1]), options);
        Self { moving, static_profile: over_range / loops as f64 }
    }
}

/// Deviance of a moving cell whose measured power is `ratio_db` above its mean.
pub(super) fn moving_deviance(ratio_db: Tensor<3>) -> Tensor<3> {
    let ratio = ratio_db * (LN_10 / 10.0);
    ratio.clone().exp() - ratio - 1.0
}

/// Deviance of a static cell: (ln P − ln(|s|² + N/e^γ))² / (2 π²/6).
pub(super) fn static_deviance(ratio_db: Tensor<3>) -> Tensor<3> {
    let ratio = ratio_db * (LN_10 / 10.0);
    ratio.clone() * ratio * (3.0 / (PI * PI))
}

/// The power of noise by which a static return's is raised: that of its mean logarithm.
pub(super) fn mean_logarithm(power: f64) -> f64 {
    power * (-EULER_GAMMA).exp()
}
