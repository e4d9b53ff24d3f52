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
    error::Result,
    heatmap::{RangeDoppler, power_db, remove_loop_mean},
    paths::{Amplitude, Dechirp, DirectPaths, Points},
    simulator::{FrameView, Scene},
};

/// How a part of the body returns: power falls with these powers of the cosine of incidence, each with a gain of its own.
const LOBES: [f64; 2] = [1.0, 8.0];

/// Variance of the decibels of a mean of many exponentially distributed powers, times their number, dB²: (10/ln 10)².
const SPECKLE_DB2: f64 = 18.861_169_701_161_39;

/// What a frame's maps are compared by.
pub struct Comparison<'a> {
    pub transform: &'a RangeDoppler,
    /// Mean power of noise in a cell.
    pub floor: f64,
    /// `[doppler, doppler]`
    pub blur_doppler: Tensor<2>,
    /// `[range, range]`
    pub blur_range: Tensor<2>,
}

impl<'a> Comparison<'a> {
    /// `blur_cells`: standard deviation of the Gaussian; Doppler is cyclic, range ends.
    pub fn new(transform: &'a RangeDoppler, floor: f64, blur_cells: f64, device: &Device) -> Self {
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
            floor,
        }
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
    /// variance smaller and neighbours alike, which cancels in the sum.
    ///
    /// # Gradient
    /// Flows to `expected`.
    pub fn nats(&self, expected: Tensor<2>, measured: Tensor<2>) -> Tensor<1> {
        let db = |power: Tensor<2>| power_db(self.blur_doppler.clone().matmul(power).matmul(self.blur_range.clone()), 0.0);
        (db(expected + self.floor) - db(measured)).square().sum() / (2.0 * SPECKLE_DB2)
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

/// Expected power of the moving body at a receiver, `[doppler, range]`, without noise.
///
/// # Shapes
/// - `log_gain`: `[part, lobe]`, nepers of power
///
/// # Gradient
/// Flows to the pose and to the gains; smooth, but for who is seen.
///
/// # Errors
/// None of its own; a frame outside the motion was refused before.
pub fn power(
    scene: &Scene,
    view: &FrameView,
    sampled: &Sampled,
    pose: Option<&PoseTensors>,
    log_gain: Tensor<2>,
    transform: &RangeDoppler,
) -> Result<Tensor<2>> {
    let device = log_gain.device();
    let radar = &scene.radar;
    let count = sampled.points.len();
    let posed = scene.posed(view, pose, &device).expect("a refined scene is posed by tensors");
    let displacement = posed.displacement(&sampled.points, 0..radar.loops_per_frame, None);
    let one = Amplitude::real(Tensor::ones([count, 1], (&device, DType::F32)));
    let points = Points { reference_m: &sampled.reference_m, displacement: &displacement, amplitude: &one };
    let phasors = DirectPaths::new(points, radar, 0, Dechirp::Exact).phasors(0);
    let middle = radar.loops_per_frame / 2;
    let over_doppler = transform.moving_response(phasors.phase_turns);
    let over_range = transform.range_response(phasors.sweep_turns.narrow(1, middle, 1));
    let spreading = phasors.amplitude.narrow(1, middle, 1).square();
    let towards = scene.towards_radar(&sampled.reference_m, posed.middle_m(&sampled.points), &device);
    let cosine = (posed.normals(&sampled.points) * towards).sum_dim(1).clamp_min(1e-3);
    let lobes = LOBES.map(|exponent| (cosine.clone().log() * exponent).exp());
    let parts: Vec<i64> = sampled.parts.iter().map(|&part| part as i64).collect();
    let parts = Tensor::from_data(TensorData::new(parts, [count]), &device.clone().without_autodiff());
    let gain = log_gain.select(0, parts).exp();
    let reflected = (gain * Tensor::cat(lobes.to_vec(), 1)).sum_dim(1);
    let power = reflected * posed.areas_m2(&sampled.points) * spreading * sampled.stand_for;
    Ok(over_doppler.transpose().matmul(over_range * power))
}

/// Number of gains a part has.
pub const LOBES_A_PART: usize = LOBES.len();
