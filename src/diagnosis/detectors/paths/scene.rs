//! Where neither the body nor anything smeared from what is known can be: the cells that paths are looked for in.

use rayon::prelude::*;

use super::background;
use super::sidelobes::Sidelobes;
use crate::diagnosis::Evidence;
use crate::diagnosis::detectors::clutter::clutter_power;
use crate::diagnosis::evidence::signed;
use crate::diagnosis::locate::{BODY_FACTOR, CELLS_PER_VALUE};
use crate::diagnosis::power::{PowerModel, Template};
use crate::effects;
use crate::grid::Grid;

/// Doppler bins around zero in which static clutter leaves a residual wherever the body was in some frame.
pub const CLUTTER_BINS: i64 = 2;
/// Cells by which the body's support grows along Doppler: accelerations within a frame.
const DOPPLER_MARGIN: i64 = 2;
/// Whose undoing leaves leakage of the body at fixed ranges.
pub const FILTERS: [&str; 2] = [effects::if_highpass::ID, effects::if_lowpass::ID];

/// Powers over the noise, and what is expected of them without any further path, `[frame, doppler, range]`.
pub struct Scene<'a> {
    pub evidence: &'a Evidence,
    pub model: &'a PowerModel,
    pub loops: usize,
    pub samples: usize,
    pub bins: usize,
    /// Channels that a power is the mean of.
    pub channels: f64,
    /// Cells of a map where in every frame a residual of static clutter can be, or nothing is received.
    never: Vec<bool>,
    /// These, and where the body can be.
    taken: Grid<bool, 3>,
    /// These, and where the body's sidelobes reach: they move in step with it.
    reached: Grid<bool, 3>,
    /// Expected power in the other cells: noise, and what other imperfections smear along a range or a Doppler.
    base: Grid<f32, 3>,
    /// The same without the sidelobes of what was measured where the body is.
    floor: Grid<f32, 3>,
    /// Whether cells of the body are free too, for what is far stronger than the body.
    pub over_body: bool,
    /// By range, how many times [`Evidence::noise`] the variance of noise in complex maps is that powers count as one.
    pub shape: Vec<f64>,
}

/// The cells of some frames one after the other, `[frame · doppler · range]`, as the scene puts them together.
#[derive(Default)]
struct Frames {
    taken: Vec<bool>,
    reached: Vec<bool>,
    floor: Vec<f32>,
    lobes: Vec<f32>,
}

impl Frames {
    fn one(evidence: &Evidence, model: &PowerModel, frame: usize, never: &[bool], clutter: &[f64]) -> Self {
        let map = evidence.maps().below([frame]);
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let support = grown(model.support(frame), loops, samples);
        let lobes = Sidelobes::new(map, model.support(frame), samples);
        let taken: Vec<bool> = support.iter().zip(never).map(|(support, never)| *support || *never).collect();
        // What other imperfections smear is estimated where no sidelobes are.
        let reached: Vec<bool> = taken.iter().enumerate().map(|(cell, taken)| *taken || lobes.reach(cell)).collect();
        let floor = background::floor(map, &reached, clutter);
        let lobes = (0..map.len()).map(|cell| lobes.expected(cell)).collect();
        Self { taken, reached, floor, lobes }
    }

    fn extend(&mut self, other: Self) {
        self.taken.extend(other.taken);
        self.reached.extend(other.reached);
        self.floor.extend(other.floor);
        self.lobes.extend(other.lobes);
    }
}

/// Values of all cells.
fn cells<T>(evidence: &Evidence, values: Vec<T>) -> Grid<T, 3> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    Grid::new(["frame", "doppler", "range"], [frames, loops, samples], values)
}

impl<'a> Scene<'a> {
    /// None without a body, or with too few cells to be of use.
    pub fn new(evidence: &'a Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        if loops < 16 || evidence.range_bins() < 16 {
            return None;
        }
        let model = evidence.power()?;
        let (never, clutter) = (never(evidence, model), clutter_power(evidence));
        // Before the frames ask for them all at once.
        let maps = evidence.maps();
        let one = |frame: usize| Frames::one(evidence, model, frame, &never, &clutter);
        let made: Vec<Frames> = (0..frames).into_par_iter().map(one).collect();
        let mut all = Frames::default();
        made.into_iter().for_each(|frame| all.extend(frame));
        let (taken, reached) = (cells(evidence, all.taken), cells(evidence, all.reached));
        let mut floor = cells(evidence, all.floor);
        let levels = background::noise_levels(evidence, &reached);
        floor.values_mut().par_chunks_exact_mut(samples).for_each(|row| {
            row.iter_mut().zip(&levels).for_each(|(floor, level)| *floor = floor.max(*level as f32));
        });
        if FILTERS.iter().any(|filter| evidence.accepted.contains(filter)) {
            background::raise_for_leakage(&mut floor, maps, &reached, model);
        }
        let mut base = floor.clone();
        base.values_mut().par_iter_mut().zip(&all.lobes).for_each(|(base, lobe)| *base = base.max(*lobe));
        Some(Self {
            evidence,
            model,
            loops,
            samples,
            bins: evidence.range_bins(),
            channels: evidence.cube.channels() as f64,
            never,
            taken,
            reached,
            base,
            floor,
            over_body: false,
            shape: background::shape(evidence),
        })
    }

    /// The same with the body's cells free, where its expected power is trusted to a factor only.
    pub fn over_the_body(mut self) -> Self {
        // Something strong among the body's cells has sidelobes, too: only those of the expected body count.
        self.base = self.floor.clone();
        let (size, loops, samples) = (self.size(), self.loops, self.samples);
        let (model, never) = (self.model, &self.never);
        let (taken, base) = (self.taken.values_mut(), self.base.values_mut());
        let frames = taken.par_chunks_exact_mut(size).zip(base.par_chunks_exact_mut(size)).enumerate();
        frames.for_each(|(frame, (taken, base))| {
            let expected = model.expected(frame);
            let lobes = Sidelobes::new(expected, model.support(frame), samples);
            taken.copy_from_slice(never);
            for (cell, base) in base.iter_mut().enumerate() {
                let (doppler, range) = (cell / samples, cell % samples);
                let near = (-DOPPLER_MARGIN..=DOPPLER_MARGIN).flat_map(|slow| {
                    let row = (doppler as i64 + slow).rem_euclid(loops as i64) as usize * samples;
                    (range.saturating_sub(1)..(range + 2).min(samples)).map(move |range| row + range)
                });
                let loudest = near.map(|near| f64::from(expected[near]) - 1.0).fold(0.0, f64::max);
                *base = base.max((1.0 + f64::from(BODY_FACTOR) * (loudest + lobes.power(cell))) as f32);
            }
        });
        self.over_body = true;
        self
    }

    pub fn size(&self) -> usize {
        self.loops * self.samples
    }

    pub fn frames(&self) -> usize {
        self.evidence.cube.dims[0]
    }

    pub fn map(&self, frame: usize) -> &[f32] {
        self.evidence.maps().below([frame])
    }

    pub fn taken(&self, frame: usize) -> &[bool] {
        self.taken.below([frame])
    }

    pub fn reached(&self, frame: usize) -> &[bool] {
        self.reached.below([frame])
    }

    pub fn base(&self, frame: usize) -> &[f32] {
        self.base.below([frame])
    }

    /// Expected power without any sidelobes.
    pub fn floor(&self, frame: usize) -> &[f32] {
        self.floor.below([frame])
    }

    /// A map's powers in the cells of a frame that are free to look at.
    pub fn visible(&self, frame: usize, map: &[f32]) -> Template {
        let taken = self.taken(frame);
        let least = 1e-3f32.max(1e-4 * map.iter().copied().fold(0.0, f32::max));
        Template::keeping(map, |cell, power| power > least && !taken[cell])
    }

    /// The part of a template whose Doppler is not that of static clutter.
    pub fn moving(&self, template: &Template) -> Template {
        let moves = |cell: u32| {
            let doppler = cell as usize / self.samples;
            doppler.min(self.loops - doppler) as i64 > CLUTTER_BINS
        };
        let kept = template.cells.iter().zip(&template.power).filter(|(cell, _)| moves(**cell));
        let (cells, power) = kept.map(|(&cell, &power)| (cell, power)).unzip();
        Template { cells, power }
    }

    /// Log-likelihood that a frame gains when `weight` times a template is expected besides the base, nats.
    pub fn gain(&self, frame: usize, template: &Template, weight: f64) -> f64 {
        let (map, base) = (self.map(frame), self.base(frame));
        let sum: f64 = (template.cells.iter().zip(&template.power))
            .map(|(&cell, &template)| {
                let (power, base) = (f64::from(map[cell as usize]), f64::from(base[cell as usize]));
                let expected = base + weight * f64::from(template);
                (base / expected).ln() + power / base - power / expected
            })
            .sum();
        sum * self.channels / CELLS_PER_VALUE
    }

    /// Of some frames, templates by frame.
    pub fn gains(&self, frames: &[usize], templates: &[Template], weight: f64) -> f64 {
        frames.iter().map(|&frame| self.gain(frame, &templates[frame], weight)).sum()
    }

    /// The weight (≥ 0) of templates `[frame]` that some frames' powers make most likely, over a grid of tenths of a
    /// decade below the ratio of energies: the base is more than what is there.
    pub fn weight(&self, frames: &[usize], templates: &[Template]) -> f64 {
        let (mut above, mut below) = (0.0, 0.0);
        for &frame in frames {
            for (&cell, &power) in templates[frame].cells.iter().zip(&templates[frame].power) {
                above += f64::from((self.map(frame)[cell as usize] - self.base(frame)[cell as usize]).max(0.0));
                below += f64::from(power);
            }
        }
        if above <= 0.0 || below <= 0.0 {
            return 0.0;
        }
        let best = |steps: &mut dyn Iterator<Item = i32>| {
            let tried: Vec<i32> = steps.collect();
            let gain = |step: i32| self.gains(frames, templates, above / below * 10f64.powf(f64::from(step) / 10.0));
            let gains: Vec<(i32, f64)> = tried.into_par_iter().map(|step| (step, gain(step))).collect();
            gains.into_iter().filter(|(_, gain)| *gain > 0.0).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(step, _)| step)
        };
        let Some(coarse) = best(&mut (-10..=3).map(|step| 3 * step)) else { return 0.0 };
        let fine = best(&mut (coarse - 2..=coarse + 2)).unwrap_or(coarse);
        above / below * 10f64.powf(f64::from(fine) / 10.0)
    }

    /// Ranges in metres of a box of bins.
    pub fn range_m(&self, bin: f64) -> f64 {
        bin / self.model.cells.bins_per_m
    }

    /// Of a Doppler bin in FFT order, not unwrapped.
    pub fn velocity_mps(&self, bin: f64) -> f64 {
        signed(bin, self.loops) / self.model.cells.doppler_per_mps
    }
}

/// Cells of a map where in every frame a residual of static clutter can be, or nothing is received.
fn never(evidence: &Evidence, model: &PowerModel) -> Vec<bool> {
    let ([frames, _, _, loops, samples], bins) = (evidence.cube.dims, evidence.range_bins());
    let visited = visited_ranges(model, frames, samples);
    let is_never = |cell: usize| {
        let (doppler, range) = (cell / samples, cell % samples);
        let off_zero = doppler.min(loops - doppler) as i64;
        range >= bins || (off_zero <= CLUTTER_BINS && visited[range]) || off_zero == 0
    };
    (0..loops * samples).map(is_never).collect()
}

/// Range bins that the body is in during some frame, with power or so slowly that static clutter hides how much.
fn visited_ranges(model: &PowerModel, frames: usize, samples: usize) -> Vec<bool> {
    let mut visited = vec![false; samples];
    for frame in 0..frames {
        let support = model.support(frame).iter().enumerate().filter(|(_, support)| **support).map(|(cell, _)| cell);
        support.chain(model.predicted(frame)).for_each(|cell| visited[cell % samples] = true);
    }
    visited
}

/// The support, wider along Doppler.
fn grown(support: &[bool], loops: usize, samples: usize) -> Vec<bool> {
    let mut grown = support.to_vec();
    for cell in (0..support.len()).filter(|&cell| support[cell]) {
        for step in -DOPPLER_MARGIN..=DOPPLER_MARGIN {
            grown[((cell / samples) as i64 + step).rem_euclid(loops as i64) as usize * samples + cell % samples] = true;
        }
    }
    grown
}
