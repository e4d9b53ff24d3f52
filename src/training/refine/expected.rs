//! The map of power that a body is expected to return, smooth in its pose.
//!
//! A coherent map's cells are speckle: they change altogether when a part of the body moves by a fraction of the wavelength
//! against another, so its decibels lead a pose nowhere from centimetres away. Their mean over the parts' phases is the sum of
//! the parts' powers, each spread over the cells by the radar's own response. That is as wide as a cell and has the same
//! decibels but for the speckle, whose spread is known.

use burn::tensor::{DType, Device, Tensor, TensorData};

use crate::{
    body::PoseTensors,
    complex::Complex,
    heatmap::{HeatmapConfig, RangeDoppler, power_db, remove_loop_mean},
    paths::{Amplitude, Dechirp, DirectPaths, Points},
    radar::Radar,
    simulator::{FrameView, Scene},
};

/// How a part of the body returns: power falls with these powers of the cosine of incidence, each with a gain of its own.
const LOBES: [f64; 2] = [1.0, 8.0];

/// Variance of the decibels of a mean of many exponentially distributed powers, times their number, dB²: (10/ln 10)².
const SPECKLE_DB2: f64 = 18.861_169_701_161_39;

/// Cells of a map of power that hold as much as one independent cell. The power of white noise m cells away is correlated by the
/// square of Σw² e^{j2πnm/N} / Σw², w the window; the sum over m is N Σw⁴ / (Σw²)² (Parseval), 1.94 for a Hann window along each axis.
pub fn cells_a_look(radar: &Radar, heatmap: &HeatmapConfig) -> f64 {
    let of = |weights: Vec<f64>| {
        let sum = |power: i32| weights.iter().map(|weight| weight.powi(power)).sum::<f64>();
        weights.len() as f64 * sum(4) / sum(2).powi(2)
    };
    of(heatmap.range_window.weights(radar.samples_per_chirp)) * of(heatmap.doppler_window.weights(radar.loops_per_frame))
}

/// What the comparisons of a recording share.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// Mean power of noise in a cell.
    pub floor: f64,
    pub cells_a_look: f64,
}

/// What a frame's maps are compared by.
pub struct Comparison<'a> {
    pub transform: &'a RangeDoppler,
    pub noise: Noise,
    /// `[doppler, doppler]`
    pub blur_doppler: Tensor<2>,
    /// `[range, range]`
    pub blur_range: Tensor<2>,
}

impl<'a> Comparison<'a> {
    /// `blur_cells`: standard deviation of the Gaussian; Doppler is cyclic, range ends.
    pub fn new(transform: &'a RangeDoppler, noise: Noise, blur_cells: f64, device: &Device) -> Self {
        let blur = |cells: usize, cyclic: bool| -> Tensor<2> {
            let entry = |row: usize, column: usize| -> f64 {
                let apart = row.abs_diff(column);
                let apart = if cyclic { apart.min(cells - apart) } else { apart } as f64;
                if blur_cells > 0.0 { (-0.5 * (apart / blur_cells).powi(2)).exp() } else { f64::from(u8::from(apart == 0.0)) }
            };
            let row = |row: usize| {
                let weights: Vec<f64> = (0..cells).map(|column| entry(row, column)).collect();
                let sum: f64 = weights.iter().sum();
                weights.into_iter().map(move |weight| weight / sum)
            };
            Tensor::from_data(
                TensorData::new((0..cells).flat_map(row).collect::<Vec<f64>>(), [cells, cells]),
                (device, DType::F32),
            )
        };
        Self {
            blur_doppler: blur(transform.doppler_bins(), true),
            blur_range: blur(transform.range_bins(), false).transpose(),
            transform,
            noise,
        }
    }

    /// Of the decibels of a cell, once neighbours are counted as often as they are independent, dB².
    pub fn variance_db2(&self) -> f64 {
        SPECKLE_DB2 * self.noise.cells_a_look
    }

    /// Maps of power, blurred: `[…, doppler, range]`.
    pub fn blurred(&self, power: Tensor<3>) -> Tensor<3> {
        self.blur_doppler.clone().unsqueeze::<3>().matmul(power).matmul(self.blur_range.clone().unsqueeze::<3>())
    }

    /// What was measured, `[doppler, range]`, power: static returns removed, the receivers of the first transmitter averaged.
    pub fn measured(&self, signal: Complex<4>) -> Tensor<2> {
        let [_, receivers, loops, samples] = signal.dims();
        let first = |part: Tensor<4>| part.narrow(0, 0, 1).reshape([receivers, loops, samples]);
        let signal = Complex::new(first(signal.re), first(signal.im));
        let power = self.transform.map(remove_loop_mean(signal)).power();
        power.mean_dim(0).squeeze_dim(0)
    }

    /// Nats by which the decibels of two maps of power differ: squares over twice the variance of speckle. Blurring makes the
    /// variance smaller and neighbours alike, which cancels in the sum. The window makes neighbours alike, and the variance no smaller:
    /// without [`cells_a_look`] the data would outweigh the priors by that factor (of composite likelihoods: Varin, Reid & Firth 2011).
    ///
    /// # Gradient
    /// Flows to `expected`.
    pub fn nats(&self, expected: Tensor<2>, measured: Tensor<2>) -> Tensor<1> {
        let db = |power: Tensor<2>| power_db(self.blur_doppler.clone().matmul(power).matmul(self.blur_range.clone()), 0.0);
        (db(expected + self.noise.floor) - db(measured)).square().sum() / (2.0 * self.variance_db2())
    }
}

/// The points of a frame that stand for the visible body, and the part of it that each belongs to.
pub struct Sampled {
    points: Vec<usize>,
    reference_m: Vec<[f64; 3]>,
    /// Rows of the gains.
    parts: Vec<usize>,
    /// How many visible points one of these stands for.
    stand_for: f64,
}

impl Sampled {
    /// `part`: of every point of the body.
    pub fn new(view: &FrameView, part: &[usize], most: usize) -> Self {
        let visible = &view.direct.body;
        let step = visible.len().div_ceil(most).max(1);
        let points: Vec<usize> = visible.iter().copied().step_by(step).collect();
        let body = view.body.as_ref().expect("a refined scene has a body");
        Self {
            reference_m: points.iter().map(|&point| body.position_m[point]).collect(),
            parts: points.iter().map(|&point| part.get(point).copied().unwrap_or(0)).collect(),
            stand_for: visible.len() as f64 / points.len().max(1) as f64,
            points,
        }
    }
}

/// Where the power of a body's points lies.
struct Spread {
    /// `[point, doppler]`
    doppler: Tensor<2>,
    /// `[point, range]`
    range: Tensor<2>,
    /// Power of a gain of one, `[point, lobe]`.
    lobes: Tensor<2>,
}

impl Spread {
    fn new(
        scene: &Scene,
        view: &FrameView,
        sampled: &Sampled,
        pose: Option<&PoseTensors>,
        transform: &RangeDoppler,
        device: &Device,
    ) -> Self {
        let radar = &scene.radar;
        let count = sampled.points.len();
        let posed = scene.posed(view, pose, device).expect("a refined scene is posed by tensors");
        let displacement = posed.displacement(&sampled.points, 0..radar.loops_per_frame, None);
        let one = Amplitude::real(Tensor::ones([count, 1], (device, DType::F32)));
        let points = Points { reference_m: &sampled.reference_m, displacement: &displacement, amplitude: &one };
        let phasors = DirectPaths::new(points, radar, 0, Dechirp::Exact).phasors(0);
        let middle = radar.loops_per_frame / 2;
        let spreading = phasors.amplitude.narrow(1, middle, 1).square();
        let towards = scene.towards_radar(&sampled.reference_m, posed.middle_m(&sampled.points), device);
        let cosine = (posed.normals(&sampled.points) * towards).sum_dim(1).clamp_min(1e-3);
        let lobes = LOBES.map(|exponent| (cosine.clone().log() * exponent).exp());
        Self {
            doppler: transform.moving_response(phasors.phase_turns),
            range: transform.range_response(phasors.sweep_turns.narrow(1, middle, 1)),
            lobes: Tensor::cat(lobes.to_vec(), 1) * posed.areas_m2(&sampled.points) * spreading * sampled.stand_for,
        }
    }
}

/// Expected power of the moving body at a receiver, `[doppler, range]`, without noise.
///
/// # Shapes
/// - `log_gain`: `[part, lobe]`, nepers of power
///
/// # Gradient
/// Flows to the pose and to the gains; smooth, but for who is seen.
pub fn power(
    scene: &Scene,
    view: &FrameView,
    sampled: &Sampled,
    pose: Option<&PoseTensors>,
    log_gain: Tensor<2>,
    transform: &RangeDoppler,
) -> Tensor<2> {
    let device = log_gain.device();
    let spread = Spread::new(scene, view, sampled, pose, transform, &device);
    let parts: Vec<i64> = sampled.parts.iter().map(|&part| part as i64).collect();
    let parts = Tensor::from_data(TensorData::new(parts, [sampled.points.len()]), &device.clone().without_autodiff());
    let gain = log_gain.select(0, parts).exp();
    let power = (gain * spread.lobes).sum_dim(1);
    spread.doppler.transpose().matmul(spread.range * power)
}

/// The maps that [`power`] adds up, each for a gain of one, `[part and lobe, doppler, range]`: with the pose fixed it is linear in the
/// gains. No gradient.
pub fn basis(
    scene: &Scene,
    view: &FrameView,
    sampled: &Sampled,
    parts: usize,
    transform: &RangeDoppler,
    device: &Device,
) -> Tensor<3> {
    let spread = Spread::new(scene, view, sampled, None, transform, device);
    let count = sampled.points.len();
    let belongs: Vec<f64> = sampled
        .parts
        .iter()
        .flat_map(|&own| (0..parts).flat_map(move |part| std::iter::repeat_n(f64::from(u8::from(own == part)), LOBES_A_PART)))
        .collect();
    let gains = parts * LOBES_A_PART;
    let belongs: Tensor<2> = Tensor::from_data(TensorData::new(belongs, [count, gains]), (device, DType::F32));
    // `[gain, point, 1]`
    let weights = (spread.lobes.repeat_dim(1, parts) * belongs).transpose().reshape([gains, count, 1]);
    let doppler: Tensor<3> = spread.doppler.transpose().unsqueeze();
    doppler.matmul(spread.range.unsqueeze::<3>() * weights)
}

/// Number of gains a part has.
pub const LOBES_A_PART: usize = LOBES.len();

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Window;

    #[test]
    fn windows_make_cells_alike() {
        let radar = Radar::small(1);
        let of =
            |window| cells_a_look(&radar, &HeatmapConfig { range_window: window, doppler_window: window, ..Default::default() });
        assert!((of(Window::Rectangular) - 1.0).abs() < 1e-12);
        // Σw⁴ = 35/128 N and Σw² = 3/8 N of a Hann window of height 1.
        assert!((of(Window::Hann) - (35.0 / 18.0f64).powi(2)).abs() < 1e-9);
    }
}
