//! How unlikely measured cells are under simulated ones: what moves by the law of speckle, what stands still by the law of a
//! known return.
//!
//! The mean of a frame over its loops holds the static returns, the rest what moves; the two are uncorrelated in white noise.
//!
//! - *Moving*: many points a wavelength apart and more share a cell, their phases are not known: a complex Gaussian cell, whose
//!   power is exponential. The measured power P is a draw with some mean; so is the simulated power |s|², to which the noise adds
//!   its mean N. Where noise prevails, P/μ with μ = |s|² + N is exponential; where the return does, it is the ratio of two draws, F
//!   with 2 and 2 degrees of freedom. Between them F with 2 and 2k, k = μ/|s|²: the deviance is
//!   (k + 1) ln((k + P/μ) / (k + 1)) − ln(P/μ), which tends to P/μ − ln(P/μ) − 1 (Itakura & Saito 1968) and to
//!   2 ln((1 + P/μ) / 2) − ln(P/μ), as far from a return twice as strong as from one half as strong. With |s|² taken for the mean,
//!   a level would be fitted too strong by 4 dB at 10 dB over the noise and by 7 dB at 20 dB.
//! - *Static*: a wall's power is the same in every frame, and the simulation's error is a factor of it (reflectivity, spreading,
//!   the receiver's response). ln P is normal about ln(|s|² + N/e^γ), with the variance π²/6 that the logarithm of an exponential
//!   has; without a return both moments are those of noise alone. Under the exponential law the pull on a cell that is simulated
//!   far too strong does not grow with the error, so that walls that are not there stay for long.

use std::f64::consts::{LN_10, PI, TAU};

use burn::tensor::{Tensor, TensorCreationOptions, TensorData};
use num_complex::Complex64;

use crate::{heatmap::HeatmapConfig, radar::Radar};

/// Euler's γ: the logarithm of an exponential of mean 1 has the mean −γ.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// Cells that are compared: powers of maps and of range profiles.
pub(super) struct Cells {
    /// Of what is left without the mean over the loops, `[map, doppler, range]`, dB.
    pub moving_db: Tensor<3>,
    /// The return's power of the same cells, and with the noise's, `[map, doppler, range]`.
    pub moving: [Tensor<3>; 2],
    /// Of the mean over the loops, `[map, 1, range]`, dB; none where static returns do not count.
    pub static_db: Option<Tensor<3>>,
}

impl Cells {
    /// The return's power over its own and all of the cell's; `floor` decides where there is neither return nor noise.
    pub fn share(&self, floor: f64) -> Tensor<3> {
        let [power, mean] = self.moving.clone();
        power.clone() / (power + mean + floor)
    }
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
                let phasor = |(index, &weight)| Complex64::from_polar(weight, TAU * turns * index as f64);
                let at_rest = weights.iter().enumerate().map(phasor).sum::<Complex64>().norm_sqr();
                // Weights w less the mean of w e^{jφ}: Σ|w|² − |Σ w e^{jφ}|² / L; rounding must not make it negative.
                over_range * (squares - at_rest / loops as f64).max(0.0)
            })
            .collect();
        let moving = Tensor::from_data(TensorData::new(rows, [1, loops, 1]), options);
        Self { moving, static_profile: over_range / loops as f64 }
    }
}

/// Least share of a return by which is divided; what it changes is a millionth of the ratio's square.
const LEAST_SHARE: f64 = 1e-6;

/// Deviance of a moving cell whose measured power is `ratio_db` above the simulated mean μ, which a return of the power s shares with
/// noise. `share`: s/(s + μ) = 1/(k + 1), from 0 in noise alone to 1/2 without noise.
pub(super) fn moving_deviance(ratio_db: Tensor<3>, share: Tensor<3>) -> Tensor<3> {
    let ratio = ratio_db * (LN_10 / 10.0);
    let share = share.clamp_min(LEAST_SHARE);
    ((ratio.clone().exp() - 1.0) * share.clone()).log1p() / share - ratio
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
