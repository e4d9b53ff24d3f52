//! What all strong static returns have in common in a chirp: their complex gain relative to their mean over time.

mod clutter_spectra;
mod part;
mod scale;
mod series;
mod sharing;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::evidence::Evidence;
use crate::grid::Grid;

pub use clutter_spectra::free;
use clutter_spectra::{ClutterSpectra, OfFrame};
pub use part::{Group, PATTERN, Part, ahead};
use scale::FARTHEST;
pub use series::Series;
pub use sharing::{INFORMATIVE_GAIN, most_have};

/// Deviation of the gain of the static returns from one, group by group of ranges.
pub struct Field {
    pub frames: usize,
    pub loops: usize,
    pub groups: Vec<Group>,
    /// `[frame, loop, group]`, zero where nothing can be said; its imaginary part is an angle where phase excursions are large.
    deviation: Grid<Complex64, 3>,
    /// Inverse variance of a complex deviation, `[frame, group]`; zero where nothing can be said.
    weight: Grid<f64, 2>,
    /// Whether the body is at none of a group's ranges, `[frame, group]`.
    free: Grid<bool, 2>,
    /// Radar time of every loop, `[frame, loop]`: the mean over its transmitters.
    pub times_s: Vec<f64>,
    /// Radians up to which a phase can be read.
    pub farthest: f64,
}

impl Field {
    /// None where too little of the recording is static clutter.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, _] = evidence.cube.dims;
        let clutter = ClutterSpectra::new(evidence)?;
        let groups = clutter.groups();
        if groups.len() < 2 || evidence.split.held_out.is_empty() {
            return None;
        }
        let per_frame: Vec<OfFrame> = (0..frames).into_par_iter().map(|frame| clutter.of_frame(frame, &groups)).collect();
        let (mut deviation, mut weight) = (vec![], vec![]);
        for of_frame in per_frame {
            deviation.extend(of_frame.deviation.into_values());
            weight.extend(of_frame.weight);
        }
        let mut field = Self {
            frames,
            loops,
            deviation: Grid::new(["frame", "loop", "group"], [frames, loops, groups.len()], deviation),
            weight: Grid::new(["frame", "group"], [frames, groups.len()], weight),
            free: free_groups(evidence, &groups),
            groups,
            times_s: times_s(evidence),
            farthest: FARTHEST[0],
        };
        field.unroll(&evidence.split.training);
        field.calibrate();
        let known = (0..frames).filter(|&f| field.weights(f).iter().filter(|w| **w > 0.0).count() >= 2).count();
        (2 * known > frames).then_some(field)
    }

    /// Deviations of one frame and loop, `[group]`.
    fn deviations(&self, frame: usize, index: usize) -> &[Complex64] {
        self.deviation.below([frame, index])
    }

    /// Mean cosine to the boresight of the static returns, as sure as each group is.
    pub fn mean_ahead(&self) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for frame in 0..self.frames {
            for (group, weight) in self.groups.iter().zip(self.weights(frame)) {
                (sum, all) = (sum + weight * group.ahead, all + weight);
            }
        }
        if all > 0.0 { sum / all } else { 1.0 }
    }

    /// Inverse variances of one frame's deviations, `[group]`.
    pub fn weights(&self, frame: usize) -> &[f64] {
        self.weight.below([frame])
    }
}

/// Whether the body is at none of a group's ranges, `[frame, group]`.
fn free_groups(evidence: &Evidence, groups: &[Group]) -> Grid<bool, 2> {
    let [frames, bins] = [evidence.cube.dims[0], evidence.range_bins()];
    let of_frame = |frame: usize| {
        let free = free(evidence, frame, bins);
        groups.iter().map(|group| free[group.bins.clone()].iter().all(|free| *free)).collect::<Vec<bool>>()
    };
    Grid::new(["frame", "group"], [frames, groups.len()], (0..frames).flat_map(of_frame).collect())
}

/// Of every loop, `[frame, loop]`: the mean over its transmitters.
fn times_s(evidence: &Evidence) -> Vec<f64> {
    let ([frames, _, _, loops, _], radar) = (evidence.cube.dims, &evidence.radar);
    let middle_s = 0.5 * (radar.tx_m.len() as f64 - 1.0) * radar.chirp_period_s;
    let of_frame = |&start: &f64| (0..loops).map(move |index| start + index as f64 * radar.loop_period_s() + middle_s);
    evidence.starts_s[..frames].iter().flat_map(of_frame).collect()
}
