//! Dyadic boxes of frame, Doppler and range, and which of them are significant.

use super::Region;
use super::residual::Residual;
use super::sums::{Table, intervals};
use crate::diagnosis::Evidence;
use crate::diagnosis::evidence::signed;
use crate::diagnosis::finding::Place;
use crate::diagnosis::power::Cells;
use crate::diagnosis::statistics::{corrected, log_sum, mean_power_tail};

/// Share of false boxes among those that are returned.
const FALSE_SHARE: f64 = 0.05;
/// Of the training frames' excess, what others may have.
const SHARES: [f64; 3] = [1.0, 0.1, 0.01];
/// Regions that a report can use.
const MOST: usize = 40;

/// Half-open intervals of the three axes.
#[derive(Clone, Copy)]
struct Box3 {
    low: [usize; 3],
    high: [usize; 3],
    sum: f64,
    count: f64,
    p_value: f64,
}

pub fn regions(evidence: &Evidence, residual: &Residual) -> Vec<Region> {
    let boxes = all(residual);
    let mut found = significant(boxes);
    found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(rank(b).total_cmp(&rank(a))));
    let mut kept: Vec<Box3> = vec![];
    for candidate in found {
        if kept.len() < MOST && !kept.iter().any(|other| overlap(other, &candidate)) {
            kept.push(candidate);
        }
    }
    let cells = Cells::new(&evidence.radar);
    kept.iter().map(|found| region(evidence, residual, &cells, found)).collect()
}

/// The most unlikely box of all, judged on the training frames and tried on the held-out ones.
pub struct Strongest {
    pub region: Region,
    /// Of the training frames, corrected for all boxes.
    pub p_value: f64,
    /// Log-likelihood that held-out frames gain when the training frames' excess is expected there.
    pub gain: f64,
}

/// The most significant box with training and held-out frames in it; none where no box has both, or where the training frames
/// show no excess in it.
pub fn strongest(evidence: &Evidence, residual: &Residual) -> Option<Strongest> {
    let boxes = all(residual);
    let tried = boxes.len() as f64;
    let holds = |frames: &[usize], found: &Box3| frames.iter().any(|frame| (found.low[0]..found.high[0]).contains(frame));
    let split = &evidence.split;
    let shared = boxes.into_iter().filter(|found| holds(&split.training, found) && holds(&split.held_out, found));
    let found = shared.max_by(|a, b| b.p_value.total_cmp(&a.p_value).then(rank(a).total_cmp(&rank(b))))?;
    let sums = |frames: &[usize]| {
        let inside = frames.iter().filter(|frame| (found.low[0]..found.high[0]).contains(frame));
        let cells = inside.flat_map(|frame| {
            (found.low[1]..found.high[1])
                .flat_map(move |doppler| (found.low[2]..found.high[2]).map(move |range| [*frame, doppler, range]))
        });
        cells.fold((0.0, 0.0), |(sum, count), cell| {
            let weight = f64::from(residual.count[cell]);
            (sum + weight * f64::from(residual.ratio[cell]), count + weight)
        })
    };
    let ((sum, count), (held_sum, held_count)) = (sums(&evidence.split.training), sums(&evidence.split.held_out));
    if sum <= count || count <= 0.05 || held_count <= 0.0 {
        return None;
    }
    let mean = sum / count;
    // Held-out frames may have less of it, at even odds.
    let predicted = SHARES.map(|share| {
        let mean = 1.0 + share * (mean - 1.0);
        held_sum * (1.0 - 1.0 / mean) - held_count * mean.ln()
    });
    let gain = log_sum(predicted.into_iter()) - (SHARES.len() as f64).ln();
    let p_value = corrected(mean_power_tail(mean, count.max(0.1)), tried);
    Some(Strongest { region: region(evidence, residual, &Cells::new(&evidence.radar), &found), p_value, gain })
}

/// How far above chance, also where p-values underflow.
fn rank(found: &Box3) -> f64 {
    let mean = found.sum / found.count;
    found.count * (mean - 1.0 - mean.ln())
}

/// Dyadic boxes whose halves are merged axis by axis, with their sums.
fn all(residual: &Residual) -> Vec<Box3> {
    let count = |at: [usize; 3]| f64::from(residual.count[at]);
    let sum = |at: [usize; 3]| f64::from(residual.ratio[at]) * count(at);
    let (sums, counts) = (Table::new(residual.shape(), sum), Table::new(residual.shape(), count));
    let scales = residual.shape().map(intervals);
    let (mut boxes, mut sum_before, mut count_before) = (vec![], vec![], vec![]);
    for frames in &scales[0] {
        for dopplers in &scales[1] {
            sums.along((*frames).into(), (*dopplers).into(), &mut sum_before);
            counts.along((*frames).into(), (*dopplers).into(), &mut count_before);
            for ranges in scales[2].iter().filter(|range| range.0 < residual.bins) {
                let (low, high) = ([frames.0, dopplers.0, ranges.0], [frames.1, dopplers.1, ranges.1.min(residual.bins)]);
                let [sum, count] = [&sum_before, &count_before].map(|before| before[high[2]] - before[low[2]]);
                if count <= 0.05 {
                    continue;
                }
                let mean = sum / count;
                // Only excess is sought; the rest counts as a test that was made and failed.
                let p_value = if mean > 1.0 { mean_power_tail(mean, count.max(0.1)) } else { 1.0 };
                boxes.push(Box3 { low, high, sum, count, p_value });
            }
        }
    }
    boxes
}

/// Benjamini-Yekutieli.
fn significant(mut boxes: Vec<Box3>) -> Vec<Box3> {
    let tests = boxes.len() as f64;
    let harmonic = tests.max(1.0).ln() + 0.5772;
    boxes.retain(|found| found.p_value < FALSE_SHARE);
    boxes.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let last = boxes
        .iter()
        .enumerate()
        .rposition(|(i, found)| found.p_value <= FALSE_SHARE * (i + 1) as f64 / (tests * harmonic))
        .map_or(0, |last| last + 1);
    boxes.truncate(last);
    boxes
}

fn overlap(a: &Box3, b: &Box3) -> bool {
    (0..3).all(|axis| a.low[axis] < b.high[axis] && b.low[axis] < a.high[axis])
}

/// Ends of a half-open interval of Doppler bins, of which the upper half counts from the end, below zero.
fn dopplers([first, end]: [usize; 2], loops: usize) -> [f64; 2] {
    let [low, high] = [first, end - 1].map(|bin| signed(bin as f64, loops));
    [low.min(high) - 0.5, low.max(high) + 0.5]
}

fn region(evidence: &Evidence, residual: &Residual, cells: &Cells, found: &Box3) -> Region {
    let [frames, loops, _] = residual.shape();
    let mut place = Place::default();
    if found.high[0] - found.low[0] < frames {
        place.frames = Some((found.low[0]..found.high[0]).collect());
    }
    if found.high[1] - found.low[1] < loops {
        place.velocity_mps = Some(dopplers([found.low[1], found.high[1]], loops).map(|bin| bin / cells.doppler_per_mps));
    }
    if found.high[2] - found.low[2] < residual.bins {
        let low = (found.low[2] as f64 - 0.5).max(0.0) / cells.bins_per_m;
        place.range_m = Some([low, (found.high[2] as f64 - 0.5) / cells.bins_per_m]);
    }
    let mean = found.sum / found.count;
    let channels = evidence.cube.channels() as f64;
    Region {
        place,
        excess_db: 10.0 * mean.log10(),
        energy: (found.sum - found.count) * super::residual::CELLS_PER_VALUE / channels,
        p_value: found.p_value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_half_of_the_doppler_bins_lies_below_zero_from_its_first_on() {
        assert_eq!(dopplers([32, 48], 64), [-32.5, -16.5]);
        assert_eq!(dopplers([16, 32], 64), [15.5, 31.5]);
        assert_eq!(dopplers([0, 1], 64), [-0.5, 0.5]);
    }
}
