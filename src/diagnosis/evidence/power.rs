//! How much power the body is expected to have in every cell of the range-Doppler maps.
//!
//! The fine interference of a body's points cannot be predicted (errors of the mesh are a whole wavelength), so what
//! arrives in a cell is speckle: its power is a draw from a gamma law whose mean is predicted. That mean is the noise plus
//! the templates of each part of the body (visible area, a broad and a narrow lobe, 1/R⁴, spread by the windows) times
//! weights of their own, fitted by maximum likelihood: the nonnegative factorisation under the Itakura-Saito divergence (Févotte, Bertin,
//! Durrieu 2009) with fixed templates. Power is in units of the noise, conventions of [`Evidence::maps`].

mod fit;
mod spread;

use rayon::prelude::*;

pub use fit::{Reach, fit_weights, improve, log_likelihood};
pub use spread::{Cells, hann_power};

use super::Evidence;
use crate::diagnosis::prediction::{Point, range_and_velocity};
use crate::diagnosis::vector::{difference, dot, norm};
use crate::radar::Radar;

/// Doppler bins on either side of zero that hold residuals of static clutter.
pub const CLUTTER_BINS: usize = 2;
/// Expected power of a part, over the noise, from which on it counts as support.
const SUPPORT_LEVEL: f32 = 0.1;
/// Cells by which the support is widened: accelerations, errors of the mesh, speckle above its mean.
const SUPPORT_MARGIN: i64 = 2;
/// A part reflects with a broad and a narrow lobe, each of its own weight: powers of the cosine of the angle between the
/// normal and the radar. One lobe of a wrong width shifts a whole body by 5 mm.
pub const LOBES: [i32; 2] = [1, 8];

/// A map of few cells: indices into `[doppler, range]` and power.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Template {
    /// `[cell]`, each doppler · samples + range.
    pub cells: Vec<u32>,
    /// `[cell]`.
    pub power: Vec<f32>,
}

impl Template {
    /// Cells of a dense map that hold more than a millionth of its peak.
    fn of(map: &[f32]) -> Self {
        let least = 1e-6 * map.iter().copied().fold(0.0, f32::max);
        Self::keeping(map, |_, power| power > least)
    }

    /// The cells of a dense map that `keep` wants, by their number and power.
    pub fn keeping(map: &[f32], keep: impl Fn(usize, f32) -> bool) -> Self {
        let kept = map.iter().enumerate().filter(|&(cell, &power)| keep(cell, power));
        let (cells, power) = kept.map(|(cell, &power)| (cell as u32, power)).unzip();
        Self { cells, power }
    }
}

/// Expected power of the moving body, part by part.
pub struct PowerModel {
    pub cells: Cells,
    /// `[frame][part · 2 + lobe]`
    pub lobes: Vec<Vec<Template>>,
    /// By part and lobe, fitted on the training frames.
    pub weights: Vec<f64>,
    /// How many independent powers the mean over the channels amounts to, in cells that the body fills.
    pub independent: f64,
    expected: Vec<Vec<f32>>,
    support: Vec<Vec<bool>>,
    usable: Vec<bool>,
}

impl PowerModel {
    /// None without a body, or where nothing of it is in sight.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let body = evidence.body.as_ref()?;
        let cells = Cells::new(&evidence.radar);
        let of_frame = |points: &Vec<Point>| {
            let points = body.with_echoes(&evidence.radar, points.clone(), None);
            part_templates(&evidence.radar, &cells, &points, body.parts.len())
        };
        let templates: Vec<Vec<Template>> = body.frames.par_iter().map(of_frame).collect();
        if templates.iter().flatten().all(|template| template.cells.is_empty()) {
            return None;
        }
        let usable = usable(&cells);
        let maps = evidence.maps();
        let size = cells.loops * cells.samples;
        let training: Vec<(&[f32], &[Template])> =
            evidence.split.training.iter().map(|&frame| (maps.below([frame]), templates[frame].as_slice())).collect();
        let weights = fit_weights(&training, &usable);
        let expected: Vec<Vec<f32>> = templates.iter().map(|parts| sum(parts, &weights, size)).collect();
        let support = expected.iter().map(|map| widened(map, &cells)).collect();
        let independent = independent_channels(evidence, &expected);
        Some(Self { cells, lobes: templates, weights, independent, expected, support, usable })
    }

    /// Power of some points `[doppler, range]`, spread by the windows: (range in metres, mean of the legs to tx and rx;
    /// radial velocity in m/s, positive when receding; power in the peak).
    pub fn template(&self, points: impl Iterator<Item = (f64, f64, f64)>) -> Vec<f32> {
        let mut map = vec![0.0; self.size()];
        for (range_m, velocity_mps, power) in points {
            self.cells.deposit(&mut map, range_m, velocity_mps, power);
        }
        map
    }

    /// Body and noise, `[doppler, range]`, in units of the noise.
    pub fn expected(&self, frame: usize) -> &[f32] {
        &self.expected[frame]
    }

    /// Where the body can be, `[doppler, range]`: all else is empty of it.
    pub fn support(&self, frame: usize) -> &[bool] {
        &self.support[frame]
    }

    /// Cells in which points of the body are predicted, however much they return: of a body that stands, static clutter hides that.
    pub fn predicted(&self, frame: usize) -> impl Iterator<Item = usize> {
        self.lobes[frame].iter().flat_map(|part| part.cells.iter().map(|&cell| cell as usize))
    }

    /// Cells that mean something, `[doppler, range]`: away from static clutter, and in range of the receiver.
    pub fn usable(&self) -> &[bool] {
        &self.usable
    }

    /// Cells of a map: loops times samples.
    pub fn size(&self) -> usize {
        self.cells.loops * self.cells.samples
    }

    /// Weight of a part's power at a cosine of the angle between its normal and the way to the radar, both lobes together.
    pub fn reflectivity(&self, part: usize, cosine: f64) -> f64 {
        let of = |(lobe, &exponent): (usize, &i32)| {
            self.weights.get(part * LOBES.len() + lobe).copied().unwrap_or(0.0) * cosine.max(0.0).powi(exponent)
        };
        LOBES.iter().enumerate().map(of).sum()
    }

    /// Power that a point of the body is expected to have in the peak.
    pub fn peak(&self, radar: &Radar, point: Point) -> f64 {
        let (range_m, _) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let (power, facing) = power_and_facing(&point, range_m, radar.centre_m());
        power * self.reflectivity(point.part, facing)
    }

    /// Expected power of some parts alone (such as a limb), `[doppler, range]`.
    pub fn of_parts(&self, frame: usize, parts: impl Fn(usize) -> bool) -> Vec<f32> {
        let mut map = vec![0.0; self.size()];
        for (part, template) in self.lobes[frame].iter().enumerate().filter(|(index, _)| parts(index / LOBES.len())) {
            add(&mut map, template, self.weights[part]);
        }
        map
    }

    /// Of the measured powers (of [`Evidence::maps`]) in some frames, with another map expected in each.
    pub fn log_likelihood<'a>(
        &'a self,
        evidence: &Evidence,
        frames: &[usize],
        expected: impl Fn(usize) -> &'a [f32] + Sync,
    ) -> f64 {
        let maps = evidence.maps();
        frames.iter().map(|&frame| log_likelihood(maps.below([frame]), expected(frame), &self.usable)).sum()
    }
}

/// Templates of all parts and lobes of some points, `[part · 2 + lobe]`.
pub fn part_templates(radar: &Radar, cells: &Cells, points: &[Point], parts: usize) -> Vec<Template> {
    let mut maps: Vec<Vec<f32>> = vec![vec![]; parts * LOBES.len()];
    let centre = radar.centre_m();
    for &point in points {
        let (range_m, velocity) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let (power, facing) = power_and_facing(&point, range_m, centre);
        for (lobe, &exponent) in LOBES.iter().enumerate() {
            let Some(map) = maps.get_mut(point.part * LOBES.len() + lobe) else { continue };
            if map.is_empty() {
                *map = vec![0.0; cells.loops * cells.samples];
            }
            cells.deposit(map, range_m, velocity, power * facing.powi(exponent));
        }
    }
    maps.iter().map(|map| Template::of(map)).collect()
}

/// What a point at a range would return with a reflectivity of one, and the cosine at which it faces the radar.
fn power_and_facing(point: &Point, range_m: f64, centre: [f64; 3]) -> (f64, f64) {
    let to_radar = difference(centre, point.position_m);
    let facing = (dot(to_radar, point.normal) / norm(to_radar).max(1e-6)).max(0.0);
    (point.area_m2 / range_m.max(0.1).powi(4), facing)
}

/// Noise and weighted templates.
pub fn sum(parts: &[Template], weights: &[f64], size: usize) -> Vec<f32> {
    let mut map = vec![1.0; size];
    for (template, &weight) in parts.iter().zip(weights) {
        add(&mut map, template, weight);
    }
    map
}

fn add(map: &mut [f32], template: &Template, weight: f64) {
    for (&cell, power) in template.cells.iter().zip(&template.power) {
        map[cell as usize] += weight as f32 * power;
    }
}

/// Cells that mean something, `[doppler, range]`: away from static clutter, and in range of the receiver.
pub fn usable(cells: &Cells) -> Vec<bool> {
    let off_clutter = |doppler: usize| cells.loops < 8 || doppler.min(cells.loops - doppler) > CLUTTER_BINS;
    (0..cells.loops * cells.samples).map(|cell| off_clutter(cell / cells.samples) && cell % cells.samples < cells.bins).collect()
}

/// Cells with body power, and their neighbours.
fn widened(expected: &[f32], cells: &Cells) -> Vec<bool> {
    let mut mask = vec![false; expected.len()];
    for cell in (0..expected.len()).filter(|&cell| expected[cell] > 1.0 + SUPPORT_LEVEL) {
        for i in -SUPPORT_MARGIN..=SUPPORT_MARGIN {
            let doppler = ((cell / cells.samples) as i64 + i).rem_euclid(cells.loops as i64) as usize;
            for j in -SUPPORT_MARGIN..=SUPPORT_MARGIN {
                let range = ((cell % cells.samples) as i64 + j).rem_euclid(cells.samples as i64) as usize;
                mask[doppler * cells.samples + range] = true;
            }
        }
    }
    mask
}

/// From the scatter of the channels' powers in cells that the body fills: equal powers are one draw.
fn independent_channels(evidence: &Evidence, expected: &[Vec<f32>]) -> f64 {
    /// Frames that suffice.
    const FRAMES: usize = 4;
    let count = evidence.cube.channels();
    if count < 2 {
        return 1.0;
    }
    let noise = evidence.noise();
    let (mut scatter, mut square) = (0.0, 0.0);
    for &frame in evidence.split.training.iter().take(FRAMES) {
        let maps: Vec<_> = (0..count).map(|channel| evidence.range_doppler(frame, channel)).collect();
        for (cell, &mean) in expected[frame].iter().enumerate().filter(|(_, mean)| **mean > 30.0) {
            let powers = maps.iter().zip(noise).map(|(map, noise)| map[cell].norm_sqr() / noise.max(f64::MIN_POSITIVE));
            let (first, second) = powers.fold((0.0, 0.0), |(a, b), power| (a + power, b + power * power));
            let (first, second) = (first / count as f64, second / count as f64);
            scatter += (second - first * first) / f64::from(mean * mean);
            square += first * first / f64::from(mean * mean);
        }
    }
    if square <= 0.0 {
        return 1.0;
    }
    // Exponential powers of equal means whose fields correlate by ρ: E[scatter] = (1 − ρ²)(C − 1)/C and
    // E[square] = 1 + (1 + (C − 1) ρ²)/C.
    let (ratio, c) = (scatter / square, count as f64);
    let a = (c - 1.0) / c;
    let rho2 = ((a - ratio * (1.0 + 1.0 / c)) / (a * (1.0 + ratio))).clamp(0.0, 1.0);
    c / (1.0 + (c - 1.0) * rho2)
}
