//! Coarse search on the power: clock, heading to the line of sight and range of the body, on a grid.
//!
//! Every frame is compared with every pose of the motion that the clocks allow, once; a clock's gain is a sum over that table, and so is
//! that of frames in another order ([`super::chance`]).

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::place::{Pivot, Place};
use super::poses::{Pose, Poses};
use super::readings::Readings;
use crate::diagnosis::prediction::range_and_velocity;

/// Half of the longest step of clocks: in so long a walker goes by half of a wide cell.
const CLOCK_STEP_S: f64 = 0.05;
/// Headings to the line of sight: half a step changes a walker's radial velocity by less than a cell of 0.25 m/s.
const FACINGS: usize = 16;
const RANGE_STEP_M: f64 = 0.1;
/// The body is seen from so many distances; between them its cells are shifted.
const NODE_M: f64 = 0.6;
/// Nearest pivot that is tried.
const NEAREST_M: f64 = 0.5;
/// Vertices whose power stands for the body's.
const POINTS: usize = 150;
/// Frames, evenly picked.
const MOST_FRAMES: usize = 32;
/// Of the noise: what is expected below is left out.
const FAINT: f32 = 0.3;
/// Places nearer to each other than this are one: seconds, radians, metres.
const APART: (f64, f64, f64) = (0.25, TAU / 8.0 + 1e-9, 0.45);

/// Gains of all frames with all poses, and where in the grid they are.
pub struct Grid {
    pub clocks_s: Vec<f64>,
    ranges_m: Vec<f64>,
    /// Frames of the recording.
    pub frames: Vec<usize>,
    /// `[frame][clock]`: pose, where the motion has one.
    poses: Vec<Vec<Option<usize>>>,
    /// `[frame][pose]` → `[facing][range]`, nats.
    gains: Vec<Vec<Vec<f32>>>,
}

/// One frame for the law of the tail: (2E + p)/(2 + p) = 2E · inverse + rest.
struct Frame {
    inverse: Vec<f32>,
    rest: Vec<f32>,
}

impl Frame {
    fn of(readings: &Readings, frame: usize) -> Self {
        let power = readings.power(frame);
        Self { inverse: power.iter().map(|p| 1.0 / (2.0 + p)).collect(), rest: power.iter().map(|p| p / (2.0 + p)).collect() }
    }
}

/// What every pose is compared with: frames, at all headings and ranges.
struct Searched<'a> {
    readings: &'a Readings,
    pivot: &'a Pivot,
    frames: &'a [Frame],
    ranges_m: &'a [f64],
    /// Distances from which the body is seen, and its power there.
    nodes: &'a [f64],
    scales: &'a [f64],
}

impl Searched<'_> {
    /// Of a pose, `[frame]` → `[facing][range]`, nats; nothing where the motion has none.
    fn gains(&self, pose: Option<&Pose>) -> Vec<Vec<f32>> {
        let Self { readings, ranges_m, nodes, .. } = *self;
        let mut gains = vec![vec![0.0f32; if pose.is_some() { FACINGS * ranges_m.len() } else { 0 }]; self.frames.len()];
        let Some(pose) = pose else { return gains };
        let of_node = |range: f64| (((range - NEAREST_M) / NODE_M).round() as usize).min(nodes.len() - 1);
        for facing in 0..FACINGS {
            for (node, &node_m) in nodes.iter().enumerate() {
                let near: Vec<usize> = (0..ranges_m.len()).filter(|&range| of_node(ranges_m[range]) == node).collect();
                if near.is_empty() {
                    continue;
                }
                let map = map(readings, &placed(pose, self.pivot, facing, node_m));
                let template = Template::of(readings, &map, self.scales[node]);
                for range in near {
                    let shift = ((ranges_m[range] - node_m) * readings.cells.bins_per_m).round() as i32;
                    for (frame, gains) in self.frames.iter().zip(&mut gains) {
                        gains[facing * ranges_m.len() + range] = template.gain(readings, frame, shift);
                    }
                }
            }
        }
        gains
    }
}

fn placed(pose: &Pose, pivot: &Pivot, facing: usize, node_m: f64) -> Pose {
    let facing_rad = TAU * facing as f64 / FACINGS as f64;
    pose.clone().placed(pivot, &Place { facing_rad, range_m: node_m, ..pivot.stated() })
}

/// Of each distance: what makes the body as strong as what moves in the recording.
fn scales(readings: &Readings, pivot: &Pivot, shown: &[Option<Pose>], nodes: &[f64]) -> Vec<f64> {
    let moving = moving_energy(readings);
    let known: Vec<&Pose> = shown.iter().flatten().collect();
    let some: Vec<&Pose> = known.iter().copied().step_by(known.len().div_ceil(8).max(1)).collect();
    nodes
        .par_iter()
        .map(|&node| {
            let both = some.iter().flat_map(|pose| (0..FACINGS).step_by(2).map(move |facing| (pose, facing)));
            let energies: Vec<f64> = both
                .map(|(pose, facing)| map(readings, &placed(pose, pivot, facing, node)).iter().map(|p| f64::from(*p)).sum())
                .collect();
            moving * energies.len() as f64 / energies.iter().sum::<f64>().max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// Cells and powers of the body at one distance.
struct Template {
    /// Doppler row and range bin, expected power over the noise and noise.
    cells: Vec<(u32, i32, f32)>,
    log_expected: f64,
}

impl Grid {
    /// Compares frames with poses; `lag_s` is the largest clock that is tried.
    pub fn new(readings: &Readings, poses: &Poses, pivot: &Pivot, lag_s: f64) -> Self {
        let farthest_m = readings.farthest_m();
        let all = readings.frames();
        let count = all.min(MOST_FRAMES);
        let frames: Vec<usize> = (0..count).map(|index| index * all / count).collect();
        let step_s = clock_step_s(readings);
        let side = (lag_s / step_s).round().max(1.0) as i64;
        let clocks_s: Vec<f64> = (-side..=side).map(|step| step as f64 * step_s).collect();
        let first_s = readings.middle_s[frames[0]] - side as f64 * step_s;
        let last_s = readings.middle_s[frames[count - 1]] + side as f64 * step_s;
        let shown: Vec<Option<Pose>> = (0..=((last_s - first_s) / step_s).round() as usize)
            .map(|index| poses.at(first_s + index as f64 * step_s).map(thinned))
            .collect();
        let of_clock = |frame: &usize, clock: &f64| -> Option<usize> {
            let index = ((readings.middle_s[*frame] - clock - first_s) / step_s).round() as usize;
            shown.get(index).is_some_and(Option::is_some).then_some(index)
        };
        let table = frames.iter().map(|frame| clocks_s.iter().map(|clock| of_clock(frame, clock)).collect()).collect();
        let ranges_m: Vec<f64> =
            (0..).map(|step| NEAREST_M + f64::from(step) * RANGE_STEP_M).take_while(|range| *range <= farthest_m).collect();
        let nodes: Vec<f64> =
            (0..).map(|step| NEAREST_M + f64::from(step) * NODE_M).take_while(|node| *node <= farthest_m + NODE_M).collect();
        let scales = scales(readings, pivot, &shown, &nodes);
        let compared: Vec<Frame> = frames.iter().map(|&frame| Frame::of(readings, frame)).collect();
        let searched = Searched { readings, pivot, frames: &compared, ranges_m: &ranges_m, nodes: &nodes, scales: &scales };
        let by_pose: Vec<Vec<Vec<f32>>> = shown.par_iter().map(|pose| searched.gains(pose.as_ref())).collect();
        // From [pose][frame] to [frame][pose].
        let mut gains: Vec<Vec<Vec<f32>>> = vec![vec![]; frames.len()];
        by_pose.into_iter().for_each(|of_frames| gains.iter_mut().zip(of_frames).for_each(|(all, one)| all.push(one)));
        Self { clocks_s, ranges_m, frames, poses: table, gains }
    }

    fn cells(&self) -> usize {
        FACINGS * self.ranges_m.len()
    }

    /// Gains `[clock][facing, range]` where place `n` of the recording is taken by frame `order[n]`; nothing for clocks at which the
    /// motion has less than half of the frames.
    fn sums(&self, order: &[usize]) -> Vec<Vec<f32>> {
        let clock = |clock: usize| {
            let mut sum = vec![0.0f32; self.cells()];
            let known = (0..self.frames.len()).filter(|&frame| self.poses[frame][clock].is_some()).count();
            if 2 * known < self.frames.len() {
                return sum;
            }
            for (frame, &shown) in order.iter().enumerate() {
                if let Some(pose) = self.poses[frame][clock] {
                    sum.iter_mut().zip(&self.gains[shown][pose]).for_each(|(sum, gain)| *sum += gain);
                }
            }
            sum
        };
        (0..self.clocks_s.len()).into_par_iter().map(clock).collect()
    }

    /// The largest gain with frames in this order.
    pub fn largest(&self, order: &[usize]) -> f64 {
        self.sums(order).iter().flatten().map(|gain| f64::from(*gain)).fold(0.0, f64::max)
    }

    /// Places of the largest gains, apart from each other, at most so many; best first.
    pub fn peaks(&self, pivot: &Pivot, most: usize) -> Vec<Place> {
        let order: Vec<usize> = (0..self.frames.len()).collect();
        let mut all: Vec<(f64, f64, f64, f64)> = vec![];
        for (clock, sums) in self.sums(&order).iter().enumerate() {
            for (cell, &gain) in sums.iter().enumerate().filter(|(_, gain)| **gain > 0.0) {
                let facing_rad = TAU * (cell / self.ranges_m.len()) as f64 / FACINGS as f64;
                all.push((f64::from(gain), self.clocks_s[clock], facing_rad, self.ranges_m[cell % self.ranges_m.len()]));
            }
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut peaks: Vec<Place> = vec![];
        for (_, clock_s, facing_rad, range_m) in all {
            let place = Place { clock_s, facing_rad, range_m, ..pivot.stated() };
            if peaks.len() == most {
                break;
            }
            if !peaks.iter().any(|peak| same(peak, &place)) {
                peaks.push(place);
            }
        }
        peaks
    }
}

/// Whether two places are one for the grid.
fn same(a: &Place, b: &Place) -> bool {
    (a.clock_s - b.clock_s).abs() < APART.0
        && turned_rad(a.facing_rad - b.facing_rad).abs() < APART.1
        && (a.range_m - b.range_m).abs() < APART.2
}

/// An angle between half a turn to either side.
pub fn turned_rad(angle: f64) -> f64 {
    (angle + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU
}

/// A part of the frames' period, or a multiple of it where that is short.
fn clock_step_s(readings: &Readings) -> f64 {
    let mut steps: Vec<f64> = readings.middle_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let period = crate::diagnosis::statistics::median(&mut steps).max(1e-4);
    match period >= CLOCK_STEP_S {
        true => period / (period / CLOCK_STEP_S - 1e-9).ceil(),
        false => period * (CLOCK_STEP_S / period).floor(),
    }
}

/// Energy of what moves in a frame over the noise: mean over the frames.
fn moving_energy(readings: &Readings) -> f64 {
    let of = |frame: usize| {
        let cells = readings.power(frame).iter().zip(&readings.usable).filter(|(_, usable)| **usable);
        // Of noise alone the excess over its mean would be as much again; a cell counts from three times the noise on.
        cells.map(|(power, _)| f64::from(*power)).filter(|power| *power > 3.0).map(|power| power - 1.0).sum::<f64>()
    };
    (0..readings.frames()).map(of).sum::<f64>() / readings.frames().max(1) as f64
}

fn thinned(pose: Pose) -> Pose {
    let step = pose.position_m.len().div_ceil(POINTS);
    let pick = |values: Vec<[f64; 3]>| values.into_iter().step_by(step).collect();
    Pose {
        position_m: pick(pose.position_m),
        velocity_mps: pick(pose.velocity_mps),
        normal: pick(pose.normal),
        area_m2: pose.area_m2.into_iter().step_by(step).collect(),
    }
}

/// Power of the vertices that face the radar, `[doppler, range]`, usable cells only.
fn map(readings: &Readings, pose: &Pose) -> Vec<f32> {
    let centre = readings.radar.centre_m();
    let mut map = vec![0.0f32; readings.size()];
    for vertex in 0..pose.position_m.len() {
        let position = pose.position_m[vertex];
        let facing = (0..3).map(|axis| (centre[axis] - position[axis]) * pose.normal[vertex][axis]).sum::<f64>();
        if facing <= 0.0 {
            continue;
        }
        let (range_m, velocity) = range_and_velocity(&readings.radar, position, pose.velocity_mps[vertex]);
        let power = pose.area_m2[vertex] * facing / range_m.max(0.1).powi(5);
        readings.cells.deposit(&mut map, range_m, velocity, power);
    }
    map.iter_mut().zip(&readings.usable).filter(|(_, usable)| !**usable).for_each(|(power, _)| *power = 0.0);
    map
}

impl Template {
    fn of(readings: &Readings, map: &[f32], scale: f64) -> Self {
        let samples = readings.cells.samples;
        let strong = map.iter().enumerate().map(|(cell, power)| (cell, power * scale as f32)).filter(|(_, power)| *power > FAINT);
        let cells: Vec<(u32, i32, f32)> =
            strong.map(|(cell, power)| ((cell / samples * samples) as u32, (cell % samples) as i32, 1.0 + power)).collect();
        Self { log_expected: cells.iter().map(|(_, _, expected)| f64::from(*expected).ln()).sum(), cells }
    }

    /// Of a frame with the body over the frame without, nats: the law of one channel in `likelihood`.
    fn gain(&self, readings: &Readings, frame: &Frame, shift: i32) -> f32 {
        let bins = readings.cells.bins as i32;
        let (mut logs, mut product, mut outside) = (0.0, 1.0f64, 0.0);
        for (index, &(row, bin, expected)) in self.cells.iter().enumerate() {
            let bin = bin + shift;
            if bin < 0 || bin >= bins {
                outside += f64::from(expected).ln();
                continue;
            }
            let cell = (row as i32 + bin) as usize;
            product *= f64::from(2.0 * expected * frame.inverse[cell] + frame.rest[cell]);
            if index % 16 == 15 {
                logs += product.ln();
                product = 1.0;
            }
        }
        (2.0 * (self.log_expected - outside) - 3.0 * (logs + product.ln())) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_wrapped_to_half_a_turn() {
        assert!((turned_rad(0.75 * TAU) + 0.25 * TAU).abs() < 1e-12);
        assert!((turned_rad(-0.1) + 0.1).abs() < 1e-12 && (turned_rad(0.1 + 3.0 * TAU) - 0.1).abs() < 1e-9);
    }
}
