//! Where neither the body nor anything smeared from what is known can be: the cells that paths are looked for in.

use rayon::prelude::*;

use crate::diagnosis::Evidence;
use crate::diagnosis::locate::{BODY_FACTOR, CELLS_PER_VALUE};
use crate::diagnosis::power::{PowerModel, Template};
use crate::diagnosis::statistics::median;
use crate::diagnosis::suspects::clutter::still_power;
use crate::effects;

/// Doppler bins around zero in which static clutter leaves remains wherever the body was in some frame.
pub const STILL_BINS: i64 = 2;
/// Cells by which the body's support grows along Doppler: accelerations within a frame.
const DOPPLER_MARGIN: i64 = 2;
/// Accelerations raise sidelobes above the window's own.
const SIDELOBE_SAFETY: f64 = 10.0;
/// Sidelobes below this share of the noise are nothing.
const SIDELOBE_LEVEL: f64 = 0.3;
/// Whose undoing leaves leakage of the body at fixed ranges.
const FILTERS: [&str; 2] = [effects::if_highpass::ID, effects::if_lowpass::ID];

/// Powers over the noise, and what is expected of them without any further path, `[frame, doppler, range]`.
pub struct Scene<'a> {
    pub evidence: &'a Evidence,
    pub model: &'a PowerModel,
    pub loops: usize,
    pub samples: usize,
    pub bins: usize,
    /// Channels that a power is the mean of.
    pub channels: f64,
    /// Cells of a map where in every frame remains of the room can be, or nothing is received.
    never: Vec<bool>,
    /// These, and where the body can be.
    taken: Vec<bool>,
    /// These, and where the body's sidelobes reach: they move in step with it.
    reached: Vec<bool>,
    /// Expected power in the other cells: noise, and what other imperfections smear along a range or a Doppler.
    base: Vec<f32>,
    /// The same without the sidelobes of what was measured where the body is.
    floor: Vec<f32>,
    /// Whether cells of the body are free too, for what is far stronger than the body.
    pub over_body: bool,
    /// By range, how many times [`Evidence::noise`] the variance of noise in complex maps is that powers count as one.
    pub shape: Vec<f64>,
}

/// The cells of one frame, `[doppler, range]`, as the scene puts them together.
struct Frame {
    taken: Vec<bool>,
    reached: Vec<bool>,
    floor: Vec<f32>,
    lobes: Vec<f32>,
}

impl<'a> Scene<'a> {
    /// None without a body, or with too few cells to be of use.
    pub fn new(evidence: &'a Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        if loops < 16 || evidence.range_bins() < 16 {
            return None;
        }
        let model = evidence.power()?;
        let (bins, size) = (evidence.range_bins(), loops * samples);
        let visited = visited_ranges(model, frames, loops, samples);
        let clutter = still_power(evidence);
        let maps = evidence.maps();
        let is_never = |cell: usize| {
            let (doppler, range) = (cell / samples, cell % samples);
            let still = doppler.min(loops - doppler) as i64;
            range >= bins || (still <= STILL_BINS && visited[range]) || still == 0
        };
        let never: Vec<bool> = (0..size).map(is_never).collect();
        let made: Vec<Frame> = (0..frames)
            .into_par_iter()
            .map(|frame| {
                let map = &maps[frame * size..(frame + 1) * size];
                let support = grown(model.support(frame), loops, samples);
                let lobes = lobes(map, model.support(frame), loops, samples);
                let taken: Vec<bool> = support.iter().zip(&never).map(|(support, never)| *support || *never).collect();
                // What other imperfections smear is estimated where no sidelobes are.
                let near = |cell: usize| lobes[cell] * SIDELOBE_SAFETY > SIDELOBE_LEVEL;
                let reached: Vec<bool> = (0..size).map(|cell| taken[cell] || near(cell)).collect();
                let floor = floor(map, &reached, &clutter, loops, samples);
                let lobes: Vec<f32> =
                    (0..size).map(|cell| if near(cell) { (1.0 + SIDELOBE_SAFETY * lobes[cell]) as f32 } else { 1.0 }).collect();
                Frame { taken, reached, floor, lobes }
            })
            .collect();
        let (mut taken, mut reached, mut base, mut lobes) = (vec![], vec![], vec![], vec![]);
        for frame in made {
            taken.extend(frame.taken);
            reached.extend(frame.reached);
            base.extend(frame.floor);
            lobes.extend(frame.lobes);
        }
        let levels = noise_levels(maps, &reached, &evidence.split.training, loops, samples, bins);
        base.par_chunks_exact_mut(samples).for_each(|row| {
            row.iter_mut().zip(&levels).for_each(|(base, level)| *base = base.max(*level as f32));
        });
        if FILTERS.iter().any(|filter| evidence.accepted.contains(filter)) {
            raise_for_leakage(&mut base, maps, &reached, model, frames, loops, samples);
        }
        let floor = base.clone();
        base.par_iter_mut().zip(&lobes).for_each(|(base, lobe)| *base = base.max(*lobe));
        let channels = evidence.cube.channels() as f64;
        let shape = shape(evidence);
        Some(Self {
            evidence,
            model,
            loops,
            samples,
            bins,
            channels,

            never,
            taken,
            reached,
            base,
            floor,
            over_body: false,
            shape,
        })
    }

    /// The same with the body's cells free, where its expected power is trusted to a factor only.
    pub fn over_the_body(mut self) -> Self {
        // Something strong among the body's cells has sidelobes, too: only those of the expected body count.
        self.base = std::mem::take(&mut self.floor);
        let (size, loops, samples) = (self.size(), self.loops, self.samples);
        let (model, never) = (self.model, &self.never);
        let frames = self.taken.par_chunks_exact_mut(size).zip(self.base.par_chunks_exact_mut(size)).enumerate();
        frames.for_each(|(frame, (taken, base))| {
            let expected = model.expected(frame);
            let lobes = lobes(expected, model.support(frame), loops, samples);
            taken.copy_from_slice(never);
            for (cell, base) in base.iter_mut().enumerate() {
                let (doppler, range) = (cell / samples, cell % samples);
                let near = (-DOPPLER_MARGIN..=DOPPLER_MARGIN).flat_map(|slow| {
                    let row = (doppler as i64 + slow).rem_euclid(loops as i64) as usize * samples;
                    (range.saturating_sub(1)..(range + 2).min(samples)).map(move |range| row + range)
                });
                let loudest = near.map(|near| f64::from(expected[near]) - 1.0).fold(0.0, f64::max);
                *base = base.max((1.0 + f64::from(BODY_FACTOR) * (loudest + lobes[cell])) as f32);
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
        &self.evidence.maps()[frame * self.size()..(frame + 1) * self.size()]
    }

    pub fn taken(&self, frame: usize) -> &[bool] {
        &self.taken[frame * self.size()..(frame + 1) * self.size()]
    }

    pub fn reached(&self, frame: usize) -> &[bool] {
        &self.reached[frame * self.size()..(frame + 1) * self.size()]
    }

    pub fn base(&self, frame: usize) -> &[f32] {
        &self.base[frame * self.size()..(frame + 1) * self.size()]
    }

    /// Expected power without any sidelobes.
    pub fn floor(&self, frame: usize) -> &[f32] {
        &self.floor[frame * self.size()..(frame + 1) * self.size()]
    }

    /// A map's powers in the cells of a frame that are free to look at.
    pub fn visible(&self, frame: usize, map: &[f32]) -> Template {
        let taken = self.taken(frame);
        let least = 1e-3f32.max(1e-4 * map.iter().copied().fold(0.0, f32::max));
        let (cells, power) = (map.iter().enumerate())
            .filter(|(cell, power)| **power > least && !taken[*cell])
            .map(|(cell, &power)| (cell as u32, power))
            .unzip();
        Template { cells, power }
    }

    /// The part of a template whose Doppler is not that of static clutter.
    pub fn moving(&self, template: &Template) -> Template {
        let moves = |cell: u32| {
            let doppler = cell as usize / self.samples;
            doppler.min(self.loops - doppler) as i64 > STILL_BINS
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
        let loops = self.loops as f64;
        let signed = if bin >= 0.5 * loops { bin - loops } else { bin };
        signed / self.model.cells.doppler_per_mps
    }
}

/// The noise's level in each range bin over that of the others, from the quieter of the free cells: where a filter that
/// was undone ends abruptly, neighbouring bins are not informative.
fn noise_levels(maps: &[f32], taken: &[bool], frames: &[usize], loops: usize, samples: usize, bins: usize) -> Vec<f64> {
    const FEWEST_CELLS: usize = 48;
    let quiet = |range: usize| {
        let cells = frames.iter().flat_map(|frame| (0..loops).map(move |doppler| (frame * loops + doppler) * samples + range));
        let mut powers: Vec<f64> = cells.filter(|&cell| !taken[cell]).map(|cell| f64::from(maps[cell])).collect();
        let index = powers.len() * 35 / 100;
        (powers.len() >= FEWEST_CELLS).then(|| *powers.select_nth_unstable_by(index, f64::total_cmp).1)
    };
    let quiet: Vec<Option<f64>> =
        (0..samples).into_par_iter().map(|range| if range < bins { quiet(range) } else { None }).collect();
    let usual = median(&mut quiet.iter().copied().flatten().collect::<Vec<_>>()).max(f64::MIN_POSITIVE);
    quiet.iter().map(|level| level.map_or(1.0, |level| level / usual)).collect()
}

/// Raises the base at ranges that show a share of whatever the body returns at the same Doppler, in most of the cells
/// where that is strongest. An undone filter ends abruptly where it would amplify too much; there a window's sidelobes no
/// longer cancel.
fn raise_for_leakage(
    base: &mut [f32],
    maps: &[f32],
    taken: &[bool],
    model: &PowerModel,
    frames: usize,
    loops: usize,
    samples: usize,
) {
    const STRONG: f64 = 0.03;
    const FEWEST_CELLS: usize = 12;
    let mut body = vec![0.0f64; frames * loops];
    for (row, body) in body.iter_mut().enumerate() {
        let support = &model.support(row / loops)[row % loops * samples..][..samples];
        let powers = &maps[row * samples..][..samples];
        *body = support.iter().zip(powers).filter(|(support, _)| **support).map(|(_, &power)| f64::from(power)).sum();
    }
    let strong = (STRONG * body.iter().copied().fold(0.0, f64::max)).max(100.0);
    let share = |range: usize| {
        let rows = (0..frames * loops).filter(|&row| body[row] > strong && !taken[row * samples + range]);
        let mut shares: Vec<f64> = rows.map(|row| (f64::from(maps[row * samples + range]) - 1.5).max(0.0) / body[row]).collect();
        // The upper quartile, for what leaks is speckle.
        let index = shares.len() * 3 / 4;
        if shares.len() < FEWEST_CELLS { 0.0 } else { *shares.select_nth_unstable_by(index, f64::total_cmp).1 }
    };
    let shares: Vec<f64> = (0..samples).into_par_iter().map(share).collect();
    base.par_chunks_exact_mut(samples).zip(&body).for_each(|(row, body)| {
        row.iter_mut().zip(&shares).for_each(|(base, share)| *base = base.max((1.0 + 3.0 * share * body) as f32));
    });
}

/// What [`Evidence::maps`] divides a range bin's powers by besides the noise's variance.
fn shape(evidence: &Evidence) -> Vec<f64> {
    let samples = evidence.cube.dims[4];
    let count = evidence.cube.channels() as f64;
    let mut power = vec![0.0; samples];
    for (channel, noise) in evidence.noise().iter().enumerate() {
        let map = evidence.range_doppler(0, channel);
        let weight = 1.0 / (noise.max(f64::MIN_POSITIVE) * count);
        for (cell, value) in map.iter().enumerate() {
            power[cell % samples] += value.norm_sqr() * weight;
        }
    }
    let mut flat = vec![0.0f64; samples];
    let first = &evidence.maps()[..evidence.cube.dims[3] * samples];
    first.iter().enumerate().for_each(|(cell, &value)| flat[cell % samples] += f64::from(value));
    power.iter().zip(flat).map(|(power, flat)| if flat > 0.0 && *power > 0.0 { power / flat } else { 1.0 }).collect()
}

/// Range bins that the body has power in during some frame.
fn visited_ranges(model: &PowerModel, frames: usize, loops: usize, samples: usize) -> Vec<bool> {
    let mut visited = vec![false; samples];
    for frame in 0..frames {
        for doppler in 0..loops {
            let row = &model.support(frame)[doppler * samples..(doppler + 1) * samples];
            visited.iter_mut().zip(row).for_each(|(visited, support)| *visited |= support);
        }
    }
    visited
}

/// Power of a Hann window far from its peak, an upper bound.
fn hann_envelope(cells: f64) -> f64 {
    let x = cells.max(1.5);
    (1.0 / (std::f64::consts::PI * x * (x * x - 1.0))).powi(2).min(1.0)
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

/// Upper bounds of the powers that the windows' sidelobes carry from a map's cells within the support.
fn lobes(map: &[f32], support: &[bool], loops: usize, samples: usize) -> Vec<f64> {
    let mut lobes = vec![0.0f64; map.len()];
    for cell in (0..map.len()).filter(|&cell| support[cell]) {
        let (doppler, range) = (cell / samples, cell % samples);
        let power = f64::from(map[cell]);
        if power * SIDELOBE_SAFETY * hann_envelope(3.0) < SIDELOBE_LEVEL {
            continue;
        }
        // Away from both axes the product of two envelopes vanishes.
        for slow in -3..=3i64 {
            let row = (doppler as i64 + slow).rem_euclid(loops as i64) as usize * samples;
            let across = if slow.abs() < 2 { 1.0 } else { hann_envelope(slow.abs() as f64) };
            for other in 0..samples {
                let apart = other.abs_diff(range).min(samples - other.abs_diff(range));
                lobes[row + other] += power * across * hann_envelope(apart as f64);
            }
        }
        for fast in -3..=3i64 {
            let column = (range as i64 + fast).rem_euclid(samples as i64) as usize;
            let across = if fast.abs() < 2 { 1.0 } else { hann_envelope(fast.abs() as f64) };
            for other in 0..loops {
                let apart = other.abs_diff(doppler).min(loops - other.abs_diff(doppler));
                lobes[other * samples + column] += power * across * hann_envelope(apart as f64);
            }
        }
    }
    lobes
}

/// Noise, raised where a whole range or a whole Doppler is louder than noise, or clutter has sidebands: imperfections of
/// the signal chain do that, and a path does not.
fn floor(map: &[f32], taken: &[bool], clutter: &[f64], loops: usize, samples: usize) -> Vec<f32> {
    /// A median below this many times the noise is noise.
    const LOUD: f64 = 1.35;
    let raised = |values: &mut Vec<f64>| if values.len() < 8 { 1.0 } else { median(values) };
    let level = |median: f64| if median > LOUD { 2.0 * median } else { 1.0 };
    let mut base = vec![1.0f64; map.len()];
    for doppler in 0..loops {
        let cells = || (0..samples).filter(|range| !taken[doppler * samples + range]);
        let mut row: Vec<f64> = cells().map(|range| f64::from(map[doppler * samples + range])).collect();
        let row = level(raised(&mut row));
        let mut smear: Vec<f64> = cells()
            .filter(|&range| clutter[range] > 100.0)
            .map(|range| (f64::from(map[doppler * samples + range]) - 1.5).max(0.0) / clutter[range])
            .collect();
        let smear = if smear.len() < 8 { 0.0 } else { 3.0 * median(&mut smear) };
        for range in 0..samples {
            base[doppler * samples + range] = row.max(1.0 + smear * clutter[range]);
        }
    }
    for range in 0..samples {
        let mut column: Vec<f64> = (0..loops)
            .map(|doppler| doppler * samples + range)
            .filter(|&cell| !taken[cell])
            .map(|cell| f64::from(map[cell]))
            .collect();
        let column = level(raised(&mut column));
        for doppler in 0..loops {
            let cell = doppler * samples + range;
            base[cell] = base[cell].max(column);
        }
    }
    base.iter().map(|&value| value as f32).collect()
}
